// The line at the bottom: the class in hand, what lies under the pointer, and what was said last.

import { h, named, say, several } from "../../../../s3d-report/web/src/dom.js";
import type { Hovered } from "../hand/hover.js";
import { type Look, metres2, words } from "../look.js";

const LASTS = 6000;

export class Status {
  readonly element: HTMLElement;
  private readonly swatch = h("span", { class: "swatch" });
  private readonly hand = h("strong", {});
  private readonly patch = h("span", { class: "patch" });
  private readonly said = h("span", { class: "said", role: "status" });
  private timer = 0;

  constructor(private readonly look: Look) {
    this.element = h(
      "footer",
      { class: "status panel" },
      h("span", { class: "hand" }, this.swatch, this.hand),
      this.patch,
      this.said,
    );
  }

  take(name: string): void {
    this.swatch.style.background = this.look.css(name);
    this.hand.textContent = words(name);
  }

  /** Tells of the patch under the pointer. */
  hover(now: Hovered | null, name: string | null, proposed: string | null, level: number): void {
    // For tests, and whoever extends the page.
    const { dataset } = this.element;
    dataset["face"] = now ? String(now.face) : "";
    dataset["node"] = now ? String(now.node) : "";
    dataset["faces"] = now ? String(now.faces.length) : "";
    dataset["instance"] = now ? String(now.instance) : "";
    if (!now) {
      say(this.patch, "");
      return;
    }
    const what =
      name !== null ? named(name) : proposed !== null ? `proposed: ${words(proposed)}` : "no label";
    say(
      this.patch,
      `${what} · ${metres2(now.area)} · ${level === 0 ? "one patch" : `${several(level, "join")} up`}`,
    );
  }

  say(text: string, isFault = false): void {
    say(this.said, text);
    this.said.classList.toggle("fault", isFault);
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.said.replaceChildren(), LASTS);
  }
}
