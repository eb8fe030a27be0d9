// The page's colours of classes, as people with any kind of colour vision see them. Without a browser.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { bundled } from "../lib/bundled.mjs";

const { paletteOf } = await bundled("palette.ts");

const S3DIS =
  "ceiling floor wall beam column window door table chair sofa bookcase board clutter <UNK>".split(" ");

const linear = (color) =>
  color.map((byte) => (byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4));
const times = (matrix, v) => matrix.map((row) => row.reduce((sum, a, k) => sum + a * v[k], 0));

function lab(rgb) {
  const clipped = rgb.map((c) => Math.min(1, Math.max(0, c)));
  const toXyz = [
    [0.4124, 0.3576, 0.1805],
    [0.2126, 0.7152, 0.0722],
    [0.0193, 0.1192, 0.9505],
  ];
  const f = (t) => (t > (6 / 29) ** 3 ? Math.cbrt(t) : t / (3 * (6 / 29) ** 2) + 4 / 29);
  const [x, y, z] = times(toXyz, clipped).map((t, k) => f(t / [0.9505, 1, 1.089][k]));
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

// Another model than the page's for red and green: Viénot, Brettel and Mollon (1999), by its matrices of
// linear sRGB. Blue: Machado, Oliveira and Fernandes (2009).
const EYES = {
  "all cones": [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
  "no red cones": [
    [0.11238, 0.88762, 0],
    [0.11238, 0.88762, 0],
    [0.00401, -0.00401, 1],
  ],
  "no green cones": [
    [0.29275, 0.70725, 0],
    [0.29275, 0.70725, 0],
    [-0.02234, 0.02234, 1],
  ],
  "no blue cones": [
    [1.255528, -0.076749, -0.178779],
    [-0.078411, 0.930809, 0.147602],
    [0.004733, 0.691367, 0.3039],
  ],
};

/** The least difference (CIE76) between two colours of a list, by the kind of eyes. */
function leastOf(colors) {
  return Object.fromEntries(
    Object.entries(EYES).map(([eyes, matrix]) => {
      const seen = colors.map((color) => lab(times(matrix, linear(color))));
      const pairs = seen.flatMap((a, i) =>
        seen.slice(0, i).map((b) => Math.hypot(...a.map((c, k) => c - b[k]))),
      );
      return [eyes, Math.min(...pairs)];
    }),
  );
}

test("the default classes are told apart with any kind of colour vision", () => {
  const least = leastOf(paletteOf(S3DIS));
  for (const [eyes, difference] of Object.entries(least))
    assert.ok(difference >= 15, `${eyes}: ${difference.toFixed(1)}`);
  // Also from surface without a label and from what was not seen.
  const with_none = leastOf([...paletteOf(S3DIS), [128, 128, 128], [0, 0, 0]]);
  assert.ok(Math.min(...Object.values(with_none)) >= 10, JSON.stringify(with_none));
});

test("the building is calm, and things are strong", () => {
  const chroma = (color) => Math.hypot(...lab(linear(color)).slice(1));
  paletteOf(S3DIS).forEach((color, i) => {
    if (i < 5) assert.ok(chroma(color) < 25, S3DIS[i]);
    else assert.ok(chroma(color) > 35, S3DIS[i]);
  });
  const light = paletteOf(["kitchen_wall", "Ceiling", "walls of fame"]).map(chroma);
  assert.ok(light[0] < 25 && light[1] < 25 && light[2] > 35, `${light}`);
});

test("any taxonomy gets colours of its own, and always the same", () => {
  const forty = Array.from({ length: 40 }, (_, i) => `class ${i}`);
  const colors = paletteOf(forty);
  assert.deepEqual(paletteOf(forty), colors);
  const { "all cones": least } = leastOf(colors);
  assert.ok(least >= 9, `${least}`);
  assert.equal(paletteOf(Array.from({ length: 300 }, (_, i) => `class ${i}`)).length, 300);
  assert.deepEqual(paletteOf([]), []);
});

test("given colours stay, and the others keep away from them", () => {
  const names = ["wall", "chair", "lamp"];
  const given = paletteOf(names.slice(0, 2));
  const all = paletteOf(names, given);
  assert.deepEqual(all.slice(0, 2), given);
  assert.ok(Math.min(...Object.values(leastOf(all))) > 20);
});

test("colours are those that the poster has", () => {
  const golden = JSON.parse(readFileSync(new URL("../../../tests/palette.json", import.meta.url), "utf8"));
  assert.ok(golden.length >= 4);
  for (const { names, colors } of golden) assert.deepEqual(paletteOf(names), colors, `${names}`);
});
