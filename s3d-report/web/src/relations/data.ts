// The files of what belongs together: the objects of views, partners of views, and the graph of an area.

import { type Index, load } from "../data.js";

/** The kinds of parts of an outline. */
export const [SEEN, HIDDEN, CUT] = [0, 1, 2];

/** An object of a view. */
export interface SeenObject {
  label: number;
  /** Its visible pixels, and those that it would have without others. */
  seen: number;
  alone: number;
  /** The share that others hide, and the share that the frame cuts off. */
  hidden: number;
  cut: number | null;
  /** Labels of what is in front, 0 for surface without a label, and how many pixels each hides. */
  by: [number, number][];
  nearest_m: number;
  /** Rings of parts: the kind of each, then x and y of its corners, in pixels of the data set. */
  outline: number[][][];
}

/** An image that shares surface with a view: a picture, or the panorama of a location. */
export interface Partner {
  picture?: number;
  pano?: number;
  /** The share of the view that the other image sees, and the share of the other that the view sees. */
  shared: [number, number];
  angle_deg: number | null;
  distance_m: number;
  turn_deg: number;
  /** Places that both show: x and y in the view, then in the other image, in pixels of the data set. */
  points: [number, number, number, number][];
}

/** Where images were taken: a scan location, or the place of a photograph by its picture. */
export interface Place {
  location?: number;
  picture?: number;
}

export interface Graph {
  edges: { ends: [Place, Place]; share: number; pairs: number }[];
  left_out: number;
}

/** The entry of a picture in a file of `views_per_file` entries. */
async function ofPicture<T>(index: Index, kind: string, picture: number): Promise<T | null> {
  const all = await load<(T | null)[]>(`${kind}_${Math.floor(picture / index.views_per_file)}`);
  return all[picture % index.views_per_file] ?? null;
}

export const loadObjects = (index: Index, picture: number): Promise<SeenObject[] | null> =>
  ofPicture(index, "objects", picture);

/** The partners of a view; none if the pairs of its area are unknown. */
export async function loadPartners(index: Index, area: number, picture: number): Promise<Partner[]> {
  if (!index.pairs?.includes(area)) return [];
  return (await ofPicture<Partner[]>(index, "pairs", picture)) ?? [];
}

export const loadGraph = (area: number): Promise<Graph> => load(`graph_${area}`);
