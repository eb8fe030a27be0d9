// The files of a mesh: unpacked, and checked against their own numbers and the index.

import { type Mesh, type Rgb, load } from "../data.js";
import { unpack } from "../picture/faces.js";

/** A part of a mesh, its faces sorted by material. */
export interface Part {
  origin: Rgb;
  step: Rgb;
  /** In steps from the origin, 3 a vertex. */
  position: Uint16Array;
  /** Colours for faces without a texture, 3 a vertex; null if the materials have the colours. */
  color: Uint8Array | null;
  /** Indices of vertices, 3 a face. */
  index: Uint32Array;
  /** In steps from the coordinates' origin, 2 a corner. */
  uv: Uint16Array | null;
  uvOrigin: [number, number];
  uvStep: [number, number];
  /** Indices of the faces in the data set's mesh. */
  face: Uint32Array;
  /** Indices into the mesh's materials. */
  material: Uint16Array;
}

export interface Box {
  label: number;
  /** The smallest and the largest x, y, z. */
  box: number[];
}

interface Packed {
  vertices: number;
  faces: number;
  origin: Rgb;
  step: Rgb;
  uv_origin: [number, number];
  uv_step: [number, number];
  position: string;
  color: string | null;
  index: string;
  uv: string | null;
  face: string;
  material: string;
}

const damaged = (key: string, words: string): Error =>
  new Error(`data/${key}.js is damaged (${words}): make the report again`);

const are = (values: unknown, count: number): boolean =>
  Array.isArray(values) && values.length === count && values.every((v) => Number.isFinite(v));

function all(values: Uint16Array | Uint32Array, below: number): boolean {
  for (let i = 0; i < values.length; i++) if ((values[i] ?? 0) >= below) return false;
  return true;
}

export async function loadPart(mesh: Mesh, part: number): Promise<Part> {
  const key = `mesh_${mesh.area}_${part}`;
  const packed = await load<Packed>(key);
  const { vertices, faces } = packed;
  const bytes = async (name: "position" | "color" | "index" | "uv" | "face" | "material", length: number) => {
    const buffer = await unpack(String(packed[name])).catch(() => {
      throw damaged(key, `${name} cannot be unpacked`);
    });
    if (buffer.byteLength !== length)
      throw damaged(key, `${name} has ${buffer.byteLength} bytes, and ${length} are needed`);
    return buffer;
  };
  if (!are([vertices, faces], 2)) throw damaged(key, "it has no numbers of vertices and faces");
  if (!are(packed.origin, 3) || !are(packed.step, 3)) throw damaged(key, "origin or step is missing");
  const textured = packed.uv !== null;
  if (textured && (!are(packed.uv_origin, 2) || !are(packed.uv_step, 2)))
    throw damaged(key, "uv_origin or uv_step is missing");
  const [position, color, index, uv, face, material] = await Promise.all([
    bytes("position", 6 * vertices),
    packed.color === null ? null : bytes("color", 3 * vertices),
    bytes("index", 12 * faces),
    textured ? bytes("uv", 12 * faces) : null,
    bytes("face", 4 * faces),
    bytes("material", 2 * faces),
  ]);
  const made: Part = {
    origin: packed.origin,
    step: packed.step,
    position: new Uint16Array(position),
    color: color && new Uint8Array(color),
    index: new Uint32Array(index),
    uv: uv && new Uint16Array(uv),
    uvOrigin: textured ? packed.uv_origin : [0, 0],
    uvStep: textured ? packed.uv_step : [0, 0],
    face: new Uint32Array(face),
    material: new Uint16Array(material),
  };
  if (!all(made.index, vertices)) throw damaged(key, "a face has a vertex that does not exist");
  if (!all(made.face, mesh.faces)) throw damaged(key, "a face has a number that the mesh does not have");
  if (!all(made.material, mesh.materials.length)) throw damaged(key, "a face has no material");
  return made;
}

/** The textures of one file, decoded. */
export async function loadTextures(mesh: Mesh, file: number): Promise<HTMLImageElement[]> {
  const key = `textures_${mesh.area}_${file}`;
  const urls = await load<string[]>(key);
  if (!Array.isArray(urls)) throw damaged(key, "it has no list of textures");
  return Promise.all(
    urls.map(async (url, i) => {
      const image = new Image();
      image.src = String(url);
      await image.decode().catch(() => {
        throw damaged(key, `texture ${16 * file + i} cannot be read`);
      });
      return image;
    }),
  );
}

export async function loadBoxes(area: number): Promise<Box[]> {
  const key = `boxes_${area}`;
  const boxes = await load<Box[]>(key);
  if (!Array.isArray(boxes) || !boxes.every((b) => are([b.label], 1) && are(b.box, 6)))
    throw damaged(key, "a box is invalid");
  return boxes;
}
