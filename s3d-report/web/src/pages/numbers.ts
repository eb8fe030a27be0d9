// The paper's tables, pixels by class, and the distributions of views.

import { bar, histogram } from "./charts.js";
import { css } from "../colors.js";
import type { Index, View } from "../data.js";
import { append, count, h, metres2, named, percent, roomName, table } from "../dom.js";
import { link } from "../route/route.js";
import { votesSection } from "./disputes.js";
import { yawOf } from "./views.js";

/** The rows of a table with a column for each area, and for several areas one for their sum. */
function byArea(
  rows: [string, (area: number) => number][],
  areas: number,
  words = count,
): (string | HTMLElement)[][] {
  return rows.map(([name, of]) => {
    const values = Array.from({ length: areas }, (_, i) => of(i));
    const sum = values.reduce((a, b) => a + b, 0);
    const cells = areas > 1 ? [...values, sum] : values;
    return [name, ...cells.map((value) => h("span", { class: "number" }, words(value)))];
  });
}

function tables(index: Index): HTMLElement {
  const section = h("section", {});
  const areas = index.statistics?.areas;
  if (!areas) return h("section", {}, h("p", {}, "statistics.json is missing or damaged."));
  const head = (first: string): string[] => [
    first,
    ...areas.map((a) => `Area ${a.area}`),
    ...(areas.length > 1 ? ["All"] : []),
  ];
  const n = areas.length;
  const labelled = areas.some((a) => a.floor_m2 !== undefined);
  const data: [string, (i: number) => number][] = [
    ["Points", (i) => areas[i]?.points ?? 0],
    ["Faces", (i) => areas[i]?.faces ?? 0],
    ["Views", (i) => areas[i]?.regular_images ?? 0],
    ["Panoramas", (i) => areas[i]?.panoramas ?? 0],
  ];
  const rows = byArea(data, n);
  if (labelled) rows.push(...byArea([["Floor", (i) => areas[i]?.floor_m2 ?? 0]], n, metres2));
  append(section, [h("h2", {}, "Data"), table(head(""), rows)]);
  if (!labelled) {
    append(section, [h("p", { class: "quiet" }, "There are no labels.")]);
    return section;
  }
  const names = (of: (i: number) => Record<string, unknown> | undefined): string[] => [
    ...new Set(areas.flatMap((_, i) => Object.keys(of(i) ?? {}))),
  ];
  const order = index.classes.map((c) => c.name);
  const instances = (i: number): Record<string, number> | undefined => areas[i]?.instances_per_class;
  const classes = names(instances).sort((a, b) => order.indexOf(a) - order.indexOf(b));
  const found = classes.filter((c) => areas.some((_, i) => (instances(i)?.[c] ?? 0) > 0));
  const types = names((i) => areas[i]?.rooms_per_type).filter((t) =>
    areas.some((a) => (a.rooms_per_type?.[t]?.rooms ?? 0) > 0),
  );
  append(section, [
    h("h2", {}, "Instances"),
    table(
      head("Class"),
      byArea(
        found.map((c) => [named(c), (i) => instances(i)?.[c] ?? 0]),
        n,
      ),
    ),
    h("h2", {}, "Rooms"),
    table(
      head("Type"),
      byArea(
        types.map((t) => [roomName(t), (i) => areas[i]?.rooms_per_type?.[t]?.rooms ?? 0]),
        n,
      ),
    ),
    h("h2", {}, "Floor"),
    table(
      head("Type"),
      byArea(
        types.map((t) => [roomName(t), (i) => areas[i]?.rooms_per_type?.[t]?.floor_m2 ?? 0]),
        n,
        metres2,
      ),
    ),
  ]);
  return section;
}

/** Each class with its pixels, faces, m² and instances. */
function classes(index: Index): HTMLElement | null {
  const labelled = index.pixels_by_class.reduce((a, b) => a + b, 0);
  const all = labelled + index.pixels_unlabelled;
  if (labelled === 0) return null;
  const sum = (values: (number | undefined)[]): number => values.reduce<number>((a, b) => a + (b ?? 0), 0);
  const surface = index.surface_by_class;
  const rows = index.classes.map(({ name, color }, i) => {
    return {
      name: named(name),
      color: css(color),
      pixels: index.pixels_by_class[i] ?? 0,
      ...(surface[i] ?? { faces: 0, m2: 0 }),
      instances: sum((index.statistics?.areas ?? []).map((a) => a.instances_per_class?.[name])),
      href: link("views", [], { class: String(i), sort: "share" }),
    };
  });
  rows.sort((a, b) => b.pixels - a.pixels);
  const shown = rows.filter((row) => row.pixels + row.faces + row.instances > 0);
  const most = Math.max(...shown.map((row) => row.pixels));
  const words =
    `${count(all)} pixels of panoramas and views see the mesh; ` +
    `${percent(index.pixels_unlabelled / all)} of them are unlabelled. ` +
    `A class leads to the views that show most of it.`;
  const number = (text: string): HTMLElement => h("span", { class: "number" }, text);
  const cells = shown.map((row) => [
    h("a", { href: row.href }, row.name),
    bar(row.pixels / most, row.color),
    number(percent(row.pixels / all)),
    number(count(row.pixels)),
    number(count(row.faces)),
    number(metres2(row.m2)),
    number(count(row.instances)),
  ]);
  const head = ["Class", "", "Share", "Pixels", "Faces", "Surface", "Instances"];
  const list = table(head, cells);
  list.classList.add("classes");
  return h("section", {}, h("h2", {}, "Classes"), h("p", { class: "quiet" }, words), list);
}

function distributions(index: Index): HTMLElement | null {
  const views = index.views.filter((view) => view.photograph === null);
  const split = (of: (view: View) => number | null): { kept: number[]; dropped: number[] } => {
    const values = (kept: boolean): number[] =>
      views.filter((v) => (v.frame !== null) === kept).flatMap((v) => of(v) ?? []);
    return { kept: values(true), dropped: values(false) };
  };
  if (views.length === 0) return null;
  const entropy = split((v) => v.entropy);
  const highest = [...entropy.kept, ...entropy.dropped].reduce((a, b) => Math.max(a, b), 0.1);
  const photographs = index.views.some((v) => v.photograph !== null);
  // The next number below a bound, with the index's rounding: a bar ends where the next one begins.
  const below = (key: string, bound: number): string =>
    key === "entropy" ? (bound - 1e-4).toFixed(4) : (bound - 0.01).toFixed(2);
  const href =
    (key: string) =>
    (kept: boolean, min: number | null, max: number | null): string =>
      link("views", [], {
        ...(kept ? photographs && { show: "kept" } : { show: "dropped" }),
        ...(min !== null && { [`${key}_min`]: String(min) }),
        ...(max !== null && { [`${key}_max`]: below(key, max) }),
      });
  const bell = (value: number, deviation: number): number => Math.exp(-0.5 * (value / deviation) ** 2);
  const charts = [
    histogram({
      title: "Yaw",
      unit: "°",
      from: -180,
      to: 180,
      bins: 36,
      ...split(yawOf),
      density: () => 1,
      href: href("yaw"),
    }),
    histogram({
      title: "Pitch",
      unit: "°",
      from: -60,
      to: 60,
      bins: 40,
      ...split((v) => v.pitch_deg),
      density: (v) => bell(v, 15),
      href: href("pitch"),
    }),
    histogram({
      title: "Field of view",
      unit: "°",
      from: 10,
      to: 75,
      bins: 26,
      ...split((v) => v.fov_deg),
      density: (v) => bell(75 - v, 30),
      href: href("fov"),
    }),
    histogram({
      title: "Entropy",
      unit: "nats",
      from: 0,
      to: Math.ceil(10 * highest) / 10,
      bins: 40,
      ...entropy,
      href: href("entropy"),
    }),
  ];
  const words =
    "Kept views, with dropped views on top in grey, and the distribution that views are drawn from. " +
    "A bar leads to its views; arrow keys go from bar to bar.";
  return h(
    "section",
    {},
    h("h2", {}, "Views"),
    h("p", { class: "quiet" }, words),
    h("div", { class: "charts" }, ...charts),
  );
}

export function numbersPage(index: Index): HTMLElement {
  const page = h("main", { class: "page" }, h("h1", {}, "Numbers"));
  append(page, [classes(index), distributions(index), votesSection(index), tables(index)]);
  return page;
}
