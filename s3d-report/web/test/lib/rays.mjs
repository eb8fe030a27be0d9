// Rays through the canvas, cast at every face of the data set's own mesh; and its faces with a texture.

import { readFileSync } from "node:fs";

const less = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((c) => c / Math.hypot(...a));

/** For each face of `rgb.obj`, whether its material has a texture. */
export function texturedFaces(folder) {
  const words = (name) =>
    readFileSync(`${folder}/${name}`, "utf8")
      .split("\n")
      .map((line) => line.trim().split(/\s+/));
  const textured = new Set();
  let material = "";
  for (const [word, name] of words("rgb.mtl")) {
    if (word === "newmtl") material = name;
    if (word === "map_Kd") textured.add(material);
  }
  const faces = [];
  for (const [word, name] of words("rgb.obj")) {
    if (word === "usemtl") material = name;
    if (word === "f") faces.push(textured.has(material));
  }
  return faces;
}

/**
 * The first front that a ray meets, no higher than the section (Möller and Trumbore). The hit is `clear`
 * unless it is near an edge, or another face is just behind.
 */
export function firstFront({ vertices, faces }, from, ray, section = Infinity) {
  let [best, second] = [null, Infinity];
  faces.forEach((corners, face) => {
    const [a, b, c] = corners.map((corner) => vertices[corner]);
    const [ab, ac] = [less(b, a), less(c, a)];
    const across = cross(ray, ac);
    const det = dot(ab, across);
    if (det <= 1e-12) return;
    const to = less(from, a);
    const u = dot(to, across) / det;
    const turned = cross(to, ab);
    const v = dot(ray, turned) / det;
    const t = dot(ac, turned) / det;
    // A ray that only just misses a face may hit it on the screen.
    if (u < -0.02 || v < -0.02 || u + v > 1.02 || t <= 0) return;
    const point = from.map((f, k) => f + t * ray[k]);
    if (point[2] > section) return;
    const edge = Math.min(u, v, 1 - u - v);
    if (!best || t < best.t) {
      second = best?.t ?? Infinity;
      best = { face, t, point, edge };
    } else second = Math.min(second, t);
  });
  if (!best) return null;
  return { ...best, clear: best.edge > 0.02 && second - best.t > 0.02 };
}

/**
 * The ray of a point of the canvas, in shares of its size, with `at` in the middle and 50° from top to
 * bottom.
 */
function rayOf(from, at, [u, v], aspect) {
  const ahead = unit(less(at, from));
  const right = unit(cross(ahead, [0, 0, 1]));
  const up = cross(right, ahead);
  const tan = Math.tan((25 * Math.PI) / 180);
  const [x, y] = [(2 * u - 1) * tan * aspect, (1 - 2 * v) * tan];
  return unit(ahead.map((c, k) => c + x * right[k] + y * up[k]));
}

/** Places on the canvas that lie on no line, in shares of its size. */
export const spread = (count) =>
  Array.from({ length: count }, (_, k) => [
    0.04 + 0.92 * ((k * 0.618034) % 1),
    0.12 + 0.84 * ((k + 0.5) / count),
  ]);

/** A whole pixel of the page near a place on the canvas, and the ray of its middle. */
export function aim(box, stand, place) {
  const [x, y] = [Math.round(box.x + place[0] * box.width), Math.round(box.y + place[1] * box.height)];
  const exact = [(x - box.x) / box.width, (y - box.y) / box.height];
  return { x, y, ray: rayOf(stand.from, stand.at, exact, box.width / box.height) };
}

export const onCanvas = (page, x, y) =>
  page.evaluate(([px, py]) => document.elementFromPoint(px, py)?.tagName === "CANVAS", [x, y]);
