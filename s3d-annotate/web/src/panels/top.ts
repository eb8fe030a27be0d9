// The line at the top: the scene's name, how much is done, whether it is saved, and the menu.

import { count, h, named, percent, s, say } from "../../../../s3d-report/web/src/dom.js";
import type { Scene, State } from "../scene.js";
import { post } from "../server.js";
import type { Saved } from "../work.js";

const FORMATS: readonly [string, string][] = [
  ["ply", "PLY with labels"],
  ["scannet", "ScanNet"],
  ["scannetpp", "ScanNet++"],
  ["s3dis", "S3DIS"],
];

const SAVED: Record<Saved, string> = {
  saved: "Everything is saved",
  saving: "Saving …",
  gone: "The server is gone",
};

/** A share as a ring. */
class Ring {
  readonly element: HTMLElement;
  private readonly arc = s("circle", {
    class: "arc",
    cx: 12,
    cy: 12,
    r: 9,
    pathLength: 100,
    "stroke-dasharray": "0 100",
  });
  private readonly told = h("span", {});

  constructor(private readonly what: string) {
    const svg = s("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" });
    svg.append(s("circle", { class: "track", cx: 12, cy: 12, r: 9 }), this.arc);
    this.element = h("span", { class: "ring" }, svg, this.told);
  }

  set(part: number, whole: number, title: string): void {
    const share = whole > 0 ? Math.min(1, part / whole) : 0;
    this.arc.setAttribute("stroke-dasharray", `${(100 * share).toFixed(2)} 100`);
    // All but a rest is not all.
    const shown = part < whole ? Math.min(share, 0.994) : share;
    this.told.textContent = `${percent(shown)} of the ${this.what}`;
    this.element.title = title;
    this.element.hidden = whole <= 0;
  }
}

export class Top {
  readonly element: HTMLElement;
  readonly banner = h("p", { class: "banner", role: "alert", hidden: true });
  private readonly surface = new Ring("surface");
  private readonly pixels = new Ring("pixels");
  private readonly saved = h("span", { class: "saved", role: "status" });
  private readonly result = h("p", { class: "result", role: "status" });

  constructor(scene: Scene, help: () => void, plan: () => void) {
    const does = (words: string, path: string, body: unknown): HTMLElement =>
      h("button", { type: "button", click: () => void this.write(path, body) }, words);
    const menu = h(
      "details",
      { class: "menu" },
      h("summary", { role: "button" }, "Write"),
      h(
        "div",
        { class: "panel" },
        does("labels.npz and rooms.json", "save", {}),
        ...FORMATS.map(([format, words]) => does(words, "write", { format })),
        this.result,
      ),
    );
    menu.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !menu.open) return;
      menu.open = false;
      menu.querySelector("summary")?.focus();
      event.stopPropagation();
    });
    document.addEventListener("pointerdown", (event) => {
      if (!menu.contains(event.target as Node)) menu.open = false;
    });
    this.element = h(
      "header",
      { class: "top" },
      h("h1", { class: "title", title: named(scene.folder) }, named(scene.name)),
      this.surface.element,
      this.pixels.element,
      this.saved,
      h("button", { type: "button", "aria-keyshortcuts": "P", click: plan }, "Plan"),
      menu,
      h("button", { type: "button", "aria-keyshortcuts": "H", click: help }, "Help"),
    );
  }

  private async write(path: string, body: unknown): Promise<void> {
    say(this.result, "Writing …");
    try {
      const told = await post<{ saved?: string[]; written?: string }>(path, body);
      say(this.result, `Written: ${named(told.written ?? (told.saved ?? []).join(", "))}`);
    } catch (e) {
      say(this.result, e instanceof Error ? e.message : String(e));
    }
  }

  tell(state: State, saved: Saved): void {
    const { labelled_m2, total_m2, labelled_pixels, total_pixels } = state;
    const rest = (total_m2 - labelled_m2).toFixed(1);
    this.surface.set(
      labelled_m2,
      total_m2,
      `${labelled_m2.toFixed(1)} of ${total_m2.toFixed(1)} m² have a label; ${rest} m² have none`,
    );
    this.pixels.set(
      labelled_pixels,
      total_pixels,
      `${count(labelled_pixels)} of ${count(total_pixels)} pixels of the planned views`,
    );
    if (this.saved.textContent !== SAVED[saved]) this.saved.textContent = SAVED[saved];
    this.saved.dataset["is"] = saved;
    const gone = saved === "gone";
    if (gone && this.banner.hidden)
      this.banner.textContent =
        "The server does not answer. Everything up to the last saved gesture is on disk. This page tries again.";
    this.banner.hidden = !gone;
  }
}
