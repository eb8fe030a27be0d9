// The images that share most with a view, as cards under it.

import { type Index, type View, loadSmallPano, loadThumb } from "../data.js";
import { append, h, percent, roomName } from "../dom.js";
import { nameOf } from "../pages/names.js";
import { link } from "../route/route.js";
import type { Partner } from "./data.js";

/** The address of a partner beside a view. */
export function partnerLink(view: number, partner: Partner): string {
  const of = partner.pano === undefined ? ["with", partner.picture ?? 0] : ["pano", partner.pano];
  return link("view", [view, ...of]);
}

/** The name of a partner. */
export function partnerName(index: Index, partner: Partner): string {
  if (partner.pano !== undefined) {
    const location = index.locations[partner.pano];
    return `${roomName(location?.room ?? "")} · ${location?.uuid.slice(0, 8) ?? ""} · panorama`;
  }
  const view = index.views.find((one) => one.picture === partner.picture);
  return view ? nameOf(index, view) : "view";
}

/** `1.35 m away, directions 12° apart`. */
export function apartWords({ distance_m, angle_deg, turn_deg }: Partner): string {
  if (distance_m < 0.01) return `same place, turned by ${turn_deg.toFixed(0)}°`;
  const angle = angle_deg === null ? "" : `, directions ${angle_deg.toFixed(0)}° apart`;
  return `${distance_m.toFixed(2)} m away${angle}`;
}

function card(index: Index, view: number, partner: Partner): HTMLElement {
  const image = h("img", { alt: "", decoding: "async" });
  const small =
    partner.pano === undefined ? loadThumb(index, partner.picture ?? 0) : loadSmallPano(index, partner.pano);
  const none = (words: string): void => image.replaceWith(h("span", { class: "no-thumb" }, words));
  small.then(
    (url) => {
      if (url === null) none("no colours");
      else image.src = url;
    },
    (e: unknown) => none(String(e)),
  );
  const [mine, others] = partner.shared.map(percent);
  const words = [`shows ${mine} of this view`, `this view shows ${others} of it`, apartWords(partner)].map(
    (line) => h("span", { class: "quiet" }, line),
  );
  const name = h("span", { class: "card-name" }, partnerName(index, partner));
  const to = h("a", { href: partnerLink(view, partner) }, image, name, ...words);
  return h("div", { class: "card", role: "listitem" }, to);
}

/** Cards of the partners of a view; null if it has none. */
export function partnerCards(index: Index, view: View, partners: Partner[]): HTMLElement | null {
  if (partners.length === 0 || view.picture === null) return null;
  const section = h("section", { class: "partners" }, h("h2", {}, "Images that share surface with it"));
  const here = partners.filter((one) => one.distance_m < 0.01);
  const there = partners.filter((one) => one.distance_m >= 0.01);
  for (const [words, group] of [
    ["From other places", there],
    ["From the same place", here],
  ] as const) {
    if (group.length === 0) continue;
    const grid = h("div", { class: "grid", role: "list" });
    grid.append(...group.map((partner) => card(index, view.picture ?? 0, partner)));
    append(section, [h("h3", {}, words), grid]);
  }
  return section;
}
