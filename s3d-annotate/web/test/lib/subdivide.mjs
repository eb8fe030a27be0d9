// A finer mesh: `node subdivide.mjs FROM.obj TO.obj` cuts each triangle into nine.

import { createReadStream, createWriteStream } from "node:fs";
import { createInterface } from "node:readline";

const [from, to] = process.argv.slice(2);
const out = createWriteStream(to);
const vertices = [];
const coordinates = [];
const between = (a, b, c, [i, j, k]) => a.map((v, axis) => (i * v + j * b[axis] + k * c[axis]) / 3);

const faces = [];
for await (const line of createInterface({ input: createReadStream(from) })) {
  const words = line.split(/\s+/);
  if (words[0] === "v") vertices.push(words.slice(1, 4).map(Number));
  else if (words[0] === "vt") coordinates.push(words.slice(1, 3).map(Number));
  else if (words[0] === "f") faces.push(words.slice(1, 4).map((word) => word.split("/")));
  else if (/^(mtllib|usemtl|o|g) /.test(line)) faces.push(line);
}
const known = new Map();
let [count, coordinate] = [0, 0];
for (const face of faces) {
  if (typeof face === "string") {
    out.write(`${face}\n`);
    continue;
  }
  const corners = face.map(([v]) => vertices[v - 1]);
  const uv = face.map(([, t]) => coordinates[t - 1] ?? [0, 0]);
  const number = new Map();
  for (let i = 0; i <= 3; i++)
    for (let j = 0; j <= 3 - i; j++) {
      const shares = [i, j, 3 - i - j];
      const at = between(...corners, shares).map((c) => c.toFixed(6));
      const key = at.join();
      if (!known.has(key)) {
        known.set(key, ++count);
        out.write(`v ${at.join(" ")}\n`);
      }
      out.write(
        `vt ${between(...uv, shares)
          .map((c) => c.toFixed(6))
          .join(" ")}\n`,
      );
      number.set(`${i}${j}`, `${known.get(key)}/${++coordinate}`);
    }
  const name = (i, j) => number.get(`${i}${j}`);
  for (let i = 0; i < 3; i++)
    for (let j = 0; j < 3 - i; j++) {
      out.write(`f ${name(i + 1, j)} ${name(i, j + 1)} ${name(i, j)}\n`);
      if (i + j < 2) out.write(`f ${name(i + 1, j)} ${name(i + 1, j + 1)} ${name(i, j + 1)}\n`);
    }
}
out.end();
