// What should be looked at: files that are missing or damaged, surface without labels, classes in dispute.

import type { Index } from "../data.js";
import { append, count, h, metres2, percent, several, table } from "../dom.js";
import { link } from "../route.js";

/** The terms of the page; whoever bundles code of others adds theirs here. */
const LICENCE =
  "This page is part of s3d, which is under the MIT licence or the Apache licence 2.0, as you choose. " +
  "It contains no code of others.";

/** How many notes the tab counts: what is wrong with files. */
export const faultCount = (index: Index): number => index.faults.length;

function faults(index: Index): HTMLElement {
  const section = h("section", {}, h("h2", {}, "Files"));
  if (index.faults.length === 0) {
    append(section, [h("p", {}, "Every file that this report reads is as it was written.")]);
    return section;
  }
  const rows = index.faults.map(({ path, message }) => [h("code", {}, path), message]);
  append(section, [
    h("p", {}, `${several(index.faults.length, "file")} missing or damaged:`),
    table(["File", "What is wrong"], rows),
  ]);
  return section;
}

function surface(index: Index): HTMLElement | null {
  const items: HTMLElement[] = [];
  for (const area of index.areas) {
    const of = `Area ${area.area}: `;
    if (area.faces_left_out > 0) {
      items.push(
        h(
          "li",
          {},
          `${of}${count(area.faces_left_out)} faces of the input were left out: ` +
            "without area, or with the corners of an earlier one.",
        ),
      );
    }
    const bare = area.unlabelled?.without_label;
    if (bare && bare.faces > 0) {
      const pixels = bare.pixels === undefined ? "" : `, ${count(bare.pixels)} pixels`;
      const to = link("views", [], { sort: "unlabelled" });
      items.push(
        h(
          "li",
          {},
          `${of}${count(bare.faces)} faces have no label (${metres2(bare.m2)}${pixels}): `,
          h("a", { href: to }, "views that show most of it"),
        ),
      );
    }
    const filled = (area.unlabelled?.without_votes.faces ?? 0) - (bare?.faces ?? 0);
    if (filled > 0)
      items.push(
        h("li", {}, `${of}${count(filled)} faces have no votes, and the label of the surface beside them.`),
      );
    if (area.offset_m)
      items.push(h("li", {}, `${of}coordinates are those of the scan less ${area.offset_m.join(", ")} m.`));
  }
  return items.length === 0 ? null : h("section", {}, h("h2", {}, "Surface"), h("ul", {}, ...items));
}

/** The panorama nearest to a point, turned to it. */
function placeOf(index: Index, area: number, point: [number, number, number]): string | null {
  let best: { distance: number; href: string } | null = null;
  for (const l of index.locations) {
    if (l.area !== area || !l.pano || !l.position || l.azimuth_rad === null) continue;
    const [x, y, z] = point.map((c, axis) => c - (l.position?.[axis] ?? 0)) as [number, number, number];
    const distance = Math.hypot(x, y, z);
    if (best && best.distance <= distance) continue;
    const degrees = (radians: number): string => ((radians * 180) / Math.PI).toFixed(1);
    const lon = l.azimuth_rad - Math.atan2(y, x);
    const wrapped = lon - 2 * Math.PI * Math.round(lon / (2 * Math.PI));
    const gaze = { lon: degrees(wrapped), lat: degrees(Math.atan2(z, Math.hypot(x, y))), fov: "45" };
    best = { distance, href: link("pano", [l.area, l.uuid], gaze) };
  }
  return best?.href ?? null;
}

function disputes(index: Index): HTMLElement | null {
  const section = h("section", {}, h("h2", {}, "Disputes"));
  let found = false;
  for (const { area, votes } of index.votes) {
    const { faces_contested: contested, faces_won_with_less_than_three_quarters: close } = votes.total;
    const of = index.votes.length > 1 ? `Area ${area}: ` : "";
    append(section, [
      h(
        "p",
        {},
        `${of}Points of several labels voted for ${count(contested)} of ${count(votes.faces)} faces ` +
          `(${percent(contested / Math.max(1, votes.faces))}); ` +
          `${count(close)} were won with less than three quarters of the votes.`,
      ),
    ]);
    found = true;
    const classes = votes.disputing_classes.slice(0, 12);
    if (classes.length > 0) {
      const rows = classes.map((d) => [
        d.classes.join(" and "),
        h("span", { class: "number" }, count(d.faces)),
        h("span", { class: "number" }, `${d.m2.toFixed(3)} m²`),
      ]);
      append(section, [table(["Classes", "Faces", "Surface"], rows)]);
    }
    const patches = votes.disputed_patches.slice(0, 12).map((p) => {
      const href = placeOf(index, area, p.center);
      const name = p.labels.join(" or ");
      return [
        href ? h("a", { href }, name) : name,
        h("span", { class: "number" }, count(p.faces)),
        h("span", { class: "number" }, `${p.m2.toFixed(3)} m²`),
      ];
    });
    if (patches.length > 0)
      append(section, [h("h3", {}, "Largest patches"), table(["Labels", "Faces", "Surface"], patches)]);
  }
  return found ? section : null;
}

function about(index: Index): HTMLElement {
  const d = index.data_set;
  const options = Object.entries(d.options).map(([name, value]) => [
    name,
    typeof value === "object" ? JSON.stringify(value) : String(value),
  ]);
  const taxonomy = d.taxonomy === null ? "without labels" : `${index.labels.length} labels of ${d.taxonomy}`;
  return h(
    "section",
    {},
    h("h2", {}, "Data set"),
    h(
      "p",
      {},
      `${d.name}: made by s3d ${d.version} with seed ${d.seed}; ` +
        `${count(d.files)} files, ${(d.bytes / 1e6).toFixed(1)} MB; ${taxonomy}.`,
    ),
    h("details", {}, h("summary", {}, "Options of the export"), table(["Option", "Value"], options)),
    h("details", {}, h("summary", {}, "Licences"), h("p", {}, LICENCE)),
  );
}

export function notesPage(index: Index): HTMLElement {
  const page = h("main", { class: "page" }, h("h1", {}, "Notes"));
  append(page, [faults(index), surface(index), disputes(index), about(index)]);
  return page;
}
