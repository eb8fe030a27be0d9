// The faces of a mesh: for drawing, for rays, and for the height of ceilings.

import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  FrontSide,
  Group,
  type Material,
  Mesh,
  Ray,
  Sphere,
  Vector3,
} from "three";
import { MeshBVH } from "three-mesh-bvh";
import type { Rgb } from "../data.js";
import type { FaceChanges } from "../compare/data.js";
import { type FaceVotes, NO_VOTES } from "../picture/faces.js";
import type { Slab } from "../storeys.js";
import { type Level, belowCeilings, levelOf } from "./ceilings.js";
import type { Part } from "./files.js";

/** Makes the materials of the faces. */
export interface Painter {
  /** The material for the faces of a part that have the material at this index. */
  of: (part: Part, place: number) => Material;
}

/** The hit of a ray: the face's index in the data set's mesh. */
export interface Hit {
  face: number;
  point: Rgb;
  distance: number;
}

/** Faces are lit from above and from one side; this is the least light. */
const SHADE = 0.66;
const LAMP = new Vector3(0.35, -0.45, 0.82).normalize();

/** The number of vertices in a sample. */
const SAMPLE = 4000;

/** A line to a point ends this much before it, metres. */
const SHORT = 0.002;

/** A border is drawn this far off its faces; and the reach of a search for a face, metres. */
const RAISED = 0.008;
const NEARBY = 0.2;

const cornersOf = (vertices: Float32Array, index: Uint32Array, face: number): [Vector3, Vector3, Vector3] =>
  [0, 1, 2].map((k) => new Vector3().fromArray(vertices, 3 * (index[3 * face + k] ?? 0))) as [
    Vector3,
    Vector3,
    Vector3,
  ];

/** A name for a corner; vertices of two parts are one if they are at the same place. */
const key = ({ x, y, z }: Vector3): string => [x, y, z].map((c) => Math.round(1e3 * c)).join();

/** The triangles that hang together by corners with the one next to a point. */
function together<T extends readonly Vector3[]>(triangles: T[], at: Vector3): T[] {
  const touching = new Map<string, T[]>();
  for (const triangle of triangles)
    for (const corner of triangle)
      touching.set(key(corner), [...(touching.get(key(corner)) ?? []), triangle]);
  const off = (triangle: T): number => Math.min(...triangle.map((corner) => corner.distanceTo(at)));
  const first = triangles.reduce<T | null>((best, t) => (best && off(best) <= off(t) ? best : t), null);
  const found = new Set<T>(first ? [first] : []);
  // The set grows while it is gone through.
  for (const triangle of found)
    for (const corner of triangle) for (const next of touching.get(key(corner)) ?? []) found.add(next);
  return [...found];
}

export class Surface {
  readonly group = new Group();
  private readonly drawings: { mesh: Mesh; materials: Material[] }[] = [];
  private readonly parts: { bvh: MeshBVH; vertices: Float32Array; index: Uint32Array; face: Uint32Array }[] =
    [];
  private readonly up: Level[] = [];
  private readonly down: Level[] = [];
  private readonly ray = new Ray();

  constructor(private readonly paint: Painter) {}

  add(part: Part, votes: FaceVotes | null, changes: FaceChanges | null): void {
    const faces = part.face.length;
    const world = new Float32Array(part.position.length);
    for (let i = 0; i < world.length; i++)
      world[i] = (part.origin[i % 3] ?? 0) + (part.step[i % 3] ?? 0) * (part.position[i] ?? 0);
    const position = new Uint16Array(12 * faces);
    const tint = part.color && new Uint8Array(12 * faces);
    const told = new Uint32Array(3 * faces);
    const changed = changes && new Uint8Array(12 * faces);
    const corners = [new Vector3(), new Vector3(), new Vector3()] as const;
    for (let f = 0; f < faces; f++) {
      const number = part.face[f] ?? 0;
      const word = ((votes?.label[number] ?? 0) | ((votes?.margin[number] ?? NO_VOTES) << 24)) >>> 0;
      corners.forEach((corner, k) => corner.fromArray(world, 3 * (part.index[3 * f + k] ?? 0)));
      const light = this.light(corners);
      for (let k = 0; k < 3; k++) {
        const [from, to] = [3 * (part.index[3 * f + k] ?? 0), 4 * (3 * f + k)];
        for (let axis = 0; axis < 3; axis++) {
          position[to + axis] = part.position[from + axis] ?? 0;
          if (tint) tint[to + axis] = part.color?.[from + axis] ?? 0;
        }
        position[to + 3] = Math.round(65535 * light);
        told[3 * f + k] = word;
        if (changed) changed[4 * (3 * f + k)] = changes.kind(number);
      }
    }
    this.group.add(this.drawn(part, position, told, { tint, changed }));
    const met = new BufferGeometry();
    met.setAttribute("position", new BufferAttribute(world, 3));
    met.setIndex(new BufferAttribute(part.index, 1));
    this.parts.push({
      bvh: new MeshBVH(met, { indirect: true }),
      vertices: world,
      index: part.index,
      face: part.face,
    });
  }

  private drawn(
    part: Part,
    position: Uint16Array,
    told: Uint32Array,
    more: Record<"tint" | "changed", Uint8Array | null>,
  ): Mesh {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(position, 4));
    geometry.setAttribute("told", new BufferAttribute(told, 1));
    if (more.tint) geometry.setAttribute("tint", new BufferAttribute(more.tint, 4, true));
    if (more.changed) geometry.setAttribute("changed", new BufferAttribute(more.changed, 4));
    if (part.uv) geometry.setAttribute("uv", new BufferAttribute(part.uv, 2));
    geometry.boundingSphere = new Sphere(new Vector3(32768, 32768, 32768), 65536);
    const materials: Material[] = [];
    const faces = part.material.length;
    for (let from = 0; from < faces;) {
      const place = part.material[from] ?? 0;
      let to = from;
      while (to < faces && part.material[to] === place) to += 1;
      geometry.addGroup(3 * from, 3 * (to - from), materials.length);
      materials.push(this.paint.of(part, place));
      from = to;
    }
    const mesh = new Mesh<BufferGeometry, Material | Material[]>(geometry, materials);
    this.drawings.push({ mesh, materials });
    mesh.position.fromArray(part.origin);
    mesh.scale.fromArray(part.step.map((step) => step || 1));
    mesh.frustumCulled = false;
    return mesh;
  }

  /** Whether to use the materials; otherwise each part is drawn at once with its first material. */
  useMaterials(all: boolean): void {
    for (const { mesh, materials } of this.drawings) mesh.material = all ? materials : (materials[0] ?? []);
  }

  /** The light of a face. Also records the surface of level faces. */
  private light([a, b, c]: readonly [Vector3, Vector3, Vector3]): number {
    const z = (a.z + b.z + c.z) / 3;
    const normal = b.sub(a).cross(c.sub(a));
    const twice = normal.length();
    if (twice === 0) return 1;
    normal.divideScalar(twice);
    if (normal.z > 0.9) this.up.push([z, twice / 2]);
    if (normal.z < -0.9) this.down.push([z, twice / 2]);
    return (1 + SHADE) / 2 + ((1 - SHADE) / 2) * normal.dot(LAMP);
  }

  /** The height of the lowest floor; null without any. */
  floor(): number | null {
    return levelOf(this.up, 0.02);
  }

  /** A height just below the ceilings that are over a floor, and not over the next; null without any. */
  ceiling(floor: number, above: number): number | null {
    return belowCeilings(this.down, floor, above);
  }

  /** A sample of the vertices in a slab. */
  sample({ low, high }: Slab): Rgb[] {
    const points: Rgb[] = [];
    const all = this.parts.reduce((sum, { vertices }) => sum + vertices.length / 3, 0);
    const step = Math.max(1, Math.floor(all / SAMPLE));
    for (const { vertices } of this.parts)
      for (let i = 0; i < vertices.length; i += 3 * step) {
        const [x = 0, y = 0, z = 0] = vertices.subarray(i, i + 3);
        if (z >= low && z <= high) points.push([x, y, z]);
      }
    return points;
  }

  /** The point on some faces that is nearest to their middle, and their surface; null if none is shown. */
  placeOf(faces: Set<number>): { at: Rgb; m2: number } | null {
    const found: { at: Vector3; m2: number }[] = [];
    for (const { vertices, index, face } of this.parts)
      face.forEach((number, f) => {
        if (!faces.has(number)) return;
        const [a, b, c] = cornersOf(vertices, index, f);
        const m2 = b.clone().sub(a).cross(c.clone().sub(a)).length() / 2;
        found.push({ at: a.add(b).add(c).divideScalar(3), m2 });
      });
    const m2 = found.reduce((sum, part) => sum + part.m2, 0);
    if (m2 === 0) return null;
    const middle = new Vector3();
    for (const part of found) middle.addScaledVector(part.at, part.m2 / m2);
    const away = ({ at }: { at: Vector3 }): number => at.distanceToSquared(middle);
    const { x, y, z } = found.reduce((best, part) => (away(part) < away(best) ? part : best)).at;
    return { at: [x, y, z], m2 };
  }

  /** The first front of a face that a ray hits in a slab. */
  pick(origin: Vector3, direction: Vector3, { low, high }: Slab): Hit | null {
    // The part of the ray in the slab.
    const ends = [(low - origin.z) / direction.z, (high - origin.z) / direction.z].sort((a, b) => a - b);
    const isLevel = direction.z === 0;
    if (isLevel && (origin.z < low || origin.z > high)) return null;
    const [near, far] = isLevel ? [0, Infinity] : [Math.max(0, ends[0] ?? 0), ends[1] ?? Infinity];
    if (far < near) return null;
    this.ray.set(origin, direction);
    let best: Hit | null = null;
    for (const { bvh, face } of this.parts) {
      const hit = bvh.raycastFirst(this.ray, FrontSide, near, Math.min(far, best?.distance ?? Infinity));
      if (!hit || (best && hit.distance >= best.distance)) continue;
      const { x, y, z } = hit.point;
      best = { face: face[hit.faceIndex ?? 0] ?? 0, point: [x, y, z], distance: hit.distance };
    }
    return best;
  }

  /** Whether no face, front or back, lies between two points. */
  isFree(from: Rgb, to: Rgb): boolean {
    const way = new Vector3(...to).sub(new Vector3(...from));
    const far = way.length() - SHORT;
    this.ray.set(new Vector3(...from), way.normalize());
    return this.parts.every(({ bvh }) => far <= SHORT || !bvh.raycastFirst(this.ray, DoubleSide, SHORT, far));
  }

  /** The direction that the face next to a point looks in; null if there is no face nearby. */
  normalAt(point: Rgb): Vector3 | null {
    let best: { distance: number; normal: Vector3 } | null = null;
    for (const { bvh, vertices, index } of this.parts) {
      const near = bvh.closestPointToPoint(new Vector3(...point), undefined, 0, best?.distance ?? NEARBY);
      if (!near || near.distance >= (best?.distance ?? NEARBY)) continue;
      const [a, b, c] = cornersOf(vertices, index, near.faceIndex);
      const normal = b.sub(a).cross(c.sub(a));
      if (normal.length() > 0) best = { distance: near.distance, normal: normal.normalize() };
    }
    return best?.normal ?? null;
  }

  /**
   * The border of the faces in a box (lowest and highest x, y, z) that are wanted and hang together with the
   * one next to a point, raised off them: two ends for each edge that only one of them has.
   */
  border(box: number[], at: Rgb, wanted: (face: number) => boolean): number[] {
    const within = ({ x, y, z }: Vector3): boolean =>
      [x, y, z].every((c, k) => c >= (box[k] ?? 0) - RAISED && c <= (box[k + 3] ?? 0) + RAISED);
    const found: [Vector3, Vector3, Vector3][] = [];
    for (const { vertices, index, face } of this.parts)
      face.forEach((number, f) => {
        const corners = wanted(number) ? cornersOf(vertices, index, f) : [];
        if (corners.length === 3 && corners.every(within)) found.push(corners as [Vector3, Vector3, Vector3]);
      });

    const edges = new Map<string, number[]>();
    for (const [a, b, c] of together(found, new Vector3(...at))) {
      const raise = b.clone().sub(a).cross(c.clone().sub(a)).setLength(RAISED);
      for (const [from, to] of [
        [a, b],
        [b, c],
        [c, a],
      ] as const) {
        const back = `${key(to)} ${key(from)}`;
        const ends = [from, to].flatMap((end) => end.clone().add(raise).toArray());
        if (!edges.delete(back)) edges.set(`${key(from)} ${key(to)}`, ends);
      }
    }
    return [...edges.values()].flat();
  }

  close(): void {
    for (const { mesh } of this.drawings) mesh.geometry.dispose();
  }
}
