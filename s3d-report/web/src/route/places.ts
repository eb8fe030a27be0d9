// Links that show a world point: in the nearest panorama, and in 3D.

import type { Index, Rgb } from "../data.js";
import { directionIn } from "../picture/geometry.js";
import { link, spaceLink } from "./route.js";

const DEGREES = 180 / Math.PI;

/** The link to the panorama nearest to a point, turned to it; `look` adds to the address. */
export function panoramaOf(
  index: Index,
  area: number,
  point: Rgb,
  look: Record<string, string> = {},
): string | null {
  let best: { distance: number; href: string } | null = null;
  for (const l of index.locations) {
    if (l.area !== area || !l.pano || !l.position || l.azimuth_rad === null) continue;
    const ray = point.map((c, axis) => c - (l.position?.[axis] ?? 0)) as Rgb;
    const distance = Math.hypot(...ray);
    if (best && best.distance <= distance) continue;
    const [lon, lat] = directionIn(l, ray);
    const gaze = { lon: (lon * DEGREES).toFixed(1), lat: (lat * DEGREES).toFixed(1), fov: "45" };
    best = { distance, href: link("pano", [l.area, l.uuid], { ...gaze, ...look }) };
  }
  return best?.href ?? null;
}

/** The link to an image of a scan location by its name in the data set: a number, or `equirectangular`. */
export function imageLink(index: Index, area: number, uuid: string, frame: string): string | null {
  const at = index.locations.findIndex((l) => l.area === area && l.uuid === uuid);
  if (frame === "equirectangular") return index.locations[at]?.pano ? link("pano", [area, uuid]) : null;
  const view = index.views.find((v) => v.location === at && String(v.frame) === frame);
  return at >= 0 && view && view.picture !== null ? link("view", [view.picture]) : null;
}

/** The link to a disputed patch in the nearest panorama. */
export function disputeInPanorama(index: Index, area: number, center: Rgb): string | null {
  const hasVotes = index.meshes.some((m) => m.area === area && m.has_votes);
  return panoramaOf(index, area, center, hasVotes ? { left: "rgb", right: "contested" } : {});
}

/** The link to such a patch: in a panorama, or else in 3D. */
export function patchLink(index: Index, area: number, center: Rgb): string | null {
  const hasMesh = index.meshes.some((m) => m.area === area);
  return disputeInPanorama(index, area, center) ?? (hasMesh ? spaceLink(area, center) : null);
}
