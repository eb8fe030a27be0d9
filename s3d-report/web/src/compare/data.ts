// The comparison with another data set, in a report that was made against one (`s3d_report::files`,
// docs/compare.md). A is the data set of the report, B the other.

import { type Index, type Picture, type Rgb, load, loadPicture } from "../data.js";
import { named } from "../dom.js";
import { unpack } from "../picture/faces.js";
import { paletteOf } from "../palette.js";

export interface Counts {
  faces: number;
  m2: number;
  pixels: number;
}

export interface Pixels {
  pixels: number;
  pixels_changed: number;
  psnr_db: number | null;
  mean: number | null;
  largest: number | null;
}

interface DataSet {
  folder: string;
  version: string;
  seed: number;
  files: number;
  bytes: number;
  areas: number[];
  taxonomy: string | null;
}

export interface ViewName {
  area: number;
  uuid: string;
  candidate?: number;
}

export interface ModalityChanges extends Pixels {
  modality: string;
  same: number;
  same_pixels: number;
  renumbered: number;
  changed: number;
  other_pose: number;
  other_form: number;
  unread: number;
  only_a: number;
  only_b: number;
}

/** Instances that share most of their surface, and what they lost and gained. */
export interface InstanceChange {
  kind: "class" | "extent" | "split" | "merged" | "regrouped" | "vanished" | "appeared";
  a: string[];
  b: string[];
  m2_a: number | null;
  m2_b: number | null;
  lost: Counts;
  gained: Counts;
  relabelled: Counts;
  class_changed: Counts;
}

/** An instance with another name in B. */
export type Renamed = { a: string; b: string } & Counts;

export interface Comparison {
  equal: boolean;
  full: boolean;
  a: DataSet;
  b: DataSet;
  settings: { name: string; a: unknown; b: unknown }[];
  inputs: { area: number; path: string; a: string | null; b: string | null }[];
  files: { kind: string; same: number; changed: number; only_a: number; only_b: number; first: string[] }[];
  areas: {
    area: number;
    faces_a: number | null;
    faces_b: number | null;
    geometry: "same" | "other" | "unread" | "one_sided" | "unlabelled";
    faces_changed: number;
    m2_changed: number;
    m2_only_a: number;
    m2_only_b: number;
  }[];
  labels: {
    a: number;
    b: number;
    added: string[];
    gone: string[];
    renumbered: Renamed[];
    other_room: Renamed[];
    changed: Counts;
    class_changed: Counts;
    matrix: ({ a: string; b: string } & Counts)[];
    instances: InstanceChange[];
  } | null;
  views: Record<
    | "lost"
    | "gained"
    | "redrawn"
    | "locations_lost"
    | "locations_gained"
    | "photographs_lost"
    | "photographs_gained",
    ViewName[]
  > & { kept_a: number; kept_b: number };
  modalities: ModalityChanges[];
  poses: {
    same: number;
    same_camera: number;
    moved: { a: string; b: string; m: number; degrees: number; k_px: number | null }[];
    largest_m: number;
    largest_degrees: number;
    largest_k_px: number;
  };
  notes: string[];
  unread: { side: "a" | "b"; path: string; message: string }[];
}

export interface ChangedPicture {
  picture: number | null;
  pano: number | null;
  is_there: boolean;
  pixels: Record<string, Pixels>;
  /** Indices into the comparison's matrix of classes, and the number of pixels that changed so. */
  classes: [number, number][];
}

interface Compared {
  comparison: Comparison;
  classes: Index["classes"];
  labels: Index["labels"];
  /** The index of the label of the same instance in A, by label of B. */
  partners: (number | null)[];
  depth_units_per_m: number;
  changed_faces: number[];
  pictures: ChangedPicture[];
  faults: { path: string; message: string }[];
}

/** The differences between A and B, with labels and classes of both. */
export interface Against extends Compared {
  /** The index of A, with B's labels and classes after its own. */
  both: Index;
  /** The index in `both.labels` of each of B's labels: of the same instance and class in A, if there is one. */
  labelOfB: Uint32Array;
  /** The names that B's labels have in B, by index in `both.labels`. */
  namesInB: Map<number, string>;
  /** The factor that turns B's depths into A's units. */
  depthOfB: number;
}

/** Labels of A and B are the same if they belong to the same instance and class, whatever their names. */
function merged(index: Index, compared: Compared): Against {
  const { classes, labels } = { classes: [...index.classes], labels: [...index.labels] };
  const places = new Map(classes.map(({ name }, i) => [name, i]));
  const classOfB = compared.classes.map((of) => places.get(of.name) ?? classes.push(of) - 1);
  // Classes of B alone get colours that A's do not have.
  const colors = paletteOf(
    classes.map(({ name }) => name),
    index.classes.map(({ color }) => color),
  );
  classes.forEach((each, i) => (classes[i] = { ...each, color: colors[i] ?? each.color }));
  const labelOfB = compared.labels.map((label, i) => {
    const own = { ...label, class: label.class === null ? null : (classOfB[label.class] ?? null) };
    const partner = compared.partners[i] ?? null;
    const isSame = partner !== null && index.labels[partner]?.class === own.class;
    return isSame ? partner : labels.push(own) - 1;
  });
  const namesInB = new Map(labelOfB.map((place, i) => [place, compared.labels[i]?.name ?? ""]));
  const pixels = classes.map((_, i) => (labels.some((label) => label.class === i) ? 1 : 0));
  const units = index.data_set.depth_units_per_m;
  return {
    ...compared,
    both: { ...index, classes, labels, pixels_by_class: pixels },
    labelOfB: Uint32Array.from(labelOfB),
    namesInB,
    depthOfB: units / (compared.depth_units_per_m || units),
  };
}

let made: Promise<Against> | null = null;

/** The differences; null if the report was not made against another data set. */
export function loadAgainst(index: Index): Promise<Against> | null {
  if (index.against === null || index.against === undefined) return null;
  made ??= load<Compared>("compare").then((compared) => merged(index, compared));
  made.catch(() => (made = null));
  return made;
}

/** The pictures of A and B for an image that differs; null if neither could be read. */
export async function loadPair(
  index: Index,
  { picture, pano, is_there }: ChangedPicture,
  number: number,
): Promise<{ a: Picture | null; b: Picture | null }> {
  const ofA =
    pano !== null ? load<Picture | null>(`pano_${pano}`) : loadPicture(index, picture ?? Number.NaN);
  const [a, b] = await Promise.all([ofA, is_there ? load<Picture | null>(`other_${number}`) : null]);
  return { a, b };
}

/** How a face or pixel changed: to another instance of the same class, or to another class. */
export const INSTANCE = 1;
export const CLASS = 2;

/** How one label changed to another, both as indices into `both.labels`. */
export function kindOf({ both }: Against, a: number, b: number): 0 | typeof INSTANCE | typeof CLASS {
  if (a === b) return 0;
  return both.labels[a]?.class === both.labels[b]?.class ? INSTANCE : CLASS;
}

/**
 * A connected patch of changed faces: labels as indices into `both.labels`, and the centre of a face in the
 * middle.
 */
export interface Patch extends Omit<Counts, "pixels"> {
  a: number;
  b: number;
  center: Rgb;
}

/** The faces whose labels differ. */
export interface FaceChanges {
  /** The largest patches, changes of class first. */
  patches: Patch[];
  /** How a face changed; 0 if it did not. */
  kind: (face: number) => number;
  /** Its labels in A and B, if it changed. */
  labelsOf: (face: number) => [number, number] | null;
  /** Groups by both labels: changes of class first, then those with more faces. */
  groups: Group[];
}

/** Faces that changed from one label to another, as indices into `both.labels`. */
export interface Group {
  a: number;
  b: number;
  kind: typeof INSTANCE | typeof CLASS;
  faces: number[];
}

/** The faces of an area whose labels differ; null if there are none, or if the meshes differ. */
export async function loadChanges(against: Against, area: number): Promise<FaceChanges | null> {
  if (!against.changed_faces.includes(area)) return null;
  const key = `changed_${area}`;
  const packed = await load<Record<"face" | "a" | "b", string> & { faces: number; patches: Patch[] }>(key);
  const texts = [packed.face, packed.a, packed.b].map(String);
  const rows = await Promise.all(texts.map(unpack)).catch(() => []);
  const fits = rows.every((row) => row.byteLength === 4 * packed.faces);
  const [face, a, b] = fits ? rows.map((row) => new Uint32Array(row)) : [];
  if (!face || !a || !b || !Array.isArray(packed.patches))
    throw new Error(`data/${key}.js is damaged: make the report again`);
  const placeOf = new Map<number, number>();
  const groups = new Map<number, Group>();
  face.forEach((number, place) => {
    placeOf.set(number, place);
    const [x, y] = [a[place] ?? 0, (b[place] = against.labelOfB[b[place] ?? 0] ?? 0)];
    const pair = x * against.both.labels.length + y;
    const group = groups.get(pair) ?? { a: x, b: y, kind: kindOf(against, x, y) || INSTANCE, faces: [] };
    group.faces.push(number);
    groups.set(pair, group);
  });
  const labelsOf = (number: number): [number, number] | null => {
    const place = placeOf.get(number);
    return place === undefined ? null : [a[place] ?? 0, b[place] ?? 0];
  };
  return {
    patches: packed.patches.map((patch) => ({ ...patch, b: against.labelOfB[patch.b] ?? 0 })),
    labelsOf,
    kind: (number) => {
      const labels = labelsOf(number);
      return labels ? kindOf(against, ...labels) : 0;
    },
    groups: [...groups.values()].sort((x, y) => y.kind - x.kind || y.faces.length - x.faces.length),
  };
}

export type Side = "a" | "b";

/** The name of a label in A or in B. */
const ownName = ({ both, namesInB }: Against, label: number, side: Side): string | undefined =>
  (side === "b" ? namesInB.get(label) : undefined) ?? both.labels[label]?.name;

/** Whether the name of a class or instance means this label. The comparison calls no label `<UNK>`. */
function isNamed(against: Against, label: number, name: string | null, side: Side): boolean {
  if (name === null) return true;
  const of = against.both.labels[label]?.class ?? null;
  if (of === null) return name === "<UNK>";
  return ownName(against, label, side) === name || against.both.classes[of]?.name === name;
}

/** The first group that was `was` in A and is `is` in B. If both are null, any group. */
export const groupOf = (
  against: Against,
  { groups }: FaceChanges,
  was: string | null,
  is: string | null,
): Group | undefined =>
  groups.find(({ a, b }) => isNamed(against, a, was, "a") && isNamed(against, b, is, "b"));

/** The name of a label's class or instance in A or in B, as the comparison writes it, for text. */
export function nameOf(against: Against, label: number, of: "class" | "instance", side: Side): string {
  const found = against.both.labels[label];
  const its = found?.class === null || !found ? undefined : against.both.classes[found.class];
  if (!its || !found) return "unlabelled";
  return named(of === "class" ? its.name : (ownName(against, label, side) ?? ""));
}

/** What is one thing in A and another in B. */
export const changedWords = (was: string, is: string): string => `${was} in A, ${is} in B`;

/** A class in words; the comparison has `<UNK>` and `<nothing>`, too. */
export const classWords = (name: string): string =>
  name === "<UNK>" ? "unlabelled" : name === "<nothing>" ? "nothing seen" : named(name);
