// The order of changed images in a list, and the images that show one change of labels.

import { type Route, link } from "../route/route.js";
import { type Against, type ChangedPicture, type Pixels, changedWords, classWords } from "./data.js";

/** A change of labels, by class in A and in B; the list of images may be limited to it. */
export interface Change {
  was: string;
  is: string;
}

export const changeOf = ({ query }: Route): Change | null => {
  const [was, is] = [query.get("was"), query.get("is")];
  return was === null || is === null ? null : { was, is };
};

export const changeWords = ({ was, is }: Change): string =>
  was === is ? `${classWords(was)}, another instance` : changedWords(classWords(was), classWords(is));

/** The images that show a change. */
export const imagesOf = (change: Change): string => link("compare", [], { ...change });

const share = (pixels: Pixels | undefined): number =>
  pixels ? pixels.pixels_changed / Math.max(1, pixels.pixels) : 0;

/**
 * The modality that says most about a difference: labels, otherwise the one with the largest share of
 * pixels. Colours of labels follow from labels, so they count only if nothing else differs.
 */
export function mostChanged({ pixels }: ChangedPicture): [string, Pixels] | null {
  const told = Object.entries(pixels).filter(([modality]) => modality !== "semantic_pretty");
  const of = told.length > 0 ? told : Object.entries(pixels);
  const labels = of.find(([modality]) => modality === "semantic");
  return labels ?? of.sort((a, b) => share(b[1]) - share(a[1]))[0] ?? null;
}

/** Images that differ in colours of labels alone come last. */
function shareOf(changed: ChangedPicture): number {
  const most = mostChanged(changed);
  if (!most) return -2;
  return most[0] === "semantic_pretty" ? share(most[1]) - 1.5 : share(most[1]);
}

/** The number of pixels of each picture that show a change; pictures without any are left out. */
function pixelsOf({ comparison, pictures }: Against, { was, is }: Change): Map<number, number> {
  const place = comparison.labels?.matrix.findIndex(({ a, b }) => a === was && b === is) ?? -1;
  const found = pictures.map(({ classes }, k): [number, number] => {
    return [k, classes.find(([of]) => of === place)?.[1] ?? 0];
  });
  return new Map(found.filter(([, pixels]) => pixels > 0));
}

/** The number of pictures that show each change, by index in the comparison's matrix. */
export function imagesByChange({ pictures }: Against): Map<number, number> {
  const images = new Map<number, number>();
  for (const { classes } of pictures)
    for (const [place] of classes) images.set(place, (images.get(place) ?? 0) + 1);
  return images;
}

export interface Order {
  /** Indices into `pictures`. */
  numbers: number[];
  /** The number of pixels that show the requested change, by picture; null if no change is requested. */
  pixels: Map<number, number> | null;
}

/**
 * The pictures that show a change, those with most of its pixels first. Without a change all pictures, by
 * the share of pixels whose labels differ, or, without labels, of pixels that differ.
 */
export function orderOf(against: Against, change: Change | null): Order {
  const pixels = change && pixelsOf(against, change);
  const numbers = [...(pixels?.keys() ?? against.pictures.keys())];
  const size = (k: number): number => {
    const picture = against.pictures[k];
    return pixels?.get(k) ?? (picture ? shareOf(picture) : -2);
  };
  return { numbers: numbers.sort((a, b) => size(b) - size(a)), pixels };
}
