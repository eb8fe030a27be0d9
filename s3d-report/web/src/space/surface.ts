// The faces of a mesh: for drawing, for rays, and for the height of ceilings.

import {
  BufferAttribute,
  BufferGeometry,
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
import { type FaceVotes, NO_VOTES } from "../faces.js";
import type { Part } from "./files.js";
import type { Paint } from "./paint.js";

/** The hit of a ray: the face's index in the data set's mesh. */
export interface Hit {
  face: number;
  point: Rgb;
  distance: number;
}

/** Faces are lit from above and from one side; this is the least light. */
const SHADE = 0.66;
const LAMP = new Vector3(0.35, -0.45, 0.82).normalize();

/**
 * The distance of the section below the ceilings, and the least height of a ceiling above its floor,
 * metres.
 */
const BELOW_CEILING = 0.1;
const ROOM = 1.9;

/** The number of vertices in a sample. */
const SAMPLE = 4000;

/** A height and the surface at it, m². */
type Level = [z: number, m2: number];

/** The height below which lies this share of the surface. */
function levelOf(levels: Level[], share: number): number | null {
  const sorted = [...levels].sort((a, b) => a[0] - b[0]);
  const all = sorted.reduce((sum, [, m2]) => sum + m2, 0);
  let below = 0;
  return sorted.find(([, m2]) => (below += m2) >= share * all)?.[0] ?? null;
}

export class Surface {
  readonly group = new Group();
  private readonly drawings: { mesh: Mesh; materials: Material[] }[] = [];
  private readonly parts: { bvh: MeshBVH; vertices: Float32Array; index: Uint32Array; face: Uint32Array }[] =
    [];
  private readonly up: Level[] = [];
  private readonly down: Level[] = [];
  private readonly ray = new Ray();

  constructor(private readonly paint: Paint) {}

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

  /** A height just below the ceilings; null without any. */
  ceiling(): number | null {
    const floor = levelOf(this.up, 0.02);
    if (floor === null) return null;
    const ceilings = this.down.filter(([z]) => z > floor + ROOM);
    const lowest = levelOf(ceilings, 0.1);
    return lowest === null ? null : lowest - BELOW_CEILING;
  }

  /** A sample of the vertices below the section. */
  sample(section: number): Rgb[] {
    const points: Rgb[] = [];
    const all = this.parts.reduce((sum, { vertices }) => sum + vertices.length / 3, 0);
    const step = Math.max(1, Math.floor(all / SAMPLE));
    for (const { vertices } of this.parts)
      for (let i = 0; i < vertices.length; i += 3 * step) {
        const [x = 0, y = 0, z = 0] = vertices.subarray(i, i + 3);
        if (z <= section) points.push([x, y, z]);
      }
    return points;
  }

  /** The point on some faces that is nearest to their middle, and their surface; null if none is shown. */
  placeOf(faces: Set<number>): { at: Rgb; m2: number } | null {
    const found: { at: Vector3; m2: number }[] = [];
    const corner = (vertices: Float32Array, vertex: number): Vector3 =>
      new Vector3().fromArray(vertices, 3 * vertex);
    for (const { vertices, index, face } of this.parts)
      face.forEach((number, f) => {
        if (!faces.has(number)) return;
        const [a, b, c] = [0, 1, 2].map((k) => corner(vertices, index[3 * f + k] ?? 0)) as [
          Vector3,
          Vector3,
          Vector3,
        ];
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

  /** The first front of a face that a ray hits, below the section. */
  pick(origin: Vector3, direction: Vector3, section: number): Hit | null {
    // The part of the ray below the section.
    let [near, far] = [0, Infinity];
    const meets = (section - origin.z) / direction.z;
    if (origin.z > section) {
      if (direction.z >= 0) return null;
      near = meets;
    } else if (direction.z > 0) far = meets;
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

  close(): void {
    for (const { mesh } of this.drawings) mesh.geometry.dispose();
  }
}
