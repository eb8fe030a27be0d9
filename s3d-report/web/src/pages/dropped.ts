// Small pictures of dropped views, drawn from the panorama of their location.

import { type Index, type Picture, type View, load } from "../data.js";
import { type Pixels, cut } from "../picture/geometry.js";
import { decoded } from "../picture/images.js";

/** The width of a small picture, pixels. */
export const WIDTH = 128;

async function pixelsOf(location: number): Promise<Pixels | null> {
  const { rgb } = (await load<Picture | null>(`pano_${location}`)) ?? { rgb: null };
  return rgb === null ? null : decoded(rgb);
}

/** The number of panoramas that are kept. */
const KEPT = 3;
const panoramas = new Map<number, Promise<Pixels | null>>();

function panoramaOf(location: number): Promise<Pixels | null> {
  const pixels = panoramas.get(location) ?? pixelsOf(location);
  panoramas.delete(location);
  panoramas.set(location, pixels);
  pixels.catch(() => panoramas.delete(location));
  for (const old of [...panoramas.keys()].slice(0, -KEPT)) panoramas.delete(old);
  return pixels;
}

/** The drawing under way: one after the other, so that few panoramas are in memory at once. */
let drawing: Promise<unknown> = Promise.resolve();

/** Whether a view can be drawn from its panorama. */
export const canDraw = (index: Index, { location, yaw_deg, pitch_deg, fov_deg }: View): boolean =>
  location !== null &&
  (index.locations[location]?.pano ?? false) &&
  yaw_deg !== null &&
  pitch_deg !== null &&
  fov_deg !== null;

/** Draws a view on a canvas; false if there is no panorama in colour. */
export function drawDropped(view: View, canvas: HTMLCanvasElement): Promise<boolean> {
  const drawn = drawing.then(() => !canvas.isConnected || draw(view, canvas));
  drawing = drawn.catch(() => false);
  return drawn;
}

async function draw(view: View, canvas: HTMLCanvasElement): Promise<boolean> {
  const from = await panoramaOf(view.location ?? -1);
  const context = canvas.getContext("2d");
  if (!from || !context) return false;
  const pixels = cut(from, view.yaw_deg ?? 0, view.pitch_deg ?? 0, view.fov_deg ?? 60, WIDTH);
  const image = context.createImageData(WIDTH, WIDTH);
  image.data.set(pixels);
  context.putImageData(image, 0, 0);
  return true;
}
