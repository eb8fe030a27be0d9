// What users should check: missing or damaged files, unlabelled surface, disputed classes.

import type { Index } from "../data.js";
import { append, count, h, metres2, named, percent, several, table } from "../dom.js";
import { licences } from "../licences.js";
import { disputeInPanorama } from "../route/places.js";
import { link, spaceLink } from "../route/route.js";

/** What is damaged: the number, and words for what is counted. */
export function damageOf(index: Index): { count: number; words: string } {
  const files = index.faults.length;
  const found = (index.verified?.faults ?? []).reduce((sum, group) => sum + group.count, 0);
  const words = [
    files > 0 && `${several(files, "file")} missing or damaged`,
    found > 0 && `${several(found, "fault")} found by s3d verify`,
  ];
  return { count: files + found, words: words.filter(Boolean).join(", ") };
}

/** The link for a warning: the location that it names, or the unlabelled surface. */
function placeOfWarning(index: Index, warning: string): [string, string] | null {
  const location = index.locations.find((l) => l.pano && warning.includes(l.uuid));
  if (location) return [link("pano", [location.area, location.uuid]), "its panorama"];
  if (index.classes.length > 0 && /without a label|no label|unlabelled/.test(warning))
    return [link("views", [], { sort: "unlabelled" }), "views that show most of it"];
  return null;
}

/** Warnings that differ only in numbers and identifiers, together, in the order of the first of each. */
export function alike<T extends { warning: string }>(warnings: T[]): T[][] {
  const groups = new Map<string, T[]>();
  for (const each of warnings) {
    const form = each.warning.replace(/[0-9a-f-]{8,}|\d+(?:\.\d+)?/g, "#");
    const group = groups.get(form) ?? [];
    groups.set(form, [...group, each]);
  }
  return [...groups.values()];
}

function warnings(index: Index): HTMLElement | null {
  const all = index.areas.flatMap(({ area, warnings = [] }) =>
    warnings.map((warning) => ({ area, warning })),
  );
  if (all.length === 0) return null;
  const item = ({ area, warning }: { area: number; warning: string }): HTMLElement => {
    const place = placeOfWarning(index, warning);
    const of = index.areas.length > 1 ? `Area ${area}: ` : "";
    const line = h("li", {}, of, named(warning));
    append(line, place ? [" (", h("a", { href: place[0] }, place[1]), ")"] : []);
    return line;
  };
  const items = alike(all).map(([first = { area: 0, warning: "" }, ...others]) => {
    const line = item(first);
    if (others.length === 0) return line;
    const summary = h("summary", {}, `${several(others.length, "warning")} like this`);
    append(line, [h("details", {}, summary, h("ul", {}, ...others.map(item)))]);
    return line;
  });
  return h("section", {}, h("h2", {}, "Warnings of the export"), h("ul", {}, ...items));
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
  const rows = index.faults.map(({ path, message }) => [fileName(index, path), named(message)]);
  append(section, [
    h("p", {}, `${several(index.faults.length, "file")} missing or damaged:`),
    table(["File", "What is wrong"], rows),
  ]);
  return section;
}

/** The name of a file, with a link to its picture. */
function fileName(index: Index, path: string): HTMLElement {
  const name = h("code", {}, named(path));
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
    const lines = first.map(([path, message]) => [topic, fileName(index, path), named(message)]);
    return n > first.length ? [...lines, [topic, "", `${count(n - first.length)} more like this`]] : lines;
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
          `${of}${several(area.faces_left_out, "face")} of the input were left out, ` +
            "without an area or with the corners of an earlier face.",
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
          `${of}${several(bare.faces, "face")} unlabelled (${metres2(bare.m2)}${pixels}): `,
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
        h("li", {}, `${of}${several(filled, "face")} without votes took the label of the surface beside.`),
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
      const name = p.labels.map(named).join(" or ");
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
        h("h3", {}, "Largest disputed patches"),
        table(["Labels", "Faces", "Surface", "", ""], patches),
      ]);
  }
  return found ? section : null;
}

function about(index: Index): HTMLElement {
  const d = index.data_set;
  const options = Object.entries(d.options).map(([name, value]) => [
    name,
    typeof value === "object" ? JSON.stringify(value) : String(value),
  ]);
  const taxonomy =
    d.taxonomy === null
      ? "without labels"
      : `${several(index.labels.length, "label")} of ${named(d.taxonomy)}`;
  return h(
    "section",
    {},
    h("h2", {}, "Data set"),
    h(
      "p",
      {},
      `${named(d.name)}: made by s3d ${d.version} with seed ${d.seed}; ` +
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
