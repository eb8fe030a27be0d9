// The mesh: its arrays as the server sends them, and its parts as they are drawn.

import type { Part } from "../../../../s3d-report/web/src/space/files.js";
import type { Place, Scene } from "../scene.js";
import { readBytes } from "../server.js";

/** A part has no more faces, so that building its tree of boxes is short. */
const MOST_FACES = 30_000;
/** The largest step of positions, metres. */
const STEP = 0.0005;
/** A part is at most this large, in steps. */
const MOST_STEPS = 65_000;

export interface Mesh {
  /** 3 a vertex, from the scene's origin. */
  positions: Float32Array;
  /** 3 vertices a face. */
  faces: Uint32Array;
  /** sRGB, 3 a vertex; null if the materials have the colours. */
  colors: Uint8Array | null;
  materials: Uint16Array;
  /** 2 a corner; null without textures. */
  uv: Float32Array | null;
  /** m² a face. */
  areas: Float32Array;
}

export async function readMesh(scene: Scene): Promise<Mesh> {
  const { vertices, faces } = scene;
  const [positions, index, colors, materials, uv] = await Promise.all([
    readBytes("positions.bin", 12 * vertices),
    readBytes("faces.bin", 12 * faces),
    scene.has_colors ? readBytes("colors.bin", 3 * vertices) : null,
    readBytes("materials.bin", 2 * faces),
    scene.textures > 0 ? readBytes("uv.bin", 24 * faces) : null,
  ]);
  const mesh = {
    positions: new Float32Array(positions),
    faces: new Uint32Array(index),
    colors: colors && new Uint8Array(colors),
    materials: new Uint16Array(materials),
    uv: uv && new Float32Array(uv),
  };
  return { ...mesh, areas: areasOf(mesh) };
}

function areasOf({ positions: p, faces }: Pick<Mesh, "positions" | "faces">): Float32Array {
  const areas = new Float32Array(faces.length / 3);
  for (let f = 0; f < areas.length; f++) {
    const [a, b, c] = [3 * faces[3 * f]!, 3 * faces[3 * f + 1]!, 3 * faces[3 * f + 2]!];
    const [ux, uy, uz] = [p[b]! - p[a]!, p[b + 1]! - p[a + 1]!, p[b + 2]! - p[a + 2]!];
    const [vx, vy, vz] = [p[c]! - p[a]!, p[c + 1]! - p[a + 1]!, p[c + 2]! - p[a + 2]!];
    areas[f] = Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx) / 2;
  }
  return areas;
}

/** The middle of a face. */
export function middleOf({ positions, faces }: Pick<Mesh, "positions" | "faces">, face: number): Place {
  return [0, 1, 2].map((axis) => {
    const sum = [0, 1, 2].reduce((s, k) => s + (positions[3 * (faces[3 * face + k] ?? 0) + axis] ?? 0), 0);
    return sum / 3;
  }) as Place;
}

/** The least and the greatest coordinates of some faces. */
export function boxOf(
  { positions, faces }: Pick<Mesh, "positions" | "faces">,
  some: Iterable<number>,
): [Place, Place] {
  const low: Place = [Infinity, Infinity, Infinity];
  const high: Place = [-Infinity, -Infinity, -Infinity];
  for (const face of some)
    for (let k = 0; k < 3; k++) {
      const at = 3 * (faces[3 * face + k] ?? 0);
      for (let axis = 0; axis < 3; axis++) {
        const c = positions[at + axis] ?? 0;
        if (c < (low[axis] ?? 0)) low[axis] = c;
        if (c > (high[axis] ?? 0)) high[axis] = c;
      }
    }
  return [low, high];
}

/** The step of all positions: parts have one grid, so that no gaps open between them. */
export function stepOf(mesh: Pick<Mesh, "positions" | "faces">): number {
  let longest = 0;
  const { positions, faces } = mesh;
  for (let f = 0; f < faces.length / 3; f++) {
    const [low, high] = boxOf(mesh, [f]);
    longest = Math.max(longest, ...high.map((c, k) => c - (low[k] ?? 0)));
  }
  return positions.length === 0 ? STEP : Math.max(STEP, longest / (MOST_STEPS / 2));
}

/** Groups of faces that are close to each other, none too many or too large for a part. */
export function groupsOf(mesh: Pick<Mesh, "positions" | "faces">, step: number): Uint32Array[] {
  const count = mesh.faces.length / 3;
  const done: Uint32Array[] = [];
  const open = [Uint32Array.from({ length: count }, (_, f) => f)];
  for (let group = open.pop(); group; group = open.pop()) {
    const [low, high] = boxOf(mesh, group);
    const sides = high.map((c, k) => c - (low[k] ?? 0));
    const side = Math.max(...sides);
    if (group.length < 2 || (group.length <= MOST_FACES && side <= step * MOST_STEPS)) {
      if (group.length > 0) done.push(group);
      continue;
    }
    const axis = sides.indexOf(side);
    const middle = Float32Array.from(group, (face) => middleOf(mesh, face)[axis] ?? 0);
    const border = middle.slice().sort()[middle.length >> 1] ?? 0;
    let [lower, upper] = [
      group.filter((_, i) => middle[i]! < border),
      group.filter((_, i) => middle[i]! >= border),
    ];
    if (lower.length === 0)
      [lower, upper] = [group.slice(0, group.length >> 1), group.slice(group.length >> 1)];
    open.push(upper, lower);
  }
  return done;
}

/** A part of the mesh from some of its faces. */
export function partOf(mesh: Mesh, group: Uint32Array, step: number): Part {
  const face = group.slice().sort((a, b) => mesh.materials[a]! - mesh.materials[b]! || a - b);
  const [low] = boxOf(mesh, face);
  const cell = low.map((c) => Math.floor(c / step)) as Place;
  const number = new Map<number, number>();
  const index = new Uint32Array(3 * face.length);
  face.forEach((f, i) => {
    for (let k = 0; k < 3; k++) {
      const vertex = mesh.faces[3 * f + k] ?? 0;
      let known = number.get(vertex);
      if (known === undefined) number.set(vertex, (known = number.size));
      index[3 * i + k] = known;
    }
  });
  const position = new Uint16Array(3 * number.size);
  const color = mesh.colors && new Uint8Array(3 * number.size);
  for (const [vertex, at] of number)
    for (let axis = 0; axis < 3; axis++) {
      position[3 * at + axis] = Math.round(mesh.positions[3 * vertex + axis]! / step) - cell[axis]!;
      if (color) color[3 * at + axis] = mesh.colors?.[3 * vertex + axis] ?? 0;
    }
  return {
    origin: cell.map((c) => c * step) as Place,
    step: [step, step, step],
    position,
    color,
    index,
    face,
    material: Uint16Array.from(face, (f) => mesh.materials[f] ?? 0),
    ...coordinatesOf(mesh, face),
  };
}

/** The coordinates in textures of some faces, in steps. */
function coordinatesOf({ uv }: Mesh, face: Uint32Array): Pick<Part, "uv" | "uvOrigin" | "uvStep"> {
  if (!uv) return { uv: null, uvOrigin: [0, 0], uvStep: [0, 0] };
  const low = [Infinity, Infinity] as [number, number];
  const high = [-Infinity, -Infinity] as [number, number];
  for (const f of face)
    for (let k = 0; k < 6; k++) {
      const c = uv[6 * f + k] ?? 0;
      low[k % 2] = Math.min(low[k % 2]!, c);
      high[k % 2] = Math.max(high[k % 2]!, c);
    }
  const uvStep = low.map((c, k) => (high[k]! - c) / 65535) as [number, number];
  const quantised = new Uint16Array(6 * face.length);
  face.forEach((f, i) => {
    for (let k = 0; k < 6; k++)
      quantised[6 * i + k] = Math.round(((uv[6 * f + k] ?? 0) - low[k % 2]!) / (uvStep[k % 2]! || 1));
  });
  return { uv: quantised, uvOrigin: low, uvStep };
}
