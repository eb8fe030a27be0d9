// A histogram that filters: a drag over it chooses a range of values.

import { h, s } from "../dom.js";
import { bins } from "./charts.js";

const [WIDTH, HEIGHT, BINS] = [240, 44, 40];
/** A press that moves no farther is a click, which chooses all again; a share of the width. */
const STILL = 0.015;

export type Range = [min: number | null, max: number | null];

export interface Brush {
  element: HTMLElement;
  /** Shows a range that was chosen elsewhere. */
  show: (range: Range) => void;
}

/** A round number near a value, so that a range reads well: one hundredth of the spread, or finer. */
function rounded(value: number, spread: number): number {
  const step = 10 ** Math.floor(Math.log10(Math.max(spread, 1e-9) / 100));
  return Number((Math.round(value / step) * step).toPrecision(12));
}

/** The range between two shares of the spread; ends at the edge are open. */
export function rangeOf(a: number, b: number, from: number, to: number): Range {
  const [low, high] = [Math.min(a, b), Math.max(a, b)];
  const at = (share: number): number => rounded(from + share * (to - from), to - from);
  return [low <= 0 ? null : at(low), high >= 1 ? null : at(high)];
}

export function brush(name: string, values: number[], range: Range, chosen: (range: Range) => void): Brush {
  const from = values.reduce((least, v) => Math.min(least, v), Infinity);
  const to = Math.max(
    from + 1e-6,
    values.reduce((most, v) => Math.max(most, v), -Infinity),
  );
  const counts = bins(values, from, to, BINS);
  const most = Math.max(1, ...counts);
  const svg = s("svg", {
    class: "brush",
    viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
    preserveAspectRatio: "none",
    "aria-hidden": "true",
  });
  svg.append(s("title", {}, `${name}: drag to choose a range, click to choose all`));
  const bars = counts.map((n, i) => {
    // A bar of few values is seen, too.
    const tall = n === 0 ? 0 : Math.max(1.5, (n / most) * (HEIGHT - 3));
    const size = { x: (i * WIDTH) / BINS + 0.4, y: HEIGHT - tall, width: WIDTH / BINS - 0.8, height: tall };
    return s("rect", { class: "bar", ...size });
  });
  const chosenPart = s("rect", { class: "window", y: 0, height: HEIGHT });
  svg.append(...bars, chosenPart);

  const show = ([min, max]: Range): void => {
    const share = (value: number): number => Math.min(1, Math.max(0, (value - from) / (to - from)));
    const [low, high] = [min === null ? 0 : share(min), max === null ? 1 : share(max)];
    const isAll = min === null && max === null;
    chosenPart.setAttribute("x", String(low * WIDTH));
    chosenPart.setAttribute("width", String(Math.max(1, (high - low) * WIDTH)));
    chosenPart.setAttribute("visibility", isAll ? "hidden" : "visible");
    bars.forEach((bar, i) => {
      const middle = (i + 0.5) / BINS;
      bar.classList.toggle("out", !isAll && (middle < low || middle > high));
    });
  };
  const shareAt = (event: PointerEvent): number => {
    const box = svg.getBoundingClientRect();
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  };
  let start: number | null = null;
  const ranged = (event: PointerEvent): Range => {
    const [a, b] = [start ?? 0, shareAt(event)];
    return Math.abs(a - b) < STILL ? [null, null] : rangeOf(a, b, from, to);
  };
  svg.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    svg.setPointerCapture(event.pointerId);
    start = shareAt(event);
  });
  svg.addEventListener("pointermove", (event) => {
    if (start !== null) show(ranged(event));
  });
  svg.addEventListener("pointerup", (event) => {
    if (start === null) return;
    const now = ranged(event);
    start = null;
    show(now);
    chosen(now);
  });
  svg.addEventListener("pointercancel", () => {
    start = null;
    show(range);
  });
  show(range);
  return { element: h("span", { class: "brushed" }, svg), show };
}
