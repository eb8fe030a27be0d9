// The tree of rooms and instances beside a mesh.

import { css } from "../colors.js";
import type { Index } from "../data.js";
import { append, choice, count, h, named, roomName, roomOf } from "../dom.js";
import type { Box } from "./files.js";

export interface OfClass {
  class: number;
  instances: Box[];
}

/** The instances by room and class: rooms by name, classes in their order. */
export function treeOf(index: Index, boxes: Box[]): { room: string; classes: OfClass[] }[] {
  const rooms = new Map<string, Map<number, Box[]>>();
  for (const box of boxes) {
    const label = index.labels[box.label];
    if (!label || label.class === null) continue;
    const room = roomOf(label.name);
    const classes = rooms.get(room) ?? new Map<number, Box[]>();
    rooms.set(room, classes);
    classes.set(label.class, [...(classes.get(label.class) ?? []), box]);
  }
  const { compare } = new Intl.Collator("en", { numeric: true });
  const nameOf = (box: Box): string => index.labels[box.label]?.name ?? "";
  return [...rooms]
    .sort(([a], [b]) => compare(a, b))
    .map(([room, classes]) => ({
      room,
      classes: [...classes]
        .sort(([a], [b]) => a - b)
        .map(([its, instances]) => ({
          class: its,
          instances: instances.sort((a, b) => compare(nameOf(a), nameOf(b))),
        })),
    }));
}

export interface TreeOptions {
  /** The class that alone has its colours; null for all. */
  only: number | null;
  isolate: (of: number | null) => void;
  /** Lights up an instance; none with null. */
  light: (label: number | null) => void;
  visit: (box: Box) => void;
}

/** Content that is made when it is opened. */
function folded(title: (Node | string)[], many: number, fill: () => HTMLElement[]): HTMLDetailsElement {
  const details = h(
    "details",
    {},
    h("summary", {}, ...title, h("span", { class: "quiet" }, ` ${count(many)}`)),
  );
  details.addEventListener("toggle", () => append(details, fill()), { once: true });
  return details;
}

function keyOf(index: Index, of: number): HTMLElement {
  const key = h("span", { class: "key" });
  key.style.background = css(index.classes[of]?.color ?? [128, 128, 128]);
  return key;
}

export function treePanel(index: Index, boxes: Box[], options: TreeOptions): HTMLElement | null {
  const rooms = treeOf(index, boxes);
  if (rooms.length === 0) return null;
  const button = (box: Box): HTMLElement => {
    const [its = "", number = ""] = (index.labels[box.label]?.name ?? "").split("_");
    const element = h(
      "button",
      { type: "button", click: () => options.visit(box) },
      named(`${its} ${number}`),
    );
    for (const event of ["pointerenter", "focus"])
      element.addEventListener(event, () => options.light(box.label));
    for (const event of ["pointerleave", "blur"]) element.addEventListener(event, () => options.light(null));
    return element;
  };
  const classOf = ({ class: of, instances }: OfClass): HTMLElement =>
    folded([keyOf(index, of), named(index.classes[of]?.name ?? "")], instances.length, () =>
      instances.map(button),
    );
  const found = [...new Set(rooms.flatMap(({ classes }) => classes.map((c) => c.class)))].sort(
    (a, b) => a - b,
  );
  const entries = found.map((of): [string, string] => [
    String(of),
    `Only ${named(index.classes[of]?.name ?? "")}`,
  ]);
  const only = choice(
    "Classes in colour",
    [["", "All classes"], ...entries],
    options.only === null ? "" : String(options.only),
    (value) => options.isolate(value === "" ? null : Number(value)),
  );
  const list = rooms.map(({ room, classes }) =>
    folded(
      [roomName(room)],
      classes.reduce((sum, { instances }) => sum + instances.length, 0),
      () => classes.map(classOf),
    ),
  );
  return h("details", { class: "tree" }, h("summary", {}, "Rooms and instances"), only, ...list);
}
