// The grid of views: sorted, filtered, and loaded while scrolling.

import { css } from "../colors.js";
import { type Index, type View, loadThumb } from "../data.js";
import { append, choice, count, h, named, percent, roomName, several } from "../dom.js";
import { type Page, type Route, link, replaceRoute } from "../route/route.js";
import { type Range, brush } from "./brush.js";
import { WIDTH, canDraw, drawDropped } from "./dropped.js";
import { nameOf } from "./names.js";
import { inPanorama, reasonOf } from "./view.js";

/** A property to sort and filter by: a number, or nothing where a view has none. */
interface Property {
  key: string;
  name: string;
  of: (view: View) => number | null;
  step: number;
}

const PROPERTIES: Property[] = [
  { key: "entropy", name: "Entropy", of: (v) => v.entropy, step: 0.05 },
  { key: "coverage", name: "Scan coverage, %", of: (v) => hundred(v.seen?.coverage), step: 1 },
  { key: "unlabelled", name: "Unlabelled, %", of: (v) => hundred(v.seen?.unlabelled), step: 1 },
  { key: "instances", name: "Instances", of: (v) => v.seen?.instances ?? null, step: 1 },
  { key: "yaw", name: "Yaw, °", of: (v) => yawOf(v), step: 5 },
  { key: "pitch", name: "Pitch, °", of: (v) => v.pitch_deg, step: 5 },
  { key: "fov", name: "Field of view, °", of: (v) => v.fov_deg, step: 5 },
];

/** The yaw to the left, half a turn at most. */
export function yawOf(view: View): number | null {
  const yaw = view.yaw_deg;
  return yaw === null ? null : yaw - 360 * Math.round(yaw / 360);
}

const hundred = (share: number | null | undefined): number | null => (share == null ? null : 100 * share);

/** The number of cards that are added at a time. */
const BATCH = 60;

export function viewsPage(index: Index, route: Route): Page {
  const query = Object.fromEntries(route.query) as Record<string, string>;
  const there = PROPERTIES.filter((p) => index.views.some((v) => p.of(v) !== null));
  const shareOf = (view: View): number => {
    const wanted = Number(query["class"] ?? -1);
    return view.seen?.classes.find(([c]) => c === wanted)?.[1] ?? 0;
  };
  const grid = h("div", { class: "grid", role: "list" });
  const total = h("p", { class: "quiet", role: "status" });
  const more = h("div", { class: "more" });
  // A new entry of the history: the way back leads to the filters.
  const clear = h("button", { type: "button", class: "clear" }, "Clear filters");
  clear.addEventListener("click", () => {
    const kept = Object.entries(query).filter(([key]) => isOrder(key));
    window.location.hash = link("views", [], Object.fromEntries(kept));
  });
  let shown: View[] = [];
  let cards = 0;

  const thumbs = new IntersectionObserver(
    (seen) => {
      for (const { isIntersecting, target } of seen) {
        if (!isIntersecting) continue;
        thumbs.unobserve(target);
        const none = (words: string): void => target.replaceWith(h("span", { class: "no-thumb" }, words));
        const view = drawn.get(target);
        if (view) {
          drawDropped(view, target as HTMLCanvasElement).then(
            (is) => is || none("no colours"),
            (e: unknown) => none(String(e)),
          );
          continue;
        }
        const picture = Number((target as HTMLElement).dataset["picture"]);
        loadThumb(index, picture).then(
          (url) => {
            if (url !== null) (target as HTMLImageElement).src = url;
            else none("no colours");
          },
          (e: unknown) => none(String(e)),
        );
      }
    },
    { rootMargin: "400px" },
  );
  const bottom = new IntersectionObserver(
    (seen) => {
      if (seen.some((entry) => entry.isIntersecting)) addCards();
    },
    { rootMargin: "800px" },
  );

  function addCards(): void {
    for (const view of shown.slice(cards, cards + BATCH)) grid.append(card(index, view, thumbs));
    cards = Math.min(shown.length, cards + BATCH);
    bottom.unobserve(more);
    if (cards < shown.length) bottom.observe(more);
  }

  function update(): void {
    replaceRoute("views", [], query);
    const ranges = there.map((p) => ({
      p,
      min: bound(query[`${p.key}_min`]),
      max: bound(query[`${p.key}_max`]),
    }));
    shown = index.views.filter((view) => {
      const kind = view.photograph !== null ? "photograph" : view.frame === null ? "dropped" : "kept";
      if ((query["show"] ?? "pictures") === "pictures" ? kind === "dropped" : query["show"] !== kind)
        return false;
      if (query["room"] && `${view.area}/${view.room}` !== query["room"]) return false;
      if (query["location"] && String(view.location) !== query["location"]) return false;
      if (query["class"] && shareOf(view) < (bound(query["share"]) ?? 1) / 100) return false;
      return ranges.every(({ p, min, max }) => {
        const value = p.of(view);
        if (min === null && max === null) return true;
        return value !== null && value >= (min ?? -Infinity) && value <= (max ?? Infinity);
      });
    });
    const by = there.find((p) => p.key === query["sort"]);
    const named = query["sort"] === "room";
    const sign = named || query["order"] === "up" ? 1 : -1;
    const value = query["sort"] === "share" ? shareOf : named ? roomPlace(index) : by?.of;
    if (value) {
      // Views without a number come last in both orders.
      const number = (view: View): number => value(view) ?? -sign * Infinity;
      shown.sort((a, b) => sign * (number(a) - number(b)) || 0);
    }
    clear.hidden = filtersIn(query).length === 0;
    total.textContent = `${count(shown.length)} of ${several(index.views.length, "view")}`;
    grid.replaceChildren();
    cards = 0;
    addCards();
  }

  const set =
    (name: string) =>
    (value: string): void => {
      if (value === "") delete query[name];
      else query[name] = value;
      update();
    };
  const element = h("main", { class: "page wide" }, h("h1", {}, "Views"));
  const counted = h("div", { class: "counted" }, total, clear);
  element.append(controls(index, there, query, set), counted, grid, more);
  update();
  return {
    element,
    close: () => {
      thumbs.disconnect();
      bottom.disconnect();
    },
    reach: (height) => {
      while (cards < shown.length && document.documentElement.scrollHeight < height) addCards();
    },
  };
}

const isOrder = (key: string): boolean => key === "sort" || key === "order";

/** The parts of an address that leave views out. */
const filtersIn = (query: Record<string, string>): string[] =>
  Object.keys(query).filter((key) => !isOrder(key) && !(key === "show" && query[key] === "pictures"));

/** The rank of a view's room among all, by area and name. */
function roomPlace(index: Index): (view: View) => number {
  const rooms = roomsOf(index);
  const places = new Map(rooms.map((room, i) => [room, i]));
  return (view) => places.get(`${view.area}/${view.room}`) ?? rooms.length;
}

const roomsOf = (index: Index): string[] =>
  [...new Set(index.views.map((v) => `${v.area}/${v.room}`))].sort(
    new Intl.Collator("en", { numeric: true }).compare,
  );

const bound = (text: string | undefined): number | null => {
  const value = text === undefined || text.trim() === "" ? Number.NaN : Number(text);
  return Number.isFinite(value) ? value : null;
};

function controls(
  index: Index,
  there: Property[],
  query: Record<string, string>,
  set: (name: string) => (value: string) => void,
): HTMLElement {
  const rooms = roomsOf(index);
  const areas = index.areas.length > 1;
  const roomWords = (key: string): string => {
    const [area, room] = key.split("/");
    return `${areas ? `area ${area}, ` : ""}${roomName(room ?? "")}`;
  };
  const present = index.classes
    .map((c, i): [string, string] => [String(i), named(c.name)])
    .filter(([i]) => index.pixels_by_class[Number(i)]);
  const dropped = index.views.some((v) => v.frame === null);
  const photographs = index.views.some((v) => v.photograph !== null);
  const kinds: [string, string][] = [["pictures", "Views with a picture"]];
  if (photographs && index.views.some((v) => v.frame !== null && v.photograph === null))
    kinds.push(["kept", "Kept views"], ["photograph", "Photographs"]);
  if (dropped) kinds.push(["dropped", "Dropped views"]);
  const sorts: [string, string][] = [
    ["", "In order"],
    ...there.map((p): [string, string] => [p.key, p.name]),
  ];
  if (rooms.length > 1) sorts.push(["room", "Room"]);
  if (present.length > 0) sorts.push(["share", "Share of the class"]);
  const orders: [string, string][] = [
    ["", "highest first"],
    ["up", "lowest first"],
  ];
  const order = choice("Order", orders, query["order"] ?? "", set("order"));
  const ordered = (by: string): boolean => by !== "" && by !== "room";
  order.hidden = !ordered(query["sort"] ?? "");
  const bar = h("div", { class: "controls" });
  append(bar, [
    kinds.length > 1 && choice("Which views", kinds, query["show"] ?? "pictures", set("show")),
    choice("Sort by", sorts, query["sort"] ?? "", (by) => {
      order.hidden = !ordered(by);
      set("sort")(by);
    }),
    order,
    rooms.length > 1 &&
      choice(
        "Room",
        [["", "All rooms"], ...rooms.map((r): [string, string] => [r, roomWords(r)])],
        query["room"] ?? "",
        set("room"),
      ),
    index.locations.length > 1 &&
      choice(
        "Scan location",
        [
          ["", "All locations"],
          ...index.locations.map((l, i): [string, string] => [
            String(i),
            `${roomWords(`${l.area}/${l.room}`)} · ${l.uuid.slice(0, 8)}`,
          ]),
        ],
        query["location"] ?? "",
        set("location"),
      ),
    present.length > 0 &&
      choice("Class", [["", "All classes"], ...present], query["class"] ?? "", set("class")),
  ]);
  const number = (name: string, label: string, step: number, changed = () => {}): HTMLInputElement => {
    const input = h("input", {
      type: "number",
      step,
      value: query[name] ?? "",
      "aria-label": label,
      input: () => {
        set(name)(input.value);
        changed();
      },
    });
    return input;
  };
  const fill = (): void => {
    const ranges = h("div", { class: "ranges" });
    for (const p of there) {
      const rangeNow = (): Range => [bound(query[`${p.key}_min`]), bound(query[`${p.key}_max`])];
      const values = index.views.flatMap((view) => p.of(view) ?? []);
      const show = (): void => chart.show(rangeNow());
      const least = number(`${p.key}_min`, `${p.name}, at least`, p.step, show);
      const most = number(`${p.key}_max`, `${p.name}, at most`, p.step, show);
      const chart = brush(p.name, values, rangeNow(), ([min, max]) => {
        for (const [input, end, value] of [
          [least, "min", min],
          [most, "max", max],
        ] as const) {
          input.value = value === null ? "" : String(value);
          set(`${p.key}_${end}`)(input.value);
        }
      });
      const fields = h("span", { class: "ends" }, least, "to", most);
      append(ranges, [h("div", { class: "range" }, h("span", {}, p.name), chart.element, fields)]);
    }
    if (present.length > 0)
      append(ranges, [
        h(
          "label",
          {},
          h("span", {}, "Class, at least %"),
          number("share", "Share of the class, at least, %", 1),
        ),
      ]);
    details.append(ranges);
  };
  const open = Object.keys(query).some((key) => /_(min|max)$|^share$/.test(key));
  const details = h("details", { open }, h("summary", {}, "Filter by numbers"));
  // Histograms of many views take a moment, so they are made when somebody looks.
  if (open) fill();
  else details.addEventListener("toggle", fill, { once: true });
  return h("div", {}, bar, details);
}

/** Why a view was dropped, in short; null if it was not. */
function dropped(view: View): string | null {
  if (view.frame !== null || view.photograph !== null) return null;
  return view.place?.reason === "lowest" ? "dropped: lowest entropy" : "dropped: not drawn";
}

/** What stands in the place of a picture: a dropped view is drawn from the panorama of its location. */
function stand(index: Index, view: View, thumbs: IntersectionObserver): Element {
  if (!canDraw(index, view)) return h("span", { class: "no-thumb" }, dropped(view) ?? "missing");
  const canvas = h("canvas", { class: "drawn", width: WIDTH, height: WIDTH });
  drawn.set(canvas, view);
  thumbs.observe(canvas);
  return canvas;
}

/** The views of canvases. */
const drawn = new WeakMap<Element, View>();

function card(index: Index, view: View, thumbs: IntersectionObserver): HTMLElement {
  const name = nameOf(index, view);
  const to = view.picture === null ? inPanorama(index, view) : link("view", [view.picture]);
  const image = h("img", { alt: "", "data-picture": view.picture, decoding: "async" });
  if (view.picture !== null) thumbs.observe(image);
  const strip = h("span", { class: "strip", "aria-hidden": "true" });
  for (const [place, share] of view.seen?.classes ?? []) {
    const part = h("span", {});
    part.style.flexGrow = String(share);
    part.style.background = css(index.classes[place]?.color ?? [128, 128, 128]);
    strip.append(part);
  }
  const numbers = [
    dropped(view),
    view.entropy !== null && `entropy ${view.entropy.toFixed(2)}`,
    view.fov_deg !== null && `${view.fov_deg.toFixed(0)}°`,
    view.seen?.unlabelled && view.seen.unlabelled >= 0.005
      ? `${percent(view.seen.unlabelled)} unlabelled`
      : null,
  ].filter(Boolean);
  const body = [
    view.picture === null ? stand(index, view, thumbs) : image,
    strip,
    h(
      "span",
      { class: "card-name" },
      view.photograph === null ? roomName(view.room) : named(view.photograph),
    ),
    h("span", { class: "quiet" }, numbers.join(" · ")),
    h("span", { class: "hidden" }, `${name}. ${reasonOf(view)}`),
  ];
  const title = `${name}. ${reasonOf(view)}`;
  const inner = to === null ? h("div", {}, ...body) : h("a", { href: to, title }, ...body);
  return h("div", { class: "card", role: "listitem" }, inner);
}
