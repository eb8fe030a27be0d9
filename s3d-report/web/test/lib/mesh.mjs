// The data set's own mesh and votes, read without the code of the page.

import { readFileSync } from "node:fs";
import { inflateRawSync } from "node:zlib";

/** Vertices and triangles of `rgb.obj`, in the world's axes. */
export function readObj(path) {
  const [vertices, faces] = [[], []];
  for (const line of readFileSync(path, "utf8").split("\n")) {
    const words = line.split(/\s+/);
    // The file is Y-up.
    if (words[0] === "v") vertices.push([Number(words[1]), -Number(words[3]), Number(words[2])]);
    if (words[0] === "f") faces.push(words.slice(1, 4).map((word) => Number(word.split("/")[0]) - 1));
  }
  return { vertices, faces };
}

const less = (a, b) => a.map((c, k) => c - b[k]);
const dot = (a, b) => a.reduce((sum, c, k) => sum + c * b[k], 0);

/** The distance of a point from a triangle: from its plane, or from its nearest edge. */
export function distanceTo(point, [a, b, c]) {
  const alongEdge = (from, to) => {
    const edge = less(to, from);
    const t = Math.min(1, Math.max(0, dot(less(point, from), edge) / dot(edge, edge)));
    return Math.hypot(
      ...less(
        point,
        from.map((v, k) => v + t * edge[k]),
      ),
    );
  };
  const [u, v, w] = [less(b, a), less(c, a), less(point, a)];
  const [uu, uv, vv, wu, wv] = [dot(u, u), dot(u, v), dot(v, v), dot(w, u), dot(w, v)];
  const all = uu * vv - uv * uv;
  const [s, t] = [(vv * wu - uv * wv) / all, (uu * wv - uv * wu) / all];
  if (s >= 0 && t >= 0 && s + t <= 1) return Math.hypot(...w.map((x, k) => x - s * u[k] - t * v[k]));
  return Math.min(alongEdge(a, b), alongEdge(b, c), alongEdge(c, a));
}

/** The arrays of an NPZ file; only `<u4` is read. */
export function readNpz(path) {
  const file = readFileSync(path);
  const end = file.lastIndexOf(Buffer.from([0x50, 0x4b, 5, 6]));
  const arrays = {};
  let at = file.readUInt32LE(end + 16);
  for (let k = 0; k < file.readUInt16LE(end + 10); k++) {
    const [method, size, start] = [
      file.readUInt16LE(at + 10),
      file.readUInt32LE(at + 20),
      file.readUInt32LE(at + 42),
    ];
    const [name, extra, comment] = [28, 30, 32].map((place) => file.readUInt16LE(at + place));
    const key = file.toString("utf8", at + 46, at + 46 + name).replace(".npy", "");
    const bytes = start + 30 + file.readUInt16LE(start + 26) + file.readUInt16LE(start + 28);
    const stored = file.subarray(bytes, bytes + size);
    const array = method === 0 ? stored : inflateRawSync(stored);
    const body = array.subarray(10 + array.readUInt16LE(8));
    if (array.toString("latin1", 10, 80).includes("<u4"))
      arrays[key] = Array.from({ length: body.length / 4 }, (_, i) => body.readUInt32LE(4 * i));
    at += 46 + name + extra + comment;
  }
  return arrays;
}
