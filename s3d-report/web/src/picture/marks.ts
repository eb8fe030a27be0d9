// Marks in a picture: the point that was clicked last, and a measuring line. Both are in world coordinates,
// so they stay in place while the view turns.

import type { Rgb } from "../data.js";
import { h, s } from "../dom.js";
import { Corners, type Measured } from "./measure.js";

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

/** A click this close to the first corner closes an outline, CSS pixels. */
const CLOSE = 12;

export class Marks {
  private readonly corners = new Corners();
  private pin: Rgb | null = null;
  private readonly fill = s("polygon", { class: "measure-fill" });
  private readonly halos = s("g", { class: "measure-halo" });
  private readonly lines = s("g", { class: "measure" });
  private readonly dots = s("g", {});
  private readonly picture = s(
    "svg",
    { class: "marks", "aria-hidden": "true" },
    this.fill,
    this.halos,
    this.lines,
    this.dots,
  );
  private readonly told = h("span", { class: "chip", role: "status" });
  private readonly place = h("span", { class: "pin", "aria-hidden": "true" });
  private readonly link = h("a", { class: "chip corner", hidden: true }, "Show in 3D");
  readonly elements: Element[] = [this.picture, this.told, this.place, this.link];
  /** Where the first corner was drawn last. */
  private first: [number, number] | null = null;

  /** What the next clicks measure. */
  set measured(what: Measured) {
    this.corners.what = what;
  }

  /** Handles a click while measuring, at a point of the world and of the canvas. */
  measure(point: Rgb, at: [number, number]): void {
    const { first } = this;
    this.corners.add(point, first !== null && Math.hypot(at[0] - first[0], at[1] - first[1]) < CLOSE);
    this.told.textContent = this.corners.words;
  }

  /** Takes back the last corner. */
  undo(): void {
    this.corners.undo();
    this.told.textContent = this.corners.words;
  }

  endMeasure(): void {
    this.corners.clear();
    this.told.textContent = "";
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
    const { points, edges, isClosed, middle } = this.corners;
    this.first = onScreen(points[0] ?? null);
    const dots = points.flatMap((point) => (onScreen(point) ? [point] : []));
    this.dots.replaceChildren(
      ...points.flatMap((point) => {
        const at = onScreen(point);
        return at
          ? [s("circle", { class: "measure-end", r: 5, transform: `translate(${at.join(" ")})` })]
          : [];
      }),
    );
    // Behind the camera there is no outline to fill.
    const isWhole = isClosed && dots.length === points.length;
    const ring = isWhole ? points.map((point) => (onScreen(point) ?? []).join(",")).join(" ") : "";
    this.fill.setAttribute("points", ring);

    const parts = edges.flatMap(([from, to]) => {
      const [a, b] = [project(from), project(to)];
      const ends = a && b ? clipped(a, b) : null;
      if (!ends) return [];
      const [start, end] = [screen(ends[0]), screen(ends[1])];
      const part = inside(start, end, width, height);
      const at = (t: number): [number, number] => [
        start[0] + t * (end[0] - start[0]),
        start[1] + t * (end[1] - start[1]),
      ];
      return part ? [[at(part[0]), at(part[1])] as const] : [];
    });
    for (const lines of [this.halos, this.lines])
      lines.replaceChildren(
        ...parts.map(([[x1, y1], [x2, y2]]) =>
          s(
            "line",
            Object.fromEntries(Object.entries({ x1, y1, x2, y2 }).map(([k, c]) => [k, c.toFixed(2)])),
          ),
        ),
      );
    // The words of a line are in the middle of the part that is seen.
    const [line] = parts;
    const between: [number, number] | null = line
      ? [(line[0][0] + line[1][0]) / 2, (line[0][1] + line[1][1]) / 2]
      : null;
    put(this.told, isClosed ? onScreen(middle) : between);
  }
}
