// Cutting: a part of a patch becomes an object of its own.

import { h, s } from "../../../../s3d-report/web/src/dom.js";
import type { Desk } from "../desk.js";
import { runsOf } from "../mesh/runs.js";
import type { Place, Point } from "../scene.js";
import { type Cut, Preview } from "./preview.js";

export const WAYS = ["line", "box", "color", "brush"] as const;
export type Way = (typeof WAYS)[number];

const NAMES: Record<Way, string> = { line: "Line", box: "Box", color: "Colour", brush: "Brush" };
const TAUGHT: Record<Way, string> = {
  line: "Drag a line across the patch: what lies right of it is cut off.",
  box: "Click four corners on the surface.",
  color: "Click a colour; the wheel, [ and ] set the tolerance.",
  brush: "Drag over faces, with Shift to add; [ and ] set the size.",
};
/** The most rays that a brush sends at once. */
const MOST_RAYS = 420;

export class Cuts {
  way: Way | null = null;
  readonly bar = h("div", { class: "cuts panel", role: "toolbar", "aria-label": "Cut", hidden: true });
  readonly overlay = s("svg", { class: "knife", "aria-hidden": "true" });
  private readonly told = h("span", { class: "quiet" });
  private readonly buttons = new Map<Way, HTMLButtonElement>();
  private tolerance = 0.06;
  private radius = 22;
  private start: Point | null = null;
  private pointer: Point = [-1, -1];
  private corners: Place[] = [];
  private brushed = new Set<number>();
  private brushedAt: { face: number; root: number; instance: number } | null = null;
  /** The object that the brush adds to; null: it makes a new one. */
  private target: number | null = null;
  private readonly preview: Preview;
  private readonly sizes = h("span", { class: "sizes" });

  constructor(private readonly desk: Desk) {
    this.preview = new Preview(desk);
    for (const way of WAYS) {
      const button = h(
        "button",
        { type: "button", "aria-pressed": "false", click: () => this.open(way) },
        NAMES[way],
      );
      this.buttons.set(way, button);
      this.bar.append(button);
    }
    const close = h(
      "button",
      { type: "button", "aria-label": "End cutting", click: () => this.open(null) },
      "×",
    );
    for (const [sign, label, up] of [
      ["−", "Less", false],
      ["+", "More", true],
    ] as const)
      this.sizes.append(
        h("button", { type: "button", "aria-label": label, click: () => void this.size(up) }, sign),
      );
    this.bar.append(this.told, this.sizes, close);
  }

  /** The next way to cut. */
  cycle(): void {
    this.open(WAYS[this.way === null ? 0 : (WAYS.indexOf(this.way) + 1) % WAYS.length] ?? null);
  }

  open(way: Way | null): void {
    this.way = way;
    this.bar.hidden = way === null;
    this.sizes.hidden = way !== "color" && way !== "brush";
    this.reset();
    for (const [its, button] of this.buttons) button.setAttribute("aria-pressed", String(its === way));
    this.teach();
  }

  private teach(): void {
    if (!this.way) return;
    const more = { color: ` Tolerance ${this.tolerance.toFixed(3)}.`, brush: ` ${2 * this.radius} pixels.` };
    const count = this.way === "box" && this.corners.length > 0 ? ` ${this.corners.length} of 4.` : "";
    this.told.textContent = TAUGHT[this.way] + (more[this.way as "color"] ?? "") + count;
  }

  /** Forgets a cut that is not complete. Returns whether there was one. */
  reset(): boolean {
    const had = this.start !== null || this.corners.length > 0 || this.brushed.size > 0;
    this.start = null;
    this.corners = [];
    this.brushed = new Set();
    this.brushedAt = null;
    this.preview.clear();
    this.draw();
    this.teach();
    return had;
  }

  /** `adds`: the brush adds to the object that it begins on, or to the last one. */
  down(x: number, y: number, adds: boolean): void {
    const { work, view, say } = this.desk;
    this.pointer = [x, y];
    this.target = null;
    if (adds && this.way === "brush") {
      const face = view.pick(x, y)?.face;
      this.target = (face !== undefined && work.at(face)) || work.last;
      if (this.target === null) {
        say("There is no object to add to yet.", true);
        return;
      }
    }
    if (this.way !== "box") this.start = [x, y];
    if (this.way === "brush") this.brush(x, y);
    if (this.way === "box") void this.corner(x, y);
    if (this.way === "color") this.preview.show(this.color(x, y));
  }

  move(x: number, y: number): void {
    const [fromX, fromY] = this.pointer;
    this.pointer = [x, y];
    if (this.way === "color") this.preview.show(this.color(x, y));
    if (this.way === "line" && this.start) this.preview.show(this.line(this.start, [x, y]));
    if (this.way === "box" && this.corners.length === 3) this.preview.show(this.fourth(x, y));
    if (this.way === "brush" && this.start) {
      const steps = Math.min(8, Math.max(1, Math.ceil(Math.hypot(x - fromX, y - fromY) / this.radius)));
      for (let k = 1; k <= steps; k++)
        this.brush(fromX + ((x - fromX) * k) / steps, fromY + ((y - fromY) * k) / steps);
    }
    this.draw();
  }

  /** The pointer has left the scene. */
  leave(): void {
    if (this.way === "color") this.preview.clear();
  }

  async up(x: number, y: number): Promise<void> {
    const { start, way } = this;
    this.start = null;
    if (way === "box" || !start) return;
    if (way === "line" && Math.hypot(x - start[0], y - start[1]) > 4) {
      const cut = this.line(start, [x, y]);
      if (cut) await this.cut(cut);
      else this.desk.say("The line lies on no patch.", true);
    }
    if (way === "color") {
      const cut = this.color(x, y);
      if (cut) await this.cut(cut);
    }
    if (way === "brush" && this.target !== null && this.brushed.size > 0) {
      const { target } = this;
      const what = { faces: runsOf(this.brushed) };
      if (await this.desk.perform({ add: { what, instance: target } })) this.desk.work.last = target;
    } else if (way === "brush" && this.brushedAt && this.brushed.size > 0) {
      const { face, root } = this.brushedAt;
      await this.cut({ at: { face, node: root }, by: { faces: runsOf(this.brushed) } });
    }
    this.reset();
  }

  /** The wheel: the tolerance of colours. Returns whether it was for this. */
  wheel(delta: number): boolean {
    if (this.way !== "color") return false;
    this.tolerate(Math.exp(-delta / 700));
    return true;
  }

  private tolerate(times: number): void {
    this.tolerance = Math.min(0.4, Math.max(0.005, this.tolerance * times));
    this.teach();
    this.preview.show(this.color(...this.pointer));
  }

  /** The brackets: the tolerance of colours, or the size of the brush. Returns whether they were for this. */
  size(up: boolean): boolean {
    if (this.way === "color") {
      this.tolerate(up ? 1.25 : 0.8);
      return true;
    }
    if (this.way !== "brush") return false;
    this.radius = Math.min(160, Math.max(4, Math.round(this.radius * (up ? 1.25 : 0.8))));
    this.teach();
    this.draw();
    return true;
  }

  private cut({ at, by }: Cut): Promise<boolean> {
    return this.desk.perform({ cut: { at, by, class: this.desk.inHand() } });
  }

  private line(from: Point, to: Point): Cut | null {
    const { view, hover, where } = this.desk;
    const middle: Point = [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2];
    const hit = view.pick(...middle) ?? view.pick(...from);
    if (!hit) return null;
    const eye = view.from;
    const on = ([x, y]: Point): Place => {
      const ray = view.ray(x, y).multiplyScalar(hit.distance).toArray();
      return where.world(eye.map((c, k) => c + (ray[k] ?? 0)));
    };
    return {
      at: hover.patchAt(hit.face),
      by: { line: { eye: where.world(eye), from: on(from), to: on(to) } },
    };
  }

  private async corner(x: number, y: number): Promise<void> {
    const hit = this.desk.view.pick(x, y);
    if (!hit) {
      this.desk.say("This corner lies on no face.", true);
      return;
    }
    this.corners.push(hit.point);
    this.teach();
    this.draw();
    if (this.corners.length < 4) return;
    const cut = this.box(this.corners, hit.face);
    this.reset();
    await this.cut(cut);
  }

  /** The box whose fourth corner is under the pointer. */
  private fourth(x: number, y: number): Cut | null {
    const hit = this.desk.view.pick(x, y);
    return hit && this.box([...this.corners, hit.point], hit.face);
  }

  /** A box of the patch in its middle, or else of a face. */
  private box(corners: Place[], face: number): Cut {
    const { view, hover, where } = this.desk;
    const { left, top } = view.canvas.getBoundingClientRect();
    const on = this.seen(corners);
    const [u, v] = [0, 1].map((k) => on.reduce((sum, p) => sum + (p[k] ?? 0), 0) / on.length) as Point;
    const at = hover.patchAt(view.pick(left + u, top + v)?.face ?? face);
    const [a, b, c, d] = corners.map((corner) => where.world(corner)) as [Place, Place, Place, Place];
    return { at, by: { box: { corners: [a, b, c, d] } } };
  }

  private color(x: number, y: number): Cut | null {
    const hit = this.desk.view.pick(x, y);
    return hit && { at: this.desk.hover.patchAt(hit.face), by: { color: { tolerance: this.tolerance } } };
  }

  /** Where places in front of the eye are on the canvas. */
  private seen(places: Place[]): Point[] {
    return places.flatMap((place) => {
      const at = this.desk.view.screen(place);
      return at ? [at] : [];
    });
  }

  /**
   * Takes the faces that are seen in the circle and belong to the object, or lack of one, it began on. If it adds
   * to an object, it takes those of all others.
   */
  private brush(x: number, y: number): void {
    const { view, work, table } = this.desk;
    const { radius, brushed } = this;
    const first = this.brushedAt ?? this.beginAt(x, y);
    if (!first) return;
    this.brushedAt = first;
    const step = Math.max(2, Math.sqrt((Math.PI * radius * radius) / MOST_RAYS));
    const before = brushed.size;
    for (let v = -radius; v <= radius; v += step)
      for (let u = -radius; u <= radius; u += step) {
        if (u * u + v * v > radius * radius) continue;
        const face = view.pick(x + u, y + v)?.face;
        if (face === undefined || brushed.has(face)) continue;
        const isWanted =
          this.target === null
            ? work.at(face) === first.instance && work.tree.holds(first.root, face)
            : work.at(face) !== this.target;
        if (isWanted) brushed.add(face);
      }
    if (brushed.size === before) return;
    table.light("taken", Uint32Array.from(brushed));
    view.draw();
  }

  private beginAt(x: number, y: number): { face: number; root: number; instance: number } | null {
    const { view, work } = this.desk;
    const face = view.pick(x, y)?.face;
    return face === undefined ? null : { face, root: work.tree.rootAt(face), instance: work.at(face) };
  }

  /** Draws the line, the corners or the circle over the scene. */
  draw(): void {
    const { view } = this.desk;
    const box = view.canvas.getBoundingClientRect();
    const on = ([x, y]: Point): Point => [x - box.left, y - box.top];
    const shapes: SVGElement[] = [];
    const both = (points: string): void => {
      for (const name of ["halo", "edge"]) shapes.push(s("polyline", { class: name, points }));
    };
    if (this.way === "line" && this.start)
      both([on(this.start), on(this.pointer)].map((p) => p.join()).join(" "));
    if (this.way === "brush") {
      const [cx, cy] = on(this.pointer);
      for (const name of ["halo", "edge"]) shapes.push(s("circle", { class: name, cx, cy, r: this.radius }));
    }
    const corners = this.seen(this.corners);
    if (corners.length > 1) both(corners.map((p) => p.join()).join(" "));
    for (const [cx, cy] of corners) shapes.push(s("circle", { class: "corner", cx, cy, r: 4 }));
    this.overlay.replaceChildren(...shapes);
  }
}
