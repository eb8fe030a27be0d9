// The mesh from above under a plan.

import { type Ground, type Index, load } from "../data.js";
import { s } from "../dom.js";
import type { Storeys } from "../storeys.js";

/** The file of a ground. The mask is white where something is seen; null if that is everywhere. */
interface Picture {
  image: string;
  mask: string | null;
}

export interface GroundLayer {
  element: SVGElement;
  /** Loads the picture; once. */
  fill: () => Promise<void>;
}

/** Whether plans have their ground: the last choice. */
export const shown = { ground: true };

/** The ground of a storey, as an index; null without one. */
export function groundOf(index: Index, area: number, storeys: Storeys, storey: number): number | null {
  const found = (index.grounds ?? []).findIndex(
    (ground) => ground.area === area && storeys.of(ground.floors[0]) === storey,
  );
  return found < 0 ? null : found;
}

/** Opposite corners of a ground: x and y. */
export function cornersOf({ west, north, size, pixel_m }: Ground): [number, number][] {
  return [
    [west, north],
    [west + size[0] * pixel_m, north - size[1] * pixel_m],
  ];
}

/** `1 pixel is 8 mm`. */
export function pixelWords({ pixel_m }: Ground): string {
  const mm = 1000 * pixel_m;
  return `1 pixel is ${mm < 10 ? `${mm.toFixed(1)} mm` : `${(mm / 10).toFixed(1)} cm`}`;
}

/** The ground with this index; `at` maps the world to the plan. */
export function groundLayer(
  ground: Ground,
  number: number,
  at: (x: number, y: number) => [number, number],
): GroundLayer {
  const [[west, north], [east, south]] = cornersOf(ground) as [[number, number], [number, number]];
  const [x, y] = at(west, north);
  const [right, bottom] = at(east, south);
  const place = { x, y, width: right - x, height: bottom - y, preserveAspectRatio: "none" };
  const element = s("g", { class: "ground" });
  let coming: Promise<void> | null = null;
  const get = async (): Promise<void> => {
    const { image, mask } = await load<Picture>(`ground_${number}`);
    if (typeof image !== "string")
      throw new Error(`data/ground_${number}.js is damaged (it has no image): make the report again`);
    const picture = s("image", { ...place, href: image });
    if (mask !== null) {
      const id = `seen-${number}`;
      element.append(s("mask", { id }, s("image", { ...place, href: mask })));
      picture.setAttribute("mask", `url(#${id})`);
    }
    element.append(picture);
  };
  const fill = (): Promise<void> => {
    coming ??= get();
    return coming;
  };
  return { element, fill };
}
