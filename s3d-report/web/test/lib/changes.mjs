// The changes between the data set and the one it is compared with, counted from the files of both.

import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { dataset, json } from "./common.mjs";
import { readPng } from "./images.mjs";
import { readObj } from "./mesh.mjs";

export const other = process.env["S3D_OTHER"];
const names = [dataset, other].map((folder) => json("assets/semantic_labels.json", folder));
export const isNone = (name) => name.startsWith("<UNK>");
export const classOf = (name) => (isNone(name) ? "<UNK>" : name.split("_")[0]);

/** The labels of the faces of `semantic.obj`: its materials. */
function labelsOfFaces(folder) {
  let label = "";
  const labels = [];
  for (const line of readFileSync(join(folder, "area_1/3d/semantic.obj"), "utf8").split("\n")) {
    const [word, name] = line.trim().split(/\s+/);
    if (word === "usemtl") label = name;
    if (word === "f") labels.push(label);
  }
  return labels;
}

const mesh = readObj(join(dataset, "area_1/3d/rgb.obj"));
/** The label of each face in both. */
export const ofFaces = [dataset, other].map(labelsOfFaces);
/** The surface of a face, m². */
export const surfaceOf = (face) => {
  const [a, b, c] = mesh.faces[face].map((vertex) => mesh.vertices[vertex]);
  const [u, v] = [b, c].map((p) => p.map((x, k) => x - a[k]));
  return Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
};

/**
 * The instance of B that is an instance of A: they share over half of the surface of both together. No
 * instance has two such partners.
 */
function partnersOf() {
  const sums = new Map();
  const add = (key, m2) => sums.set(key, (sums.get(key) ?? 0) + m2);
  ofFaces[0].forEach((a, face) => {
    const [b, m2] = [ofFaces[1][face], surfaceOf(face)];
    for (const key of [`A ${a}`, `B ${b}`, `both ${a} ${b}`]) add(key, m2);
  });
  const partners = new Map();
  for (const [key, m2] of sums) {
    const [kind, a, b] = key.split(" ");
    if (kind !== "both" || isNone(a) || isNone(b)) continue;
    if (m2 / (sums.get(`A ${a}`) + sums.get(`B ${b}`) - m2) > 0.5) partners.set(a, b);
  }
  return partners;
}
export const partners = partnersOf();

/** Whether the labels of a face or pixel in A and in B are of other instances or classes. */
export const isChanged = (a, b) => {
  const isOne = [a, b].some((name) => isNone(name) || name === "<nothing>") ? a === b : partners.get(a) === b;
  return !isOne || classOf(a) !== classOf(b);
};
/** The faces that changed. */
export const changedFaces = ofFaces[0].flatMap((a, face) => (isChanged(a, ofFaces[1][face]) ? [face] : []));

/**
 * The numbers of changed pixels by class in both; and for each image the pixels that changed, those of
 * another class, those of one pair, and those with another number for the same.
 */
function changedPixels() {
  const [pairs, ofImage] = [new Map(), new Map()];
  for (const kind of ["data", "pano"])
    for (const name of readdirSync(join(dataset, `area_1/${kind}/semantic`))) {
      const images = [dataset, other].map((folder) => readPng(join(folder, `area_1/${kind}/semantic`, name)));
      const own = { changed: 0, classes: 0, chair_table: 0, renumbered: 0 };
      for (let y = 0; y < images[0].height; y++)
        for (let x = 0; x < images[0].width; x++) {
          const values = images.map((image) => image.at(x, y));
          const [a, b] = values.map(([r, g, b], side) => names[side][r * 65536 + g * 256 + b] ?? "<nothing>");
          if (!isChanged(a, b)) {
            if (values[0].join() !== values[1].join()) own.renumbered += 1;
            continue;
          }
          own.changed += 1;
          const pair = `${classOf(a)} ${classOf(b)}`;
          pairs.set(pair, (pairs.get(pair) ?? 0) + 1);
          if (classOf(a) !== classOf(b)) own.classes += 1;
          if (pair === "chair table") own.chair_table += 1;
        }
      ofImage.set(name.slice(0, name.indexOf("_domain_")), own);
    }
  return { pairs, ofImage };
}
export const { pairs: pixelPairs, ofImage } = changedPixels();

/** Patches of changed faces with the same two labels, connected at shared corners. */
function patchesOf(faces) {
  const at = new Map();
  const keys = (face) =>
    mesh.faces[face].map((v) => [mesh.vertices[v], ofFaces.map((labels) => labels[face])].join());
  for (const face of faces) for (const key of keys(face)) at.set(key, [...(at.get(key) ?? []), face]);
  const seen = new Set();
  return faces.flatMap((first) => {
    if (seen.has(first)) return [];
    const patch = [first];
    seen.add(first);
    for (const face of patch)
      for (const next of keys(face).flatMap((key) => at.get(key))) {
        if (!seen.has(next)) patch.push(next);
        seen.add(next);
      }
    const [was, is] = ofFaces.map((labels) => labels[first]);
    return [{ was, is, faces: patch.length }];
  });
}
export const patches = patchesOf(changedFaces);
