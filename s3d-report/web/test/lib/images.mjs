// The data set's own images, decoded without the code of the page.

import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";
import { PNG } from "pngjs";

/** A PNG file: width, height, and a function that gives the samples of a pixel as stored. */
export function readPng(path) {
  const png = PNG.sync.read(readFileSync(path), { skipRescale: true });
  return {
    width: png.width,
    height: png.height,
    at: (x, y) => Array.from(png.data.subarray(4 * (y * png.width + x), 4 * (y * png.width + x) + 3)),
  };
}

/** The value of a half float with these bits. */
function half(bits) {
  const [sign, exponent, fraction] = [bits & 0x8000 ? -1 : 1, (bits >> 10) & 31, bits & 1023];
  if (exponent === 0) return sign * fraction * 2 ** -24;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

/** World coordinates: an OpenEXR file of half floats B, G, R in lines, compressed by ZIP or not at all. */
export function readXyz(path) {
  const file = readFileSync(path);
  let at = 8;
  const word = () => {
    const end = file.indexOf(0, at);
    const text = file.toString("latin1", at, end);
    at = end + 1;
    return text;
  };
  const head = {};
  for (let name = word(); name !== ""; name = word()) {
    word();
    const size = file.readInt32LE(at);
    head[name] = file.subarray(at + 4, at + 4 + size);
    at += 4 + size;
  }
  const window = head.dataWindow;
  const [width, height] = [window.readInt32LE(8) + 1, window.readInt32LE(12) + 1];
  const compression = head.compression[0];
  const lines = { 0: 1, 2: 1, 3: 16 }[compression];
  if (lines === undefined) throw new Error(`${path}: compression ${compression} is not read here`);
  const rows = new Array(height);
  for (let block = 0; block < Math.ceil(height / lines); block++) {
    const start = Number(file.readBigUInt64LE(at + 8 * block));
    const [first, size] = [file.readInt32LE(start), file.readInt32LE(start + 4)];
    const count = Math.min(lines, height - first);
    let bytes = file.subarray(start + 8, start + 8 + size);
    if (size < count * width * 6) bytes = unzip(bytes);
    for (let row = 0; row < count; row++) {
      const channel = (c, x) => half(bytes.readUInt16LE(2 * (width * (3 * row + c) + x)));
      rows[first + row] = (x) => [channel(2, x), channel(1, x), channel(0, x)];
    }
  }
  return { width, height, at: (x, y) => rows[y](x) };
}

/** Undoes OpenEXR's ZIP: inflates, sums the differences, and interleaves the two halves. */
function unzip(bytes) {
  const mixed = inflateSync(bytes);
  for (let i = 1; i < mixed.length; i++) mixed[i] = (mixed[i - 1] + mixed[i] - 128) & 255;
  const out = Buffer.alloc(mixed.length);
  const middle = Math.ceil(mixed.length / 2);
  for (let i = 0; i < mixed.length; i++) out[i] = mixed[i % 2 === 0 ? i / 2 : middle + (i - 1) / 2];
  return out;
}
