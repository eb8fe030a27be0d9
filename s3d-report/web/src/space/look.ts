// How a mesh is shown, as kept in the address.

import type { Index, Mesh, Rgb } from "../data.js";
import type { Slab } from "../storeys.js";
import { SHOWS, type Show } from "./paint.js";
import type { Stand } from "./eye.js";

export const MARKS = ["rooms", "locations", "kept", "dropped"] as const;
export type Mark = (typeof MARKS)[number];

export interface Look {
  show: Show;
  /** What is shown right of a line at this share of the width; null without a line. */
  beyond: Show | null;
  line: number;
  /** The class that keeps its colours; null means all do. */
  only: number | null;
  marks: Set<Mark>;
  /** The instances whose boxes are shown: a class, all, or none. */
  boxes: number | "all" | null;
  /** The height above which all is cut away; null means just below the ceilings. */
  section: number | null;
  /** The height below which all is cut away. */
  base: number;
  at: Rgb | null;
  from: Rgb | null;
  /** Whether the address names a point to mark. */
  place: boolean;
  /** The name of an instance to find. */
  instance: string | null;
  /** The class or instance in A and in B of changed faces to find; null if there is nothing to find. */
  find: { was: string | null; is: string | null } | null;
}

/** The colours in which the faces of a mesh can be shown. */
export const showsOf = (mesh: Mesh, changed: boolean): Show[] =>
  SHOWS.filter((show) =>
    show === "changed" ? changed : show === "texture" || show === "normal" || mesh.has_votes,
  );

/** The lines that can be drawn in a mesh. */
export function marksOf(index: Index, mesh: Mesh): Mark[] {
  const views = index.views.filter((view) => view.area === mesh.area && view.fov_deg !== null);
  const kept = views.filter((view) => view.frame !== null || view.photograph !== null).length;
  const has: Record<Mark, boolean> = {
    rooms: index.rooms.some((room) => room.area === mesh.area),
    locations: index.locations.some((location) => location.area === mesh.area && location.position),
    kept: kept > 0,
    dropped: kept < views.length,
  };
  return MARKS.filter((mark) => has[mark]);
}

function point(text: string | null): Rgb | null {
  const numbers = (text ?? "").split(",").map((word) => (word.trim() === "" ? Number.NaN : Number(word)));
  return numbers.length === 3 && numbers.every((c) => Math.abs(c) < 1e7) ? (numbers as Rgb) : null;
}

function numberIn(query: URLSearchParams, name: string): number | null {
  const text = query.get(name) ?? "";
  const value = text.trim() === "" ? Number.NaN : Number(text);
  return Number.isFinite(value) ? value : null;
}

/** The part of the area that is drawn. */
export const slabIn = ({ section, base }: Look): Slab => ({ low: base, high: section ?? Infinity });

export function lookFrom(index: Index, mesh: Mesh, query: URLSearchParams, changed: boolean): Look {
  const show = query.get("show") as Show;
  const there = marksOf(index, mesh);
  const named = query.get("marks")?.split(",") ?? ["rooms", "locations"];
  const boxes = query.get("boxes");
  const isClass = (word: string | null): boolean =>
    word !== null && /^\d+$/.test(word) && index.classes[Number(word)] !== undefined;
  const only = query.get("only");
  const section = query.get("section");
  return {
    show: showsOf(mesh, changed).includes(show) ? show : "texture",
    beyond: null,
    line: 0.5,
    only: isClass(only) ? Number(only) : null,
    marks: new Set(there.filter((mark) => named.includes(mark))),
    boxes: boxes === "all" ? "all" : isClass(boxes) ? Number(boxes) : null,
    section: section === "none" ? Infinity : numberIn(query, "section"),
    base: numberIn(query, "base") ?? -Infinity,
    at: point(query.get("at")),
    from: point(query.get("from")),
    place: !query.has("show") || !query.has("marks"),
    instance: query.get("instance"),
    find: query.has("was") || query.has("is") ? { was: query.get("was"), is: query.get("is") } : null,
  };
}

export function queryOf(look: Look, { at, from }: Stand): Record<string, string> {
  const words = (place: Rgb): string => place.map((c) => c.toFixed(3)).join(",");
  const { section, base } = look;
  return {
    at: words(at),
    from: words(from),
    show: look.show,
    ...(section !== null && { section: Number.isFinite(section) ? section.toFixed(2) : "none" }),
    ...(Number.isFinite(base) && { base: base.toFixed(2) }),
    marks: [...look.marks].join(","),
    ...(look.only !== null && { only: String(look.only) }),
    ...(look.boxes !== null && { boxes: String(look.boxes) }),
  };
}
