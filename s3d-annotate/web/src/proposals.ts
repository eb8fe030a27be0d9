// What the server proposes: surfaces of the building, its rooms, and finds of a detector.

import type { Look } from "./look.js";
import { facesOf } from "./mesh/runs.js";
import type { Place, RoomShape, State, Structure } from "./scene.js";
import { NotYet, readJson } from "./server.js";
import type { FaceTable } from "./space/table.js";
import type { Work } from "./work.js";

/** The time between questions for a structure that is still being found, ms. */
const PATIENCE = 1500;
/** A room's floor may be this much off, metres. */
const SLACK = 0.3;

interface Surface {
  class: string;
  faces: Uint32Array;
  room: number | null;
}

const isIn = ([x, y]: readonly number[], outline: readonly (readonly number[])[]): boolean => {
  let inside = false;
  outline.forEach(([ax = 0, ay = 0], i) => {
    const [bx = 0, by = 0] = outline[(i + 1) % outline.length] ?? [];
    if (ay > (y ?? 0) !== by > (y ?? 0) && (x ?? 0) < ax + (((y ?? 0) - ay) * (bx - ax)) / (by - ay))
      inside = !inside;
  });
  return inside;
};

/** Whether a room has a place in the world. */
export const roomHas = (room: RoomShape, world: readonly number[]): boolean =>
  room.parts.some(
    ({ outline, heights: [low, high] }) =>
      (world[2] ?? 0) > low - SLACK && (world[2] ?? 0) < high + SLACK && isIn(world, outline),
  );

/** A place inside a room, a little above its floor: the middle, or beside a corner. */
function insideOf(room: RoomShape): Place | null {
  const part = room.parts[0];
  if (!part) return null;
  const { outline, heights } = part;
  const z = heights[0] + 0.5;
  const mean = [0, 1].map((k) => outline.reduce((sum, p) => sum + (p[k] ?? 0), 0) / outline.length);
  const tries = [
    mean,
    ...outline.map((p, i) => {
      const next = outline[(i + 2) % outline.length] ?? p;
      return [0.5, 0.5].map((share, k) => (p[k] ?? 0) + share * ((next[k] ?? 0) - (p[k] ?? 0)));
    }),
  ];
  const [x, y] = tries.find((p) => isIn(p, outline)) ?? mean;
  return [x ?? 0, y ?? 0, z];
}

export class Proposals {
  structure: Structure | null = null;
  private surfaces: Surface[] = [];
  private readonly surfaceAt: Int32Array;
  /** Called when the proposals are there. */
  arrived: () => void = () => {};

  constructor(
    private readonly work: Work,
    private readonly table: FaceTable,
    private readonly look: Look,
  ) {
    this.surfaceAt = new Int32Array(work.instances.length).fill(-1);
  }

  /** Waits for the structure, and shows it. */
  async load(): Promise<void> {
    for (;;) {
      try {
        this.structure = await readJson<Structure>("structure.json");
        break;
      } catch (e) {
        if (!(e instanceof NotYet)) throw e;
        await new Promise((done) => window.setTimeout(done, PATIENCE));
      }
    }
    this.surfaces = this.structure.surfaces.map((surface) => ({ ...surface, faces: facesOf(surface.faces) }));
    this.surfaces.forEach(({ faces }, i) => {
      for (const face of faces) this.surfaceAt[face] = i;
    });
    this.paint(this.work.instances.keys());
    this.arrived();
  }

  /** Gives faces the colours of their labels, or of what is proposed. */
  paint(faces: Iterable<number>): void {
    const { work, table, look } = this;
    const known = new Map<number, readonly number[]>();
    for (const face of faces) {
      const number = work.at(face);
      if (number > 0) {
        let color = known.get(number);
        if (!color) known.set(number, (color = look.ofInstance(work.instance(number)?.class ?? "", number)));
        table.color(face, color, "labelled", number);
        continue;
      }
      const surface = this.surfaces[this.surfaceAt[face] ?? -1];
      if (surface) table.color(face, look.of(surface.class), "proposed", 0);
      else table.color(face, [0, 0, 0], "none", 0);
    }
  }

  /** Whether a surface has faces that could take its label. */
  private isOpen({ faces }: Surface): boolean {
    return faces.some((face) => this.work.at(face) === 0);
  }

  /** The proposed class of a face without a label; null without one. */
  classAt(face: number): string | null {
    const surface = this.surfaces[this.surfaceAt[face] ?? -1];
    return surface && this.work.at(face) === 0 ? surface.class : null;
  }

  /** The proposed rooms that no room covers yet. */
  openRooms(state: State): number[] {
    return (this.structure?.rooms ?? []).flatMap((room, i) => {
      const inside = insideOf(room);
      return inside && state.rooms.some(({ is }) => roomHas(is, inside)) ? [] : [i];
    });
  }

  /**
   * What Enter accepts: all that is proposed for the room of a face or place, or else the one surface there.
   * Null if nothing is.
   */
  around(face: number | null, world: Place): { surfaces: number[]; rooms: number[] } | null {
    if (!this.structure) return null;
    const at = face === null ? -1 : (this.surfaceAt[face] ?? -1);
    let room = this.surfaces[at]?.room ?? null;
    if (room === null && at < 0) {
      const found = this.structure.rooms.findIndex((shape) => roomHas(shape, world));
      room = found < 0 ? null : found;
    }
    const surfaces = this.surfaces.flatMap((surface, i) =>
      (room === null ? i === at : surface.room === room) && this.isOpen(surface) ? [i] : [],
    );
    const rooms = room !== null && this.openRooms(this.work.state).includes(room) ? [room] : [];
    return surfaces.length + rooms.length > 0 ? { surfaces, rooms } : null;
  }

  /** All that can still be accepted. */
  all(): { surfaces: number[]; rooms: number[] } {
    return {
      surfaces: this.surfaces.flatMap((surface, i) => (this.isOpen(surface) ? [i] : [])),
      rooms: this.openRooms(this.work.state),
    };
  }
}
