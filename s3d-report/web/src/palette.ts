// The page's own colours of classes. Surfaces of a building are calm, things are strong, and all are told
// apart by people with any kind of colour vision. The same names give the same colours.

import { MISSING, NULL_LABEL, oklch } from "./colors.js";
import type { Rgb } from "./data.js";

/** Classes that are the building itself, by the last word of their names, and how light they are. */
const CALM: { of: RegExp; lightness: [number, number] }[] = [
  { of: /(^|[\s_-])(ceiling|roof)s?$/i, lightness: [0.9, 0.96] },
  { of: /(^|[\s_-])walls?$/i, lightness: [0.78, 0.88] },
  { of: /(^|[\s_-])(floor|ground)s?$/i, lightness: [0.6, 0.72] },
  { of: /(^|[\s_-])(beam|column|pillar|stair)s?$/i, lightness: [0.46, 0.9] },
];

type Matrix = readonly [Rgb, Rgb, Rgb];

/**
 * What people without one kind of cones see of linear sRGB: no red, no green, no blue (G. M. Machado,
 * M. M. Oliveira, L. A. F. Fernandes, 2009).
 */
const DEFICIENCIES: readonly Matrix[] = [
  [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
  ],
  [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.01182, 0.04294, 0.968881],
  ],
  [
    [1.255528, -0.076749, -0.178779],
    [-0.078411, 0.930809, 0.147602],
    [0.004733, 0.691367, 0.3039],
  ],
];

const times = (matrix: Matrix, v: Rgb): Rgb =>
  matrix.map(([a, b, c]) => a * v[0] + b * v[1] + c * v[2]) as Rgb;

const linear = (color: Rgb): Rgb =>
  color.map((byte) => {
    const c = byte / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  }) as Rgb;

/** CIELAB of linear sRGB, white D65. */
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
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

/** A colour as four kinds of eyes see it, in CIELAB. */
export function seenBy(color: Rgb): Rgb[] {
  const light = linear(color);
  return [lab(light), ...DEFICIENCIES.map((matrix) => lab(times(matrix, light)))];
}

const WHITE: Rgb = [100, 0, 0];

/** The least difference (CIE76) of two colours for any of these eyes. */
export function difference(a: Rgb[], b: Rgb[]): number {
  let least = Infinity;
  for (let kind = 0; kind < a.length; kind++) {
    const [p, q] = [a[kind] ?? WHITE, b[kind] ?? WHITE];
    least = Math.min(least, (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2);
  }
  return Math.sqrt(least);
}

interface Candidate {
  color: Rgb;
  seen: Rgb[];
}

/** Colours of OKLCH in even steps of lightness and hue, as far as sRGB has them. */
function candidates([low, high]: [number, number], chromas: number[], turn: number): Candidate[] {
  const found: Candidate[] = [];
  for (let lightness = low; lightness <= high + 1e-9; lightness += 0.035)
    for (const chroma of chromas)
      for (let hue = 0; hue < 360; hue += turn) {
        const color = oklch(lightness, chroma, hue);
        if (color.every((c) => c > 0 && c < 255)) found.push({ color, seen: seenBy(color) });
      }
  return found;
}

/** More classes than this are not improved once more. */
const MANY = 64;
const ROUNDS = 4;

/** A colour for each class; the first have `given` ones. */
export function paletteOf(names: string[], given: Rgb[] = []): Rgb[] {
  const strong = candidates([0.43, 0.85], [0.12, 0.16, 0.2], 15);
  const calm = new Map(CALM.map(({ lightness }) => [lightness, candidates(lightness, [0.015, 0.04], 30)]));
  const rules = names.map((name) => CALM.find(({ of }) => of.test(name)) ?? null);
  const choices = rules.map((rule) => (rule && calm.get(rule.lightness)) ?? strong);
  const taken: (Rgb[] | null)[] = [MISSING, NULL_LABEL].map(seenBy);
  const chosen: (Rgb | null)[] = names.map((_, i) => given[i] ?? null);
  taken.push(...chosen.map((color) => color && seenBy(color)));

  const all = [...new Set(choices)].flat();
  /** By candidate, the differences from all that is taken; null where nothing is known yet. */
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
    .sort((a, b) => Number(rules[b] !== null) - Number(rules[a] !== null) || a - b);
  for (let round = 0; round <= (names.length > MANY ? 0 : ROUNDS); round++) order.forEach(choose);
  return chosen.map((color) => color ?? NULL_LABEL);
}
