// The panel on the right: doubts, objects, checks.

import { count, h, named, say, several } from "../../../../s3d-report/web/src/dom.js";
import { keyOf } from "../keys.js";
import { type Look, metres2 } from "../look.js";
import type { Check, Instance, State } from "../scene.js";
import { readJson } from "../server.js";

/** So many objects are listed before the rest is asked for. */
const FEW = 60;
/** Checks are read again this long after the last gesture, ms. */
const CALM = 700;

export interface Wishes {
  doubt: () => void;
  accept: () => void;
  acceptAll: () => void;
  visit: (instance: Instance) => void;
  check: (check: Check) => void;
}

export class Side {
  readonly element: HTMLElement;
  private readonly doubt = h("p", { class: "told", role: "status" });
  private readonly yes: HTMLButtonElement;
  private readonly proposed = h("p", { class: "told" });
  private readonly all: HTMLButtonElement;
  private readonly objects = h("ul", { class: "rows" });
  private readonly objectsHead = h("summary", {}, "Objects");
  private readonly objectsPart: HTMLDetailsElement;
  private readonly checks = h("ul", { class: "rows" });
  private readonly checksHead = h("summary", {}, "Checks");
  private readonly checksPart: HTMLDetailsElement;
  private state: State | null = null;
  private last: number | null = null;
  private shown = FEW;
  private timer = 0;
  private pending = false;

  constructor(
    private readonly look: Look,
    private readonly wishes: Wishes,
  ) {
    const next = h(
      "button",
      { type: "button", "aria-keyshortcuts": "Tab", click: wishes.doubt },
      `Next doubt  ${keyOf("doubt")}`,
    );
    this.yes = h("button", { type: "button", click: wishes.accept, hidden: true }, "Accept  Enter");
    this.all = h("button", { type: "button", click: wishes.acceptAll }, "Accept all");
    this.objectsPart = h("details", {}, this.objectsHead, this.objects);
    this.checksPart = h("details", {}, this.checksHead, this.checks);
    this.objectsPart.addEventListener("toggle", () => this.list());
    this.checksPart.addEventListener("toggle", () => this.check());
    this.element = h(
      "aside",
      { class: "side panel", "aria-label": "Review" },
      h(
        "details",
        { open: true },
        h("summary", {}, "To do"),
        h("div", { class: "todo" }, this.proposed, this.all, this.doubt, h("p", {}, next, this.yes)),
      ),
      this.objectsPart,
      this.checksPart,
    );
    this.all.hidden = true;
  }

  /** Tells of the doubt that is shown; `canAccept` if there is a guess. */
  tellDoubt(words: string, canAccept: boolean): void {
    say(this.doubt, words);
    this.yes.hidden = !canAccept;
  }

  tellProposals(surfaces: number, rooms: number): void {
    const some = surfaces + rooms > 0;
    this.all.hidden = !some;
    const parts = [surfaces > 0 && several(surfaces, "surface"), rooms > 0 && several(rooms, "room")];
    say(
      this.proposed,
      some ? `Proposed: ${parts.filter(Boolean).join(", ")}. Enter accepts those of a room.` : "",
    );
  }

  tell(state: State, last: number | null): void {
    this.state = state;
    this.last = last;
    this.objectsHead.textContent = `Objects  ${count(state.instances.length)}`;
    if (!this.pending) {
      this.pending = true;
      requestAnimationFrame(() => {
        this.pending = false;
        this.list();
      });
    }
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.check(), CALM);
  }

  private list(): void {
    if (!this.state || !this.objectsPart.open) return;
    const newest = [...this.state.instances].sort((a, b) => b.number - a.number);
    const rows = newest.slice(0, this.shown).map((instance) => {
      const swatch = h("span", { class: "swatch" });
      swatch.style.background = this.look.css(instance.class);
      const visit = (): void => this.wishes.visit(instance);
      const isLast = instance.number === this.last;
      const button = h(
        "button",
        { type: "button", click: visit, "aria-pressed": String(isLast) },
        swatch,
        h("span", { class: "what" }, named(instance.name ?? instance.class)),
        h("span", { class: "amount" }, metres2(instance.area_m2)),
      );
      return h("li", {}, button);
    });
    if (newest.length > this.shown) {
      const more = (): void => {
        this.shown += 500;
        this.list();
      };
      rows.push(
        h(
          "li",
          {},
          h("button", { type: "button", click: more }, `${count(newest.length - this.shown)} more`),
        ),
      );
    }
    this.objects.replaceChildren(...rows);
  }

  private check(): void {
    if (!this.checksPart.open) return;
    void readJson<{ checks: Check[] }>("checks.json").then(
      ({ checks }) => {
        this.checksHead.textContent = `Checks  ${count(checks.length)}`;
        const rows = checks.map((check) =>
          h("li", {}, h("button", { type: "button", click: () => this.wishes.check(check) }, check.text)),
        );
        this.checks.replaceChildren(
          ...(rows.length > 0 ? rows : [h("li", { class: "told" }, "Nothing looks wrong.")]),
        );
      },
      (e: unknown) => {
        this.checks.replaceChildren(h("li", { class: "told" }, e instanceof Error ? e.message : String(e)));
      },
    );
  }
}
