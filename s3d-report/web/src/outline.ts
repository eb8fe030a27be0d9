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

type Point = [number, number];

/** The centroid of a ring. */
function centroidOf(ring: Point[]): Point {
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

/** The distance of a point from the nearest of the rings, negative outside of them (even-odd rule). */
function depthIn(rings: Point[][], [x, y]: Point): number {
  let [isInside, nearest] = [false, Infinity];
  for (const ring of rings)
    ring.forEach(([ax, ay], i) => {
      const [bx, by] = ring[(i + 1) % ring.length] ?? [ax, ay];
      if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) isInside = !isInside;
      const [dx, dy] = [bx - ax, by - ay];
      const along = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1);
      const t = Math.min(1, Math.max(0, along));
      nearest = Math.min(nearest, Math.hypot(ax + t * dx - x, ay + t * dy - y));
    });
  return isInside ? nearest : -nearest;
}

/** The innermost point is found to this share of the outline's shorter side. */
const EXACT = 0.02;

/**
 * The point inside an outline that is farthest from its border (the pole of inaccessibility), up to a small
 * error: the place for a name. Squares that may hold a better point than the best one so far are cut into
 * four. The centroid of the largest ring is kept if no other point is clearly better.
 */
export function innermost(rings: Point[][]): Point {
  const largest = [...rings].sort((a, b) => sizeOf(b) - sizeOf(a))[0];
  if (!largest || sizeOf(largest) === 0) return largest?.[0] ?? [0, 0];
  const [xs, ys] = [0, 1].map((axis) => rings.flat().map((corner) => corner[axis] ?? 0)) as [
    number[],
    number[],
  ];
  const least = (values: number[]): number => values.reduce((a, b) => Math.min(a, b));
  const most = (values: number[]): number => values.reduce((a, b) => Math.max(a, b));
  const [x0, x1, y0, y1] = [least(xs), most(xs), least(ys), most(ys)];
  // Of a thin outline, no more than a hundred squares.
  const side = Math.max(Math.min(x1 - x0, y1 - y0), Math.max(x1 - x0, y1 - y0) / 100);

  const squareAt = (at: Point, half: number) => {
    const depth = depthIn(rings, at);
    return { at, half, depth, limit: depth + half * Math.SQRT2 };
  };
  let best = squareAt(centroidOf(largest), 0);
  let squares: ReturnType<typeof squareAt>[] = [];
  for (let x = x0; x < x1; x += side)
    for (let y = y0; y < y1; y += side) squares.push(squareAt([x + side / 2, y + side / 2], side / 2));

  while (squares.length > 0) {
    for (const square of squares) if (square.depth > best.depth + EXACT * side) best = square;
    const { depth } = best;
    squares = squares
      .filter(({ limit }) => limit > depth + EXACT * side)
      .flatMap(({ at: [x, y], half }) => {
        const step = half / 2;
        const corners: Point[] = [
          [x - step, y - step],
          [x + step, y - step],
          [x - step, y + step],
          [x + step, y + step],
        ];
        return corners.map((corner) => squareAt(corner, step));
      });
  }
  return best.at;
}

/** Twice the area of a ring. */
export const sizeOf = (ring: [number, number][]): number =>
  Math.abs(
    ring.reduce((sum, [ax, ay], i) => {
      const [bx, by] = ring[(i + 1) % ring.length] ?? [ax, ay];
      return sum + ax * by - bx * ay;
    }, 0),
  );
