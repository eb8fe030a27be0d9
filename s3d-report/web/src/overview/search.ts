// Everything with a name in a report, and what fits some words.

import type { Index } from "../data.js";
import { roomName, roomOf } from "../dom.js";
import { nameOf } from "../pages/names.js";
import { inPanorama } from "../pages/view.js";
import { link, spaceLink } from "../route/route.js";
import { boxOf } from "../outline.js";
import { floorOf } from "../storeys.js";

export interface Thing {
  kind: "Room" | "Class" | "Instance" | "Scan location" | "View";
  name: string;
  href: string;
}

/** The direction from a room to the eye that looks at it. */
const BACK = [0.3, -0.62, 0.9];
/** The number of things that are found, and of one kind. */
const [MOST, OF_KIND] = [24, 8];

/** The link to a room: in 3D from above, or else to its views. */
function roomLink(index: Index, room: Index["rooms"][number]): string {
  if (!index.meshes.some(({ area }) => area === room.area))
    return link("views", [], { room: `${room.area}/${room.name}` });
  const box = boxOf(room.outline.flat());
  const size = Math.max(box.w, box.h, 2);
  const at = [box.x + box.w / 2, box.y + box.h / 2, (floorOf(room) ?? 0) + 0.5];
  const from = at.map((c, k) => c + 1.3 * size * (BACK[k] ?? 0));
  return `${spaceLink(room.area, at, from, "texture")}&marks=rooms%2Clocations`;
}

const natural = new Intl.Collator("en", { numeric: true });

/** All things, the kinds in the order in which they are shown. */
export function thingsOf(index: Index): Thing[] {
  const of = (area: number): string => (index.areas.length > 1 ? ` · area ${area}` : "");
  const meshes = new Map(index.meshes.map((mesh) => [mesh.area, mesh]));
  const rooms = index.rooms.map((room): Thing => {
    return { kind: "Room", name: `${roomName(room.name)}${of(room.area)}`, href: roomLink(index, room) };
  });
  const classes = index.classes.flatMap(({ name }, i): Thing[] =>
    index.pixels_by_class[i]
      ? [{ kind: "Class", name, href: link("views", [], { class: String(i), sort: "share" }) }]
      : [],
  );
  const instances = index.labels.flatMap((label): Thing[] => {
    if (label.class === null) return [];
    const parts = label.name.split("_");
    const area = Number(parts[4] ?? index.areas[0]?.area);
    const name = `${parts[0]} ${parts[1]} · ${roomName(roomOf(label.name))}${of(area)}`;
    const href = meshes.get(area)?.has_votes
      ? link("space", [area], { instance: label.name })
      : link("views", [], { class: String(label.class), sort: "share" });
    return [{ kind: "Instance", name, href }];
  });
  instances.sort((a, b) => natural.compare(a.name, b.name));
  const locations = index.locations.flatMap((l): Thing[] => {
    const name = `${roomName(l.room)} · ${l.uuid.slice(0, 8)}${of(l.area)}`;
    const there = l.position && meshes.has(l.area);
    const href = l.pano
      ? link("pano", [l.area, l.uuid])
      : there && l.position
        ? spaceLink(l.area, l.position)
        : null;
    return href === null ? [] : [{ kind: "Scan location", name, href }];
  });
  const views = index.views.flatMap((view): Thing[] => {
    const href = view.picture !== null ? link("view", [view.picture]) : inPanorama(index, view);
    return href === null ? [] : [{ kind: "View", name: nameOf(index, view), href }];
  });
  return [...rooms, ...classes, ...instances, ...locations, ...views];
}

/** Words without case, and with numbers apart, as in `chair3`. */
const plain = (text: string): string => text.toLowerCase().normalize("NFKD").replace(/[_·]/g, " ");

/** The things that have all words, those that begin with the first one first; few of each kind. */
export function matches(things: Thing[], text: string): Thing[] {
  const words = plain(text).split(/\s+/).filter(Boolean);
  const found: { thing: Thing; rank: number; i: number }[] = [];
  things.forEach((thing, i) => {
    const name = ` ${plain(`${thing.name} ${thing.kind}`)}`;
    if (!words.every((word) => name.includes(word))) return;
    const starts = words.filter((word) => name.includes(` ${word}`)).length;
    const begins = words[0] !== undefined && name.startsWith(` ${words[0]}`);
    found.push({ thing, rank: starts + (begins ? 1 : 0), i });
  });
  found.sort((a, b) => b.rank - a.rank || a.i - b.i);
  const left = new Map<string, number>();
  const few = found.filter(({ thing: { kind } }) => {
    const n = left.get(kind) ?? 0;
    left.set(kind, n + 1);
    return n < OF_KIND;
  });
  return few.slice(0, MOST).map(({ thing }) => thing);
}
