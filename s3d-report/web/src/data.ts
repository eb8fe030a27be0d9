// The content of a report (`s3d_report::files`), and its files, which are loaded as scripts when they are
// needed.

export type Rgb = [number, number, number];

export interface Seen {
  coverage: number | null;
  unlabelled: number | null;
  instances: number | null;
  /** The median depth around the horizon, metres; missing in older reports. */
  depth_m?: number | null;
  /** Indices of classes, and their shares of the pixels. */
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
  /** The first direction of view, degrees to the right of the centre column. */
  look_deg?: number | null;
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
  /** For a photograph. Like `forward` and `up`, the directions of its camera, it is in world coordinates. */
  position: Rgb | null;
  forward?: Rgb | null;
  up?: Rgb | null;
  seen: Seen | null;
  /** The number of its objects, which are in `objects_N`; missing without any. */
  objects?: number;
}

export interface Room {
  area: number;
  name: string;
  floor_m2: number;
  /** The height of its floor; missing in older reports. */
  floor?: number | null;
  heights: [number, number] | null;
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
  warnings?: string[];
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

export interface VotesOf {
  name: string;
  points: number;
  faces_voted: number;
  votes_per_voted_face: number;
  faces_contested: number;
  faces_won_with_less_than_three_quarters: number;
  faces_won_with_less_than_half: number;
}

export interface Votes {
  faces: number;
  faces_without_votes: number;
  m2_without_votes: number;
  total: Omit<VotesOf, "name">;
  rooms: VotesOf[];
  classes: VotesOf[];
  disputing_classes: { classes: [string, string]; faces: number; m2: number }[];
  disputed_patches: { labels: [string, string]; faces: number; m2: number; center: Rgb; bbox?: number[] }[];
}

export interface VoteSpread {
  /** Faces by all of their votes: 0, 1, 2, 3 to 4, 5 to 8, and so on. */
  votes: Surface[];
  /** Faces with votes, by margin in ten parts. */
  margin: Surface[];
}

export interface Mesh {
  area: number;
  /** The number in the data set's mesh. */
  faces: number;
  /** The number in the report's files. */
  shown: number;
  /** The edge of the cubes in which vertices were merged, in metres; null if none were. */
  cell_m: number | null;
  min: Rgb;
  max: Rgb;
  files: number;
  texture_files: number;
  has_votes: boolean;
  has_boxes: boolean;
  /** Null without votes. */
  spread: VoteSpread | null;
  materials: { color: Rgb; texture: number | null }[];
}

export interface Verified {
  files: number;
  checks: number;
  notes: string[];
  faults: { topic: string; kind: string; count: number; first: [string, string][] }[];
}

/** The ground of a plan: a storey from above, below its ceilings. */
export interface Ground {
  area: number;
  /** The heights of the lowest and the highest floor of the storey. */
  floors: [number, number];
  /** The height above which all is cut away. */
  cut: number | null;
  /** The least x and the greatest y, metres. */
  west: number;
  north: number;
  /** Width and height in pixels. */
  size: [number, number];
  /** The side of a pixel, metres. */
  pixel_m: number;
}

/** A table of an evaluation. A number that is not defined is null. */
export interface ScoreTable {
  title: string;
  columns: string[];
  rows: {
    name: string;
    scores: { value: number | null; interval: [number | null, number | null] | null }[];
  }[];
}

/** Counts by true class; a last count of a row is of what was predicted as no class. */
export interface ConfusionTable {
  classes: string[];
  counts: number[][];
}

/** A result of `s3d eval`. */
export interface Scores {
  name: string;
  protocol: string;
  version: number;
  variant: string;
  evaluator: string;
  definition: string[];
  counted: Record<string, number>;
  tables: ScoreTable[];
  confusion: ConfusionTable | null;
  against: { differences: ScoreTable[] } | null;
  notes: string[];
  units: {
    columns: string[];
    rows: string[];
    units: { area: number; name: string; scores: (number | null)[][] }[];
  };
}

export interface Index {
  form: number;
  data_set: {
    name: string;
    missing_yet: string[] | null;
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
  meshes: Mesh[];
  /** Each with a file `ground_N`; missing in older reports. */
  grounds?: Ground[];
  /** The areas with pairs of images, each with a file `graph_A`; missing without any. */
  pairs?: number[];
  /** The number of files `scores_N`. */
  scores: number;
  /** The name of the data set that the report was made against. */
  against?: string | null;
  pixels_by_class: number[];
  /** Faces and m² of each class, including filled faces. */
  surface_by_class: Surface[];
  pixels_unlabelled: number;
  faults: { path: string; message: string }[];
  verified: Verified | null;
}

export interface Pinhole {
  /** Focal lengths and principal point, in pixels of the data set's image. */
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
  /** Faces of `rgb.obj`, from 0. */
  face: string | null;
  camera?: Pinhole | null;
  /** The width and the height of the colours in a file of their own; missing if there is none. */
  sharp?: [number, number];
}

/** What is shown before the index is read. */
export interface First {
  name: string;
  parts: Parts;
  /** Rings of x and y, metres. */
  outline: [number, number][][];
}

/** The parts of a report that are not empty. */
export type Parts = Record<"meshes" | "panoramas" | "views" | "plan" | "against" | "scores", boolean>;

declare global {
  interface Window {
    s3dReport: (key: string, text: string, packed?: boolean) => void;
  }
}

/** The version of the files that this page reads. */
export const FORM = 2;

/** The number of files of a kind that are kept. The least recently used file goes first. */
const KEPT: Record<string, number> = {
  index: 1,
  first: 0,
  pano: 4,
  panos: 10,
  sharp: 2,
  other: 4,
  views: 6,
  objects: 4,
  pairs: 4,
  thumbs: 40,
  mesh: 0,
  textures: 0,
  ground: 0,
  compare: 0,
};

const files = new Map<string, Promise<unknown>>();
/** Files that are not here yet: none of them is asked for twice, whether it is kept or not. */
const coming = new Map<string, Promise<unknown>>();
const arriving = new Map<string, (text: string, packed: boolean) => void>();

window.s3dReport = (key, text, packed = false) => arriving.get(key)?.(text, packed);

/** Decodes Base64 of a zlib stream. */
export function unpacked(text: string): Response {
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
}

/** The value in the file `data/KEY.js`. */
export function load<T>(key: string): Promise<T> {
  const there = files.get(key) ?? coming.get(key);
  files.delete(key);
  const file = there ?? run(key);
  if (!there) {
    const arrived = (): boolean => coming.delete(key);
    coming.set(key, file);
    file.then(arrived, arrived);
  }
  files.set(key, file);
  file.catch(() => files.delete(key));
  const kind = key.split("_")[0] ?? "";
  const same = [...files.keys()].filter((k) => k.split("_")[0] === kind);
  for (const old of same.slice(0, Math.max(0, same.length - (KEPT[kind] ?? 1)))) files.delete(old);
  return file as Promise<T>;
}

function run(key: string): Promise<unknown> {
  const inPage = document.querySelector(`script[data-key="${key}"]`);
  if (inPage) return Promise.resolve(inPage.textContent).then(JSON.parse);
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    const path = `data/${key}.js`;
    const end = (): void => {
      arriving.delete(key);
      script.remove();
    };
    const value = async (text: string, packed: boolean): Promise<unknown> => {
      try {
        return JSON.parse(packed ? await unpacked(text).text() : text);
      } catch (e) {
        throw new Error(`${path} is damaged: ${String(e)}`);
      }
    };
    arriving.set(key, (text, packed) => resolve(value(text, packed)));
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

/** The small image of a location's panorama; null if it has none. */
export function loadSmallPano(index: Index, location: number): Promise<string | null> {
  const file = Math.floor(location / index.thumbs_per_file);
  const all = load<(string | null)[]>(`panos_${file}`);
  return all.then((small) => small[location % index.thumbs_per_file] ?? null);
}
