// The pointer on the scene: hovering, painting, cutting, and turning.

import type { Desk } from "../desk.js";
import type { Cuts } from "./cuts.js";
import type { Painting } from "./painting.js";

export class Pointer {
  private readonly held = new Set<string>();
  private readonly fingers = new Set<number>();
  private cutting = false;
  /** Whether the keys point: at the middle of the view. */
  private isKeyed = false;
  private isOver = false;

  constructor(
    private readonly desk: Desk,
    private readonly painting: Painting,
    private readonly cuts: Cuts,
  ) {
    const { canvas } = desk.view;
    // Before the eye's own listeners, which ask whether a drag is theirs.
    canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.cancel(event));
    canvas.addEventListener("pointerleave", () => {
      this.isOver = false;
      if (!this.painting.isOpen) desk.hover.clear();
      if (!this.cutting) cuts.leave();
    });
    canvas.addEventListener("wheel", (event) => this.wheel(event), { capture: true, passive: false });
    window.addEventListener("keydown", (event) => this.held.add(event.code));
    window.addEventListener("keyup", (event) => this.held.delete(event.code));
    canvas.addEventListener("focus", () => {
      this.isKeyed = !this.isOver && canvas.matches(":focus-visible");
      if (this.isKeyed) this.aim();
    });
    canvas.addEventListener("keyup", (event) => this.keyed(event));
    window.addEventListener("blur", () => this.held.clear());
  }

  /** Points at the middle of the view. */
  private aim(): void {
    const { view, hover } = this.desk;
    const middle = view.screen(view.eye.stand.at);
    const box = view.canvas.getBoundingClientRect();
    if (middle) hover.move(box.left + middle[0], box.top + middle[1]);
  }

  private keyed(event: KeyboardEvent): void {
    if (!this.isKeyed) return;
    const { hover } = this.desk;
    if (event.key === " " && this.cuts.way === null && hover.x >= 0) {
      this.painting.begin(event.shiftKey ? "add" : event.altKey ? "erase" : "label", hover.x, hover.y);
      void this.painting.end();
    } else if (event.key.startsWith("Arrow") || "+-=".includes(event.key)) this.aim();
  }

  private down(event: PointerEvent): void {
    this.isKeyed = false;
    const { view, hover } = this.desk;
    view.canvas.focus({ preventScroll: true });
    if (event.pointerType === "touch") {
      this.fingers.add(event.pointerId);
      if (this.fingers.size > 1) {
        // The first finger was to turn, too.
        this.painting.cancel();
        this.cuts.reset();
        this.cutting = false;
        return;
      }
    }
    const turns = this.held.has("Space") || event.ctrlKey || event.metaKey;
    view.canvas.dataset["grip"] = turns ? "turn" : "paint";
    view.grip(turns ? "turn" : "paint");
    const { clientX: x, clientY: y } = event;
    this.reach(x, y);
    if (turns || event.button !== 0) {
      hover.clear();
      return;
    }
    view.canvas.setPointerCapture(event.pointerId);
    if (this.cuts.way !== null) {
      this.cutting = true;
      this.cuts.down(x, y, event.shiftKey);
      return;
    }
    hover.clear();
    this.painting.begin(event.shiftKey ? "add" : event.altKey ? "erase" : "label", x, y);
  }

  private move(event: PointerEvent): void {
    if (this.fingers.size > 1) return;
    this.isKeyed = false;
    this.isOver = true;
    const { clientX: x, clientY: y } = event;
    if (this.painting.isOpen) this.painting.move(x, y);
    else if (this.cuts.way !== null && (event.buttons === 0 || this.cutting)) {
      this.cuts.move(x, y);
      if (event.buttons === 0) this.desk.hover.move(x, y);
    } else if (event.buttons === 0) this.desk.hover.move(x, y);
  }

  private up(event: PointerEvent): void {
    this.fingers.delete(event.pointerId);
    const { clientX: x, clientY: y } = event;
    if (this.painting.isOpen) void this.painting.end().then(() => this.desk.hover.move(x, y));
    else if (this.cutting) {
      this.cutting = false;
      void this.cuts.up(x, y).then(() => this.desk.hover.move(x, y));
    } else if (event.pointerType !== "touch") this.desk.hover.move(x, y);
  }

  private cancel(event: PointerEvent): void {
    this.fingers.delete(event.pointerId);
    this.painting.cancel();
    this.cuts.reset();
    this.cutting = false;
  }

  /** Lets the eye turn and zoom about what lies under the pointer. */
  private reach(x: number, y: number): void {
    const { view } = this.desk;
    if (view.photograph !== null) return;
    const hit = view.pick(x, y);
    if (hit) view.eye.reach(view.eye.depth(hit.point));
  }

  private wheel(event: WheelEvent): void {
    const delta = event.deltaY || event.deltaX;
    if (!event.shiftKey && this.cuts.wheel(event.deltaY)) {
      event.preventDefault();
      event.stopImmediatePropagation();
    } else if (event.shiftKey) {
      event.preventDefault();
      event.stopImmediatePropagation();
      if (!this.cuts.size(delta < 0)) this.desk.hover.step(delta < 0);
    } else this.reach(event.clientX, event.clientY);
  }
}
