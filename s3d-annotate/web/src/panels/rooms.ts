// The rooms on a plan: which there are, which are proposed, and on which storey.

import { sizeOf } from "../../../../s3d-report/web/src/outline.js";
import { type Storeys, storeysOf } from "../../../../s3d-report/web/src/storeys.js";
import type { Proposals } from "../proposals.js";
import { words } from "../look.js";
import type { Room, RoomShape, State } from "../scene.js";

/** A room of the plan: accepted with its number, or proposed with its index. */
export interface Drawn {
  key: string;
  room: Room | null;
  proposed: number | null;
  is: RoomShape;
  storey: number;
}

export const areaOf = ({ parts }: RoomShape): number =>
  parts.reduce((sum, { outline }) => sum + sizeOf(outline) / 2, 0);

export const heightsOf = ({ parts }: RoomShape): [number, number] => [
  Math.min(...parts.map(({ heights }) => heights[0])),
  Math.max(...parts.map(({ heights }) => heights[1])),
];

export const nameOf = ({ room, is }: Pick<Drawn, "room" | "is">): string =>
  words(is.name ?? room?.name ?? is.kind ?? (room ? `room ${room.number}` : "room"));

/** All rooms, and the storeys that they make. */
export function drawnRooms(state: State, proposals: Proposals): { rooms: Drawn[]; storeys: Storeys } {
  const shapes = proposals.structure?.rooms ?? [];
  const drafts: Omit<Drawn, "storey">[] = [
    ...state.rooms.map((room) => ({ key: `room ${room.number}`, room, proposed: null, is: room.is })),
    ...proposals.openRooms(state).flatMap((i) => {
      const is = shapes[i];
      return is ? [{ key: `proposed ${i}`, room: null, proposed: i, is }] : [];
    }),
  ].filter(({ is }) => is.parts.length > 0);
  const storeys = storeysOf(
    {
      locations: [],
      rooms: drafts.map(({ key, is }) => ({
        area: 1,
        name: key,
        floor_m2: areaOf(is),
        floor: heightsOf(is)[0],
        heights: heightsOf(is),
        outline: is.parts.map(({ outline }) => outline),
      })),
    },
    1,
  );
  return { rooms: drafts.map((draft) => ({ ...draft, storey: storeys.ofRoom(draft.key) })), storeys };
}
