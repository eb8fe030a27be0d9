// What the page remembers while it is open: where one was in each tab, the place on each page, and the layers
// that were chosen.

import { type Page, type Route, link } from "./route.js";

/** A place on a page that was left. */
interface Place {
  scroll: number;
  /** Which `<details>` were open. */
  open: boolean[];
  /** The element with the focus, by its signature and its number among those with the same. */
  focus: [string, number] | null;
}

/** The last address of each kind of page; the last visited comes last. */
const addresses = new Map<string, string>();
const places = new Map<string, Place>();
let now = "";

/** The pages that a list leads to, by the page of the list. */
const DETAILS: Record<string, string> = { views: "view", compare: "pair" };

const kindOf = ({ page, path }: Pick<Route, "page" | "path">): string =>
  page === "compare" && path.length > 0 ? "pair" : page;

/** Remembers the address of the open page. */
export function remember(route: Pick<Route, "page" | "path">, address: string): void {
  const kind = kindOf(route);
  addresses.delete(kind);
  addresses.set(kind, address);
  now = address;
}

/** The address that was visited before any of this kind of page; null if there is none. */
export const lastBefore = (kind: string): string | null =>
  [...addresses].findLast(([visited]) => visited !== kind)?.[1] ?? null;

const signature = (element: Element): string =>
  [element.tagName, element.getAttribute("href"), element.getAttribute("aria-label")].join(" ");

const sameAs = (page: Element, sign: string): Element[] =>
  [...page.querySelectorAll("a, button, input, select, summary, canvas, [tabindex]")].filter(
    (element) => signature(element) === sign,
  );

/** Remembers the place on a page that is left. */
export function leave({ element }: Page): void {
  const focused = document.activeElement;
  const sign = focused && element.contains(focused) ? signature(focused) : null;
  places.set(now, {
    scroll: window.scrollY,
    open: [...element.querySelectorAll("details")].map((details) => details.open),
    focus: sign === null ? null : [sign, focused ? sameAs(element, sign).indexOf(focused) : -1],
  });
}

/** Goes to where one was on a page, or else to its start. */
export function comeBack(page: Page, address: string): void {
  const { element } = page;
  const place = places.get(address);
  if (!place) {
    window.scrollTo(0, 0);
    const start = page.start ?? (document.activeElement === document.body ? element : null);
    start?.setAttribute("tabindex", "-1");
    start?.focus({ preventScroll: true });
    page.start?.scrollIntoView();
    return;
  }
  const details = [...element.querySelectorAll("details")];
  if (details.length === place.open.length)
    details.forEach((each, i) => {
      if (each.open === place.open[i]) return;
      each.open = !each.open;
      // What is made when it opens is needed at once.
      each.dispatchEvent(new Event("toggle"));
    });
  page.reach?.(place.scroll + window.innerHeight);
  window.scrollTo(0, place.scroll);
  if (!place.focus) return;
  const [sign, number] = place.focus;
  const focused = sameAs(element, sign)[number];
  if (focused instanceof HTMLElement || focused instanceof SVGElement) focused.focus({ preventScroll: true });
}

/** Makes each tab lead to where one was in it. The open tab leads from a detail to its list. */
export function pointTabs(nav: Element, route: Route, page: string): void {
  const kind = kindOf({ ...route, page });
  for (const tab of nav.querySelectorAll<HTMLAnchorElement>("a[data-page]")) {
    const its = tab.dataset["page"] ?? "";
    const isOpen = kind === its || DETAILS[its] === kind;
    const kinds = isOpen ? [its] : [its, DETAILS[its] ?? its];
    const last = [...addresses].findLast(([visited]) => kinds.includes(visited))?.[1];
    tab.href = last ?? link(its);
    if (isOpen) tab.setAttribute("aria-current", "page");
    else tab.removeAttribute("aria-current");
    tab.onclick = (event) => {
      if (kind !== its || event.ctrlKey || event.metaKey || event.shiftKey) return;
      // One is there already.
      event.preventDefault();
      window.scrollTo(0, 0);
    };
  }
}

/** The layers and the line between them that were chosen last, for pictures whose address has none. */
export const chosen: { left?: string; right?: string; split?: number } = {};

/** The part of an address with the last direction of view, by panorama. */
export const gazes = new Map<string, Record<string, string>>();
