// Outlines from above: boxes, centres, sizes.

/** A box with a margin around its content. */
export interface Box {
  x: number;
  y: number;
  w: number;
  h: number;
}

export function boxOf(points: number[][]): Box {
  let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x = 0, y = 0] of points) {
    [x0, y0, x1, y1] = [Math.min(x0, x), Math.min(y0, y), Math.max(x1, x), Math.max(y1, y)];
  }
  if (x0 > x1) return { x: 0, y: 0, w: 1, h: 1 };
  const margin = 0.05 * Math.max(x1 - x0, y1 - y0) + 0.3;
  return { x: x0 - margin, y: y0 - margin, w: x1 - x0 + 2 * margin, h: y1 - y0 + 2 * margin };
}

/** The centroid of a ring. */
export function middleOf(ring: [number, number][]): [number, number] {
  let [area, x, y] = [0, 0, 0];
  ring.forEach(([ax, ay], i) => {
    const [bx, by] = ring[(i + 1) % ring.length] ?? [ax, ay];
    const cross = ax * by - bx * ay;
    area += cross;
    x += (ax + bx) * cross;
    y += (ay + by) * cross;
  });
  return area === 0 ? (ring[0] ?? [0, 0]) : [x / (3 * area), y / (3 * area)];
}

/** Twice the area of a ring. */
export const sizeOf = (ring: [number, number][]): number =>
  Math.abs(
    ring.reduce((sum, [ax, ay], i) => {
      const [bx, by] = ring[(i + 1) % ring.length] ?? [ax, ay];
      return sum + ax * by - bx * ay;
    }, 0),
  );
