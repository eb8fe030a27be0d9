// Colours for values without a colour of their own: distances, classes, instances.

import type { Index, Rgb } from "./data.js";
import rules from "../../src/poster/palette.json" with { type: "json" };

/** Where nothing was seen. */
export const MISSING = rules.missing as Rgb;
/** Surface without a label, in images of classes and instances. */
export const NULL_LABEL = rules.unlabelled as Rgb;
/** A label of another class in the other data set, and another instance of the same class there. */
export const OTHER_CLASS: Rgb = [255, 0, 255];
export const OTHER_INSTANCE: Rgb = [255, 190, 40];

/** The tint of the instance under the pointer. */
export const LIT: Rgb = [255, 222, 0];

/** A colour as a GLSL expression. */
export const shader = (color: Rgb): string => `vec3(${color.map((c) => (c / 255).toFixed(6)).join(", ")})`;

/** A colour of OKLCH (B. Ottosson, 2020), clipped to sRGB. */
export function oklch(lightness: number, chroma: number, hueDeg: number): Rgb {
  const hue = (hueDeg * Math.PI) / 180;
  const [a, b] = [chroma * Math.cos(hue), chroma * Math.sin(hue)];
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const t = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * t,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * t,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * t,
  ];
  return linear.map((c) => {
    const v = c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055;
    return Math.round(255 * Math.min(1, Math.max(0, v)));
  }) as Rgb;
}

/** From near to far in `n` colours: light yellow, green, blue, dark violet, in even steps of lightness. */
export function depthRamp(n: number): Uint8Array {
  const ramp = new Uint8Array(4 * n);
  for (let i = 0; i < n; i++) {
    const t = i / (n - 1);
    const [r, g, b] = oklch(0.93 - 0.68 * t, 0.13 - 0.04 * Math.abs(2 * t - 1), 105 + 200 * t);
    ramp.set([r, g, b, 255], 4 * i);
  }
  return ramp;
}

/** From a tie to votes that agree in `n` colours: light yellow, orange, violet, nearly black. */
export function marginRamp(n: number): Uint8Array {
  const ramp = new Uint8Array(4 * n);
  for (let i = 0; i < n; i++) {
    const t = i / (n - 1);
    const [r, g, b] = oklch(0.94 - 0.7 * t, 0.17 - 0.3 * Math.abs(t - 0.4) ** 1.5, 105 - 190 * t);
    ramp.set([r, g, b, 255], 4 * i);
  }
  return ramp;
}

/** A ramp as a background, from left to right. */
export function gradient(ramp: (n: number) => Uint8Array): string {
  const colors = ramp(9);
  const stops = Array.from({ length: 9 }, (_, i) => `rgb(${colors.subarray(4 * i, 4 * i + 3).join(" ")})`);
  return `linear-gradient(to right, ${stops.join(", ")})`;
}

/** The number of columns in tables of colours by label. */
export const TABLE_WIDTH = 256;

/**
 * A table of colours by label, in rows of `TABLE_WIDTH`. The opacity is a number for the class, 0 without a
 * class: its lower byte in the table by class, its upper byte in the table by instance.
 */
export function labelTable(index: Index, by: "class" | "instance"): { pixels: Uint8Array; rows: number } {
  const rows = Math.max(1, Math.ceil(index.labels.length / TABLE_WIDTH));
  const pixels = new Uint8Array(4 * TABLE_WIDTH * rows);
  index.labels.forEach((label, i) => {
    const of_class = label.class === null ? undefined : index.classes[label.class]?.color;
    const color = (by === "class" ? of_class : label.class === null ? undefined : label.color) ?? NULL_LABEL;
    const number = label.class === null ? 0 : label.class + 1;
    pixels.set([...color, by === "class" ? number & 255 : number >> 8], 4 * i);
  });
  return { pixels, rows };
}

export const css = ([r, g, b]: Rgb): string => `rgb(${r} ${g} ${b})`;
