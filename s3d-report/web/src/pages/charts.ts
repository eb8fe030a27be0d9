// Bars and histograms, drawn as SVG.

import { append, h, s } from "../dom.js";

/** Values in bins of the same width; a last value at the upper end belongs to the last bin. */
export function bins(values: number[], from: number, to: number, count: number): number[] {
  const found = new Array<number>(count).fill(0);
  for (const value of values) {
    if (value < from || value > to) continue;
    const bin = Math.min(count - 1, Math.floor(((value - from) / (to - from)) * count));
    found[bin] = (found[bin] ?? 0) + 1;
  }
  return found;
}

export interface Histogram {
  title: string;
  unit: string;
  from: number;
  to: number;
  bins: number;
  kept: number[];
  dropped: number[];
  /** The density that values were drawn from, if there is one; its scale does not matter. */
  density?: (value: number) => number;
}

/** Kept values with dropped ones on top of them, and the curve that they were drawn from. */
export function histogram({
  title,
  unit,
  from,
  to,
  bins: n,
  kept,
  dropped,
  density,
}: Histogram): HTMLElement {
  const [w, height, floor] = [320, 130, 110];
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
  const svg = s("svg", { class: "chart", viewBox: `0 0 ${w} ${height}`, role: "img", "aria-label": words });
  const step = w / n;
  low.forEach((count, i) => {
    const [start, end] = [i, i + 1].map((k) => (from + (k / n) * (to - from)).toFixed(1));
    const text = `${start} to ${end} ${unit}: ${count} kept, ${high[i] ?? 0} dropped`;
    const [x, wide] = [i * step + 0.5, step - 1];
    const sum = count + (high[i] ?? 0);
    append(svg, [
      s(
        "rect",
        { class: "bar", x, y: y(count), width: wide, height: floor - y(count) },
        s("title", {}, text),
      ),
      s(
        "rect",
        { class: "bar dropped", x, y: y(sum), width: wide, height: y(count) - y(sum) },
        s("title", {}, text),
      ),
    ]);
  });
  if (weight > 0) {
    const points = expected.map((count, i) => `${((i + 0.5) * step).toFixed(1)},${y(count).toFixed(1)}`);
    svg.append(s("polyline", { class: "curve", points: points.join(" ") }));
  }
  svg.append(s("line", { class: "axis", x1: 0, x2: w, y1: floor, y2: floor }));
  for (const [value, x, anchor] of [
    [from, 0, "start"],
    [(from + to) / 2, w / 2, "middle"],
    [to, w, "end"],
  ] as const) {
    svg.append(
      s("text", { x, y: height - 5, "text-anchor": anchor }, `${Number(value.toFixed(1))} ${unit}`.trim()),
    );
  }
  return h("figure", {}, h("figcaption", {}, title), svg);
}

/** A bar a row, with its name, its share of the longest, and words. */
export function bars(
  rows: { name: string; value: number; words: string; color: string; href?: string }[],
): HTMLElement {
  const most = Math.max(1e-9, ...rows.map((row) => row.value));
  const list = h("div", { class: "bars", role: "list" });
  for (const { name, value, words, color, href } of rows) {
    const bar = h("span", { class: "bar" });
    bar.style.width = `${(100 * value) / most}%`;
    bar.style.background = color;
    const label = href ? h("a", { href }, name) : h("span", {}, name);
    list.append(
      h(
        "div",
        { class: "bar-row", role: "listitem" },
        label,
        h("span", { class: "track" }, bar),
        h("span", { class: "quiet" }, words),
      ),
    );
  }
  return list;
}
