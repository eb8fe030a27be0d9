// The labels of the built-in scene as it was generated, and what a person who knows them would point at.

import { readFileSync } from "node:fs";

const key = (point) => point.map((c) => Math.round(500 * c)).join();

/** The label of each face that a data set's `semantic.obj` has, by the sum of its corners. */
function labelsIn(path) {
  const vertices = [];
  const found = new Map();
  let label = "";
  for (const line of readFileSync(path, "utf8").split("\n")) {
    const words = line.split(/\s+/);
    // The file is Y-up.
    if (words[0] === "v") vertices.push([Number(words[1]), -Number(words[3]), Number(words[2])]);
    if (words[0] === "usemtl") label = words[1];
    if (words[0] !== "f") continue;
    const corners = words.slice(1, 4).map((word) => vertices[word.split("/")[0] - 1]);
    found.set(key([0, 1, 2].map((axis) => corners.reduce((sum, c) => sum + c[axis], 0))), label);
  }
  return found;
}

/** What the server tells of a scene, as arrays. */
export async function readScene(url) {
  const get = async (name) => fetch(url + name);
  const bytes = async (name) => (await get(name)).arrayBuffer();
  const scene = await (await get("scene.json")).json();
  const tree = await bytes("tree.bin");
  return {
    ...scene,
    positions: new Float32Array(await bytes("positions.bin")),
    index: new Uint32Array(await bytes("faces.bin")),
    segment: new Uint32Array(await bytes("segments.bin")),
    parent: new Uint32Array(tree, 0, scene.nodes),
    cost: new Float32Array(tree, 4 * scene.nodes, scene.nodes),
  };
}

/** For each face of a scene: its corners' middle, its normal, its area, and its label as generated. */
export function facesOf({ positions, index, origin }, semantic) {
  const labels = labelsIn(semantic);
  return Array.from({ length: index.length / 3 }, (_, face) => {
    const [a, b, c] = [0, 1, 2].map((k) => {
      const at = 3 * index[3 * face + k];
      return origin.map((o, axis) => o + positions[at + axis]);
    });
    const sum = a.map((v, axis) => v + b[axis] + c[axis]);
    const [u, v] = [b, c].map((p) => p.map((x, axis) => x - a[axis]));
    const across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const twice = Math.hypot(...across);
    return {
      middle: sum.map((x) => x / 3),
      normal: across.map((x) => x / (twice || 1)),
      m2: twice / 2,
      label: labels.get(key(sum)) ?? null,
    };
  });
}

/** The class of a label such as `chair_3_office_1_1`; null without one. */
export const classOf = (label) => (label === null || label.startsWith("<") ? null : label.split("_")[0]);

/** The room of such a label, `office_1`. */
export const roomOf = (label) => label.split("_").slice(2, 4).join("_");
