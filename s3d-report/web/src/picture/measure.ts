// Distances and areas between points that were clicked.

import type { Rgb } from "../data.js";

/** What is measured: the distance of two points, or the area of an outline with any number of corners. */
export type Measured = "distance" | "area";

const away = (a: Rgb, b: Rgb): number => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

/** The length of the lines from corner to corner, and back to the first one if the line is closed; metres. */
export const lengthOf = (corners: Rgb[], isClosed: boolean): number =>
  corners.reduce((sum, corner, i) => {
    const next = corners[i + 1] ?? (isClosed ? corners[0] : undefined);
    return sum + (next ? away(corner, next) : 0);
  }, 0);

/**
 * The area inside an outline, m² (Newell's formula). Corners that lie in no plane count as seen along the
 * outline's mean normal, and what is passed twice in opposite directions counts for nothing.
 */
export function areaOf(corners: Rgb[]): number {
  const [first] = corners;
  if (!first) return 0;
  const sum: Rgb = [0, 0, 0];
  corners.forEach((corner, i) => {
    const next = corners[(i + 1) % corners.length] ?? first;
    const [a, b] = [corner, next].map((point) => point.map((c, k) => c - (first[k] ?? 0))) as [Rgb, Rgb];
    for (const k of [0, 1, 2] as const)
      sum[k] += (a[(k + 1) % 3] ?? 0) * (b[(k + 2) % 3] ?? 0) - (a[(k + 2) % 3] ?? 0) * (b[(k + 1) % 3] ?? 0);
  });
  return Math.hypot(...sum) / 2;
}

/** `1.234 m`, or `3.21 m² · around 7.654 m`; nothing for a single point. */
export function wordsOf(corners: Rgb[], what: Measured): string {
  if (corners.length < 2) return "";
  if (what === "distance" || corners.length < 3) return `${lengthOf(corners, false).toFixed(3)} m`;
  const m2 = areaOf(corners);
  return `${m2.toFixed(m2 < 100 ? 3 : 1)} m² · around ${lengthOf(corners, true).toFixed(2)} m`;
}

/** The corners of what is measured, and what a click makes of them. */
export class Corners {
  points: Rgb[] = [];
  what: Measured = "distance";
  /** Whether the next click begins anew. */
  private isDone = false;

  get isClosed(): boolean {
    return this.what === "area" && this.points.length > 2;
  }

  /** Adds a corner. `isFirst` says that the click hit the first one, which closes an outline. */
  add(point: Rgb, isFirst: boolean): void {
    if (this.isDone) this.clear();
    if (isFirst && this.isClosed) this.isDone = true;
    else this.points.push(point);
    if (this.what === "distance" && this.points.length === 2) this.isDone = true;
  }

  /** Takes back the last corner. */
  undo(): void {
    this.points.pop();
    this.isDone = false;
  }

  clear(): void {
    this.points = [];
    this.isDone = false;
  }

  get words(): string {
    return wordsOf(this.points, this.what);
  }

  /** Pairs of corners with a line between them. */
  get edges(): [Rgb, Rgb][] {
    const { points, isClosed } = this;
    return points.flatMap((corner, i): [Rgb, Rgb][] => {
      const next = points[i + 1] ?? (isClosed ? points[0] : undefined);
      return next ? [[corner, next]] : [];
    });
  }

  /** The middle of the corners; null without any. */
  get middle(): Rgb | null {
    const { points } = this;
    if (points.length === 0) return null;
    return [0, 1, 2].map((k) => points.reduce((sum, p) => sum + (p[k] ?? 0), 0) / points.length) as Rgb;
  }
}
