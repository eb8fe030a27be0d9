// The classes: which is in hand, their keys, and how much of each there is.

import { count, h } from "../../../../s3d-report/web/src/dom.js";
import { CLASS_KEYS } from "../keys.js";
import { type Look, metres2, words } from "../look.js";
import type { State } from "../scene.js";

interface Row {
  name: string;
  button: HTMLButtonElement;
  item: HTMLElement;
  told: HTMLElement;
}

export class Classes {
  readonly element: HTMLElement;
  private readonly rows: Row[];
  private readonly field: HTMLInputElement;
  private readonly list: HTMLElement;
  private found: Row[] = [];
  private active = 0;
  inHand: string;
  /** Called when another class is in hand. */
  changed: () => void = () => {};
  /** Called when the search ends. */
  left: () => void = () => {};

  constructor(classes: string[], look: Look) {
    this.inHand = classes[0] ?? "";
    this.rows = classes.map((name, i) => {
      const told = h("span", { class: "amount" });
      const swatch = h("span", { class: "swatch" });
      swatch.style.background = look.css(name);
      const key = CLASS_KEYS[i];
      const button = h(
        "button",
        {
          type: "button",
          "aria-pressed": "false",
          title: key && `Key ${key.toUpperCase()}`,
          click: () => this.take(name),
        },
        h("kbd", {}, key?.toUpperCase() ?? ""),
        swatch,
        h("span", { class: "what" }, words(name)),
        told,
      );
      return { name, button, item: h("li", {}, button), told };
    });
    this.list = h("ul", { class: "rows" }, ...this.rows.map(({ item }) => item));
    this.field = h("input", {
      type: "text",
      class: "search",
      "aria-label": "Find a class",
      placeholder: "Find a class  /",
    });
    this.field.addEventListener("input", () => this.filter());
    this.field.addEventListener("blur", () => this.clear());
    this.field.addEventListener("keydown", (event) => this.key(event));
    this.element = h("section", { class: "classes panel", "aria-label": "Classes" }, this.field, this.list);
    this.take(this.inHand);
  }

  take(name: string): void {
    this.inHand = name;
    for (const row of this.rows) row.button.setAttribute("aria-pressed", String(row.name === name));
    const row = this.rows.find((one) => one.name === name);
    row?.item.scrollIntoView({ block: "nearest" });
    this.changed();
  }

  /** Takes the class of a key. Returns whether it has one. */
  takeKey(key: string): boolean {
    const row = this.rows[CLASS_KEYS.indexOf(key.toLowerCase())];
    if (!row || key === "") return false;
    this.take(row.name);
    return true;
  }

  find(): void {
    this.field.focus();
    this.filter();
  }

  private filter(): void {
    const sought = this.field.value.trim().toLowerCase();
    const rank = ({ name }: Row): number => {
      const at = words(name).toLowerCase().indexOf(sought);
      return at < 0 ? Infinity : at;
    };
    this.found = this.rows.filter((row) => rank(row) < Infinity);
    if (sought !== "") this.found.sort((a, b) => rank(a) - rank(b));
    for (const row of this.rows) row.item.hidden = !this.found.includes(row);
    this.list.append(...this.found.map(({ item }) => item));
    this.mark(0);
  }

  private mark(active: number): void {
    this.active = Math.max(0, Math.min(this.found.length - 1, active));
    for (const row of this.rows) row.item.classList.toggle("active", row === this.found[this.active]);
    this.found[this.active]?.item.scrollIntoView({ block: "nearest" });
  }

  private clear(): void {
    this.field.value = "";
    this.list.append(...this.rows.map(({ item }) => item));
    for (const { item } of this.rows) {
      item.hidden = false;
      item.classList.remove("active");
    }
  }

  private key(event: KeyboardEvent): void {
    if (event.key === "ArrowDown") this.mark(this.active + 1);
    else if (event.key === "ArrowUp") this.mark(this.active - 1);
    else if (event.key === "Enter") {
      const row = this.found[this.active];
      if (row) this.take(row.name);
      this.left();
    } else if (event.key === "Escape") this.left();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Shows how much of each class there is. */
  tell({ instances }: State): void {
    const sums = new Map<string, [number, number]>();
    for (const { class: name, area_m2 } of instances) {
      const [number, area] = sums.get(name) ?? [0, 0];
      sums.set(name, [number + 1, area + area_m2]);
    }
    for (const { name, told } of this.rows) {
      const sum = sums.get(name);
      told.textContent = sum ? `${count(sum[0])} · ${metres2(sum[1])}` : "";
    }
  }
}
