// The viewpoint, kept in the page's address: it stays when the page is read again.

import type { Stand } from "../../../../s3d-report/web/src/space/eye.js";
import type { Frame, Place } from "../scene.js";
import type { View } from "./view.js";

/** The address follows the eye after it has been still for this long, ms. */
const CALM = 300;

function place(text: string | null): Place | null {
  const numbers = (text ?? "").split(",").map(Number);
  return text && numbers.length === 3 && numbers.every(Number.isFinite) ? (numbers as Place) : null;
}

/** The viewpoint in an address; null without one. */
export function standIn(hash: string, where: Frame): Stand | null {
  const query = new URLSearchParams(hash.replace(/^#/, ""));
  const [at, from] = [place(query.get("at")), place(query.get("from"))];
  return at && from ? { at: where.near(at), from: where.near(from) } : null;
}

/** Keeps the viewpoint and the address the same. Returns what is to be called after each picture. */
export function keepAddress(view: View, where: Frame): () => void {
  let timer = 0;
  let before = "";
  const go = (): void => {
    const stand = standIn(window.location.hash, where);
    if (stand) view.fly(stand);
  };
  const stand = standIn(window.location.hash, where);
  if (stand) view.eye.set(stand);
  window.addEventListener("hashchange", go);
  const write = (): void => {
    if (view.photograph !== null) return;
    const words = (near: Place): string =>
      where
        .world(near)
        .map((c) => c.toFixed(3))
        .join(",");
    const { at, from } = view.eye.stand;
    const hash = `#at=${words(at)}&from=${words(from)}`;
    if (hash !== before) window.history.replaceState(null, "", hash);
    before = hash;
  };
  return () => {
    window.clearTimeout(timer);
    timer = window.setTimeout(write, CALM);
  };
}
