// Shared by the tests of the page: the report and its data set, and comparisons of the two. S3D_REPORT and
// S3D_DATASET name the folders; `run` makes them.

import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { readout } from "./browser.mjs";
import { bundled } from "./bundled.mjs";
import { readPng, readXyz } from "./images.mjs";

export const report = process.env["S3D_REPORT"];
export const dataset = process.env["S3D_DATASET"];
export const bare = process.env["S3D_BARE_REPORT"];
export const json = (path, folder = dataset) => JSON.parse(readFileSync(join(folder, path), "utf8"));
const { paletteOf } = await bundled("palette.ts");
export const index = readIndex(report);

export function readIndex(folder) {
  const script = readFileSync(join(folder, "data/index.js"), "utf8");
  return coloured(
    JSON.parse(JSON.parse(script.slice('s3dReport("index",'.length, script.lastIndexOf(");")))),
  );
}

/** An index with the page's own colours of classes. */
export function coloured(read) {
  const colors = paletteOf(read.classes.map(({ name }) => name));
  read.classes.forEach((each, i) => (each.color = colors[i]));
  return read;
}

/** A data set's own images of a panorama or view. */
export function ownImages(area, kind, stem, from = dataset) {
  const path = (folder, ending) => join(from, `area_${area}/${kind}/${folder}/${stem}_domain_${ending}`);
  const label = readPng(path("semantic", "semantic.png"));
  const depth = readPng(path("depth", "depth.png"));
  const names = json("assets/semantic_labels.json", from);
  return {
    width: depth.width,
    height: depth.height,
    pose: JSON.parse(readFileSync(path("pose", "pose.json"), "utf8")),
    xyz: readXyz(path("global_xyz", "global_xyz.exr")),
    depth: (x, y) => depth.at(x, y)[0] / 512,
    label: (x, y) => {
      const [r, g, b] = label.at(x, y);
      return names[r * 65536 + g * 256 + b];
    },
  };
}

export const stemOf = (folder, uuid, frame) => {
  const names = readdirSync(join(dataset, folder));
  const found = names.find((name) => name.includes(`_${uuid}_`) && name.includes(`_frame_${frame}_`));
  return found.slice(0, found.indexOf("_domain_"));
};

export const times = (m, v) => m.map((row) => row.reduce((sum, a, k) => sum + a * v[k], 0));
export const transposed = (m) => m[0].map((_, c) => m.map((row) => row[c]));
/** The camera's axes right, down and forward, from a pose file's matrix. */
export const rotationOf = (pose) => pose.camera_rt_matrix.map((row) => row.slice(0, 3));

/** Compares the readout under the pointer with the data set's files. */
export function hold(told, own, [i, j], [width, height]) {
  const [x, y] = [
    Math.floor(((2 * i + 1) * own.width) / (2 * width)),
    Math.floor(((2 * j + 1) * own.height) / (2 * height)),
  ];
  const name = own.label(x, y);
  const where = `pixel ${i},${j}, of the data set ${x},${y}`;
  assert.equal(told.pixel, `${i},${j}`, where);
  assert.equal(told.class, name.startsWith("<UNK>") ? "unlabelled" : name.split("_")[0], where);
  if (!name.startsWith("<UNK>")) assert.equal(told.instance, name, where);
  const xyz = told["X Y Z"].trim().split(/\s+/).map(Number);
  const ours = own.xyz.at(x, y);
  xyz.forEach((c, axis) => assert.ok(Math.abs(c - ours[axis]) < 0.01, `${where}: ${xyz} and ${ours}`));
  return { x, y, distance: Number.parseFloat(told.distance) };
}

export const near = (a, b, tolerance, words) =>
  assert.ok(Math.abs(a - b) <= tolerance, `${words}: ${a} and ${b}`);

/** Points of a box that lie on no line. */
export function spread(count, box) {
  return Array.from({ length: count }, (_, k) => [
    Math.round(box.x + box.width * (0.06 + 0.88 * ((k * 0.618034) % 1))),
    Math.round(box.y + box.height * (0.16 + 0.8 * ((k + 0.5) / count))),
  ]);
}

export const degrees = Math.PI / 180;
export const queryOf = (page) =>
  page.evaluate(() => Object.fromEntries(new URLSearchParams(location.hash.split("?")[1] ?? "")));

/**
 * The pixel of a reduced panorama that a point of the screen shows, by vectors instead of the page's
 * formulas.
 */
export function panoramaPixel(own, gaze, box, [px, py], [width, height]) {
  const f = Math.max(box.width, box.height) / 2 / Math.tan(gaze.fov / 2);
  const [x, y] = [(px - box.x - box.width / 2) / f, (py - box.y - box.height / 2) / f];
  // A level camera that looks along the middle of the panorama, turned to the right by lon and up by lat.
  const forward = rotationOf(own.pose)[2];
  const azimuth = Math.atan2(forward[1], forward[0]) - gaze.lon;
  const [c, s, cl, sl] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(gaze.lat), Math.sin(gaze.lat)];
  const [right, ahead, up] = [
    [s, -c, 0],
    [c * cl, s * cl, sl],
    [-c * sl, -s * sl, cl],
  ];
  const ray = [0, 1, 2].map((k) => ahead[k] + x * right[k] - y * up[k]);
  const centre = Math.atan2(forward[1], forward[0]);
  const u = ((centre - Math.atan2(ray[1], ray[0])) / (2 * Math.PI) + 2.5) % 1;
  const v = 0.5 - Math.atan2(ray[2], Math.hypot(ray[0], ray[1])) / Math.PI;
  return [u * width, v * height];
}

export async function holdPanorama(page, at, hover) {
  const location = index.locations[at];
  const stem = stemOf(`area_${location.area}/pano/pose`, location.uuid, "equirectangular");
  const own = ownImages(location.area, "pano", stem);
  const picture = readPicture(report, `pano_${at}`);
  const box = await page.locator(".viewer canvas").boundingBox();
  const query = await queryOf(page);
  const gaze = { lon: query.lon * degrees, lat: query.lat * degrees, fov: query.fov * degrees };
  let held = 0;
  for (const point of spread(40, box)) {
    const [u, v] = panoramaPixel(own, gaze, box, point, picture.size);
    const edge = (c) => Math.min(c - Math.floor(c), Math.ceil(c) - c);
    // On an edge between two pixels both are right.
    if (edge(u) < 0.02 || edge(v) < 0.02) continue;
    if (!(await hover(point))) continue;
    const pixel = [Math.floor(u), Math.floor(v)];
    const { x, y, distance } = hold(await readout(page), own, pixel, picture.size);
    near(distance, own.depth(x, y), 1 / 512, "distance");
    held += 1;
  }
  assert.ok(held >= 20, `${held} pixels were held`);
}

export function readPicture(folder, key) {
  const script = readFileSync(join(folder, `data/${key}.js`), "utf8");
  return JSON.parse(JSON.parse(script.slice(`s3dReport("${key}",`.length, script.lastIndexOf(");"))));
}

export async function holdView(page, view) {
  const { uuid } = index.locations[view.location];
  const own = ownImages(view.area, "data", stemOf(`area_${view.area}/data/pose`, uuid, view.frame));
  const picture = readPicture(report, `views_${Math.floor(view.picture / index.views_per_file)}`)[
    view.picture % index.views_per_file
  ];
  const box = await page.locator(".viewer canvas").boundingBox();
  const scale = Math.min(box.width / own.width, box.height / own.height);
  const rotation = rotationOf(own.pose);
  let held = 0;
  for (const point of spread(26, box)) {
    const u = ((point[0] - box.x - box.width / 2) / scale / own.width + 0.5) * picture.size[0];
    const v = ((point[1] - box.y - box.height / 2) / scale / own.height + 0.5) * picture.size[1];
    const edge = (c) => Math.min(c - Math.floor(c), Math.ceil(c) - c);
    if (edge(u) < 0.02 || edge(v) < 0.02) continue;
    await page.mouse.move(...point);
    if (!(await page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.tagName === "CANVAS", point)))
      continue;
    const { x, y, distance } = hold(await readout(page), own, [Math.floor(u), Math.floor(v)], picture.size);
    // Depth along the optical axis is the distance along the ray, less its slant.
    const [[fx, , cx], [, fy, cy]] = own.pose.camera_k_matrix;
    const ray = times(transposed(rotation), [(x + 0.5 - cx) / fx, (y + 0.5 - cy) / fy, 1]);
    near(distance / Math.hypot(...ray), own.depth(x, y), 1 / 512, "depth");
    held += 1;
  }
  assert.ok(held >= 20, `${held} pixels were held`);
}

/** The script of a report's file. */
export const script = (key, value) => `s3dReport("${key}",${JSON.stringify(JSON.stringify(value))});\n`;

/** Calls `use` with a copy of a report, whose files are changed by `change(write, folder)`. */
export async function withCopy(change, use, from = report) {
  const made = mkdtempSync(join(tmpdir(), "s3d-report-"));
  const folder = join(made, "copy");
  try {
    cpSync(from, folder, { recursive: true });
    change((key, value) => writeFileSync(join(folder, `data/${key}.js`), script(key, value)), folder);
    await use(folder);
  } finally {
    rmSync(made, { recursive: true });
  }
}

/** What axe, which the page has loaded, finds on it: a line for each kind of fault. */
export async function axeFinds(page, hash) {
  const { violations } = await page.evaluate(() => window.axe.run());
  return violations.map(
    ({ id, help, nodes }) => `${hash} ${id} (${help}): ${nodes.length} times, ${nodes[0].html.slice(0, 160)}`,
  );
}
