// The heights of ceilings, from level faces.

/** A height and the surface at it, m². */
export type Level = [z: number, m2: number];

/**
 * The distance of the section below the ceilings, and the least height of a ceiling above its floor,
 * metres.
 */
const BELOW_CEILING = 0.1;
const ROOM = 1.9;
/** A ceiling may be this much higher than the floor above it, metres. */
const SLACK = 0.2;

/** The height below which lies this share of the surface. */
export function levelOf(levels: Level[], share: number): number | null {
  const sorted = [...levels].sort((a, b) => a[0] - b[0]);
  const all = sorted.reduce((sum, [, m2]) => sum + m2, 0);
  let below = 0;
  return sorted.find(([, m2]) => (below += m2) >= share * all)?.[0] ?? null;
}

/** A height just below the ceilings over a floor, and below the next floor above; null without any. */
export function belowCeilings(down: Level[], floor: number, above: number): number | null {
  const lowest = levelOf(
    down.filter(([z]) => z > floor + ROOM && z < above + SLACK),
    0.1,
  );
  return lowest === null ? null : lowest - BELOW_CEILING;
}
