// The tree of patches, sets of faces, the parts of a mesh, and the table of keys.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bundled } from "../../../../s3d-report/web/test/lib/bundled.mjs";

const source = (name) => bundled(`../../../s3d-annotate/web/src/${name}`);
const { Tree } = await source("mesh/tree.ts");
const { facesOf, runsOf } = await source("mesh/runs.ts");
const { groupsOf, partOf, stepOf } = await source("mesh/mesh.ts");
const { commandOf, CLASS_KEYS, KEYS } = await source("keys.ts");

const NONE = 0xffffffff;

// Segments 0 to 3; 4 = 0 + 1, 5 = 2 + 3, 6 = 4 + 5.
const segment = Uint32Array.of(2, 0, 1, 0, 3, 2, 1);
const tree = new Tree(
  segment,
  Uint32Array.of(4, 4, 5, 5, 6, 6, NONE),
  Float32Array.of(0, 0, 0, 0, 0.125, 0.25, 0.5),
);
const sorted = (faces) => [...faces].sort((a, b) => a - b);

test("a node has the faces of the segments below it", () => {
  assert.deepEqual(sorted(tree.facesOf(0)), [1, 3]);
  assert.deepEqual(sorted(tree.facesOf(4)), [1, 2, 3, 6]);
  assert.deepEqual(sorted(tree.facesOf(5)), [0, 4, 5]);
  assert.deepEqual(sorted(tree.facesOf(6)), [0, 1, 2, 3, 4, 5, 6]);
  assert.ok(tree.holds(4, 6) && !tree.holds(4, 0) && tree.holds(6, 0));
});

test("several roots share out the faces", () => {
  const two = new Tree(segment, Uint32Array.of(4, 4, NONE, NONE, NONE), new Float32Array(5));
  assert.deepEqual(sorted(two.facesOf(2)), [0, 5]);
  assert.deepEqual(sorted(two.facesOf(4)), [1, 2, 3, 6]);
  assert.equal(two.parent(4), null);
  assert.ok(!two.holds(4, 0) && two.holds(2, 0) && !two.holds(3, 0));
});

test("one goes up by what a join costs, and down towards a face", () => {
  assert.equal(tree.nodeAt(1, 0), 0);
  assert.equal(tree.nodeAt(1, 0.125), 4);
  assert.equal(tree.nodeAt(0, 0.125), 2);
  assert.equal(tree.rootAt(0), 6);
  assert.equal(tree.childAt(6, 2), 4);
  assert.equal(tree.childAt(4, 2), 1);
  assert.equal(tree.childAt(1, 2), 1);
  assert.equal(tree.steps(6, 2), 2);
});

test("a patch holds the faces of one instance, or those of none", () => {
  const instances = Uint32Array.of(0, 0, 7, 7, 0, 0, 0);
  assert.deepEqual(sorted(tree.patch(4, 1, instances)), [1, 6]);
  assert.deepEqual(sorted(tree.patch(4, 3, instances)), [2, 3]);
});

test("runs and faces are the same sets", () => {
  assert.deepEqual([...facesOf([2, 3, 1, 1])], [2, 3, 4, 6]);
  assert.deepEqual(runsOf([6, 3, 2, 4, 3]), [2, 3, 1, 1]);
  assert.deepEqual(runsOf([0, 1, 5]), [0, 2, 3, 1]);
  assert.deepEqual([...facesOf([])], []);
  assert.deepEqual(runsOf([]), []);
});

/** A grid of squares of two triangles, `side` squares of `cell` metres on each side. */
function grid(side, cell) {
  const positions = new Float32Array(3 * (side + 1) ** 2);
  for (let y = 0; y <= side; y++)
    for (let x = 0; x <= side; x++) positions.set([x * cell, y * cell, 0.3], 3 * (y * (side + 1) + x));
  const faces = [];
  for (let y = 0; y < side; y++)
    for (let x = 0; x < side; x++) {
      const a = y * (side + 1) + x;
      faces.push(a, a + 1, a + side + 2, a, a + side + 2, a + side + 1);
    }
  const count = faces.length / 3;
  const materials = new Uint16Array(count);
  return { positions, faces: Uint32Array.from(faces), colors: null, materials, uv: null, areas: null };
}

test("parts hold each face once, few enough, and no farther off than half a step", () => {
  const mesh = grid(150, 0.4);
  const step = stepOf(mesh);
  assert.ok(step <= 0.0005, `${step}`);
  const seen = new Uint8Array(mesh.faces.length / 3);
  const groups = groupsOf(mesh, step);
  assert.ok(groups.length >= 4);
  for (const group of groups) {
    assert.ok(group.length <= 30_000);
    const part = partOf(mesh, group, step);
    part.face.forEach((face, i) => {
      seen[face] += 1;
      for (let k = 0; k < 3; k++)
        for (let axis = 0; axis < 3; axis++) {
          const drawn = part.origin[axis] + part.step[axis] * part.position[3 * part.index[3 * i + k] + axis];
          const is = mesh.positions[3 * mesh.faces[3 * face + k] + axis];
          assert.ok(Math.abs(drawn - is) <= step / 2 + 1e-6, `${drawn} ${is}`);
        }
    });
  }
  assert.ok(seen.every((count) => count === 1));
});

test("faces that lie on one another are shared out, too", () => {
  const mesh = grid(1, 1);
  const faces = new Uint32Array(6 * 40_000);
  for (let i = 0; i < 40_000; i++) faces.set(mesh.faces, 6 * i);
  const groups = groupsOf({ ...mesh, faces }, 0.0005);
  assert.ok(groups.every((group) => group.length <= 30_000));
  assert.equal(
    groups.reduce((sum, { length }) => sum + length, 0),
    80_000,
  );
});

const press = (key, held = {}) =>
  commandOf({ key, shiftKey: false, ctrlKey: false, metaKey: false, altKey: false, ...held });

test("no key means two things", () => {
  const all = KEYS.flatMap(({ keys }) => keys);
  assert.equal(new Set(all).size, all.length);
  assert.ok(CLASS_KEYS.length >= 13);
  assert.equal(new Set(CLASS_KEYS).size, CLASS_KEYS.length);
  for (const key of CLASS_KEYS) assert.equal(press(key), null, key);
});

test("keys do what the table says", () => {
  for (const { command, keys } of KEYS)
    for (const key of keys) {
      const [held, plain] = key.startsWith("Shift+") ? [{ shiftKey: true }, key.slice(6)] : [{}, key];
      assert.equal(press(plain, held), command, key);
    }
  assert.equal(press("z", { ctrlKey: true }), "undo");
  assert.equal(press("Z", { ctrlKey: true, shiftKey: true }), "redo");
  assert.equal(press("y", { metaKey: true }), "redo");
  assert.equal(press("s", { ctrlKey: true }), null);
  assert.equal(press("Tab", { shiftKey: true }), null);
  assert.equal(press("?", { shiftKey: true }), "help");
});
