// Assigns points and rooms to the storeys of an area, and names these.

import type { Index, Room } from "./data.js";
import { several } from "./dom.js";

/**
 * The floors of a storey lie within this height, metres: more than half a storey, so that a split level is
 * one, and less than a low storey.
 */
const SPAN = 1.8;
/** The assumed height of a camera above an unknown floor, metres. */
const CAMERA = 1.5;
/** An object on a floor may be this much below it, metres: less than the ceiling below. */
const SLACK = 0.15;
/** What is higher above the floor of its room belongs to a storey above, metres: a stairwell has several. */
const HEADROOM = 3;
/** A floor this close to the height 0 may be the ground floor, metres. */
const GROUND = 1;

const ORDINALS = ["First", "Second", "Third", "Fourth", "Fifth", "Sixth", "Seventh", "Eighth"];

/** A storey of an area. */
export interface Storey {
  /** `Ground floor`. */
  name: string;
  /** The heights of its lowest and its highest floor. */
  floors: [number, number];
  rooms: Room[];
  locations: number;
}

export interface Storeys {
  /** From the lowest to the highest; at least one. */
  all: Storey[];
  /** The storey of a point between a floor and its ceiling; `room` is the room it is said to be in. */
  of: (z: number, room?: string) => number;
  /** The storey of a room; the lowest, if neither the room's heights nor a location in it is known. */
  ofRoom: (room: string) => number;
}

/** The height of a room's floor. */
export const floorOf = (room: Room): number | null => room.floor ?? room.heights?.[0] ?? null;

/** The part of an area that is drawn: what is between two heights. */
export interface Slab {
  low: number;
  high: number;
}

export const WHOLE: Slab = { low: -Infinity, high: Infinity };

interface Floor {
  z: number;
  isKnown: boolean;
}

/** Floors by storey: each begins with the lowest floor that is left. */
function grouped(floors: Floor[]): Floor[][] {
  const groups: Floor[][] = [];
  for (const floor of [...floors].sort((a, b) => a.z - b.z)) {
    const group = groups.at(-1);
    if (group && floor.z - (group[0]?.z ?? 0) <= SPAN) group.push(floor);
    else groups.push([floor]);
  }
  return groups;
}

export function storeysOf(index: Pick<Index, "rooms" | "locations">, area: number): Storeys {
  const rooms = index.rooms.filter((room) => room.area === area);
  const named = new Map(rooms.map((room) => [room.name, room]));
  const isIn = (z: number, name: string): boolean => {
    const floor = named.has(name) ? floorOf(named.get(name) as Room) : null;
    return floor !== null && z >= floor - SLACK && z < floor + HEADROOM;
  };
  const stands = index.locations.flatMap((l) =>
    l.area === area && l.position ? [{ room: l.room, z: l.position[2] }] : [],
  );

  // A camera tells of a floor that no room has.
  const groups = grouped([
    ...rooms.flatMap((room) => floorOf(room) ?? []).map((z) => ({ z, isKnown: true })),
    ...stands.filter(({ z, room }) => !isIn(z, room)).map(({ z }) => ({ z: z - CAMERA, isKnown: false })),
  ]);
  const floors = groups.map((group): [number, number] => {
    const known = group.filter((floor) => floor.isKnown);
    const heights = (known.length > 0 ? known : group).map(({ z }) => z);
    return [Math.min(...heights), Math.max(...heights)];
  });
  const ofHeight = (z: number): number =>
    Math.max(
      0,
      floors.findLastIndex(([low]) => z >= low - SLACK),
    );
  const ofRoom = (name: string): number => {
    const room = named.get(name);
    const z = (room && floorOf(room)) ?? stands.find((stand) => stand.room === name)?.z;
    return z === undefined ? 0 : ofHeight(z);
  };
  const of = (z: number, room = ""): number => (isIn(z, room) ? ofRoom(room) : ofHeight(z));

  const all = (floors.length > 0 ? floors : [[0, 0] as [number, number]]).map((heights, i): Storey => {
    return {
      name: "",
      floors: heights,
      rooms: rooms.filter((room) => ofRoom(room.name) === i),
      locations: stands.filter(({ z, room }) => of(z, room) === i).length,
    };
  });
  const ground = groundOf(all);
  all.forEach((storey, i) => (storey.name = nameOf(i - ground, ground)));
  return { all, of, ofRoom };
}

const sizeOf = ({ rooms, locations }: Storey): number => (rooms.length > 0 ? rooms.length : locations / 1e6);

/** The storey at the height 0, unless a lower one has as many rooms; the lowest if there is none. */
function groundOf(all: Storey[]): number {
  const away = ({ floors: [low] }: Storey): number => Math.abs(low);
  const nearest = all.reduce((best, storey, i) => (away(storey) < away(all[best] as Storey) ? i : best), 0);
  const storey = all[nearest] as Storey;
  const isTop = all.slice(0, nearest).every((lower) => sizeOf(lower) < sizeOf(storey));
  return away(storey) <= GROUND && isTop ? nearest : 0;
}

/** The name of the storey that is so many above the ground floor, of which so many are below it. */
function nameOf(above: number, below: number): string {
  if (above < 0) return below === 1 ? "Basement" : `Basement ${-above}`;
  if (above === 0) return "Ground floor";
  return `${ORDINALS[above - 1] ?? `${above}th`} floor`;
}

/** The storey with the most rooms, or else the most locations; the lowest of equals. */
export const fullest = (all: Storey[]): number =>
  all.reduce((best, storey, i) => (sizeOf(storey) > sizeOf(all[best] as Storey) ? i : best), 0);

/** `Ground floor · 11 rooms`. */
export function wordsOf({ name, rooms, locations }: Storey): string {
  if (rooms.length > 0) return `${name} · ${several(rooms.length, "room")}`;
  return locations > 0 ? `${name} · ${several(locations, "scan location")}` : name;
}

/** Without ceilings, a storey is cut this high above its highest floor, metres. */
const OPEN = 2.2;
/** The least height of the section above the highest floor, metres. */
const LEAST = 0.4;
/** What lies this much below the floors of a storey belongs to it as well, metres. */
const BELOW = 0.25;

/**
 * The part of the area that shows a storey from above: below its own ceilings, whose height `ceiling`
 * returns for heights that they are between, and above the storeys below.
 */
export function slabOf(
  all: Storey[],
  at: number,
  ceiling: (floor: number, above: number) => number | null,
): Slab {
  const [lowest, highest] = all[at]?.floors ?? [0, 0];
  const next = all[at + 1]?.floors[0] ?? Infinity;
  const found = ceiling(lowest, next);
  const open = Number.isFinite(next) ? Math.min(highest + OPEN, next - BELOW) : Infinity;
  const high = found === null ? open : Math.max(found, highest + LEAST);
  return { low: at === 0 ? -Infinity : lowest - BELOW, high };
}
