// The other photographs, as marks to walk to, while one is around the eye.

import { h, named } from "../../../../s3d-report/web/src/dom.js";
import type { Desk } from "../desk.js";

/** A photograph may be hidden by what is this close to it, metres. */
const SHORT = 0.3;

export class Stands {
  readonly element = h("div", { class: "stands" });
  private marks: { button: HTMLElement; at: number[] }[] = [];

  constructor(private readonly desk: Desk) {}

  /** Another photograph, or none, is around the eye. */
  entered(): void {
    const { view, scene, where } = this.desk;
    const here = view.photograph;
    this.element.replaceChildren();
    this.marks = [];
    if (here === null) return;
    for (const [number, { name, at }] of scene.photographs.entries()) {
      const near = where.near(at);
      const way = near.map((c, k) => c - (view.from[k] ?? 0));
      const away = Math.hypot(...way);
      if (number === here || away < SHORT) continue;
      const short = view.from.map((c, k) => c + ((way[k] ?? 0) * (away - SHORT)) / away);
      if (!view.surface.isFree(view.from, short as [number, number, number])) continue;
      const button = h(
        "button",
        {
          type: "button",
          class: "walk",
          "aria-label": `Go to photograph ${name}`,
          click: () => void view.enter(number),
        },
        h("span", { class: "walk-name" }, named(name)),
      );
      this.marks.push({ button, at: near });
      this.element.append(button);
    }
    this.place();
  }

  place(): void {
    const { view } = this.desk;
    const { clientWidth: width, clientHeight: height } = view.canvas;
    for (const { button, at } of this.marks) {
      const on = view.screen(at);
      const isIn = on !== null && on[0] > 0 && on[1] > 0 && on[0] < width && on[1] < height;
      button.hidden = !isIn;
      if (isIn) button.style.transform = `translate(${on[0]}px, ${on[1]}px)`;
    }
  }
}
