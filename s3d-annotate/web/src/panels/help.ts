// The card of help: five gestures for a start, and all keys.

import { h, s } from "../../../../s3d-report/web/src/dom.js";
import { licences } from "../../../../s3d-report/web/src/licences.js";
import { HANDS, KEYS } from "../keys.js";

const SEEN = "s3d-label-card";

const FIVE: readonly { name: string; does: string; icon: string }[] = [
  {
    name: "Label",
    does: "Take a class by its key. Click a patch, or drag over several: they become an object.",
    icon: "M4 20l5-1L20 8l-4-4L5 15z M13 7l4 4",
  },
  {
    name: "Add, erase",
    does: "Shift and drag adds to an object. Alt and drag erases.",
    icon: "M4 12h8 M8 8v8 M15 12h6",
  },
  {
    name: "Larger, smaller",
    does: "The keys [ and ], or Shift and the wheel, change how much a patch takes.",
    icon: "M9 9h6v6H9z M4 4h4 M4 4v4 M20 4h-4 M20 4v4 M4 20h4 M4 20v-4 M20 20h-4 M20 20v-4",
  },
  {
    name: "Cut",
    does: "S cuts a patch that holds too much: along a line, in a box, by colour, with a brush.",
    icon: "M5 19L19 5 M4 8a3 3 0 1 0 6 0a3 3 0 1 0-6 0 M14 16a3 3 0 1 0 6 0a3 3 0 1 0-6 0",
  },
  {
    name: "Accept",
    does: "Hatched faces are proposals: Enter accepts those of a room. Tab goes to what is still in doubt.",
    icon: "M4 13l5 5L20 6",
  },
];

export class Help {
  readonly element: HTMLDialogElement;

  constructor(left: () => void) {
    const five = h(
      "ol",
      { class: "five" },
      ...FIVE.map(({ name, does, icon }) =>
        h(
          "li",
          {},
          s("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, s("path", { d: icon })),
          h("strong", {}, name),
          h("span", {}, does),
        ),
      ),
    );
    const list = (title: string, rows: readonly { shown: string; does: string }[]): HTMLElement =>
      h(
        "section",
        {},
        h("h3", {}, title),
        h(
          "dl",
          {},
          ...rows.flatMap(({ shown, does }) => [h("dt", {}, h("kbd", {}, shown)), h("dd", {}, does)]),
        ),
      );
    const of = (group: string): typeof KEYS => KEYS.filter((key) => key.group === group);
    const close = (): void => this.element.close();
    this.element = h(
      "dialog",
      { class: "help", "aria-labelledby": "help-title", close: left },
      h("h2", { id: "help-title" }, "Label a scan in five gestures"),
      five,
      h(
        "p",
        { class: "quiet" },
        "Each gesture is on disk at once. Z takes it back. H shows this card again.",
      ),
      h(
        "p",
        {},
        h("button", { type: "button", class: "first", autofocus: true, click: close }, "Start labelling"),
      ),
      h(
        "details",
        {},
        h("summary", {}, "All keys"),
        h(
          "div",
          { class: "keys" },
          list("Pointer", HANDS),
          list("Patches", of("Patches")),
          list("Objects", of("Objects")),
          list("View", of("View")),
        ),
      ),
    );
    this.element.append(licences());
    this.element.addEventListener("click", (event) => {
      if (event.target === this.element) close();
    });
  }

  /** Shows the card; at the first use, the five gestures alone. */
  open(first = false): void {
    if (this.element.open) return;
    const details = this.element.querySelector("details");
    if (details) details.open = !first;
    this.element.showModal();
  }

  /** Shows the card if this browser has not shown it before. */
  openOnce(): void {
    try {
      if (window.localStorage.getItem(SEEN) !== null) return;
      window.localStorage.setItem(SEEN, "1");
    } catch {
      // Without a memory, it is shown each time.
    }
    this.open(true);
  }
}
