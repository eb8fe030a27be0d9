// Tables of the differences between two data sets.

import type { Index } from "../data.js";
import { count, h, named, percent, several, table } from "../dom.js";
import { nameOf as nameOfView } from "../pages/names.js";
import { inPanorama } from "../pages/view.js";
import { imageLink } from "../route/places.js";
import { link } from "../route/route.js";
import {
  type Against,
  type Comparison,
  type InstanceChange,
  type ModalityChanges,
  type Renamed,
  type ViewName,
  changedWords,
} from "./data.js";
import { changedLink, countsWords, matrix, number, surface } from "./matrix.js";
import { MODALITY_NAMES } from "./picture.js";

/** The number of entries shown of a list. */
const MOST = 50;

type Cells = (string | Node | null)[];

/** A table of the first rows, and the number of further rows. */
function some(head: string[], rows: Cells[], most = MOST): (HTMLElement | null)[] {
  if (rows.length === 0) return [];
  const more = rows.length - most;
  return [
    table(head, rows.slice(0, most)),
    more > 0 ? h("p", { class: "quiet" }, `${count(more)} more are in the JSON of s3d compare.`) : null,
  ];
}

function section(title: string, ...children: (Node | null)[]): HTMLElement | null {
  const there = children.filter((child) => child !== null);
  return there.length === 0 ? null : h("section", {}, h("h2", {}, title), ...there);
}

const value = (of: unknown): string =>
  of === null || of === undefined ? "–" : typeof of === "string" ? of : JSON.stringify(of);

/** How A and B were made: both data sets, and the settings and inputs that differ. */
export function madeWith({ a, b, labels, settings, inputs }: Comparison): HTMLElement {
  const rows: [string, string, string][] = [
    ["Data set", named(a.folder), named(b.folder)],
    ["Made by", `s3d ${a.version}`, `s3d ${b.version}`],
    ["Files", count(a.files), count(b.files)],
    ["Size", `${(a.bytes / 1e6).toFixed(1)} MB`, `${(b.bytes / 1e6).toFixed(1)} MB`],
    ["Areas", a.areas.join(", "), b.areas.join(", ")],
    ["Classes", a.taxonomy ?? "without labels", b.taxonomy ?? "without labels"],
  ];
  if (labels) rows.push(["Labels", count(labels.a), count(labels.b)]);
  if (!settings.some(({ name }) => name === "seed")) rows.push(["Seed", String(a.seed), String(b.seed)]);
  for (const { name, a: ofA, b: ofB } of settings) rows.push([name, value(ofA), value(ofB)]);
  for (const { area, path, a: ofA, b: ofB } of inputs)
    rows.push([`Input of area ${area}: ${named(path)}`, value(ofA?.slice(0, 12)), value(ofB?.slice(0, 12))]);
  const element = table(
    ["", "A", "B"],
    rows.map((row) => (row[1] === row[2] ? row : row.map((cell) => h("strong", {}, cell)))),
  );
  element.classList.add("sides");
  return element;
}

export function labelsSection(against: Against): HTMLElement | null {
  const { labels, areas } = against.comparison;
  if (!labels) return null;
  const meshes = areas.flatMap(({ area, geometry, m2_only_a, m2_only_b }) => {
    if (geometry === "same" || geometry === "unlabelled") return [];
    const words = {
      other:
        `its meshes differ, so faces are compared by place; ${surface(m2_only_a)} of A and ` +
        `${surface(m2_only_b)} of B are over 10 cm from the other mesh`,
      unread: "a mesh could not be read, so labels are compared by pixels and names alone",
      one_sided: "only one of the data sets has it",
    }[geometry];
    return [h("p", {}, `Area ${area}: ${words}.`)];
  });
  const { changed, class_changed: other } = labels;
  const none = changed.faces + changed.pixels === 0;
  const words = none
    ? "No face and no pixel belongs to another instance or class."
    : `Another class: ${countsWords(other)}. ` + `Another instance or class: ${countsWords(changed)}.`;
  const renamed = [
    renamedList("renumbered", labels.renumbered),
    renamedList("named by another room", labels.other_room),
  ];
  const solid = against.changed_faces.flatMap((area) => {
    if (!against.both.meshes.some((mesh) => mesh.area === area)) return [];
    const words = against.both.meshes.length > 1 ? `Changes of area ${area} in 3D` : "Changes in 3D";
    return [h("a", { href: link("space", [area], { show: "changed" }) }, words)];
  });
  const places = solid.length > 0 ? h("p", { class: "places" }, ...solid) : null;
  return section("Labels", h("p", {}, words), ...renamed, ...meshes, matrix(against), places);
}

/** Instances that are the same under another name: one line, and the list to unfold. */
function renamedList(words: string, renamed: Renamed[]): HTMLElement | null {
  if (renamed.length === 0) return null;
  const sum = { faces: 0, m2: 0, pixels: 0 };
  for (const { faces, m2, pixels } of renamed) {
    sum.faces += faces;
    sum.m2 += m2;
    sum.pixels += pixels;
  }
  const subject = `${several(renamed.length, "instance")} ${words}`;
  const summary = `${subject}, otherwise the same: ${countsWords(sum)}.`;
  const items = renamed.map(({ a, b }) => h("li", {}, changedWords(named(a), named(b))));
  return h("details", { class: "renamed" }, h("summary", {}, summary), h("ul", {}, ...items));
}

/** The area of an instance is the last number of its name. */
const areaOf = (name: string): string => name.split("_").at(-1) ?? "";

/** The link to faces that changed, named by the instance that they left or joined. */
function instanceLink(against: Against, change: InstanceChange): string | null {
  const { kind, a, b, lost, gained, relabelled } = change;
  const isLoss = kind === "vanished" || (kind === "extent" && lost.m2 >= gained.m2);
  const [was, is] = {
    class: [a[0], b[0]],
    extent: isLoss ? [a[0]] : [undefined, b[0]],
    split: [undefined, b[1]],
    merged: [a[1]],
    regrouped: [a[1]],
    vanished: [a[0]],
    appeared: [undefined, b[0]],
  }[kind];
  const counts = relabelled.faces > 0 ? relabelled : isLoss ? lost : gained;
  const href = changedLink(against, counts, { ...(was && { was }), ...(is && { is }) });
  const area = areaOf(was ?? is ?? "");
  const there = against.changed_faces.some((number) => String(number) === area);
  return href && there ? href.replace("#/space?", `#/space/${area}?`) : href;
}

const KINDS: Record<InstanceChange["kind"], string> = {
  class: "Another class",
  extent: "Another extent",
  split: "Split",
  merged: "Merged",
  regrouped: "Regrouped",
  vanished: "Vanished",
  appeared: "Appeared",
};

const instanceNames = (names: string[]): HTMLElement =>
  h("span", { class: "names" }, names.map(named).join(" + ") || "–");

export function instancesSection(against: Against): HTMLElement | null {
  const labels = against.comparison.labels;
  if (!labels) return null;
  // Columns without any surface are left out.
  const parts = (["lost", "gained", "relabelled"] as const).filter((part) =>
    labels.instances.some((instance) => instance[part].m2 > 0),
  );
  const rows = labels.instances.map((instance): Cells => {
    const href = instanceLink(against, instance);
    const kind = KINDS[instance.kind];
    const sizes = [instance.m2_a, instance.m2_b].flatMap((m2) => (m2 === null ? [] : [surface(m2)]));
    return [
      href ? h("a", { href, title: "Show in 3D" }, kind) : kind,
      instanceNames(instance.a),
      instanceNames(instance.b),
      number([...new Set(sizes)].join(" → ") || "–"),
      ...parts.map((part) => number(surface(instance[part].m2))),
      number(count(instance.lost.pixels + instance.gained.pixels + instance.relabelled.pixels)),
    ];
  });
  const columns = parts.map((part) => `${part.charAt(0).toUpperCase()}${part.slice(1)}`);
  const head = ["Change", "In A", "In B", "Surface", ...columns, "Pixels"];
  const names = (words: string, all: string[]): HTMLElement | null =>
    all.length === 0
      ? null
      : h(
          "details",
          {},
          h("summary", {}, `${several(all.length, "label")} ${words}`),
          h("p", {}, all.map(named).join(", ")),
        );
  return section(
    "Instances that changed",
    ...some(head, rows),
    names("of A without a partner in B", labels.gone),
    names("of B without a partner in A", labels.added),
  );
}

/** The link to a candidate view or scan location of A, and its name. */
function placeOf(index: Index, { area, uuid, candidate }: ViewName): { name: string; href: string | null } {
  const at = index.locations.findIndex((l) => l.area === area && l.uuid === uuid);
  const location = index.locations[at];
  const view =
    candidate === undefined
      ? undefined
      : index.views.find((v) => v.location === at && at >= 0 && v.candidate === candidate);
  if (view) {
    const href = view.picture === null ? inPanorama(index, view) : link("view", [view.picture]);
    return { name: nameOfView(index, view), href };
  }
  const name = candidate === undefined ? named(uuid) : `${uuid.slice(0, 8)} · candidate ${candidate}`;
  const pano = location?.pano && candidate === undefined ? link("pano", [area, uuid]) : null;
  return { name: index.areas.length > 1 ? `area ${area} · ${name}` : name, href: pano };
}

export function viewsSection(index: Index, { views }: Comparison): HTMLElement | null {
  const kinds: [string, ViewName[]][] = [
    ["Kept in A alone", views.lost],
    ["Kept in B alone", views.gained],
    ["In both, at other angles", views.redrawn],
    ["Scan locations in A alone", views.locations_lost],
    ["Scan locations in B alone", views.locations_gained],
    ["Photographs in A alone", views.photographs_lost],
    ["Photographs in B alone", views.photographs_gained],
  ];
  const lists = kinds.flatMap(([title, names]) => {
    if (names.length === 0) return [];
    const items = names.slice(0, MOST).map((name) => {
      const { name: words, href } = placeOf(index, name);
      return h("li", {}, href ? h("a", { href }, words) : words);
    });
    const more = names.length - items.length;
    if (more > 0) items.push(h("li", { class: "quiet" }, `${count(more)} more`));
    return [h("details", {}, h("summary", {}, `${title}: ${count(names.length)}`), h("ul", {}, ...items))];
  });
  if (lists.length === 0) return null;
  const kept = `A keeps ${several(views.kept_a, "view")}, B ${count(views.kept_b)}.`;
  return section("Views", h("p", {}, kept), ...lists);
}

const COLUMNS: [keyof ModalityChanges, string][] = [
  ["same", "Same"],
  ["same_pixels", "Same pixels"],
  ["renumbered", "Renumbered"],
  ["changed", "Changed"],
  ["other_pose", "Other pose"],
  ["other_form", "Other form"],
  ["unread", "Unread"],
  ["only_a", "Only A"],
  ["only_b", "Only B"],
];

export function modalitiesSection({ modalities }: Comparison): HTMLElement | null {
  const shown = COLUMNS.filter(([key]) => modalities.some((m) => Number(m[key]) > 0));
  const differ = modalities.some((m) => m.changed > 0);
  const rows = modalities.map((m): Cells => {
    const unit = m.modality === "normal" ? "°" : " m";
    const size = [
      m.psnr_db !== null && `PSNR ${m.psnr_db.toFixed(1)} dB`,
      m.mean !== null && `mean ${m.mean.toPrecision(2)}${unit}`,
      m.largest !== null && `largest ${m.largest.toPrecision(2)}${unit}`,
    ].filter(Boolean);
    return [
      MODALITY_NAMES[m.modality] ?? m.modality,
      ...shown.map(([key]) => number(count(Number(m[key])))),
      ...(differ ? [number(m.changed > 0 ? percent(m.pixels_changed / Math.max(1, m.pixels)) : "")] : []),
      ...(differ ? [size.join(", ")] : []),
    ];
  });
  if (rows.length === 0) return null;
  const head = ["Images", ...shown.map(([, name]) => name), ...(differ ? ["Pixels that differ", ""] : [])];
  const hint = differ ? h("p", { class: "quiet" }, "Pixels are those of the images that changed.") : null;
  return section("Images by modality", table(head, rows), hint);
}

/** The link to the image of a file of A in the report. */
function placeOfFile(index: Index, path: string): string | null {
  const [, area, uuid, frame] = /^area_(\d+)\/.*camera_([^_]+)_.*_frame_([^_]+)_domain_/.exec(path) ?? [];
  return imageLink(index, Number(area), uuid ?? "", frame ?? "");
}

export function posesSection(index: Index, { poses }: Comparison): HTMLElement | null {
  const rows = poses.moved.map(({ a, m, degrees, k_px }): Cells => {
    const href = placeOfFile(index, a);
    const name = a.split("/").at(-1) ?? a;
    return [
      href ? h("a", { href }, named(name)) : named(name),
      number(`${m.toPrecision(3)} m`),
      number(`${degrees.toPrecision(3)}°`),
      number(k_px === null ? "other size" : `${k_px.toPrecision(3)} px`),
    ];
  });
  return section("Poses that differ", ...some(["File in A", "Place", "Direction", "Lens"], rows, 20));
}

export function filesSection({ files }: Comparison): HTMLElement | null {
  const differ = files.filter((kind) => kind.changed + kind.only_a + kind.only_b > 0);
  if (differ.length === 0) return null;
  const rows = differ.map((kind): Cells => {
    const list = h("ul", {}, ...kind.first.map((path) => h("li", {}, h("code", {}, named(path)))));
    return [
      h("details", {}, h("summary", {}, kind.kind), list),
      number(count(kind.same)),
      number(count(kind.changed)),
      number(count(kind.only_a)),
      number(count(kind.only_b)),
    ];
  });
  const same = files.length - differ.length;
  const words =
    same === 0 ? null : h("p", { class: "quiet" }, `${several(same, "other kind")} of files are the same.`);
  const element = section("Files", table(["Kind", "Same", "Changed", "Only A", "Only B"], rows), words);
  element?.classList.add("files");
  return element;
}

export function faultsSection({ comparison, faults }: Against): HTMLElement | null {
  const rows = [
    ...comparison.unread.map(({ side, path, message }): Cells => [
      side.toUpperCase(),
      h("code", {}, named(path)),
      message,
    ]),
    ...faults.map(({ path, message }): Cells => ["B", h("code", {}, named(path)), message]),
  ];
  const notes = comparison.notes.map((note) => h("li", {}, note));
  const element = section(
    "Not compared",
    notes.length > 0 ? h("ul", {}, ...notes) : null,
    ...some(["", "File", "What is wrong"], rows),
  );
  return element;
}
