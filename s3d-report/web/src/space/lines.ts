// Lines in the mesh: outlines of rooms, boxes of instances, and frustums of views.

import {
  BufferAttribute,
  BufferGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  type Object3D,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import type { Index, Mesh, Rgb, Room, View } from "../data.js";
import { roomOf } from "../dom.js";
import { innermost } from "../outline.js";
import type { Box } from "./files.js";

/** The height of an outline above its floor, and the length of a frustum, metres. */
const ABOVE_FLOOR = 0.03;
const REACH = 0.45;

const ROOM: Rgb = [31, 95, 191];
const KEPT: Rgb = [210, 80, 30];
const DROPPED: Rgb = [118, 118, 124];

const share = (color: Rgb): [number, number, number] => color.map((c) => c / 255) as Rgb;

/** Lines with a width in CSS pixels; `colors` has one for each segment. */
function wide(points: number[], colors: Rgb[], width: number): LineSegments2 {
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(points);
  geometry.setColors(colors.flatMap((color) => [...share(color), ...share(color)]));
  const lines = new LineSegments2(geometry, new LineMaterial({ vertexColors: true, linewidth: width }));
  lines.frustumCulled = false;
  return lines;
}

/** The height of a room's floor: the top of its largest floor, or else the lowest point of its instances. */
export function floorOf(index: Index, mesh: Mesh, boxes: Box[], room: Room): number {
  let floor: { m2: number; top: number } | null = null;
  for (const { label, box } of boxes) {
    const { name, class: place } = index.labels[label] ?? { name: "", class: null };
    const is = place !== null && index.classes[place]?.name === "floor";
    const [x0 = 0, y0 = 0, , x1 = 0, y1 = 0, top = 0] = box;
    const m2 = (x1 - x0) * (y1 - y0);
    if (is && roomOf(name) === room.name && m2 > (floor?.m2 ?? -1)) floor = { m2, top };
  }
  return floor?.top ?? room.floor ?? room.heights?.[0] ?? mesh.min[2];
}

/** The place for a room's name. */
export const placeOfName = (room: Room, floor: number): Rgb => [...innermost(room.outline), floor];

/** The outline of a patch, from pairs of ends; nothing hides it. */
export function borderLines(points: number[]): Object3D {
  const lines = wide(points, Array<Rgb>(points.length / 6).fill(KEPT), 3.5);
  lines.material.depthTest = false;
  lines.renderOrder = 1;
  return lines;
}

export function roomLines(rooms: { room: Room; floor: number }[]): Object3D {
  const points: number[] = [];
  for (const { room, floor } of rooms)
    for (const ring of room.outline)
      ring.forEach(([x, y], i) => {
        const [toX, toY] = ring[(i + 1) % ring.length] ?? [x, y];
        points.push(x, y, floor + ABOVE_FLOOR, toX, toY, floor + ABOVE_FLOOR);
      });
  return wide(points, Array<Rgb>(points.length / 6).fill(ROOM), 2.5);
}

/** Pairs of a cube's corners; bit k of a corner says its end of axis k. */
const EDGES = [0, 1, 2].flatMap((axis) =>
  [0, 1, 2, 3, 4, 5, 6, 7].filter((c) => !(c & (1 << axis))).map((c) => [c, c | (1 << axis)] as const),
);

/** The boxes of the instances of a class, or of all classes. */
export function boxLines(index: Index, boxes: Box[], of_class: number | null): Object3D {
  const points: number[] = [];
  const colors: Rgb[] = [];
  for (const { label, box } of boxes) {
    const place = index.labels[label]?.class ?? null;
    if (place === null || (of_class !== null && place !== of_class)) continue;
    const corner = (c: number): number[] =>
      [0, 1, 2].map((axis) => box[axis + (c & (1 << axis) ? 3 : 0)] ?? 0);
    for (const [a, b] of EDGES) {
      points.push(...corner(a), ...corner(b));
      colors.push(index.classes[place]?.color ?? DROPPED);
    }
  }
  return wide(points, colors, 2);
}

type Axes = { at: Rgb; forward: Rgb; up: Rgb };

/** The position and the axes of a view's camera. */
function axesOf(index: Index, view: View): Axes | null {
  const { position, forward, up, yaw_deg: yaw, pitch_deg: pitch } = view;
  if (position && forward && up) return { at: position, forward, up };
  const location = view.location === null ? undefined : index.locations[view.location];
  if (!location?.position || location.azimuth_rad === null || yaw === null || pitch === null) return null;
  const azimuth = location.azimuth_rad + (yaw * Math.PI) / 180;
  const [c, s] = [Math.cos(azimuth), Math.sin(azimuth)];
  const [level, rise] = [Math.cos((pitch * Math.PI) / 180), Math.sin((pitch * Math.PI) / 180)];
  return { at: location.position, forward: [c * level, s * level, rise], up: [-c * rise, -s * rise, level] };
}

/**
 * The frustums of kept or of dropped views. Views are square. The index does not have the shape of a
 * photograph, so its frustum is drawn as high as it is wide.
 */
export function frustums(index: Index, area: number, kept: boolean): Object3D {
  const points: number[] = [];
  for (const view of index.views) {
    if (view.area !== area || (view.frame !== null || view.photograph !== null) !== kept) continue;
    const axes = axesOf(index, view);
    if (!axes || view.fov_deg === null) continue;
    const { at, forward: f, up: u } = axes;
    const right: Rgb = [f[1] * u[2] - f[2] * u[1], f[2] * u[0] - f[0] * u[2], f[0] * u[1] - f[1] * u[0]];
    const half = REACH * Math.tan((view.fov_deg * Math.PI) / 360);
    const corner = (x: number, y: number): number[] =>
      at.map((c, k) => c + REACH * (f[k] ?? 0) + half * (x * (right[k] ?? 0) + y * (u[k] ?? 0)));
    const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    corners.forEach((here, i) => points.push(...at, ...here, ...here, ...(corners[(i + 1) % 4] ?? here)));
  }
  // There can be 100,000 of them, so they are lines of one pixel.
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  const material = new LineBasicMaterial();
  material.color.setRGB(...share(kept ? KEPT : DROPPED));
  const lines = new LineSegments(geometry, material);
  lines.frustumCulled = false;
  return lines;
}

/** Frees the graphics card's memory for lines. */
export function drop(group: Group): void {
  for (const child of [...group.children] as (LineSegments | LineSegments2)[]) {
    child.geometry.dispose();
    for (const material of [child.material].flat()) material.dispose();
    group.remove(child);
  }
}
