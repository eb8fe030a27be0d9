// Dragging over patches: labels them, adds them to an object, or erases their labels, when the drag ends.

import type { Desk } from "../desk.js";
import { words } from "../look.js";
import type { Patch, Point } from "../scene.js";

/** Between two moves of the pointer, patches are looked for at this distance, pixels. */
const STEP = 6;
const MOST_STEPS = 40;

export type Stroke = "label" | "add" | "erase";

export class Painting {
  private stroke: Stroke | null = null;
  private target: number | null = null;
  /** The instance of the patches that a new object takes. */
  private from = 0;
  private patches: Patch[] = [];
  private faces: Uint32Array[] = [];
  private readonly seen = new Set<string>();
  private last: Point = [0, 0];

  constructor(private readonly desk: Desk) {}

  get isOpen(): boolean {
    return this.stroke !== null;
  }

  begin(stroke: Stroke, x: number, y: number): void {
    const { work, view } = this.desk;
    const hit = view.pick(x, y);
    this.stroke = stroke;
    this.patches = [];
    this.faces = [];
    this.seen.clear();
    this.last = [x, y];
    this.from = hit ? work.at(hit.face) : 0;
    this.target = stroke === "add" ? this.from || work.last : null;
    if (stroke === "add" && this.target === null) {
      this.desk.say("There is no object to add to yet.", true);
      this.cancel();
      return;
    }
    this.collect(x, y);
    this.show();
  }

  move(x: number, y: number): void {
    if (!this.stroke) return;
    const [fromX, fromY] = this.last;
    const steps = Math.min(MOST_STEPS, Math.ceil(Math.hypot(x - fromX, y - fromY) / STEP));
    const before = this.patches.length;
    for (let k = 1; k <= steps; k++)
      this.collect(fromX + (k / steps) * (x - fromX), fromY + (k / steps) * (y - fromY));
    this.last = [x, y];
    if (this.patches.length > before) this.show();
  }

  private collect(x: number, y: number): void {
    const { view, work, hover } = this.desk;
    const hit = view.pick(x, y);
    if (!hit) return;
    const instance = work.at(hit.face);
    const isWanted =
      this.stroke === "label"
        ? instance === this.from
        : this.stroke === "add"
          ? instance !== this.target
          : instance > 0;
    if (!isWanted) return;
    const patch = hover.patchAt(hit.face);
    const key = `${patch.node} ${instance}`;
    if (this.seen.has(key)) return;
    this.seen.add(key);
    this.patches.push(patch);
    this.faces.push(work.patch(patch));
  }

  private show(): void {
    const { table, view } = this.desk;
    const all = new Uint32Array(this.faces.reduce((sum, { length }) => sum + length, 0));
    let at = 0;
    for (const faces of this.faces) {
      all.set(faces, at);
      at += faces.length;
    }
    table.light(this.stroke === "erase" ? "erased" : "taken", all);
    view.draw();
  }

  cancel(): void {
    this.stroke = null;
    this.dim();
  }

  private dim(): void {
    this.desk.table.light("taken", null);
    this.desk.table.light("erased", null);
    this.desk.view.draw();
  }

  async end(): Promise<void> {
    const { stroke, patches, target } = this;
    this.stroke = null;
    if (patches.length > 0) await this.send(stroke, patches, target);
    this.dim();
  }

  private async send(stroke: Stroke | null, patches: Patch[], target: number | null): Promise<void> {
    const { desk } = this;
    const what = { patches };
    if (stroke === "erase") await desk.perform({ erase: { what } });
    if (stroke === "add" && target !== null) {
      if (await desk.perform({ add: { what, instance: target } })) desk.work.last = target;
    }
    if (stroke !== "label") return;
    const whole = desk.work.instance(this.from);
    const taken = this.faces.reduce((sum, { length }) => sum + length, 0);
    if (whole && whole.faces === taken) {
      // All of an object: it gets another class, and stays the object that it is.
      if (whole.class === desk.inHand()) desk.say(`This is ${words(whole.class)} already.`);
      else await desk.perform({ class: { instance: whole.number, class: desk.inHand() } });
      desk.work.last = whole.number;
    } else await desk.perform({ label: { what, class: desk.inHand() } });
  }
}
