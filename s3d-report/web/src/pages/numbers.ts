// The paper's tables, classes by pixels, and what the views are like.

import { bars, histogram } from "./charts.js";
import { css } from "../colors.js";
import type { Index, View } from "../data.js";
import { append, count, h, metres2, percent, roomName, table } from "../dom.js";
import { link } from "../route.js";

/** Rows of a table with a column an area and, of several, their sum. */
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
        found.map((c) => [c, (i) => instances(i)?.[c] ?? 0]),
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

function classes(index: Index): HTMLElement | null {
  const labelled = index.pixels_by_class.reduce((a, b) => a + b, 0);
  const all = labelled + index.pixels_unlabelled;
  if (labelled === 0) return null;
  const rows = index.classes.map(({ name, color }, i) => {
    const value = index.pixels_by_class[i] ?? 0;
    const href = link("views", [], { class: String(i), sort: "share" });
    return { name, value, words: percent(value / all), color: css(color), href };
  });
  rows.sort((a, b) => b.value - a.value);
  const words =
    `${count(all)} pixels of panoramas and views see the mesh; ` +
    `${percent(index.pixels_unlabelled / all)} of them have no label. ` +
    "A class leads to the views that show most of it.";
  return h(
    "section",
    {},
    h("h2", {}, "Classes by pixels"),
    h("p", { class: "quiet" }, words),
    bars(rows.filter((row) => row.value > 0)),
  );
}

function distributions(index: Index): HTMLElement | null {
  const views = index.views.filter((view) => view.photograph === null);
  const split = (of: (view: View) => number | null): { kept: number[]; dropped: number[] } => {
    const values = (kept: boolean): number[] =>
      views.filter((v) => (v.frame !== null) === kept).flatMap((v) => of(v) ?? []);
    return { kept: values(true), dropped: values(false) };
  };
  if (views.length === 0) return null;
  const wrapped = (yaw: number): number => yaw - 360 * Math.round(yaw / 360);
  const entropy = split((v) => v.entropy);
  const highest = Math.max(0.1, ...[...entropy.kept, ...entropy.dropped].slice(0, 100_000));
  const bell = (value: number, deviation: number): number => Math.exp(-0.5 * (value / deviation) ** 2);
  const charts = [
    histogram({
      title: "Yaw",
      unit: "°",
      from: -180,
      to: 180,
      bins: 36,
      ...split((v) => (v.yaw_deg === null ? null : wrapped(v.yaw_deg))),
      density: () => 1,
    }),
    histogram({
      title: "Pitch",
      unit: "°",
      from: -60,
      to: 60,
      bins: 40,
      ...split((v) => v.pitch_deg),
      density: (v) => bell(v, 15),
    }),
    histogram({
      title: "Angle of view",
      unit: "°",
      from: 10,
      to: 75,
      bins: 26,
      ...split((v) => v.fov_deg),
      density: (v) => bell(75 - v, 30),
    }),
    histogram({
      title: "Entropy",
      unit: "nats",
      from: 0,
      to: Math.ceil(10 * highest) / 10,
      bins: 40,
      ...entropy,
    }),
  ];
  const words =
    "Kept views, dropped candidates on top of them in grey, and the curve that candidates are drawn from.";
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
  append(page, [classes(index), distributions(index), tables(index)]);
  return page;
}
