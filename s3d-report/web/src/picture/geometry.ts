// Pixels, rays and points, by the conventions of the data set (conventions.json).

import type { Location, Picture, Rgb } from "../data.js";

export type Vec3 = Rgb;

const TURN = 2 * Math.PI;

/** The direction in a panorama at the middle of the screen: right of its centre column, above the horizon. */
export interface Gaze {
  lon: number;
  lat: number;
  /** The larger angle of view of the screen's two, radians. */
  fov: number;
}

/** The pixel of the full-size axis (`from` pixels) that pixel `i` of the reduced axis (`to` pixels) shows. */
export function sourcePixel(i: number, from: number, to: number): number {
  return Math.floor(((2 * i + 1) * from) / (2 * to));
}

export function clampGaze(gaze: Gaze): Gaze {
  const lon = gaze.lon - TURN * Math.round(gaze.lon / TURN);
  const limit = Math.PI / 2;
  return {
    lon,
    lat: Math.min(limit, Math.max(-limit, gaze.lat)),
    fov: Math.min((120 * Math.PI) / 180, Math.max((8 * Math.PI) / 180, gaze.fov)),
  };
}

/** The focal length in pixels of the screen: a ray this far from the middle is 45° off. */
export function focal(gaze: Gaze, width: number, height: number): number {
  return Math.max(width, height) / 2 / Math.tan(gaze.fov / 2);
}

/** The point of a panorama, in shares of its width and height, that a point of the screen shows. */
export function panoramaAt(
  gaze: Gaze,
  width: number,
  height: number,
  x: number,
  y: number,
): [number, number] {
  const f = focal(gaze, width, height);
  const [right, up] = [(x - width / 2) / f, (height / 2 - y) / f];
  const [cos, sin] = [Math.cos(gaze.lat), Math.sin(gaze.lat)];
  const [forward, rise] = [cos - up * sin, sin + up * cos];
  const lon = gaze.lon + Math.atan2(right, forward);
  const lat = Math.atan2(rise, Math.hypot(right, forward));
  const u = lon / TURN + 0.5;
  return [u - Math.floor(u), 0.5 - lat / Math.PI];
}

/** The point of the screen that shows a direction of a panorama; nothing for directions behind. */
export function screenAt(
  gaze: Gaze,
  width: number,
  height: number,
  lon: number,
  lat: number,
): [number, number] | null {
  const f = focal(gaze, width, height);
  const turn = lon - gaze.lon;
  const [x, y, z] = [Math.cos(lat) * Math.sin(turn), Math.sin(lat), Math.cos(lat) * Math.cos(turn)];
  const [cos, sin] = [Math.cos(gaze.lat), Math.sin(gaze.lat)];
  const [depth, up] = [z * cos + y * sin, y * cos - z * sin];
  if (depth <= 1e-6) return null;
  return [width / 2 + (f * x) / depth, height / 2 - (f * up) / depth];
}

/**
 * A world point on the screen of a panorama, as x·w, y·w and w: straight lines stay straight, and w is not
 * positive for points behind.
 */
export function panoramaScreen(
  location: Location,
  gaze: Gaze,
  width: number,
  height: number,
  point: Vec3,
): Vec3 {
  const here = location.position ?? [0, 0, 0];
  const [dx, dy, dz] = [point[0] - here[0], point[1] - here[1], point[2] - here[2]];
  const azimuth = (location.azimuth_rad ?? 0) - gaze.lon;
  const [level, right] = [
    dx * Math.cos(azimuth) + dy * Math.sin(azimuth),
    dx * Math.sin(azimuth) - dy * Math.cos(azimuth),
  ];
  const [cos, sin] = [Math.cos(gaze.lat), Math.sin(gaze.lat)];
  const [forward, up] = [level * cos + dz * sin, dz * cos - level * sin];
  const f = focal(gaze, width, height);
  return [(width / 2) * forward + f * right, (height / 2) * forward - f * up, forward];
}

/** A world point in the image of a view, as x·w, y·w and w, in shares of its size. */
export function viewScreen(picture: Picture, point: Vec3): Vec3 | null {
  if (!picture.camera) return null;
  const { k, rt } = picture.camera;
  const [x, y, z] = [0, 1, 2].map((row) =>
    point.reduce((sum, c, column) => sum + c * (rt[row]?.[column] ?? 0), rt[row]?.[3] ?? 0),
  ) as Vec3;
  return [(k[0] * x + k[2] * z) / picture.of[0], (k[1] * y + k[3] * z) / picture.of[1], z];
}

/** Longitude and latitude of a world direction in the panorama of a location. */
export function directionIn(location: Location, direction: Vec3): [number, number] {
  const [x, y, z] = direction;
  const lon = (location.azimuth_rad ?? 0) - Math.atan2(y, x);
  return [lon - TURN * Math.round(lon / TURN), Math.atan2(z, Math.hypot(x, y))];
}

/** The world point of a pixel of a panorama's reduced image at a distance. */
export function panoramaPoint(
  location: Location,
  picture: Picture,
  i: number,
  j: number,
  distance: number,
): Vec3 | null {
  if (location.position === null || location.azimuth_rad === null) return null;
  const u = (sourcePixel(i, picture.of[0], picture.size[0]) + 0.5) / picture.of[0];
  const v = (sourcePixel(j, picture.of[1], picture.size[1]) + 0.5) / picture.of[1];
  const azimuth = location.azimuth_rad - (u - 0.5) * TURN;
  const lat = (0.5 - v) * Math.PI;
  const [x, y, z] = location.position;
  return [
    x + distance * Math.cos(lat) * Math.cos(azimuth),
    y + distance * Math.cos(lat) * Math.sin(azimuth),
    z + distance * Math.sin(lat),
  ];
}

/** The world point of a pixel of a view's reduced image at a depth along the optical axis. */
export function viewPoint(picture: Picture, i: number, j: number, depth: number): Vec3 | null {
  if (!picture.camera) return null;
  const { k, rt } = picture.camera;
  const x = sourcePixel(i, picture.of[0], picture.size[0]) + 0.5;
  const y = sourcePixel(j, picture.of[1], picture.size[1]) + 0.5;
  const camera = [((x - k[2]) / k[0]) * depth, ((y - k[3]) / k[1]) * depth, depth];
  const less = camera.map((c, row) => c - (rt[row]?.[3] ?? 0));
  const world = [0, 1, 2].map((column) =>
    less.reduce((sum, c, row) => sum + c * (rt[row]?.[column] ?? 0), 0),
  );
  return world as Vec3;
}

/** An image as bytes of red, green, blue and opacity. */
export interface Pixels {
  width: number;
  height: number;
  data: Uint8ClampedArray;
}

/** The image of a panorama in a direction, on a canvas of this size. */
export function drawn(from: Pixels, gaze: Gaze, width: number, height: number): Uint8ClampedArray {
  const pixels = new Uint8ClampedArray(4 * width * height);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) {
      const [u, v] = panoramaAt(gaze, width, height, x + 0.5, y + 0.5);
      const column = Math.min(from.width - 1, Math.floor(u * from.width));
      const row = Math.min(from.height - 1, Math.max(0, Math.floor(v * from.height)));
      const at = 4 * (row * from.width + column);
      pixels.set(from.data.subarray(at, at + 4), 4 * (y * width + x));
    }
  return pixels;
}

/** The square image of a panorama with this yaw (to the left), pitch and field of view, in degrees. */
export function cut(from: Pixels, yaw: number, pitch: number, fov: number, width: number): Uint8ClampedArray {
  const radians = Math.PI / 180;
  return drawn(from, { lon: -yaw * radians, lat: pitch * radians, fov: fov * radians }, width, width);
}
