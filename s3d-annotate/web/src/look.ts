// The colours of labels, and the words for them.

import { css } from "../../../s3d-report/web/src/colors.js";
import type { Rgb } from "../../../s3d-report/web/src/data.js";
import { paletteOf } from "../../../s3d-report/web/src/palette.js";

export class Look {
  private readonly colors: Map<string, Rgb>;

  constructor(classes: string[]) {
    const palette = paletteOf(classes);
    this.colors = new Map(classes.map((name, i) => [name, palette[i] ?? [128, 128, 128]]));
  }

  /** The colour of a class. */
  of(name: string): Rgb {
    return this.colors.get(name) ?? [128, 128, 128];
  }

  /** The colour of an instance: that of its class, a little lighter or darker than its neighbours. */
  ofInstance(name: string, number: number): Rgb {
    const by = 0.5 * ((number * 0.6180339887) % 1) - 0.25;
    const [to, share] = by > 0 ? [255, by] : [0, -by];
    return this.of(name).map((c) => Math.round(c + share * (to - c))) as Rgb;
  }

  css(name: string): string {
    return css(this.of(name));
  }
}

/** `conferenceRoom_1` in words. */
export const words = (name: string): string =>
  name
    .replace(/([a-z])([A-Z])/g, (_, a: string, b: string) => `${a} ${b.toLowerCase()}`)
    .replaceAll("_", " ");

export const metres2 = (m2: number): string =>
  `${m2 < 0.1 ? m2.toFixed(3) : m2 < 10 ? m2.toFixed(2) : m2.toFixed(1)} m²`;
