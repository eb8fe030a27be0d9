// What is shown before the index is read: the tabs, and the outline of the rooms.

import type { First, Parts } from "./data.js";
import { h, named, s } from "./dom.js";
import { boxOf } from "./outline.js";
import { link, parseRoute } from "./route/route.js";

/** What is on the page when the program starts. */
export interface Begun {
  /** What is shown first; null if its file cannot be read. */
  first: First | null;
  /** The tabs, if they are shown. */
  header: HTMLElement | null;
  /** The place of the pages. */
  place: HTMLElement;
}

declare global {
  interface Window {
    s3dBegun?: Begun;
  }
}

const NAMES = {
  overview: "Overview",
  pano: "Panoramas",
  space: "3D",
  views: "Views",
  plan: "Plan",
  compare: "Compared",
  scores: "Scores",
  numbers: "Numbers",
  notes: "Notes",
} as const;
type Tab = keyof typeof NAMES;

/** The part of a report that a tab needs. */
const NEEDED: Partial<Record<Tab, keyof Parts>> = {
  overview: "meshes",
  pano: "panoramas",
  space: "meshes",
  views: "views",
  plan: "plan",
  compare: "against",
  scores: "scores",
};

/** The pages with a tab, in order: the first one opens first. */
export const tabsOf = (parts: Parts): Tab[] =>
  (Object.keys(NAMES) as Tab[]).filter((tab) => {
    const part = NEEDED[tab];
    return part === undefined || parts[part];
  });

/** The name of the data set, and the tabs. */
export function headerOf(name: string, parts: Parts): HTMLElement {
  const title = h("a", { class: "title", href: link(""), elementtiming: "title" }, named(name));
  const nav = h("nav", { "aria-label": "Parts of the report" });
  for (const tab of tabsOf(parts)) nav.append(h("a", { href: link(tab), "data-page": tab }, NAMES[tab]));
  return h("header", {}, title, nav);
}

/** The pages that show a frame with a picture. */
const FRAMED: string[] = ["overview", "pano", "space", "view", "plan"] satisfies (Tab | "view")[];

/** Shows the tabs, and a sketch of the page that the address asks for. */
export function sketch({ name, parts, outline }: First, place: HTMLElement): HTMLElement {
  const header = headerOf(name, parts);
  const page = parseRoute(window.location.hash).page || (tabsOf(parts)[0] ?? "");
  header.querySelector(`a[data-page="${CSS.escape(page)}"]`)?.setAttribute("aria-current", "page");
  const words = h("p", { class: "hidden", role: "status" }, "The report is opened.");
  const main = h("main", { class: "look sketch", "aria-busy": "true" }, words);
  if (page === "pano" || page === "view") main.append(h("div", { class: "look-head" }));
  if (FRAMED.includes(page)) main.append(h("div", { class: "frame" }, outlined(outline)));
  place.replaceChildren(main);
  return header;
}

function outlined(rings: [number, number][][]): SVGElement {
  const box = boxOf(rings.flat());
  const ring = (corners: [number, number][]): string =>
    `M${corners.map(([x, y]) => `${(x - box.x).toFixed(2)},${(box.y + box.h - y).toFixed(2)}`).join("L")}Z`;
  const rooms = s("path", { class: "room", d: rings.map(ring).join(""), "fill-rule": "evenodd" });
  rooms.setAttribute("stroke-width", String(Math.max(box.w, box.h) / 300));
  return s("svg", { class: "plan", viewBox: `0 0 ${box.w} ${box.h}`, "aria-hidden": "true" }, rooms);
}

/** The longest wait for the first paint, ms: the browser may paint nothing, or not tell it. */
const PATIENCE = 1500;

/** Waits until the browser has painted what is on the page; not at all if the page is hidden. */
export const painted = (): Promise<void> =>
  new Promise((done) => {
    window.setTimeout(done, document.hidden ? 0 : PATIENCE);
    new PerformanceObserver((list) => {
      if (list.getEntriesByName("first-contentful-paint").length > 0) done();
    }).observe({ type: "paint", buffered: true });
  });
