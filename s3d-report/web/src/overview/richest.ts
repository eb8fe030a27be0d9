// The richest views, no two alike; and the first panorama, which looks into a room.

import type { Index, Rgb, View } from "../data.js";

/** Views farther apart than this are as far apart as can be, metres. */
const FAR = 6;
/** The parts of a distance: another room, another place, another content, another direction. */
const PARTS = { room: 0.45, place: 0.2, content: 0.25, direction: 0.1 };

interface Features {
  view: View;
  at: Rgb | null;
  room: string;
  /** The direction from +X, radians. */
  heading: number | null;
  shares: Float32Array;
  /** How rich it is, from 0 to 1. */
  quality: number;
}

/** The entropy of some shares, nats. */
function entropyOf(shares: Float32Array): number {
  const all = shares.reduce((sum, share) => sum + share, 0);
  return shares.reduce((sum, share) => (share > 0 ? sum - (share / all) * Math.log(share / all) : sum), 0);
}

/** How rich a view is, before it is compared: its entropy where that is known. */
function riches(view: View, shares: Float32Array): number {
  const coverage = view.seen?.coverage ?? 1;
  const entropy = view.entropy ?? (view.seen?.classes.length ? entropyOf(shares) : (view.seen?.depth_m ?? 1));
  return coverage ** 2 * entropy;
}

function featuresOf(index: Index, view: View): Features {
  const location = view.location === null ? undefined : index.locations[view.location];
  const shares = new Float32Array(index.classes.length);
  for (const [place, share] of view.seen?.classes ?? []) shares[place] = share;
  const { forward } = view;
  const turned = location?.azimuth_rad != null && view.yaw_deg !== null;
  return {
    view,
    at: view.position ?? location?.position ?? null,
    room: `${view.area}/${view.room}`,
    heading: turned
      ? (location.azimuth_rad ?? 0) + ((view.yaw_deg ?? 0) * Math.PI) / 180
      : forward
        ? Math.atan2(forward[1], forward[0])
        : null,
    shares,
    quality: riches(view, shares),
  };
}

function distance(a: Features, b: Features): number {
  const away = a.at && b.at ? Math.hypot(...a.at.map((c, k) => c - (b.at?.[k] ?? 0))) : 0;
  const differ = a.shares.reduce((sum, share, i) => sum + Math.abs(share - (b.shares[i] ?? 0)), 0) / 2;
  const turned = a.heading !== null && b.heading !== null ? (1 - Math.cos(a.heading - b.heading)) / 2 : 0;
  return (
    (a.room === b.room ? 0 : PARTS.room) +
    PARTS.place * Math.min(1, away / FAR) +
    PARTS.content * Math.min(1, differ) +
    PARTS.direction * turned
  );
}

/** So many views, the richest first, and each next one rich and far from all before. */
export function richest(views: View[], index: Index, most: number): View[] {
  const all = views.filter((view) => view.picture !== null).map((view) => featuresOf(index, view));
  const highest = all.reduce((max, { quality }) => Math.max(max, quality), 1e-9);
  for (const one of all) one.quality /= highest;
  const nearest = new Float64Array(all.length).fill(1);
  const chosen: View[] = [];
  while (chosen.length < Math.min(most, all.length)) {
    let best = -1;
    let worth = -1;
    all.forEach(({ quality }, i) => {
      const value = (nearest[i] ?? 0) * quality;
      if (value > worth) [best, worth] = [i, value];
    });
    const next = all[best];
    if (!next || worth <= 0) break;
    chosen.push(next.view);
    all.forEach((other, i) => (nearest[i] = Math.min(nearest[i] ?? 0, distance(next, other))));
    nearest[best] = 0;
  }
  return chosen;
}

/**
 * The locations with panoramas, those that look into a room first: by the mean entropy of their views, or by
 * their median distance where there are no labels. Those that see little come last.
 */
function rankedLocations(index: Index): number[] {
  const entropies = new Map<number, { sum: number; n: number }>();
  const isLabelled = index.classes.length > 0;
  for (const { location, entropy } of index.views) {
    if (location === null || entropy === null || !isLabelled) continue;
    const { sum, n } = entropies.get(location) ?? { sum: 0, n: 0 };
    entropies.set(location, { sum: sum + entropy, n: n + 1 });
  }
  const ranked = index.locations.flatMap(({ pano, seen }, i) => {
    if (!pano) return [];
    const coverage = seen?.coverage ?? 0;
    const views = entropies.get(i);
    const rich = views
      ? views.sum / views.n
      : isLabelled && entropies.size > 0
        ? 0
        : (seen?.depth_m ?? coverage);
    return [{ i, coverage: Math.min(coverage, ENOUGH), rich }];
  });
  ranked.sort((a, b) => b.coverage - a.coverage || b.rich - a.rich);
  return ranked.map(({ i }) => i);
}

/** The location whose panorama is shown first; -1 without any. */
export const firstLocation = (index: Index): number => rankedLocations(index)[0] ?? -1;

/** Panoramas of unknown rooms are at least this far from each other, metres. */
const APART = 2.5;

/** So many locations with panoramas that show the most, no two in the same room. */
export function richestPanoramas(index: Index, areas: number[], most: number): number[] {
  const chosen: number[] = [];
  const isNew = (i: number): boolean => {
    const here = index.locations[i];
    return chosen.every((other) => {
      const there = index.locations[other];
      if (!here || !there || here.area !== there.area || here.room !== there.room) return true;
      const isKnown = here.room !== "" && here.room !== "unknown_1";
      if (isKnown || !here.position || !there.position) return false;
      return Math.hypot(...here.position.map((c, k) => c - (there.position?.[k] ?? 0))) >= APART;
    });
  };
  for (const i of rankedLocations(index)) {
    const location = index.locations[i];
    if (chosen.length < most && location && areas.includes(location.area) && isNew(i)) chosen.push(i);
  }
  return chosen;
}

/** A panorama that sees this share of the sphere is in a room. */
const ENOUGH = 0.75;
