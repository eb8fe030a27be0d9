// What the server tells of a scene and its labels. Places from the server are in world coordinates; the page
// reckons from the scene's origin, so that small numbers stay exact.

export type Place = [number, number, number];
export type Point = [number, number];
export type FaceRuns = number[];

export interface Scene {
  name: string;
  folder: string;
  version: string;
  faces: number;
  vertices: number;
  origin: Place;
  box: [Place, Place];
  classes: string[];
  room_types: string[];
  has_colors: boolean;
  materials: { color: Place; texture: number | null }[];
  textures: number;
  nodes: number;
  segments: number;
  photographs: { name: string; at: Place; kind: string }[];
  warnings: string[];
}

export interface Instance {
  number: number;
  /** Null without faces. */
  name: string | null;
  class: string;
  faces: number;
  area_m2: number;
}

export interface RoomPart {
  outline: Point[];
  heights: [number, number];
}

export interface RoomShape {
  /** Missing without a type. */
  kind?: string | null;
  /** Missing if the number names the room. */
  name?: string | null;
  parts: RoomPart[];
}

export interface Room {
  number: number;
  name: string | null;
  is: RoomShape;
  faces: number;
}

export interface State {
  revision: number;
  instances: Instance[];
  rooms: Room[];
  labelled_m2: number;
  total_m2: number;
  labelled_pixels: number;
  total_pixels: number;
  can_undo: boolean;
  can_redo: boolean;
}

export interface Structure {
  surfaces: { class: string; faces: FaceRuns; room: number | null; area_m2: number }[];
  rooms: RoomShape[];
}

export interface Doubt {
  face: number;
  node: number;
  area_m2: number;
  at: Place;
  from: Place;
  guess: { class: string; like: string } | null;
}

export interface Check {
  kind: string;
  text: string;
  at: Place;
  from: Place;
  instance: number | null;
}

export interface Patch {
  face: number;
  node: number;
}

export interface Selection {
  patches?: Patch[];
  faces?: FaceRuns;
}

export type Knife =
  | { line: { eye: Place; from: Place; to: Place } }
  | { box: { corners: Place[] } }
  | { color: { tolerance: number } }
  | { faces: FaceRuns };

export type Gesture =
  | { label: { what: Selection; class: string } }
  | { add: { what: Selection; instance: number } }
  | { erase: { what: Selection } }
  | { cut: { at: Patch; by: Knife; class: string | null } }
  | { join: { into: number; instances: number[] } }
  | { class: { instance: number; class: string } }
  | { accept: { surfaces: number[]; rooms: number[] } }
  | { room: { room: number | null; is: RoomShape } }
  | { split_room: { room: number; line: [Point, Point] } }
  | { join_rooms: { into: number; rooms: number[] } }
  | { remove_room: { room: number } }
  | "undo"
  | "redo";

/** Places of the world as the page reckons them, and back. */
export class Frame {
  constructor(private readonly origin: Place) {}

  near(world: readonly number[]): Place {
    return this.origin.map((o, k) => (world[k] ?? 0) - o) as Place;
  }

  world(near: readonly number[]): Place {
    return this.origin.map((o, k) => (near[k] ?? 0) + o) as Place;
  }
}
