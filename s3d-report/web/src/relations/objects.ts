// The objects of a view: their outlines over the picture, a list of them, and what hides each.

import { css } from "../colors.js";
import type { Index, Rgb } from "../data.js";
import { append, count, h, named, percent, roomOf, s, say, several } from "../dom.js";
import { actOf } from "../keys.js";
import { key } from "../picture/readout.js";
import { HIDDEN, SEEN, type SeenObject } from "./data.js";

/** Whether outlines are drawn: the last choice. */
export const shown = { objects: false };

/** The address has a word for it if outlines are drawn. */
export const objectsQuery = (): Record<string, string> => (shown.objects ? { objects: "on" } : {});

/** A colour for what has no class. */
const NO_CLASS: Rgb = [200, 200, 200];

/** A path through corners. */
const through = (corners: number[]): string =>
  corners.map((c, i) => (i % 2 === 0 ? `${i === 0 ? "M" : "L"}${c}` : `,${c}`)).join("");

/** The outline of an object as paths: its seen and its hidden part, and all of it, to be filled. */
function pathsOf(outline: number[][][]): { seen: string; hidden: string; all: string } {
  const parts = outline.flat();
  const of = (kind: number): string =>
    parts
      .filter((part) => part[0] === kind)
      .map((part) => through(part.slice(1)))
      .join("");
  // Parts follow each other, so a ring is closed by all of them.
  const all = outline.map((ring) => `${through(ring.flatMap((part) => part.slice(1)))}Z`);
  return { seen: of(SEEN), hidden: of(HIDDEN), all: all.join("") };
}

/** `1.2 m`, after the words that tell what it is. */
const metres = (m: number): string => `${m.toFixed(2)} m`;

interface Drawn {
  object: SeenObject;
  mark: SVGElement;
  row: HTMLButtonElement;
}

export interface ObjectsView {
  /** Turns outlines on and off. */
  button: HTMLButtonElement;
  /** The outlines, which lie over the picture. */
  overlay: SVGElement;
  /** The list beside the picture. */
  list: HTMLElement;
  /** Tells that the pointer is on an instance in the picture; null if it is on none. */
  point: (label: number | null) => void;
}

export interface ObjectsOptions {
  index: Index;
  /** Width and height of the view in the data set. */
  size: [number, number];
  room: string;
  objects: () => Promise<SeenObject[]>;
  /** Lights up the pixels of an instance in the picture. */
  light: (label: number | null) => void;
  /** Called when outlines were turned on or off. */
  changed: () => void;
}

export function objectsView(options: ObjectsOptions): ObjectsView {
  const { index, size, room, light, changed } = options;
  const overlay = s("svg", {
    class: "objects",
    viewBox: `0 0 ${size[0]} ${size[1]}`,
    "aria-hidden": "true",
  });
  const told = h("div", { class: "object-told", role: "status" });
  const rows = h("div", { class: "object-rows", role: "group", "aria-label": "Objects in this view" });
  const heading = h("h2", {}, "Objects");
  const list = h("section", { class: "object-list", "aria-label": "Objects" }, heading, rows, told);
  const button = h("button", { type: "button" }, "Objects");
  let drawn: Drawn[] = [];
  let filled: Promise<void> | null = null;

  const colorOf = (label: number): Rgb => index.classes[index.labels[label]?.class ?? -1]?.color ?? NO_CLASS;
  /** The name of a label, without the view's room. */
  const nameOf = (label: number): string => {
    const full = label === 0 ? undefined : index.labels[label]?.name;
    if (full === undefined) return "surface without a label";
    return named(roomOf(full) === room ? full.split("_").slice(0, 2).join("_") : full);
  };

  /** Tells of an object; of all with null. */
  const tell = (object: SeenObject | null): void => {
    told.replaceChildren();
    if (!object) {
      const hidden = drawn.filter((one) => one.object.hidden > 0).length;
      const words = `${several(drawn.length, "object")}, ${count(hidden)} of them partly hidden.`;
      const how = "Lines are solid where an object is seen, and dashed where something is in front of it.";
      append(told, [h("p", {}, words), h("p", { class: "quiet" }, how)]);
      return;
    }
    const facts = h("dl", { class: "facts" });
    const fact = (name: string, ...value: (Node | string)[]): void =>
      append(facts, [h("dt", {}, name), h("dd", {}, ...value)]);
    fact("Seen", `${count(object.seen)} of ${count(object.alone)} pixels`);
    fact("Hidden", object.hidden === 0 ? "no" : percent(object.hidden));
    if (object.by.length > 0) {
      const by = object.by.slice(0, 3).map(([label, pixels]) => {
        const mark = h("span", { class: "key hider-key" });
        return h("span", { class: "hider" }, mark, `${nameOf(label)}, ${several(pixels, "pixel")}`);
      });
      if (object.by.length > by.length)
        by.push(h("span", { class: "hider quiet" }, `and ${object.by.length - by.length} more`));
      fact("By", ...by);
    }
    if (object.cut !== null) fact("Cut off", object.cut === 0 ? "no" : `${percent(object.cut)} by the frame`);
    fact("Nearest", metres(object.nearest_m));
    const name = h("p", { class: "object-name" }, key(colorOf(object.label)));
    append(name, [named(index.labels[object.label]?.name ?? "?")]);
    append(told, [name, facts]);
  };

  /** Highlights an object, and what hides it. */
  const highlight = (label: number | null): void => {
    const object = drawn.find((one) => one.object.label === label)?.object ?? null;
    const hiders = new Set(object?.by.map(([hider]) => hider));
    overlay.classList.toggle("chosen", object !== null);
    for (const { object: one, mark, row } of drawn) {
      for (const element of [mark, row]) {
        element.classList.toggle("is-chosen", one === object);
        element.classList.toggle("is-hider", hiders.has(one.label));
      }
      // What is chosen lies on top, and below it what hides it.
      if (hiders.has(one.label)) overlay.append(mark);
    }
    const top = drawn.find((one) => one.object === object);
    if (top) overlay.append(top.mark);
    else overlay.append(...drawn.map(({ mark }) => mark));
    tell(object);
  };

  /** The row that has the focus stays highlighted while the pointer is on nothing. */
  const focused = (): number | null =>
    drawn.find(({ row }) => row === document.activeElement)?.object.label ?? null;
  const choose = (label: number | null): void => {
    const now = label ?? focused();
    light(now);
    highlight(now);
  };

  const fill = async (): Promise<void> => {
    const objects = await options.objects();
    drawn = objects.map((object) => {
      const { seen, hidden, all } = pathsOf(object.outline);
      const mark = s("g", { "data-label": object.label });
      mark.style.color = css(colorOf(object.label));
      mark.append(s("path", { class: "object-fill", d: all, "fill-rule": "evenodd" }));
      for (const kind of ["halo", "line"])
        for (const [part, d] of [
          ["seen", seen],
          ["hidden", hidden],
        ] as const)
          if (d !== "") mark.append(s("path", { class: `object-${kind} object-${part}`, d }));
      const row = h("button", { type: "button", tabindex: -1 }, key(colorOf(object.label)));
      const part = object.hidden === 0 ? "" : `${percent(object.hidden)} hidden`;
      append(row, [h("span", {}, nameOf(object.label)), h("span", { class: "quiet" }, part)]);
      for (const event of ["pointerenter", "focus"]) row.addEventListener(event, () => choose(object.label));
      for (const event of ["pointerleave", "blur"]) row.addEventListener(event, () => choose(null));
      return { object, mark, row };
    });
    // Small outlines lie on large ones.
    drawn.sort((a, b) => b.object.alone - a.object.alone);
    overlay.append(...drawn.map(({ mark }) => mark));
    rows.append(...objects.flatMap((object) => drawn.find((one) => one.object === object)?.row ?? []));
    rows.firstElementChild?.setAttribute("tabindex", "0");
    tell(null);
  };

  // One row of the list is reached by Tab, and the others from it by arrows.
  rows.addEventListener("keydown", (event) => {
    const act = actOf("objects", event);
    const all = [...rows.children] as HTMLElement[];
    const at = all.indexOf(document.activeElement as HTMLElement);
    if (!act || at < 0) return;
    event.preventDefault();
    const to = all[act === "next" ? at + 1 : at - 1];
    if (!to) return;
    all.forEach((row) => (row.tabIndex = row === to ? 0 : -1));
    to.focus();
  });

  const put = (): void => {
    button.setAttribute("aria-pressed", String(shown.objects));
    overlay.toggleAttribute("hidden", !shown.objects);
    list.hidden = !shown.objects;
    if (!shown.objects) return;
    filled ??= fill();
    filled.catch((e: unknown) => {
      say(told, e instanceof Error ? e.message : String(e));
    });
  };
  button.addEventListener("click", () => {
    shown.objects = !shown.objects;
    put();
    changed();
  });
  put();
  const point = (label: number | null): void => {
    if (shown.objects) highlight(label ?? focused());
  };
  return { button, overlay, list, point };
}
