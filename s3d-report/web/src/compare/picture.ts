// An image in both data sets: A left of the line, B right of it.

import type { Index, Location, Picture, Rgb, View } from "../data.js";
import { append, h, percent, roomName } from "../dom.js";
import { type Gaze, panoramaPoint, panoramaScreen, viewPoint, viewScreen } from "../picture/geometry.js";
import { type Modality, placeOf } from "../picture/gl.js";
import { nameOf as nameOfView } from "../pages/names.js";
import { inPanorama } from "../pages/view.js";
import { type Page, type Route, link, numberOf, replaceRoute, spaceLink } from "../route/route.js";
import { type Look, Viewer, type ViewerOptions, lookFrom, modalitiesOf, queryOf } from "../picture/viewer.js";
import { type Against, CLASS, type ChangedPicture, INSTANCE, type Pixels, kindOf, loadPair } from "./data.js";
import { changeOf, changeWords, imagesOf, orderOf } from "./order.js";
import { tellBoth } from "./words.js";

const RADIANS = Math.PI / 180;

/** The page's words for the comparison's modalities. */
export const MODALITY_NAMES: Record<string, string> = {
  rgb: "Colour",
  depth: "Depth",
  normal: "Normals",
  semantic: "Labels",
  semantic_pretty: "Colours of labels",
  global_xyz: "World coordinates",
};

const share = (pixels: Pixels): number => pixels.pixels_changed / Math.max(1, pixels.pixels);

export interface Shown {
  area: number;
  name: string;
  view: View | null;
  location: Location | null;
}

/** The image of the report that this picture shows; null if there is none. */
export function shownBy(index: Index, { picture, pano }: ChangedPicture): Shown | null {
  if (pano !== null) {
    const location = index.locations[pano];
    if (!location) return null;
    const name = `${roomName(location.room)} · ${location.uuid.slice(0, 8)} · panorama`;
    return { area: location.area, name, view: null, location };
  }
  const view = index.views.find((v) => v.picture === picture);
  if (!view) return null;
  const location = view.location === null ? null : (index.locations[view.location] ?? null);
  return { area: view.area, name: nameOfView(index, view), view, location };
}

export function pixelsWords(modality: string, pixels: Pixels): string {
  const words = [`${MODALITY_NAMES[modality] ?? modality}: ${percent(share(pixels))}`];
  const unit = modality === "normal" ? "°" : " m";
  if (pixels.psnr_db !== null) words.push(`PSNR ${pixels.psnr_db.toFixed(1)} dB`);
  if (pixels.mean !== null) words.push(`mean ${pixels.mean.toPrecision(2)}${unit}`);
  if (pixels.largest !== null) words.push(`largest ${pixels.largest.toPrecision(2)}${unit}`);
  return words.join(", ");
}

/** The modalities in which both can be shown, and the one that shows best how they differ. */
function modalitiesOfPair(against: Against, area: number, a: Picture, b: Picture): Modality[] {
  const ofB = modalitiesOf(against.both, area, b);
  const there = modalitiesOf(against.both, area, a).filter((m) => m !== "contested" && ofB.includes(m));
  if (there.includes("class") && a.of.join() === b.of.join()) there.push("changed");
  return there;
}

function firstModality({ pixels }: ChangedPicture, there: Modality[]): Modality {
  const order: [string, Modality][] = [
    ["semantic", "changed"],
    ["rgb", "rgb"],
    ["depth", "depth"],
    ["normal", "normal"],
    ["semantic_pretty", "instance"],
  ];
  const of = order.find(([modality, m]) => modality in pixels && there.includes(m))?.[1];
  return of ?? there[0] ?? "rgb";
}

/** The grid in which changed pixels of a panorama are counted: columns and rows. */
const CELLS = [36, 18] as const;

/** The cell of a panorama where most pixels have another class, or else another label. */
function mostOfPanorama(against: Against, viewer: Viewer): Pick<Gaze, "lon" | "lat"> | null {
  const { width, height, a, b } = viewer.labels;
  if (!a || !b || a.length !== b.length) return null;
  const [across, down] = CELLS;
  const counts = [INSTANCE, CLASS].map(() => new Uint32Array(across * down));
  a.forEach((label, i) => {
    const other = b[i] ?? label;
    if (label === other) return;
    const [x, y] = [i % width, Math.floor(i / width)];
    const cell = Math.floor((y * down) / height) * across + Math.floor((x * across) / width);
    const count = counts[kindOf(against, label, other) - 1];
    if (count) count[cell] = (count[cell] ?? 0) + 1;
  });
  const found = counts.reverse().find((count) => count.some((n) => n > 0));
  if (!found) return null;
  const cell = found.indexOf(found.reduce((most, n) => Math.max(most, n), 0));
  const [x, y] = [cell % across, Math.floor(cell / across)];
  return { lon: 2 * Math.PI * ((x + 0.5) / across - 0.5), lat: Math.PI * (0.5 - (y + 0.5) / down) };
}

/** The mapping between pixels of the image and world points. */
function cameraOf(
  { view, location }: Shown,
  picture: Picture,
  gaze: Gaze,
): Pick<ViewerOptions, "point" | "position" | "screen"> {
  if (!view && location)
    return {
      point: (i, j, distance) => panoramaPoint(location, picture, i, j, distance),
      position: location.position,
      screen: (point, now, width, height) => panoramaScreen(location, now ?? gaze, width, height, point),
    };
  return {
    point: (i, j, depth) => viewPoint(picture, i, j, depth),
    position: view?.position ?? location?.position ?? null,
    screen: (point, _, width, height) => {
      const at = viewScreen(picture, point);
      const [left, top, w, h_] = placeOf(picture.of, width, height);
      return at && [at[0] * w + left * at[2], at[1] * h_ + top * at[2], at[2]];
    },
  };
}

/** The link to the image's view in 3D, in the colours of the changes. */
function inSpace(index: Index, { area, view, location }: Shown, picture: Picture, gaze: Gaze): string | null {
  const position = view?.position ?? location?.position;
  if (!position || !index.meshes.some((mesh) => mesh.area === area)) return null;
  const azimuth = (location?.azimuth_rad ?? 0) - gaze.lon;
  const forward = view
    ? picture.camera?.rt[2]?.slice(0, 3)
    : [Math.cos(azimuth) * Math.cos(gaze.lat), Math.sin(azimuth) * Math.cos(gaze.lat), Math.sin(gaze.lat)];
  if (!forward) return null;
  const at = position.map((c, axis) => c + (forward[axis] ?? 0)) as Rgb;
  return `${spaceLink(area, at, position, "changed")}&marks=rooms`;
}

const sentence = (words: string): Page => ({
  element: h("main", { class: "page" }, h("h1", {}, "Compared"), h("p", { role: "alert" }, words)),
  close: () => {},
});

export async function pairPage(index: Index, against: Against, route: Route): Promise<Page> {
  const [place = ""] = route.path;
  const number = /^\d+$/.test(place) ? Number(place) : -1;
  const changed = against.pictures[number];
  const shown = changed ? shownBy(index, changed) : null;
  if (!changed || !shown) return sentence("This image is not among those that differ.");
  const change = changeOf(route);
  const order = orderOf(against, change).numbers;
  const at = order.indexOf(number);
  const step = (by: number, words: string, sign: string): HTMLElement | null => {
    const to = at < 0 ? undefined : order[at + by];
    const modality = route.query.get("modality");
    const query = { ...(modality !== null && { modality }), ...change };
    return to === undefined
      ? null
      : h("a", { class: "step", href: link("compare", [to], query), "aria-label": words }, sign);
  };
  const head = h("div", { class: "look-head" }, h("h1", {}, shown.name));
  const told = Object.entries(changed.pixels).map(([modality, pixels]) => pixelsWords(modality, pixels));
  append(head, [step(-1, "Image that differs more", "←"), step(1, "Image that differs less", "→")]);
  append(head, [
    change && h("a", { href: imagesOf(change) }, `Images: ${changeWords(change)}`),
    h("a", { href: link("compare") }, "All that differs"),
  ]);
  const places = h("p", { class: "places" });
  const words = h("p", { class: "quiet" }, `Pixels that differ · ${told.join(" · ")}`);
  const element = h("main", { class: "look pair" }, head, words);
  const { a, b } = await loadPair(index, changed, number);
  if (!a || !b) {
    const side = a ? against.comparison.b.folder : index.data_set.name;
    append(element, [
      h("p", {}, `Its image files in ${side} are missing or damaged; see Notes and Compared.`),
    ]);
    return { element, close: () => {} };
  }
  const gaze: Gaze = {
    lon: numberOf(route.query, "lon", -360, 360, 0) * RADIANS,
    lat: numberOf(route.query, "lat", -90, 90, -4) * RADIANS,
    fov: numberOf(route.query, "fov", 8, 120, 90) * RADIANS,
  };
  const modalities = modalitiesOfPair(against, shown.area, a, b);
  if (modalities.length === 0) {
    append(element, [h("p", {}, "There is nothing that both have of it.")]);
    return { element, close: () => {} };
  }
  const look: Look = lookFrom(route.query, modalities, shown.view ? null : gaze);
  const wanted = route.query.get("modality") as Modality;
  look.left = look.right = modalities.includes(wanted) ? wanted : firstModality(changed, modalities);
  const solid = h("a", { href: "" }, "See it in 3D");
  const turned = (now: Gaze): void => {
    const href = inSpace(index, shown, a, now);
    if (href) solid.setAttribute("href", href);
    solid.hidden = href === null;
  };
  turned(gaze);
  const viewer = await Viewer.open(against.both, a, look, {
    title: `${shown.name}: A left of the line, B right of it`,
    area: shown.area,
    room: shown.view?.room ?? shown.location?.room ?? "",
    ...cameraOf(shown, a, gaze),
    other: {
      picture: b,
      labels: against.labelOfB,
      depth: against.depthOfB,
      modalities,
      tell: (labelA, labelB) => (a.label || b.label ? tellBoth(against, labelA, labelB) : []),
    },
    changed: (now) => {
      const { left, right: _, split = "0.5", ...rest } = queryOf(now);
      replaceRoute("compare", [number], { ...rest, modality: left ?? "rgb", split, ...change });
      if (now.gaze) turned(now.gaze);
    },
  });
  const panorama = shown.view
    ? inPanorama(index, shown.view)
    : shown.location && link("pano", [shown.location.area, shown.location.uuid]);
  if (!shown.view && !route.query.has("lon")) {
    const most = mostOfPanorama(against, viewer);
    if (most) viewer.lookAt({ ...gaze, ...most });
  }
  append(places, [
    shown.view && h("a", { href: link("view", [shown.view.picture ?? 0]) }, "The view in A"),
    panorama && h("a", { href: panorama }, "The panorama in A"),
    solid,
  ]);
  const { folder } = against.comparison.b;
  append(viewer.overlay, [
    h("span", { class: "chip side-a" }, `A: ${index.data_set.name}`),
    h("span", { class: "chip side-b" }, `B: ${folder}`),
  ]);
  if (shown.view) {
    viewer.element.classList.add("flat");
    viewer.element.style.setProperty("--shape", String(a.of[0] / a.of[1]));
  }
  append(element, [viewer.element, places]);
  return { element, close: () => viewer.close() };
}
