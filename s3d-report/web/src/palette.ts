// The page's own colours of classes. Surfaces of a building are calm, things are strong, and all are told
// apart by people with any kind of colour vision. The same names give the same colours. `palette.json` has the
// words and numbers; the poster (`s3d-report/src/poster/palette.rs`) reads it, too, and takes the same steps.

import { MISSING, NULL_LABEL, oklch } from "./colors.js";
import type { Rgb } from "./data.js";
import rules from "../../src/poster/palette.json" with { type: "json" };

type Matrix = [Rgb, Rgb, Rgb];
type Range = [number, number];

/**
 * What people see of linear sRGB: with all cones, and without red, green or blue ones (G. M. Machado,
 * M. M. Oliveira, L. A. F. Fernandes, 2009).
 */
const EYES = rules.eyes as Matrix[];

const times = (matrix: readonly Rgb[], v: Rgb): Rgb =>
  matrix.map(([a, b, c]) => a * v[0] + b * v[1] + c * v[2]) as Rgb;

const linear = (color: Rgb): Rgb =>
  color.map((byte) => {
    const c = byte / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  }) as Rgb;

/** Steps of a unit of CIELAB. Whole numbers of them are compared, which are the same on every machine. */
const STEPS = 1024;

/** CIELAB of linear sRGB, white D65, in steps. */
function lab(rgb: Rgb): Rgb {
  const clipped = rgb.map((c) => Math.min(1, Math.max(0, c))) as Rgb;
  const xyz = times(
    [
      [0.4124564 / 0.95047, 0.3575761 / 0.95047, 0.1804375 / 0.95047],
      [0.2126729, 0.7151522, 0.072175],
      [0.0193339 / 1.08883, 0.119192 / 1.08883, 0.9503041 / 1.08883],
    ],
    clipped,
  );
  const [x, y, z] = xyz.map((t) =>
    t > 216 / 24389 ? Math.cbrt(t) : (24389 / 27 / 116) * t + 16 / 116,
  ) as Rgb;
  const steps = (value: number): number => Math.floor(STEPS * value + 0.5);
  return [steps(116 * y - 16), steps(500 * (x - y)), steps(200 * (y - z))];
}

/** A colour as four kinds of eyes see it. */
function seenBy(color: Rgb): Rgb[] {
  const light = linear(color);
  return EYES.map((matrix) => lab(times(matrix, light)));
}

/** The square of the least difference (CIE76) of two colours for any of these eyes, in steps. */
function difference(a: Rgb[], b: Rgb[]): number {
  let least = Infinity;
  a.forEach((p, kind) => {
    const q = b[kind] ?? p;
    least = Math.min(least, (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2);
  });
  return least;
}

interface Candidate {
  color: Rgb;
  seen: Rgb[];
}

/** Colours of OKLCH in even steps of lightness and hue, as far as sRGB has them. */
function candidates(
  [low, high]: Range,
  { chroma: chromas, hue_step }: { chroma: number[]; hue_step: number },
): Candidate[] {
  const found: Candidate[] = [];
  for (let lightness = low; lightness <= high + 1e-9; lightness += rules.lightness_step)
    for (const chroma of chromas)
      for (let hue = 0; hue < 360; hue += hue_step) {
        const color = oklch(lightness, chroma, hue);
        if (color.every((c) => c > 0 && c < 255)) found.push({ color, seen: seenBy(color) });
      }
  return found;
}

/** The part of a building that a class is, by the last word of its name; -1 for things. */
function partOf(name: string): number {
  const word = name.toLowerCase().split(/[ _-]/).at(-1)?.replace(/s$/, "") ?? "";
  return rules.building.findIndex(({ words }) => words.includes(word));
}

/** A colour for each class; the first have `given` ones. */
export function paletteOf(names: string[], given: Rgb[] = []): Rgb[] {
  const strong = candidates(rules.strong.lightness as Range, rules.strong);
  const calm = rules.building.map(({ lightness }) => candidates(lightness as Range, rules.calm));
  const parts = names.map(partOf);
  const choices = parts.map((part) => calm[part] ?? strong);
  const taken: (Rgb[] | null)[] = [MISSING, NULL_LABEL].map(seenBy);
  const chosen: (Rgb | null)[] = names.map((_, i) => given[i] ?? null);
  taken.push(...chosen.map((color) => color && seenBy(color)));

  const all = [...new Set(choices)].flat();
  /** By candidate, the differences from all that is taken; infinite where nothing is known yet. */
  const differences = new Map<Candidate, Float64Array>();
  const update = (at: number): void => {
    const of = taken[at];
    for (const candidate of all) {
      const row = differences.get(candidate) ?? new Float64Array(taken.length).fill(Infinity);
      differences.set(candidate, row);
      row[at] = of ? difference(candidate.seen, of) : Infinity;
    }
  };
  const choose = (at: number): void => {
    let best: { least: number; candidate: Candidate } | null = null;
    for (const candidate of choices[at] ?? strong) {
      let least = Infinity;
      const row = differences.get(candidate) ?? [];
      for (let i = 0; i < row.length; i++) if (i !== at + 2) least = Math.min(least, row[i] ?? Infinity);
      if (!best || least > best.least) best = { least, candidate };
    }
    if (!best || best.candidate.color === chosen[at]) return;
    chosen[at] = best.candidate.color;
    taken[at + 2] = best.candidate.seen;
    update(at + 2);
  };

  taken.forEach((_, i) => update(i));
  // The building first: it has fewer colours to choose from.
  const order = names
    .map((_, i) => i)
    .filter((i) => !given[i])
    .sort((a, b) => Number(parts[a] === -1) - Number(parts[b] === -1) || a - b);
  // Chosen once, the colours are improved in further rounds, unless they are many.
  const rounds = names.length > rules.many ? 0 : rules.rounds;
  for (let round = 0; round <= rounds; round++) order.forEach(choose);
  return chosen.map((color) => color ?? NULL_LABEL);
}
