// How the building is shown on the first page, as kept in the address.

import type { Index, Mesh } from "../data.js";
import { numberOf } from "../route/route.js";
import { type Look, lookFrom } from "../space/look.js";
import type { Show } from "../space/paint.js";
import type { SpaceView } from "../space/view.js";
import { fullest, storeysOf } from "../storeys.js";

/** What is right of the line at first. */
const firstOf = (shows: Show[]): Show => (shows.includes("class") ? "class" : "normal");

/** The look in an address, as far as the mesh has the colourings. */
export function overviewLook(index: Index, mesh: Mesh, shows: Show[], query: URLSearchParams): Look {
  const space = new URLSearchParams({ marks: "locations", show: "texture" });
  for (const name of ["at", "from", "only"]) {
    const value = query.get(name);
    if (value !== null) space.set(name, value);
  }
  const right = query.get("right") as Show;
  const beyond = shows.includes(right) ? right : firstOf(shows);
  const look = lookFrom(index, mesh, space, false);
  // A point without a place to look from would be a place to find.
  if (!look.from) look.at = null;
  if (!mesh.has_votes) look.only = null;
  return { ...look, beyond: beyond === "texture" ? null : beyond, line: numberOf(query, "line", 0, 1, 0.5) };
}

/** The storey in an address, null for all; by default the one with the most rooms. */
export function storeyIn(index: Index, mesh: Mesh, query: URLSearchParams): number | null {
  const word = query.get("storey") ?? "";
  const { all } = storeysOf(index, mesh.area);
  if (word === "all" && all.length > 1) return null;
  return /^\d+$/.test(word) && Number(word) < all.length ? Number(word) : fullest(all);
}

/** The part of an address with all that differs from what is shown at first. */
export function overviewQuery(shows: Show[], view: SpaceView): Record<string, string> {
  const { look, storey, storeys, eye } = view;
  const { at, from } = eye.stand;
  const words = (place: number[]): string => place.map((c) => c.toFixed(3)).join(",");
  const right = look.beyond ?? "texture";
  return {
    ...(storey !== fullest(storeys.all) && { storey: storey === null ? "all" : String(storey) }),
    ...(right !== firstOf(shows) && { right }),
    ...(Math.abs(look.line - 0.5) > 5e-4 && { line: look.line.toFixed(3) }),
    ...(look.only !== null && { only: String(look.only) }),
    ...(eye.touched && { at: words(at), from: words(from) }),
  };
}
