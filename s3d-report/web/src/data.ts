// What a report holds (docs/report.md), and how its files come in: as scripts, when they are looked at.

export type Rgb = [number, number, number];

export interface Seen {
  coverage: number | null;
  unlabelled: number | null;
  instances: number | null;
  /** Places of classes, and their shares of the pixels. */
  classes: [number, number][];
}

export interface Place {
  reason: "all" | "highest" | "drawn" | "not_drawn" | "lowest";
  rank: number;
  pool: number;
}

export interface Location {
  area: number;
  uuid: string;
  room: string;
  position: Rgb | null;
  azimuth_rad: number | null;
  pano: boolean;
  seen: Seen | null;
}

export interface View {
  area: number;
  location: number | null;
  room: string;
  photograph: string | null;
  frame: number | null;
  candidate: number | null;
  picture: number | null;
  yaw_deg: number | null;
  pitch_deg: number | null;
  fov_deg: number | null;
  entropy: number | null;
  place: Place | null;
  position: Rgb | null;
  seen: Seen | null;
}

export interface Room {
  area: number;
  name: string;
  floor_m2: number;
  outline: [number, number][][];
}

export interface Surface {
  faces: number;
  m2: number;
  pixels?: number;
}

export interface Area {
  area: number;
  faces: number;
  faces_left_out: number;
  points: number;
  annotated_points: number;
  rooms: number;
  locations: number;
  panoramas: number;
  views: number;
  frames?: number;
  rgb: string;
  unlabelled?: { without_votes: Surface; without_label: Surface };
  surface_seen?: unknown;
  offset_m?: Rgb;
}

export interface Statistics {
  areas: {
    area: number;
    points: number;
    faces: number;
    regular_images: number;
    panoramas: number;
    floor_m2?: number;
    instances_per_class?: Record<string, number>;
    rooms_per_type?: Record<string, { rooms: number; floor_m2: number }>;
  }[];
}

export interface Votes {
  faces: number;
  faces_without_votes: number;
  m2_without_votes: number;
  total: { faces_contested: number; faces_won_with_less_than_three_quarters: number };
  disputing_classes: { classes: [string, string]; faces: number; m2: number }[];
  disputed_patches: { labels: [string, string]; faces: number; m2: number; center: Rgb }[];
}

export interface Index {
  form: number;
  data_set: {
    name: string;
    version: string;
    seed: number;
    files: number;
    bytes: number;
    taxonomy: string | null;
    depth_units_per_m: number;
    options: Record<string, unknown>;
  };
  areas: Area[];
  classes: { name: string; color: Rgb }[];
  labels: { name: string; class: number | null; color: Rgb }[];
  rooms: Room[];
  locations: Location[];
  views: View[];
  views_per_file: number;
  thumbs_per_file: number;
  statistics: Statistics | null;
  votes: { area: number; votes: Votes }[];
  pixels_by_class: number[];
  pixels_unlabelled: number;
  faults: { path: string; message: string }[];
}

export interface Pinhole {
  /** Focal lengths and principal point, pixels of the data set's image. */
  k: [number, number, number, number];
  /** World → camera, OpenCV's axes. */
  rt: number[][];
}

export interface Picture {
  of: [number, number];
  size: [number, number];
  rgb: string | null;
  normal: string | null;
  depth: string | null;
  label: string | null;
  camera?: Pinhole | null;
}

declare global {
  interface Window {
    s3dReport: (key: string, text: string) => void;
  }
}

/** The form of files that this page reads. */
export const FORM = 1;

/** So many files of a kind are kept; those that were not looked at for longest go. */
const KEPT: Record<string, number> = { index: 1, pano: 4, views: 6, thumbs: 40 };

const files = new Map<string, Promise<unknown>>();
const arriving = new Map<string, (text: string) => void>();

window.s3dReport = (key, text) => arriving.get(key)?.(text);

/** The value that the file `data/KEY.js` hands over. */
export function load<T>(key: string): Promise<T> {
  const there = files.get(key);
  files.delete(key);
  const file = there ?? run(key);
  files.set(key, file);
  file.catch(() => files.delete(key));
  const kind = key.split("_")[0] ?? "";
  const same = [...files.keys()].filter((k) => k.split("_")[0] === kind);
  for (const old of same.slice(0, Math.max(0, same.length - (KEPT[kind] ?? 1)))) files.delete(old);
  return file as Promise<T>;
}

function run(key: string): Promise<unknown> {
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    const path = `data/${key}.js`;
    const end = (): void => {
      arriving.delete(key);
      script.remove();
    };
    arriving.set(key, (text) => {
      try {
        resolve(JSON.parse(text));
      } catch (e) {
        reject(new Error(`${path} is damaged: ${String(e)}`));
      }
    });
    script.onload = () => {
      end();
      reject(new Error(`${path} is damaged: make the report again`));
    };
    script.onerror = () => {
      end();
      reject(new Error(`${path} cannot be read: the report's folder must stay whole`));
    };
    script.src = path;
    document.head.append(script);
  });
}

export function loadPicture(index: Index, picture: number): Promise<Picture | null> {
  const file = Math.floor(picture / index.views_per_file);
  const pictures = load<(Picture | null)[]>(`views_${file}`);
  return pictures.then((all) => all[picture % index.views_per_file] ?? null);
}

export function loadThumb(index: Index, picture: number): Promise<string | null> {
  const file = Math.floor(picture / index.thumbs_per_file);
  const thumbs = load<(string | null)[]>(`thumbs_${file}`);
  return thumbs.then((all) => all[picture % index.thumbs_per_file] ?? null);
}
