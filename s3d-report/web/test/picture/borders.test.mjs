// Borders of labels and colours at full width, on pictures whose truth is known.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { USUAL, go, launch, open, readout } from "../lib/browser.mjs";
import { dataset, index, near, readPicture, report, stemOf, withCopy } from "../lib/common.mjs";
import { readPng } from "../lib/images.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const SIZE = 64;
/** A label of each of two classes. */
const LABELS = [0, 1].map((nth) => {
  const classes = [...new Set(index.labels.map((label) => label.class).filter((c) => c !== null))];
  return index.labels.findIndex((label) => label.class === classes[nth * 3]);
});
const colorOf = (label) => index.classes[index.labels[label].class].color;

/** The height of a slanted line at x, in pixels of the image. */
const line = (x) => 12.3 + x / 7;

/** The upper half has a slanted line; the lower half has noise. */
const labelAt = (x, y) => {
  if (y < SIZE / 2) return LABELS[y + 0.5 < line(x + 0.5) ? 0 : 1];
  return LABELS[((x * 7919 + y * 104729 + x * y * 31) >> 3) & 1];
};

const urlOf = (at) => {
  const png = new PNG({ width: SIZE, height: SIZE });
  for (let y = 0; y < SIZE; y++)
    for (let x = 0; x < SIZE; x++) {
      const label = at(x, y);
      png.data.set([label >> 16, (label >> 8) & 255, label & 255, 255], 4 * (y * SIZE + x));
    }
  return `data:image/png;base64,${PNG.sync.write(png).toString("base64")}`;
};

/** Opens a view with these labels, and calls `use` with its page, and what its canvas shows at a place. */
async function withLabels(right, use) {
  const { picture } = index.views.find((view) => view.picture !== null);
  await withCopy(
    (write) => {
      const all = readPicture(report, "views_0");
      const nothing = { rgb: null, normal: null, depth: null, face: null };
      all[picture] = { ...all[picture], ...nothing, of: [SIZE, SIZE], size: [SIZE, SIZE] };
      all[picture].label = urlOf(labelAt);
      write("views_0", all);
    },
    async (folder) => {
      const { page, faults, close } = await open(
        browser,
        folder,
        `#/view/${picture}?left=class&right=${right}&split=${right === "class" ? 1 : 0}`,
        USUAL,
      );
      const box = await page.locator(".viewer canvas").boundingBox();
      const shot = async () => {
        const png = PNG.sync.read(await page.screenshot());
        return (x, y) => {
          const [px, py] = [box.x + (x * box.width) / SIZE, box.y + (y * box.height) / SIZE].map(Math.floor);
          return [...png.data.subarray(4 * (py * png.width + px), 4 * (py * png.width + px) + 3)];
        };
      };
      await use({ page, box, shot });
      assert.deepEqual(faults, []);
      await close();
    },
  );
}

const offFrom = (color, label) => colorOf(label).reduce((sum, c, k) => sum + Math.abs(c - color[k]), 0);
/** Whether a colour is nearer to the first label's colour than to the other's, or nearly so. */
const isLike = (color, label, most = 1) =>
  offFrom(color, label) < most * offFrom(color, LABELS[LABELS[0] === label ? 1 : 0]);

/** Whether nothing lies over the canvas there: no button, line or menu. */
const isFree = (page, box, x, y) =>
  page.evaluate(
    ([px, py]) => document.elementFromPoint(px, py)?.tagName === "CANVAS",
    [box.x + (x * box.width) / SIZE, box.y + (y * box.height) / SIZE],
  );

test("a slanted border is drawn as a line, and the middle of each pixel keeps its label", async () => {
  await withLabels("class", async ({ page, box, shot }) => {
    const at = await shot();
    const off = [];
    // Away from the ends of the picture, where the border's next step is not known.
    for (let x = 8; x < SIZE - 12; x += 0.37) {
      let y = line(x) - 3;
      while (isLike(at(x, y), LABELS[0]) && y < line(x) + 3) y += 0.02;
      if (await isFree(page, box, x, y)) off.push(y - line(x));
    }
    const mean = off.reduce((sum, o) => sum + o, 0) / off.length;
    const worst = Math.max(...off.map((o) => Math.abs(o - mean)));
    const rms = Math.sqrt(off.reduce((sum, o) => sum + (o - mean) ** 2, 0) / off.length);
    // Stairs are up to 0.5 off, and 0.29 in the mean.
    assert.ok(off.length > 80 && Math.abs(mean) < 0.2, `${mean} in the mean at ${off.length} places`);
    assert.ok(worst < 0.33 && rms < 0.15, `${worst} at most, ${rms} in the mean`);

    let held = 0;
    for (let y = 6; y < SIZE; y++)
      for (let x = 0; x < SIZE - 6; x++) {
        if (y < 10 && Math.abs(x - SIZE / 2) < 20) continue;
        if (!(await isFree(page, box, x + 0.5, y + 0.5))) continue;
        const color = at(x + 0.5, y + 0.5);
        // A border may be as near as half a pixel of the screen.
        assert.ok(isLike(color, labelAt(x, y), 1.5), `label of pixel ${x},${y}: ${color}`);
        const isInside = [-1, 0, 1].every((i) =>
          [-1, 0, 1].every((j) => labelAt(x + i, y + j) === labelAt(x, y)),
        );
        if (isInside) color.forEach((c, k) => near(c, colorOf(labelAt(x, y))[k], 2, `pixel ${x},${y}`));
        held += 1;
      }
    assert.ok(held > 2500, `${held} pixels`);
  });
});

test("the readout is of the whole pixel, and the instance under the pointer has a smooth edge", async () => {
  await withLabels("class", async ({ page, box, shot }) => {
    const dark = await shot();
    for (const [x, y] of [
      [20, 8.2],
      [20.9, 14.9],
      [40.1, 18.05],
      [33.3, 40.7],
    ]) {
      await page.mouse.move(box.x + (x * box.width) / SIZE, box.y + (y * box.height) / SIZE);
      const told = await readout(page);
      const label = index.labels[labelAt(Math.floor(x), Math.floor(y))];
      assert.equal(told.pixel, `${Math.floor(x)},${Math.floor(y)}`);
      assert.equal(told.instance, label.name);
    }
    await page.mouse.move(box.x + (20 * box.width) / SIZE, box.y + (8 * box.height) / SIZE);
    await page.waitForTimeout(200);
    const lit = await shot();
    const white = (color) => color.every((c) => c > 225);
    let found = 0;
    for (let x = 8; x < SIZE - 12; x += 1.3) {
      // The light edge runs along the line, within a pixel of the image.
      const edge = [];
      for (let y = line(x) - 1.5; y < line(x) + 1.5; y += 0.03) if (white(lit(x, y))) edge.push(y);
      const off = edge.reduce((sum, y) => sum + y - line(x), 0) / edge.length;
      if (edge.length > 0 && Math.abs(off) < 0.5) found += 1;
    }
    assert.ok(found > 25, `an edge at ${found} places`);
    assert.ok(!white(dark(20, line(20) + 0.2)));
  });
});

test("the colours of a panorama are the data set's own pixels where that shows more", async () => {
  const at = index.locations.findIndex((l) => l.pano);
  const { uuid, area } = index.locations[at];
  const picture = readPicture(report, `pano_${at}`);
  const stem = stemOf(`area_${area}/pano/rgb`, uuid, "equirectangular");
  const own = readPng(`${dataset}/area_${area}/pano/rgb/${stem}_domain_rgb.png`);
  assert.deepEqual(picture.of, [own.width, own.height]);
  assert.deepEqual(
    [picture.sharp, picture.size],
    [
      [own.width, own.height],
      [own.width / 2, own.height / 2],
    ],
  );
  const { page, faults, close } = await open(browser, report, `#/pano/${area}/${uuid}?fov=90`);
  await page.waitForSelector(".viewer[data-sharp]");
  const decoded = await page.evaluate(
    async (url) => {
      const image = new Image();
      image.src = url;
      await image.decode();
      const canvas = Object.assign(document.createElement("canvas"), {
        width: image.naturalWidth,
        height: image.naturalHeight,
      });
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      return [...context.getImageData(0, 0, canvas.width, canvas.height).data];
    },
    readPicture(report, `sharp_${at}`),
  );
  let sum = 0;
  let count = 0;
  for (let y = 0; y < own.height; y += 3)
    for (let x = 0; x < own.width; x += 5, count += 3)
      own.at(x, y).forEach((c, k) => (sum += (c - decoded[4 * (y * own.width + x) + k]) ** 2));
  // JPEG of quality 85.
  assert.ok(Math.sqrt(sum / count) < 6, `${Math.sqrt(sum / count)} levels`);
  await go(page, "#/plan");
  assert.deepEqual(faults, []);
  await close();
});
