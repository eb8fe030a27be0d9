// What a presentation shows, step by step, and the words for it.

import type { Index, Rgb, Seen, View } from "../data.js";
import { named, percent, roomName, several } from "../dom.js";
import { richest, richestPanoramas } from "../overview/richest.js";
import { storeysOf, wordsOf } from "../storeys.js";

/** The most areas, views and panoramas. */
const [AREAS, VIEWS, PANORAMAS] = [6, 8, 6];
/** A panorama follows so many views. */
const BETWEEN = 2;
/** The most classes in a caption. */
const CLASSES = 6;

export type Step =
  | { kind: "building"; area: number; storey: number | null }
  | { kind: "view"; area: number; view: View }
  | { kind: "panorama"; area: number; location: number };

/** The steps for all areas, or for one: buildings storey by storey, then pictures, no two of them alike. */
export function stepsOf(index: Index, area: number | null = null): Step[] {
  const areas = index.areas.map((each) => each.area).filter((each) => area === null || each === area);
  const meshes = index.meshes.filter((mesh) => areas.includes(mesh.area)).slice(0, AREAS);
  const buildings = meshes.flatMap((mesh): Step[] => {
    const storeys = storeysOf(index, mesh.area).all.map((_, storey): number | null => storey);
    const all = storeys.length > 1 ? [null, ...storeys] : storeys;
    return all.map((storey) => ({ kind: "building", area: mesh.area, storey }));
  });

  const views = richest(
    index.views.filter((view) => areas.includes(view.area)),
    index,
    VIEWS,
  );
  const panoramas = richestPanoramas(index, areas, PANORAMAS).map((location): Step => {
    return { kind: "panorama", area: index.locations[location]?.area ?? 0, location };
  });
  const pictures = views.flatMap((view, i): Step[] => {
    const step: Step = { kind: "view", area: view.area, view };
    return (i + 1) % BETWEEN === 0 ? [step, ...panoramas.splice(0, 1)] : [step];
  });
  return [...buildings, ...pictures, ...panoramas];
}

export interface Caption {
  title: string;
  words: string;
  /** The classes that are seen most, with their colours. */
  classes: { name: string; color: Rgb }[];
}

function classesIn(index: Index, shares: [number, number][]): Caption["classes"] {
  const sorted = [...shares].filter(([, share]) => share > 0).sort((a, b) => b[1] - a[1]);
  return sorted.slice(0, CLASSES).flatMap(([i]) => index.classes[i] ?? []);
}

/** What is seen, as `4 instances, 12 % unlabelled`. */
function contentOf(seen: Seen | null): string[] {
  if (!seen) return [];
  const { instances, unlabelled } = seen;
  return [
    ...(instances !== null ? [several(instances, "instance")] : []),
    ...(unlabelled !== null && unlabelled >= 5e-4 ? [`${percent(unlabelled)} unlabelled`] : []),
  ];
}

const isKnown = (room: string): boolean => room !== "" && room !== "unknown_1";

export function captionOf(index: Index, step: Step): Caption {
  const ofArea = index.areas.length > 1 ? [`Area ${step.area}`] : [];
  const joined = (words: string[]): string => words.join(" · ");
  if (step.kind === "building") {
    const storeys = storeysOf(index, step.area).all;
    const storey = storeys[step.storey ?? -1];
    const words =
      step.storey === null ? `${several(storeys.length, "storey")}` : storey ? wordsOf(storey) : "";
    // Without rooms and locations a single storey has nothing to tell.
    const isBare = storeys.length === 1 && storey?.rooms.length === 0 && storey.locations === 0;
    const shares = index.surface_by_class.map(({ m2 }, i): [number, number] => [i, m2]);
    const labelled = index.meshes.find((mesh) => mesh.area === step.area)?.has_votes ?? false;
    return {
      title: named(index.data_set.name),
      words: joined([...ofArea, ...(isBare ? [] : [words])]),
      classes: labelled ? classesIn(index, shares) : [],
    };
  }

  const isView = step.kind === "view";
  const location = index.locations[isView ? (step.view.location ?? -1) : step.location];
  const room = isView ? step.view.room : (location?.room ?? "");
  const seen = isView ? step.view.seen : (location?.seen ?? null);
  const photograph = isView ? step.view.photograph : null;
  const what = photograph !== null ? named(photograph) : isView ? "View" : "Panorama";
  const from = isKnown(room) || !location ? [] : [`scan location ${location.uuid.slice(0, 8)}`];
  return {
    title: isKnown(room) ? roomName(room) : named(index.data_set.name),
    words: joined([...ofArea, what, ...from, ...contentOf(seen)]),
    classes: classesIn(index, seen?.classes ?? []),
  };
}

/** The share of the width left of the line, in colour, at a share of a step's time. */
export function wipeAt(t: number): number {
  const eased = (from: number, to: number): number => {
    const x = Math.min(1, Math.max(0, (t - from) / (to - from)));
    return x * x * (3 - 2 * x);
  };
  return 1 - eased(0.22, 0.5) + eased(0.74, 0.97);
}

/** Without motion there is colour in the first half, and the other layer in the second. */
export const wipeWithoutMotion = (t: number): number => (t < 0.5 ? 1 : 0);
