// What users should check: missing or damaged files, unlabelled surface, disputed classes.

import type { Index } from "../data.js";
import { append, count, h, metres2, percent, several, table } from "../dom.js";
import { disputeInPanorama } from "../places.js";
import { link, spaceLink } from "../route.js";

/** The licences of bundled packages, inserted by bundle.mjs. */
declare const LICENCES: { name: string; version: string; text: string }[];

const warningsOf = (index: Index): string[] => index.areas.flatMap((area) => area.warnings ?? []);

/** The number of notes on the tab: faults of files, and warnings of the export. */
export const faultCount = (index: Index): number =>
  index.faults.length +
  warningsOf(index).length +
  (index.data_set.missing_yet?.length ?? 0) +
  (index.verified?.faults ?? []).reduce((sum, group) => sum + group.count, 0);

/** The link for a warning: the location that it names, or the unlabelled surface. */
function placeOfWarning(index: Index, warning: string): [string, string] | null {
  const location = index.locations.find((l) => l.pano && warning.includes(l.uuid));
  if (location) return [link("pano", [location.area, location.uuid]), "its panorama"];
  if (index.classes.length > 0 && /without a label|no label|unlabelled/.test(warning))
    return [link("views", [], { sort: "unlabelled" }), "views that show most of it"];
  return null;
}

function warnings(index: Index): HTMLElement | null {
  const items = index.areas.flatMap((area) =>
    (area.warnings ?? []).map((warning) => {
      const place = placeOfWarning(index, warning);
      const of = index.areas.length > 1 ? `Area ${area.area}: ` : "";
      const item = h("li", {}, `${of}${warning}`);
      append(item, place ? [" (", h("a", { href: place[0] }, place[1]), ")"] : []);
      return item;
    }),
  );
  return items.length === 0
    ? null
    : h("section", {}, h("h2", {}, "Warnings of the export"), h("ul", {}, ...items));
}

function missing(index: Index): HTMLElement | null {
  const sentences = index.data_set.missing_yet;
  if (sentences === null) return null;
  return h(
    "section",
    {},
    h("h2", {}, "Not finished"),
    h("p", {}, "The export had not finished when this report was made:"),
    h("ul", {}, ...sentences.map((sentence) => h("li", {}, sentence))),
  );
}

function faults(index: Index): HTMLElement {
  const section = h("section", {}, h("h2", {}, "Files"));
  if (index.faults.length === 0) {
    append(section, [h("p", {}, "Every file that this report reads is as it was written.")]);
    return section;
  }
  const rows = index.faults.map(({ path, message }) => [fileName(index, path), message]);
  append(section, [
    h("p", {}, `${several(index.faults.length, "file")} missing or damaged:`),
    table(["File", "What is wrong"], rows),
  ]);
  return section;
}

/** The name of a file, with a link to its picture. */
function fileName(index: Index, path: string): HTMLElement {
  const name = h("code", {}, path);
  const [, uuid, frame] = /\/camera_([0-9A-Za-z-]+)_.*_frame_(\d+|equirectangular)_/.exec(path) ?? [];
  const area = Number(/^area_(\d+)\//.exec(path)?.[1]);
  const at = index.locations.findIndex((l) => l.area === area && l.uuid === uuid);
  const view = index.views.find((v) => v.location === at && String(v.frame) === frame);
  if (view && view.picture !== null) return h("a", { href: link("view", [view.picture]) }, name);
  return index.locations[at]?.pano ? h("a", { href: link("pano", [area, uuid ?? ""]) }, name) : name;
}

function verified(index: Index): HTMLElement | null {
  if (index.verified === null) return null;
  const { files, checks, notes: left, faults: found } = index.verified;
  const all = found.reduce((sum, group) => sum + group.count, 0);
  const words = `${several(files, "file")} and ${several(checks, "check")}: ${several(all, "fault")}.`;
  const section = h("section", {}, h("h2", {}, "Verified"), h("p", {}, words));
  const rows = found.flatMap(({ topic, count: n, first }) => {
    const named = first.map(([path, message]) => [topic, fileName(index, path), message]);
    return n > first.length ? [...named, [topic, "", `${count(n - first.length)} more like this`]] : named;
  });
  append(section, [
    rows.length > 0 && table(["", "File", "What is wrong"], rows),
    left.length > 0 && h("ul", {}, ...left.map((note) => h("li", {}, note))),
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
            "they have no area, or the corners of an earlier face.",
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
          ...(index.meshes.some((mesh) => mesh.area === area.area)
            ? [
                ", ",
                h("a", { href: link("space", [area.area], { show: "unlabelled" }) }, "where they are in 3D"),
              ]
            : []),
        ),
      );
    }
    const filled = (area.unlabelled?.without_votes.faces ?? 0) - (bare?.faces ?? 0);
    if (filled > 0)
      items.push(
        h(
          "li",
          {},
          `${of}${count(filled)} faces have no votes, and took the label of the surface beside them.`,
        ),
      );
    if (area.offset_m)
      items.push(
        h("li", {}, `${of}${area.offset_m.join(", ")} m were subtracted from the coordinates of the scan.`),
      );
  }
  return items.length === 0 ? null : h("section", {}, h("h2", {}, "Surface"), h("ul", {}, ...items));
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
    const patches = votes.disputed_patches.slice(0, 12).map((p) => {
      const near = disputeInPanorama(index, area, p.center);
      const name = p.labels.join(" or ");
      const solid = index.meshes.some((mesh) => mesh.area === area) && spaceLink(area, p.center);
      return [
        name,
        h("span", { class: "number" }, count(p.faces)),
        h("span", { class: "number" }, `${p.m2.toFixed(3)} m²`),
        solid && h("a", { href: solid }, "3D"),
        near && h("a", { href: near }, "Panorama"),
      ];
    });
    if (patches.length > 0)
      append(section, [
        h("h3", {}, "Largest patches"),
        table(["Labels", "Faces", "Surface", "", ""], patches),
      ]);
  }
  return found ? section : null;
}

function licences(): HTMLElement {
  const others = LICENCES.map(({ name, version }) => `${name} ${version}`).join(" and ");
  const words =
    "This page is part of s3d, which is under the MIT licence or the Apache licence 2.0, as you choose. " +
    `It contains ${others}, under these terms:`;
  const details = h("details", {}, h("summary", {}, "Licences"), h("p", {}, words));
  for (const { name, text } of LICENCES) append(details, [h("h3", {}, name), h("pre", {}, text)]);
  return details;
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
    licences(),
  );
}

export function notesPage(index: Index): HTMLElement {
  const page = h("main", { class: "page" }, h("h1", {}, "Notes"));
  append(page, [
    missing(index),
    faults(index),
    verified(index),
    warnings(index),
    surface(index),
    disputes(index),
    about(index),
  ]);
  return page;
}
