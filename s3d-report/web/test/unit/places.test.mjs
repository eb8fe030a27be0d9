// Places of names in outlines, and what is measured, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bundled } from "../lib/bundled.mjs";

const { innermost } = await bundled("outline.ts");
const { Corners, areaOf, lengthOf, wordsOf } = await bundled("picture/measure.ts");

/** The distance of a point from a ring. */
const away = (ring, [x, y]) =>
  Math.min(
    ...ring.map(([ax, ay], i) => {
      const [bx, by] = ring[(i + 1) % ring.length];
      const [dx, dy] = [bx - ax, by - ay];
      const t = Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)));
      return Math.hypot(ax + t * dx - x, ay + t * dy - y);
    }),
  );

const square = (x, y, side) => [
  [x, y],
  [x + side, y],
  [x + side, y + side],
  [x, y + side],
];

test("a name lies inside of an L, as far from its border as can be", () => {
  // Two arms of 2 m: the circle in the corner touches both outer walls and the inner corner.
  const ring = [
    [0, 0],
    [10, 0],
    [10, 2],
    [2, 2],
    [2, 8],
    [0, 8],
  ];
  const at = innermost([ring]);
  const radius = 2 * (2 - Math.SQRT2);
  assert.ok(at[0] < 2 && at[1] < 2, `${at}`);
  assert.ok(away(ring, at) > radius - 0.2 && away(ring, at) <= radius + 1e-9, `${at}`);
});

test("a name lies beside a hole, and in the middle of a room without corners", () => {
  const [outer, hole] = [square(0, 0, 10), square(3, 3, 4)];
  const at = innermost([outer, hole]);
  const free = Math.min(away(outer, at), away(hole, at));
  const isInHole = at.every((c) => c > 3 && c < 7);
  assert.ok(!isInHole && free > 1.5, `${at}`);
  assert.deepEqual(innermost([square(1, 2, 4)]), [3, 4]);
  const corridor = innermost([
    [
      [0, 0],
      [40, 0],
      [40, 2],
      [0, 2],
    ],
  ]);
  assert.ok(Math.abs(corridor[0] - 20) < 1e-9 && Math.abs(corridor[1] - 1) < 1e-9, `${corridor}`);
  // Outlines without a surface have a place, too.
  assert.deepEqual(innermost([]), [0, 0]);
  assert.deepEqual(
    innermost([
      [
        [5, 6],
        [7, 6],
      ],
    ]),
    [5, 6],
  );
  const thin = innermost([
    [
      [0, 0],
      [1000, 0],
      [1000, 0.001],
      [0, 0.001],
    ],
  ]);
  assert.ok(Math.abs(thin[0] - 500) < 1, `${thin}`);
});

test("an area is that of its outline in any plane", () => {
  // A rectangle of 3 × 2 m on a slope, and an L in a wall.
  const slope = [0, 3].flatMap((x) => (x === 0 ? [0, 2] : [2, 0]).map((s) => [x, 0.6 * s, 0.8 * s]));
  assert.ok(Math.abs(areaOf(slope) - 6) < 1e-12);
  assert.ok(Math.abs(lengthOf(slope, true) - 10) < 1e-12);
  assert.ok(Math.abs(lengthOf(slope, false) - 7) < 1e-12);
  const l = [
    [0, 0],
    [4, 0],
    [4, 1],
    [1, 1],
    [1, 3],
    [0, 3],
  ].map(([y, z]) => [7, y + 100, z - 50]);
  assert.ok(Math.abs(areaOf(l) - 6) < 1e-9);
  assert.equal(areaOf([]), 0);
  assert.equal(wordsOf(l, "area"), "6.000 m² · around 14.00 m");
  assert.equal(wordsOf(l.slice(0, 2), "area"), "4.000 m");
  assert.equal(wordsOf(l.slice(0, 1), "distance"), "");
});

test("clicks make lines of two ends, and outlines of any number of corners", () => {
  const corners = new Corners();
  const at = (x, y) => [x, y, 0];
  for (const x of [0, 3]) corners.add(at(x, 0), false);
  assert.equal(corners.words, "3.000 m");
  corners.add(at(9, 9), false);
  assert.deepEqual(corners.points, [at(9, 9)], "the third click begins the next line");

  corners.clear();
  corners.what = "area";
  for (const [x, y] of square(0, 0, 2)) corners.add(at(x, y), false);
  assert.equal(corners.edges.length, 4);
  assert.equal(corners.words, "4.000 m² · around 8.00 m");
  corners.add(at(0, 0.01), true);
  assert.equal(corners.points.length, 4, "a click on the first corner adds none");
  corners.undo();
  assert.equal(corners.words, "2.000 m² · around 6.83 m");
  corners.add(at(0, 2), false);
  corners.add(at(0, 0), true);
  corners.add(at(5, 5), false);
  assert.deepEqual(corners.points, [at(5, 5)], "and the next click begins the next outline");
});
