// Shared by the tests of comparisons: the report of two data sets, and the images of both.

import assert from "node:assert/strict";
import { classOf, isChanged, isNone, ofImage, other } from "../lib/changes.mjs";
import { coloured, dataset, ownImages, readPicture, stemOf } from "../lib/common.mjs";

export const report = process.env["S3D_AGAINST_REPORT"];
export const equal = process.env["S3D_EQUAL_REPORT"];
export const index = coloured(readPicture(report, "index"));
export const compare = readPicture(report, "compare");
export const grouped = (n) => n.toLocaleString("en");

export function stemOfPicture({ picture, pano }) {
  const view = index.views.find((v) => v.picture === picture && picture !== null);
  const at = pano ?? view.location;
  const frame = pano === null ? view.frame : "equirectangular";
  const folder = pano === null ? "data" : "pano";
  return [folder, stemOf(`area_1/${folder}/pose`, index.locations[at].uuid, frame), at];
}

/** The image with the most pixels of another class: its index among the pictures, and both images. */
export function mostChanged(kind) {
  const stems = compare.pictures.map(stemOfPicture);
  const places = stems.map((_, k) => k).filter((k) => stems[k][0] === kind);
  const k = places.sort((a, b) => ofImage.get(stems[b][1]).classes - ofImage.get(stems[a][1]).classes)[0];
  const [folder, stem, location] = stems[k];
  assert.ok(ofImage.get(stem).classes > 50, `${stem} has few pixels of another class`);
  return { k, location, own: [dataset, other].map((from) => ownImages(1, folder, stem, from)) };
}

export const pictureOf = (k) => {
  const { picture, pano } = compare.pictures[k];
  if (pano !== null) return readPicture(report, `pano_${pano}`);
  return readPicture(report, `views_${Math.floor(picture / index.views_per_file)}`)[
    picture % index.views_per_file
  ];
};

const sourceOf = (own, [i, j], [width, height]) => [
  Math.floor(((2 * i + 1) * own.width) / (2 * width)),
  Math.floor(((2 * j + 1) * own.height) / (2 * height)),
];

/** Pixels of a reduced picture whose neighbours have the same labels in both, grouped by their change. */
export function samples(own, size, count) {
  const found = { none: [], renumbered: [], instance: [], class: [] };
  const labels = (i, j) => own.map((image) => image.label(...sourceOf(image, [i, j], size)) ?? "<nothing>");
  for (let j = 2; j < size[1] - 2; j += 2)
    for (let i = 2; i < size[0] - 2; i += 2) {
      const [a, b] = labels(i, j);
      const kind = isChanged(a, b)
        ? classOf(a) === classOf(b)
          ? "instance"
          : "class"
        : a === b
          ? "none"
          : "renumbered";
      const around = [-1, 1].flatMap((d) => [labels(i + d, j), labels(i, j + d)]);
      if (around.every(([x, y]) => x === a && y === b)) found[kind].push({ i, j, a, b, kind });
    }
  const some = (all) => all.filter((_, n) => n % Math.ceil(all.length / count) === 0).slice(0, count);
  return Object.values(found).flatMap(some);
}

export const words = (name) => (isNone(name) ? "unlabelled" : `${name.split("_")[0]} · ${name}`);

export const colorsAt = (png, [x, y]) =>
  Array.from(png.data.subarray(4 * (y * png.width + x), 4 * (y * png.width + x) + 3));
