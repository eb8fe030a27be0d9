// The part of the address after `#`: a page, its content, and its look.

import { remember } from "./memory.js";

export interface Route {
  page: string;
  path: string[];
  query: URLSearchParams;
}

/** The page that a route opens. */
export interface Page {
  element: HTMLElement;
  close: () => void;
  /** The element that is scrolled into view at first, and gets the focus. */
  start?: HTMLElement;
  /** Loads so much of the page that it is this high, CSS pixels. */
  reach?: (height: number) => void;
}

/** What is shown of a page while it is made. */
export interface Sight {
  element: HTMLElement;
  /** Draws it, once it has its place. */
  draw: () => void;
}

export function parseRoute(hash: string): Route {
  const text = hash.replace(/^#\/?/, "");
  const at = text.indexOf("?");
  const path = (at < 0 ? text : text.slice(0, at)).split("/").map(decode);
  return {
    page: path[0] ?? "",
    path: path.slice(1),
    query: new URLSearchParams(at < 0 ? "" : text.slice(at + 1)),
  };
}

function decode(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

export function link(
  page: string,
  path: (string | number)[] = [],
  query: Record<string, string> = {},
): string {
  const parts = [page, ...path.map((part) => encodeURIComponent(part))].join("/");
  const words = new URLSearchParams(query).toString();
  return `#/${parts}${words === "" ? "" : `?${words}`}`;
}

/** Changes the address without a new entry in the history, and without opening the page again. */
export function replaceRoute(page: string, path: (string | number)[], query: Record<string, string>): void {
  const address = link(page, path, query);
  history.replaceState(null, "", address);
  remember({ page, path: path.map(String) }, address);
}

/** A number in the address, if it is within bounds; otherwise the given one. */
export function numberOf(
  query: URLSearchParams,
  name: string,
  min: number,
  max: number,
  otherwise: number,
): number {
  const text = query.get(name);
  const value = text === null || text.trim() === "" ? Number.NaN : Number(text);
  return Number.isFinite(value) ? Math.min(max, Math.max(min, value)) : otherwise;
}

/** The link to a place in 3D, with its viewpoint and colours. */
export function spaceLink(
  area: number,
  at: number[],
  from: number[] | null = null,
  show: string | null = null,
): string {
  const words = (point: number[]): string => point.map((c) => c.toFixed(3)).join(",");
  return link("space", [area], { at: words(at), ...(from && { from: words(from) }), ...(show && { show }) });
}
