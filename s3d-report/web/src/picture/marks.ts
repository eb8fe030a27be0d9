// Marks in a picture: the point that was clicked last, and a measuring line. Both are in world coordinates,
// so they stay in place while the view turns.

import type { Rgb } from "../data.js";
import { h, s } from "../dom.js";

/** A point of the screen as x·w, y·w and w; w is not positive for points behind. */
export type Projected = [number, number, number];

/** Lines nearer to the camera than this are not drawn, metres. */
const NEAR = 1e-3;

function clipped(a: Projected, b: Projected): [Projected, Projected] | null {
  if (a[2] < NEAR && b[2] < NEAR) return null;
  const toward = (behind: Projected, front: Projected): Projected => {
    if (behind[2] >= NEAR) return behind;
    const t = (NEAR - behind[2]) / (front[2] - behind[2]);
    return behind.map((c, i) => c + t * ((front[i] ?? 0) - c)) as Projected;
  };
  return [toward(a, b), toward(b, a)];
}

/** The part of a segment inside a box that starts at (0, 0), or nothing (Liang and Barsky). */
function inside(
  [x0, y0]: [number, number],
  [x1, y1]: [number, number],
  width: number,
  height: number,
): [number, number] | null {
  let [from, to] = [0, 1];
  const [dx, dy] = [x1 - x0, y1 - y0];
  for (const [step, room] of [
    [-dx, x0],
    [dx, width - x0],
    [-dy, y0],
    [dy, height - y0],
  ] as const) {
    if (step === 0) {
      if (room < 0) return null;
    } else if (step < 0) from = Math.max(from, room / step);
    else to = Math.min(to, room / step);
  }
  return from < to ? [from, to] : null;
}

const screen = ([x, y, w]: Projected): [number, number] => [x / w, y / w];

export class Marks {
  /** At most two ends. */
  private ends: Rgb[] = [];
  private pin: Rgb | null = null;
  private readonly halo = s("line", { class: "measure-halo" });
  private readonly line = s("line", { class: "measure" });
  private readonly dots = [0, 1].map(() => s("circle", { class: "measure-end", r: 5 }));
  private readonly picture = s(
    "svg",
    { class: "marks", "aria-hidden": "true" },
    this.halo,
    this.line,
    ...this.dots,
  );
  private readonly distance = h("span", { class: "chip", role: "status" });
  private readonly place = h("span", { class: "pin", "aria-hidden": "true" });
  private readonly link = h("a", { class: "chip corner", hidden: true }, "Show in 3D");
  readonly elements: Element[] = [this.picture, this.distance, this.place, this.link];

  /** The distance between the two ends, metres. */
  get length(): number | null {
    const [a, b] = this.ends;
    return a && b ? Math.hypot(...a.map((c, axis) => c - (b[axis] ?? 0))) : null;
  }

  /** Handles a click while measuring: the first end, the second, or the first of the next line. */
  measure(point: Rgb): void {
    this.ends = this.ends.length === 1 ? [...this.ends, point] : [point];
    const { length } = this;
    this.distance.textContent = length === null ? "" : `${length.toFixed(3)} m`;
  }

  endMeasure(): void {
    this.ends = [];
    this.distance.textContent = "";
  }

  /** Marks the point that was clicked, with a link to it in 3D. */
  pinAt(point: Rgb | null, href: string): void {
    this.pin = point;
    this.link.setAttribute("href", href);
    this.link.hidden = point === null;
  }

  draw(project: (point: Rgb) => Projected | null, width: number, height: number): void {
    const put = (element: HTMLElement, at: [number, number] | null): void => {
      const shown = at !== null && at[0] >= 0 && at[0] <= width && at[1] >= 0 && at[1] <= height;
      element.hidden = !shown;
      if (shown) element.style.transform = `translate(${at[0]}px, ${at[1]}px)`;
    };
    const onScreen = (point: Rgb | null): [number, number] | null => {
      const at = point && project(point);
      return at && at[2] >= NEAR ? screen(at) : null;
    };
    put(this.place, onScreen(this.pin));
    this.dots.forEach((dot, i) => {
      const at = onScreen(this.ends[i] ?? null);
      dot.setAttribute("visibility", at ? "visible" : "hidden");
      if (at) dot.setAttribute("transform", `translate(${at[0]} ${at[1]})`);
    });
    const [a, b] = this.ends.map(project);
    const ends = a && b ? clipped(a, b) : null;
    const [from, to] = ends ? [screen(ends[0]), screen(ends[1])] : [null, null];
    const part = from && to ? inside(from, to, width, height) : null;
    for (const line of [this.halo, this.line]) {
      line.setAttribute("visibility", part ? "visible" : "hidden");
      if (!from || !to || !part) continue;
      const at = (t: number): [number, number] => [
        from[0] + t * (to[0] - from[0]),
        from[1] + t * (to[1] - from[1]),
      ];
      const [[x1, y1], [x2, y2]] = [at(part[0]), at(part[1])];
      for (const [name, value] of Object.entries({ x1, y1, x2, y2 }))
        line.setAttribute(name, value.toFixed(2));
    }
    const middle = part && (part[0] + part[1]) / 2;
    put(
      this.distance,
      from && to && middle !== null
        ? [from[0] + middle * (to[0] - from[0]), from[1] + middle * (to[1] - from[1])]
        : null,
    );
  }
}
