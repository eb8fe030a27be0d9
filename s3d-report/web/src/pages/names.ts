// Names of views.

import type { Index, View } from "../data.js";
import { named, roomName } from "../dom.js";

/** The name of a view. */
export function nameOf(index: Index, view: View): string {
  if (view.photograph !== null) return named(view.photograph);
  const uuid = view.location === null ? "" : (index.locations[view.location]?.uuid.slice(0, 8) ?? "");
  const number = view.frame === null ? `dropped view ${view.candidate ?? "?"}` : `view ${view.frame}`;
  return `${roomName(view.room)} · ${uuid} · ${number}`;
}
