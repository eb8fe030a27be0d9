// Bars and histograms, drawn as SVG.

import type { Surface } from "../data.js";
import { count, h, metres2, percent, s } from "../dom.js";

/**
 * Counts values in bins of equal width. The first bin includes lower values, the last one the upper end and
 * higher values.
 */
export function bins(values: number[], from: number, to: number, count: number): number[] {
  const found = new Array<number>(count).fill(0);
  for (const value of values) {
    const place = Math.floor(((value - from) / (to - from)) * count + 1e-9);
    const bin = Math.min(count - 1, Math.max(0, place));
    found[bin] = (found[bin] ?? 0) + 1;
  }
  return found;
}

/** The size of a chart, and how high its axis is. */
const [w, height, floor] = [320, 130, 110];

export interface Histogram {
  title: string;
  unit: string;
  from: number;
  to: number;
  bins: number;
  kept: number[];
  dropped: number[];
  /** The density that values were drawn from, if any; its scale does not matter. */
  density?: (value: number) => number;
  /** The link of a bar. A bound is null for the first and last bar, which include values beyond. */
  href: (kept: boolean, min: number | null, max: number | null) => string;
}

/** Arrow keys move the focus from bar to bar; the tab key leaves the chart. */
function roving(bars: SVGElement[]): void {
  bars.forEach((bar, i) => {
    bar.setAttribute("tabindex", i === 0 ? "0" : "-1");
    bar.addEventListener("keydown", (event) => {
      const by = { ArrowRight: 1, ArrowLeft: -1, Home: -i, End: bars.length - 1 - i }[event.key];
      const to = by === undefined ? undefined : bars[i + by];
      if (!to) return;
      event.preventDefault();
      bar.setAttribute("tabindex", "-1");
      to.setAttribute("tabindex", "0");
      to.focus();
    });
  });
}

/** A histogram of kept values with dropped values stacked on top, and the curve that they were drawn from. */
export function histogram({
  title,
  unit,
  from,
  to,
  bins: n,
  kept,
  dropped,
  density,
  href,
}: Histogram): HTMLElement {
  const [low, high] = [bins(kept, from, to, n), bins(dropped, from, to, n)];
  const sums = low.map((count, i) => count + (high[i] ?? 0));
  const all = sums.reduce((a, b) => a + b, 0);
  const at = (i: number): number => from + ((i + 0.5) / n) * (to - from);
  const weights = density ? low.map((_, i) => density(at(i))) : [];
  const weight = weights.reduce((a, b) => a + b, 0);
  const expected = weights.map((v) => (weight > 0 ? (v / weight) * all : 0));
  const most = Math.max(1, ...sums, ...expected);
  const y = (count: number): number => floor - (count / most) * (floor - 8);
  const words = `${title}: ${kept.length} kept, ${dropped.length} dropped`;
  const svg = s("svg", { class: "chart", viewBox: `0 0 ${w} ${height}`, role: "group", "aria-label": words });
  const step = w / n;
  low.forEach((count, i) => {
    const [start, end] = [i, i + 1].map((k) => Number((from + (k / n) * (to - from)).toFixed(4)));
    const x = i * step + 0.5;
    const parts: [boolean, number, number][] = [
      [true, 0, count],
      [false, count, high[i] ?? 0],
    ];
    for (const [kept, below, many] of parts) {
      if (many === 0) continue;
      const text = `${start} to ${end} ${unit}: ${many} ${kept ? "kept" : "dropped"}`;
      const size = { x, y: y(below + many), width: step - 1, height: y(below) - y(below + many) };
      const bar = s("rect", { class: kept ? "bar" : "bar dropped", ...size }, s("title", {}, text));
      const to_grid = href(kept, i === 0 ? null : (start ?? null), i === n - 1 ? null : (end ?? null));
      svg.append(s("a", { href: to_grid, "aria-label": text }, bar));
    }
  });
  roving([...svg.querySelectorAll<SVGAElement>("a")]);
  if (weight > 0) {
    const points = expected.map((count, i) => `${((i + 0.5) * step).toFixed(1)},${y(count).toFixed(1)}`);
    svg.append(s("polyline", { class: "curve", points: points.join(" ") }));
  }
  svg.append(
    ...axis([from, (from + to) / 2, to].map((value) => `${Number(value.toFixed(1))} ${unit}`.trim())),
  );
  return h("figure", {}, h("figcaption", {}, title), svg);
}

/** The axis, with words at its start, middle and end. */
function axis(words: string[]): SVGElement[] {
  const at = (text: string, i: number): SVGElement => {
    const anchor = ["start", "middle", "end"][i];
    return s("text", { x: (i * w) / 2, y: height - 5, "text-anchor": anchor }, text);
  };
  return [s("line", { class: "axis", x1: 0, x2: w, y1: floor, y2: floor }), ...words.map(at)];
}

export interface Spread {
  title: string;
  bins: Surface[];
  /** Describes the faces of a bin. */
  nameOf: (bin: number) => string;
  /** Words below each bar, or at the start, middle and end of the axis. */
  ticks: { of: "bars" | "axis"; words: string[] };
}

/**
 * Shares of faces, each with the share of their surface beside it. A bar's values are shown while the
 * pointer is on it.
 */
export function spread({ title, bins, nameOf, ticks }: Spread): HTMLElement {
  const sum = (of: (bin: Surface) => number): number => bins.reduce((all, bin) => all + of(bin), 0);
  const [faces, m2] = [
    Math.max(
      1,
      sum((bin) => bin.faces),
    ),
    sum((bin) => bin.m2) || 1,
  ];
  const shares = bins.map((bin) => [bin.faces / faces, bin.m2 / m2] as const);
  const most = Math.max(...shares.flat(), 1e-9);
  const step = w / bins.length;
  const svg = s("svg", { class: "chart", viewBox: `0 0 ${w} ${height}`, role: "group", "aria-label": title });
  const told = h("p", { class: "told", "aria-hidden": "true" });
  const bars = bins.map((bin, i) => {
    const words =
      `${nameOf(i)}: ${count(bin.faces)} faces (${percent(bin.faces / faces)}), ` +
      `${metres2(bin.m2)} (${percent(bin.m2 / m2)})`;
    const tell = (text: string) => (): void => void (told.textContent = text);
    const listeners = Object.fromEntries([
      ...["pointerenter", "focus"].map((event) => [event, tell(words)]),
      ...["pointerleave", "blur"].map((event) => [event, tell("")]),
    ]);
    const column = (share: number, k: number): SVGElement => {
      const tall = (share / most) * (floor - 8);
      const size = { x: (i + 0.12 + 0.4 * k) * step, y: floor - tall, width: 0.36 * step, height: tall };
      return s("rect", { class: k === 0 ? "bar" : "bar surface", ...size });
    };
    // The whole column reacts to the pointer, even where its bars are low.
    const target = s("rect", { class: "target", x: i * step, y: 0, width: step, height: floor });
    const parts = [target, ...(shares[i] ?? []).map(column)];
    return s("g", { class: "column", role: "img", "aria-label": words, ...listeners }, ...parts);
  });
  svg.append(...bars, ...axis(ticks.of === "axis" ? ticks.words : []));
  if (ticks.of === "bars") {
    // As many labels as there is room for.
    const every = Math.ceil(bins.length / 12);
    ticks.words.forEach((text, i) => {
      const place = { x: (i + 0.5) * step, y: height - 5, "text-anchor": "middle" };
      if (i % every === 0) svg.append(s("text", place, text));
    });
  }
  roving(bars);
  return h("figure", {}, h("figcaption", {}, title), told, svg);
}

/** A bar in a cell of a table: a share of the longest. */
export function bar(share: number, color: string): HTMLElement {
  const inner = h("span", { class: "bar" });
  inner.style.width = `${Math.max(0, 100 * share)}%`;
  inner.style.background = color;
  return h("span", { class: "track", "aria-hidden": "true" }, inner);
}
