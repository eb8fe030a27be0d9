// The plan: rooms from above, and where panoramas and photographs were taken.

import type { Index, Location } from "../data.js";
import { append, h, metres2, roomName, s, several } from "../dom.js";
import { link } from "../route.js";

interface PlanOptions {
  /** In a corner of a panorama: without words. */
  small?: boolean;
  /** The place of a location in the index. */
  current?: number;
}

/** A plan that shows where one looks. */
export interface Plan {
  element: SVGSVGElement;
  /** Turns the wedge of the current location: heading from +X towards +Y, and angle of view. */
  look: (azimuth_rad: number, fov_rad: number) => void;
}

interface Box {
  x: number;
  y: number;
  w: number;
  h: number;
}

/** Other places of a room's name, in hundredths of the plan's size. */
const BESIDE: [number, number][] = [
  [13, -0.5],
  [-13, -0.5],
];

function boxOf(points: number[][]): Box {
  let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x = 0, y = 0] of points) {
    [x0, y0, x1, y1] = [Math.min(x0, x), Math.min(y0, y), Math.max(x1, x), Math.max(y1, y)];
  }
  if (x0 > x1) return { x: 0, y: 0, w: 1, h: 1 };
  const margin = 0.05 * Math.max(x1 - x0, y1 - y0) + 0.3;
  return { x: x0 - margin, y: y0 - margin, w: x1 - x0 + 2 * margin, h: y1 - y0 + 2 * margin };
}

/** The centre of a ring's surface. */
function middleOf(ring: [number, number][]): [number, number] {
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

const sizeOf = (ring: [number, number][]): number =>
  Math.abs(
    ring.reduce((sum, [ax, ay], i) => {
      const [bx, by] = ring[(i + 1) % ring.length] ?? [ax, ay];
      return sum + ax * by - bx * ay;
    }, 0),
  );

export function plan(index: Index, area: number, options: PlanOptions = {}): Plan {
  const rooms = index.rooms.filter((room) => room.area === area);
  const stands = index.locations
    .map((location, i): [Location, number] => [location, i])
    .filter(([location]) => location.area === area && location.position !== null);
  const photographs = index.views.filter(
    (view) => view.area === area && view.photograph !== null && view.position,
  );
  const points = [
    ...rooms.flatMap((room) => room.outline.flat()),
    ...stands.map(([location]) => location.position ?? []),
    ...photographs.map((view) => view.position ?? []),
  ];
  const box = boxOf(points);
  const unit = Math.max(box.w, box.h) / 100;
  // North is up: y grows upwards in the world and downwards on the screen.
  const at = (x: number, y: number): [number, number] => [x - box.x, box.y + box.h - y];
  const element = s("svg", {
    class: options.small ? "plan small" : "plan",
    viewBox: `0 0 ${box.w} ${box.h}`,
    role: options.small ? "img" : "group",
    "aria-label": `Plan of area ${area}`,
  });
  for (const room of rooms) {
    const path = room.outline.map(
      (ring) =>
        `M${ring
          .map(([x, y]) =>
            at(x, y)
              .map((c) => c.toFixed(3))
              .join(","),
          )
          .join("L")}Z`,
    );
    element.append(
      s("path", { class: "room", d: path.join(""), "fill-rule": "evenodd", "stroke-width": 0.35 * unit }),
    );
  }
  const wedge = s("path", { class: "wedge" });
  element.append(wedge);
  for (const view of photographs) {
    const [x, y] = at(view.position?.[0] ?? 0, view.position?.[1] ?? 0);
    const dot = s(
      "circle",
      { class: "photograph", cx: x, cy: y, r: 0.8 * unit },
      s("title", {}, view.photograph),
    );
    const to = link("view", [view.picture ?? 0]);
    element.append(
      options.small || view.picture === null ? dot : s("a", { href: to, "aria-label": view.photograph }, dot),
    );
  }
  const radius = (options.small ? 2 : 1.1) * unit;
  for (const [location, i] of stands) {
    const [x, y] = at(location.position?.[0] ?? 0, location.position?.[1] ?? 0);
    const seen = location.seen?.coverage;
    const sees = seen ? `: sees ${Math.round(100 * seen)} %` : "";
    const title = `${roomName(location.room)}, ${location.uuid.slice(0, 8)}${sees}`;
    const dot = s("circle", {
      class: i === options.current ? "stand current" : "stand",
      cx: x,
      cy: y,
      r: radius,
    });
    dot.append(s("title", {}, title));
    const to = link("pano", [location.area, location.uuid]);
    element.append(location.pano ? s("a", { href: to, "aria-label": title }, dot) : dot);
  }
  if (!options.small) {
    for (const room of rooms) {
      const largest = [...room.outline].sort((a, b) => sizeOf(b) - sizeOf(a))[0];
      if (!largest) continue;
      const [x, y] = at(...middleOf(largest));
      // Beside the middle, or above or below it, if somebody stands there.
      const taken = ([right, down]: [number, number]): boolean =>
        stands.some(([location]) => {
          const [sx, sy] = at(location.position?.[0] ?? 0, location.position?.[1] ?? 0);
          const [dx, dy] = [sx - x - right * unit, sy - y - (down + 0.5) * unit];
          return Math.abs(dx) < 9 * unit && Math.abs(dy) < 3.2 * unit;
        });
      const wide = boxOf(largest).w > 50 * unit;
      const places: [number, number][] = [[0, -0.5], ...(wide ? BESIDE : []), [0, -5], [0, 4], [0, -0.5]];
      const [right, down] = places.find((place) => !taken(place)) ?? [0, -0.5];
      const [tx, ty] = [x + right * unit, y + down * unit];
      const text = s("text", { class: "name", x: tx, y: ty, "font-size": 2 * unit });
      text.append(
        roomName(room.name),
        s("tspan", { class: "size", x: tx, dy: 2.2 * unit }, metres2(room.floor_m2)),
      );
      element.append(text);
    }
    const metre = [1, 2, 5, 10, 20, 50, 100].find((m) => m > box.w / 8) ?? 100;
    const [x, y] = [unit, box.h - unit];
    element.append(
      s("path", { class: "scale", d: `M${x},${y}h${metre}`, "stroke-width": 0.4 * unit }),
      s(
        "text",
        { class: "scale-text", x: x + metre / 2, y: y - 0.9 * unit, "font-size": 1.7 * unit },
        `${metre} m`,
      ),
    );
  }
  const current = options.current === undefined ? undefined : index.locations[options.current];
  const look = (azimuth: number, fov: number): void => {
    if (!current?.position) return;
    const [x, y] = at(current.position[0], current.position[1]);
    const reach = (options.small ? 16 : 9) * unit;
    const [a, b] = [azimuth + fov / 2, azimuth - fov / 2];
    const tip = (angle: number): string => `${x + reach * Math.cos(angle)},${y - reach * Math.sin(angle)}`;
    wedge.setAttribute("d", `M${x},${y}L${tip(a)}A${reach},${reach} 0 ${fov > Math.PI ? 1 : 0} 1 ${tip(b)}Z`);
  };
  return { element, look };
}

export function planPage(index: Index): HTMLElement {
  const page = h("main", { class: "page" }, h("h1", {}, "Plan"));
  for (const { area } of index.areas) {
    const rooms = index.rooms.filter((room) => room.area === area);
    const floor = rooms.reduce((sum, room) => sum + room.floor_m2, 0);
    const stands = index.locations.filter((location) => location.area === area).length;
    const photographs = index.views.filter((view) => view.area === area && view.photograph !== null).length;
    const words = [
      rooms.length > 0 && `${several(rooms.length, "room")}, ${metres2(floor)}`,
      stands > 0 && several(stands, "scan location"),
      photographs > 0 && several(photographs, "photograph"),
    ].filter(Boolean);
    const found = stands + photographs + rooms.length > 0;
    append(page, [
      h("h2", {}, `Area ${area}`),
      h(
        "p",
        { class: "quiet" },
        found ? words.join(" · ") : "It has no rooms, scan locations or photographs.",
      ),
      found && h("div", { class: "sheet" }, plan(index, area).element),
    ]);
  }
  return page;
}
