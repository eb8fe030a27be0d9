// Assigns points and rooms to the storeys of an area.

import type { Index } from "./data.js";

/** Floors closer together than this belong to one storey, metres. */
const GAP = 1.5;
/** The assumed height of a camera above an unknown floor, metres. */
const CAMERA = 1.5;
/** An object on a floor may be this much below it, metres: less than the ceiling below. */
const SLACK = 0.15;

export interface Storeys {
  /** The number of storeys, at least one. */
  count: number;
  /** The storey of a point between a floor and its ceiling. */
  ofHeight: (z: number) => number;
  /** The storey of a room; the lowest, if neither the room's heights nor a location in it is known. */
  ofRoom: (room: string) => number;
}

export function storeysOf(index: Index, area: number): Storeys {
  const rooms = index.rooms.filter((room) => room.area === area);
  const stands = index.locations.flatMap((l) =>
    l.area === area && l.position ? [{ room: l.room, z: l.position[2] }] : [],
  );
  const floors = [
    ...rooms.flatMap(({ heights }) => (heights ? [{ z: heights[0], known: true }] : [])),
    ...stands.map(({ z }) => ({ z: z - CAMERA, known: false })),
  ].sort((a, b) => a.z - b.z);
  const groups: (typeof floors)[] = [];
  for (const floor of floors) {
    const group = groups.at(-1);
    if (group && floor.z - (group.at(-1)?.z ?? 0) <= GAP) group.push(floor);
    else groups.push([floor]);
  }
  const levels = groups.map((group) => (group.find((floor) => floor.known) ?? group[0])?.z ?? 0);
  const ofHeight = (z: number): number =>
    Math.max(
      0,
      levels.findLastIndex((level) => z >= level - SLACK),
    );
  const ofRoom = (name: string): number => {
    const heights = rooms.find((room) => room.name === name)?.heights;
    const z = heights?.[0] ?? stands.find((stand) => stand.room === name)?.z;
    return z === undefined ? 0 : ofHeight(z);
  };
  return { count: Math.max(1, levels.length), ofHeight, ofRoom };
}
