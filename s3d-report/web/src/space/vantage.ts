// Viewpoints that see a place.

import { Vector3 } from "three";
import type { Rgb } from "../data.js";
import type { Slab } from "../storeys.js";
import { type Stand, rgb } from "./eye.js";
import type { Surface } from "./surface.js";

/** The viewpoint of a patch: so many times as far away as it is wide, within these distances, metres. */
const AWAY = 5;
const [NEAREST, FARTHEST] = [0.7, 3];
/** The least cosine of the angle at which a face is looked at. */
const FACING = 0.25;

/** The number of scan locations that are tried, the nearest first. */
const MOST_STANDS = 30;

/** A point, moved by a multiple of a vector. */
const moved = (from: Rgb, way: Vector3, times: number): Rgb =>
  rgb(new Vector3(...from).addScaledVector(way, times));

/** A place to look at, its size, and how far the mesh may be off it, metres. */
export interface Place {
  at: Rgb;
  size: number;
  slack: number;
}

/**
 * A viewpoint with a free view of a place, in front of its face: towards a scan location that sees it, or
 * else in front of it, or as near as possible to the current direction.
 */
export function vantage(surface: Surface, slab: Slab, place: Place, locations: Rgb[], now: Stand): Rgb {
  const { at, size, slack } = place;
  const away = Math.min(FARTHEST, Math.max(NEAREST, AWAY * size));
  const normal = surface.normalAt(at);
  const target = normal ? moved(at, normal, 0.02 + slack) : at;
  const faces = (back: Vector3): boolean => !normal || back.dot(normal) > FACING;
  const isFree = (from: Rgb): boolean => surface.isFree(from, target);

  const stands = locations.map((location) => new Vector3(...location).sub(new Vector3(...at)));
  stands.sort((a, b) => a.length() - b.length());
  const seen = stands.slice(0, MOST_STANDS).find((way) => {
    return faces(way.clone().normalize()) && way.length() > NEAREST / 2 && isFree(moved(at, way, 1));
  });
  if (seen) return moved(at, seen, Math.min(1, away / seen.length()));

  const isShown = (from: Rgb): boolean => isSeen(surface, slab, from, place);
  // From below only if nothing else is left.
  for (const rises of [
    [30, 55, 8, 80],
    [-25, -60],
  ])
    for (const distance of [away, away / 2, away / 4]) {
      const found = around(normal, now, rises)
        .filter(faces)
        .map((back) => moved(at, back, distance))
        .find((from) => isFree(from) && isShown(from));
      if (found) return found;
    }
  return normal ? moved(at, normal, NEAREST / 2) : now.from;
}

/** Directions to look from, by their angle above the horizon, those in front or near the current one first. */
function around(normal: Vector3 | null, { from, at }: Stand, rises: number[]): Vector3[] {
  const isSteep = !normal || Math.hypot(normal.x, normal.y) < 0.5;
  const azimuth = isSteep ? Math.atan2(from[1] - at[1], from[0] - at[0]) : Math.atan2(normal.y, normal.x);
  return rises.flatMap((degrees) =>
    Array.from({ length: 16 }, (_, k) => {
      const turned = azimuth + (k % 2 === 0 ? k / 2 : -(k + 1) / 2) * (Math.PI / 8);
      const rise = (degrees * Math.PI) / 180;
      const level = Math.cos(rise);
      return new Vector3(level * Math.cos(turned), level * Math.sin(turned), Math.sin(rise));
    }),
  );
}

/** Whether the front of a face near a place is what one sees from a viewpoint. */
function isSeen(surface: Surface, slab: Slab, from: Rgb, { at, size, slack }: Place): boolean {
  const ray = new Vector3(...at).sub(new Vector3(...from)).normalize();
  const hit = surface.pick(new Vector3(...from), ray, slab);
  const near = 0.02 + size / 4 + slack;
  return hit !== null && Math.hypot(...hit.point.map((c, axis) => c - (at[axis] ?? 0))) < near;
}
