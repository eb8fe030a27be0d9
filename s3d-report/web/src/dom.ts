// Elements. All text becomes text nodes, so a name cannot be markup. Names that come from data are marked by
// `named`: an element shows such a name in a <bdi>, so that its direction does not spread to the words
// around it.

type Child = Node | string | number | null | undefined | false;
type Properties = Record<string, string | number | boolean | null | undefined | ((event: never) => void)>;

const SVG = "http://www.w3.org/2000/svg";

/** What surrounds a name in text: characters that are none. */
const [OPEN, CLOSE] = ["\ufdd0", "\ufdd1"];
/** Characters that turn the direction of text, and letters from right to left. */
const MARKS = /[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/g;
const LEFTWARD = /[\u0590-\u08ff\ufb1d-\ufdcf\ufdf0-\ufdff\ufe70-\ufefc]|[\ud802\ud803\ud83a\ud83b]/;

/** A name from data, to be a part of text. */
export const named = (name: string): string => OPEN + name.replace(/[\ufdd0\ufdd1]/g, "") + CLOSE;

/** Text without marks that turn its direction. */
export const tamed = (text: string): string => text.replace(MARKS, "\ufffd");

/** Text for places without elements, as attributes are: names have isolates where they need some. */
export function flat(text: string): string {
  return text.replace(/\ufdd0([^\ufdd1]*)\ufdd1/g, (_, name: string) => {
    const plain = tamed(name);
    return LEFTWARD.test(plain) ? `\u2068${plain}\u2069` : plain;
  });
}

/** Text as nodes: names in <bdi>. */
function nodes(text: string): (Node | string)[] {
  return text.split(/(\ufdd0[^\ufdd1]*\ufdd1)/).flatMap((part): (Node | string)[] => {
    if (!part.startsWith(OPEN)) return part === "" ? [] : [part];
    const element = document.createElement("bdi");
    element.append(part.slice(1, -1));
    return [element];
  });
}

/** Replaces the content of an element by text. */
export function say(element: Element, text: string): void {
  element.replaceChildren();
  append(element, [text]);
}

function fill(element: Element, properties: Properties, children: Child[]): void {
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name, value as EventListener);
    else element.setAttribute(name, value === true ? "" : flat(String(value)));
  }
  append(element, children);
}

export function append(element: Element, children: Child[]): void {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    if (child instanceof Node) element.append(child);
    else if (element.namespaceURI === SVG || element.tagName === "OPTION")
      element.append(flat(String(child)));
    else element.append(...nodes(String(child)));
  }
}

/** Makes an HTML element. Functions become listeners, all else attributes. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  fill(element, properties, children);
  return element;
}

/** Makes an SVG element. */
export function s<K extends keyof SVGElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): SVGElementTagNameMap[K] {
  const element = document.createElementNS(SVG, tag);
  fill(element, properties, children);
  return element;
}

/** Longer lists have a search field. */
const LONG = 100;
let lists = 0;

/** A list to choose from, with the value and text of each entry. */
export function choice(
  label: string,
  entries: [string, string][],
  value: string,
  chosen: (value: string) => void,
): HTMLElement {
  if (entries.length > LONG) return search(label, entries, value, chosen);
  const list = h("select", { "aria-label": label, change: () => chosen(list.value) });
  for (const [entry, text] of entries) list.append(h("option", { value: entry }, text));
  list.value = value;
  return list;
}

function search(
  label: string,
  entries: [string, string][],
  value: string,
  chosen: (value: string) => void,
): HTMLElement {
  const values = new Map(entries.map(([entry, text]) => [flat(text), entry]));
  const options = h("datalist", { id: `list-${++lists}` });
  for (const [, text] of entries) options.append(h("option", { value: text }));
  let now = flat(entries.find(([entry]) => entry === value)?.[1] ?? "");
  const field = h("input", {
    type: "text",
    "aria-label": label,
    list: options.id,
    value: now,
    class: "search",
  });
  // The browser offers only entries that match the text, so the text is empty while one chooses.
  field.addEventListener("focus", () => {
    field.placeholder = now;
    field.value = "";
  });
  field.addEventListener("blur", () => {
    field.value = now;
  });
  field.addEventListener("input", () => {
    const entry = values.get(field.value);
    if (entry === undefined) return;
    now = field.value;
    chosen(entry);
  });
  return h("span", {}, field, options);
}

/** A table. A column whose first cell is a `.number` has numbers. */
export function table(head: string[], rows: Child[][]): HTMLTableElement {
  const isNumber = (column: number): boolean => {
    const cell = rows[0]?.[column];
    return cell instanceof Element && cell.classList.contains("number");
  };
  return h(
    "table",
    {},
    h(
      "thead",
      {},
      h(
        "tr",
        {},
        ...head.map((text, i) =>
          text === "" ? h("td", {}) : h("th", { scope: "col", class: isNumber(i) && "of-numbers" }, text),
        ),
      ),
    ),
    h("tbody", {}, ...rows.map((row) => h("tr", {}, ...row.map((cell) => h("td", {}, cell))))),
  );
}

const GROUPED = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

export const count = (n: number): string => GROUPED.format(n);
export const metres2 = (n: number): string => `${n.toFixed(1)} m²`;
export function percent(share: number): string {
  if (share > 0 && share < 0.001) return "< 0.1 %";
  return `${(100 * share).toFixed(share > 0 && share < 0.0995 ? 1 : 0)} %`;
}

/** `1 room`, `2 rooms`. */
export const several = (n: number, noun: string): string => `${count(n)} ${noun}${n === 1 ? "" : "s"}`;

/** The room in the name of an instance: `chair_3_conferenceRoom_1_1`. */
export const roomOf = (label: string): string => label.split("_").slice(2, 4).join("_");

/** `conferenceRoom_1` in words. */
export function roomWords(room: string): string {
  const words = room.replace(/([a-z])([A-Z])/g, "$1 $2").replaceAll("_", " ");
  return words === words.toUpperCase() ? words : words.toLowerCase().replace(/^wc/, "WC");
}

/** `conferenceRoom_1` in words, as a name. */
export const roomName = (room: string): string =>
  room === "" || room === "unknown_1" ? "unknown room" : named(roomWords(room));

/** Calls `show` when the pointer or the focus comes to an element, and `hide` when it leaves. */
export function pointed(element: Element, show: () => void, hide: () => void): void {
  for (const event of ["pointerenter", "focus"]) element.addEventListener(event, show);
  for (const event of ["pointerleave", "blur"]) element.addEventListener(event, hide);
}

/** Whether a click opens a link here, not in another tab or window. */
export const isPlain = (event: MouseEvent): boolean =>
  event.button === 0 && !event.ctrlKey && !event.metaKey && !event.shiftKey && !event.altKey;
