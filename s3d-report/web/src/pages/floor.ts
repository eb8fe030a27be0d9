// One storey of an area from above, with its rooms, panoramas and photographs.

import { css, depthRamp } from "../colors.js";
import type { ChangeMark } from "../compare/marks.js";
import type { Index, Location, Rgb, View } from "../data.js";
import { append, flat, metres2, named, percent, pointed, roomName, roomOf, s, several } from "../dom.js";
import { type Box, boxOf, innermost, sizeOf } from "../outline.js";
import { type GroundLayer, cornersOf, groundLayer } from "./ground.js";
import { patchLink } from "../route/places.js";
import { type GraphLayer, graphLayer, placeKey } from "../relations/graph.js";
import { link } from "../route/route.js";

export interface FloorOptions {
  /** For the corner of a panorama: without words. */
  small?: boolean;
  /** The current location, as an index. */
  current?: number;
  /** The rooms to show; all by default. */
  hasRoom?: (room: string) => boolean;
  /** Whether a point at this height is shown; the name of its room is known or empty. */
  hasHeight?: (z: number, room: string) => boolean;
  /** The index of the ground, if there is one. */
  ground?: number | null;
  /** Whether there is a graph of places whose images share surface. */
  hasGraph?: boolean;
  /** Changes of labels against another data set. */
  changes?: ChangeMark[];
  /** Called with words for the location under the pointer or with the focus; with null when there is none. */
  told?: (words: string | null) => void;
}

/** A plan that shows the direction of view. */
export interface Plan {
  element: SVGSVGElement;
  /** Turns the wedge of the current location: heading from +X towards +Y, and angle of view. */
  look: (azimuth_rad: number, fov_rad: number) => void;
  ground: GroundLayer | null;
  graph: GraphLayer | null;
}

/** Alternative positions for a room's name, in hundredths of the plan's size. */
const BESIDE: [number, number][] = [
  [13, -0.5],
  [-13, -0.5],
];

const ABOVE_BELOW: [number, number][] = [
  [0, -5],
  [0, 4],
];

const RADIANS = Math.PI / 180;

/** The colour of the share of the sphere that sees the mesh, on the same ramp as depths. */
const COVERAGE = depthRamp(101);
export function coverageColor(share: number): Rgb {
  const at = 4 * Math.round(100 * Math.min(1, Math.max(0, share)));
  return [COVERAGE[at] ?? 0, COVERAGE[at + 1] ?? 0, COVERAGE[at + 2] ?? 0];
}

/**
 * The length of a cone in hundredths of the plan: all cones have equal area, so that narrow ones stand out.
 */
const reachOf = (fov: number): number => Math.min(16, 9 * Math.sqrt(1 / fov));

/** The headings of kept views at a location: from +X towards +Y, and angle of view, radians. */
function conesAt(index: Index, at: number): [number, number][] {
  const azimuth = index.locations[at]?.azimuth_rad;
  if (azimuth === null || azimuth === undefined) return [];
  return index.views.flatMap((v): [number, number][] =>
    v.location === at && v.frame !== null && v.yaw_deg !== null && v.fov_deg !== null
      ? [[azimuth + v.yaw_deg * RADIANS, v.fov_deg * RADIANS]]
      : [],
  );
}

/** The panorama of a room that sees the most. */
function bestIn(stands: [Location, number][], room: string): Location | null {
  const seen = (l: Location | null): number => l?.seen?.coverage ?? -1;
  return stands.reduce<Location | null>(
    (best, [l]) => (l.pano && l.room === room && (!best || seen(l) > seen(best)) ? l : best),
    null,
  );
}

export function plan(index: Index, area: number, options: FloorOptions = {}): Plan {
  const { small = false, hasRoom = () => true, hasHeight = () => true, told = () => {} } = options;
  const rooms = index.rooms.filter((room) => room.area === area && hasRoom(room.name));
  const stands = index.locations
    .map((location, i): [Location, number] => [location, i])
    .filter(([l]) => l.area === area && l.position !== null && hasHeight(l.position[2], l.room));
  const photographs = index.views.filter(
    (view): view is View & { position: Rgb } =>
      view.area === area &&
      view.photograph !== null &&
      !!view.position &&
      hasHeight(view.position[2], view.room),
  );
  const under = index.grounds?.[options.ground ?? -1];
  const points = [
    ...rooms.flatMap((room) => room.outline.flat()),
    ...stands.map(([location]) => location.position ?? []),
    ...photographs.map((view) => view.position),
    // Where there are rooms, the ground ends beside them.
    ...(under && rooms.length === 0 ? cornersOf(under) : []),
  ];
  const box = boxOf(points);
  const unit = Math.max(box.w, box.h) / 100;
  // North is up: y grows upwards in the world and downwards on the screen.
  const at = (x: number, y: number): [number, number] => [x - box.x, box.y + box.h - y];
  const element = s("svg", {
    class: small ? "plan small" : "plan",
    viewBox: `0 0 ${box.w} ${box.h}`,
    role: "group",
    "aria-label": `Plan of area ${area}`,
  });
  element.style.setProperty("--unit", `${unit}px`);
  const ground = under ? groundLayer(under, options.ground ?? 0, at) : null;
  if (ground) element.append(ground.element);
  const ringPath = (ring: [number, number][]): string => {
    const corners = ring.map(([x, y]) => at(x, y).map((c) => c.toFixed(3)));
    return `M${corners.map((corner) => corner.join(",")).join("L")}Z`;
  };
  for (const room of rooms) {
    const d = room.outline.map(ringPath).join("");
    if (ground) element.append(s("path", { class: "casing", d }));
    const outline = s("path", {
      class: "room",
      d,
      "fill-rule": "evenodd",
      "stroke-width": 0.35 * unit,
    });
    const best = small ? null : bestIn(stands, room.name);
    if (!small) outline.append(s("title", {}, `${roomName(room.name)}, ${metres2(room.floor_m2)}`));
    // Keyboard users get there by the scan location itself.
    const to = best && { href: link("pano", [area, best.uuid]), tabindex: -1, "aria-hidden": "true" };
    element.append(to ? s("a", to, outline) : outline);
  }
  const wedge = s("path", { class: "wedge" });
  const cones = s("g", { class: "cones" });
  element.append(wedge, cones);
  const placed = new Map<string, [number, number]>();
  for (const [{ position }, location] of stands)
    placed.set(placeKey({ location }), at(position?.[0] ?? 0, position?.[1] ?? 0));
  for (const { picture, position } of photographs)
    if (picture !== null) placed.set(placeKey({ picture }), at(position[0], position[1]));
  const graph = options.hasGraph ? graphLayer(area, unit, (key) => placed.get(key) ?? null) : null;
  if (graph) element.append(graph.element);
  const sector = (x: number, y: number, reach: number, azimuth: number, fov: number): string => {
    const [a, b] = [azimuth + fov / 2, azimuth - fov / 2];
    const tip = (angle: number): string => `${x + reach * Math.cos(angle)},${y - reach * Math.sin(angle)}`;
    return `M${x},${y}L${tip(a)}A${reach},${reach} 0 ${fov > Math.PI ? 1 : 0} 1 ${tip(b)}Z`;
  };
  /** Shows cones, words and lines of the graph for the element under the pointer or with the focus. */
  const reveal = (
    target: Element,
    key: string,
    place: [number, number],
    headings: () => [number, number][],
    words: () => string,
  ) => {
    const show = (): void => {
      const drawn = headings().map(([azimuth, fov]) =>
        s("path", {
          class: "cone",
          d: sector(...place, reachOf(fov) * unit, azimuth, fov),
          "stroke-width": 0.12 * unit,
        }),
      );
      cones.replaceChildren(...drawn);
      graph?.near(key);
      told([words(), graph?.words(key)].filter(Boolean).join(", "));
    };
    const hide = (): void => {
      graph?.near(null);
      cones.replaceChildren();
      told(null);
    };
    pointed(target, show, hide);
  };
  for (const view of photographs) {
    const place = at(view.position[0], view.position[1]);
    const dot = s("circle", { class: "photograph", cx: place[0], cy: place[1], r: 0.8 * unit });
    const name = named(view.photograph ?? "");
    dot.append(s("title", {}, name));
    if (small || view.picture === null) {
      element.append(dot);
      continue;
    }
    const to = s("a", { href: link("view", [view.picture]), "aria-label": name }, dot);
    const { forward, fov_deg: fov } = view;
    const level = forward && Math.hypot(forward[0], forward[1]) > 0.1;
    const heading = (): [number, number][] =>
      level && fov !== null ? [[Math.atan2(forward[1], forward[0]), fov * RADIANS]] : [];
    reveal(to, placeKey({ picture: view.picture }), place, heading, () => name);
    element.append(to);
  }
  const crowd = Math.min(1, Math.max(0.35, 8 / Math.sqrt(stands.length)));
  const radius = (small ? 2 : 1.1) * unit * crowd;
  for (const [location, i] of stands) {
    const place = at(location.position?.[0] ?? 0, location.position?.[1] ?? 0);
    const coverage = location.seen?.coverage ?? null;
    const sees = coverage === null ? "" : `, scan coverage ${percent(coverage)}`;
    const title = `${roomName(location.room)}, ${location.uuid.slice(0, 8)}${sees}`;
    const current = i === options.current;
    const dot = s("circle", {
      class: current ? "stand current" : "stand",
      cx: place[0],
      cy: place[1],
      r: radius,
    });
    if (!small) {
      dot.setAttribute("stroke-width", String(0.25 * unit * crowd));
      if (coverage !== null) dot.style.fill = css(coverageColor(coverage));
    }
    dot.append(s("title", {}, title));
    if (ground) element.append(s("circle", { class: "casing", cx: place[0], cy: place[1], r: radius }));
    const href = location.pano ? link("pano", [location.area, location.uuid]) : null;
    const target = href ? s("a", { href, "aria-label": title }, dot) : dot;
    if (!small) {
      const headings = (): [number, number][] => conesAt(index, i);
      const words = (): string => `${title}, ${several(headings().length, "kept view")}`;
      reveal(target, placeKey({ location: i }), place, headings, words);
    }
    element.append(target);
  }
  if (!small) {
    append(element, [patches(index, area, hasHeight, at, unit)]);
    append(element, changed(options.changes ?? [], hasHeight, at, unit));
    // The last elements are on top, but do not block the pointer.
    append(element, [...names(rooms, stands, at, unit), scale(box, unit)].flat());
  }
  const current = options.current === undefined ? undefined : index.locations[options.current];
  const look = (azimuth: number, fov: number): void => {
    if (!current?.position) return;
    const [x, y] = at(current.position[0], current.position[1]);
    wedge.setAttribute("d", sector(x, y, (small ? 16 : 9) * unit, azimuth, fov));
  };
  return { element, look, ground, graph };
}

/** Disputed patches, each a link to a place that shows it. */
function patches(
  index: Index,
  area: number,
  hasHeight: (z: number, room: string) => boolean,
  at: (x: number, y: number) => [number, number],
  unit: number,
): SVGElement {
  const group = s("g", { class: "patches" });
  for (const { votes } of index.votes.filter((v) => v.area === area)) {
    for (const { labels, center, faces, m2 } of votes.disputed_patches) {
      if (!hasHeight(center[2], roomOf(labels[0]))) continue;
      const [x, y] = at(center[0], center[1]);
      const r = 0.7 * unit;
      const words = `${labels.map(named).join(" or ")}: ${several(faces, "face")}, ${m2.toFixed(3)} m²`;
      const mark = s("path", { class: "patch", d: `M${x},${y - r}l${r},${r}l${-r},${r}l${-r},${-r}Z` });
      mark.append(s("title", {}, words));
      const href = patchLink(index, area, center);
      group.append(href ? s("a", { href, "aria-label": `Disputed: ${words}` }, mark) : mark);
    }
  }
  return group;
}

/** Changes of labels, each a link to it in 3D; changes of class lie on top. */
function changed(
  marks: ChangeMark[],
  hasHeight: (z: number, room: string) => boolean,
  at: (x: number, y: number) => [number, number],
  unit: number,
): SVGElement[] {
  const shown = marks.filter((mark) => hasHeight(mark.at[2], ""));
  return [...shown].reverse().map(({ at: place, isClass, words, href }) => {
    const [x, y] = at(place[0], place[1]);
    const r = (isClass ? 0.75 : 0.5) * unit;
    const mark = s("rect", { x: x - r, y: y - r, width: 2 * r, height: 2 * r });
    mark.setAttribute("class", isClass ? "change class" : "change");
    mark.setAttribute("stroke-width", String(0.25 * unit));
    mark.append(s("title", {}, words));
    return href === null ? mark : s("a", { href, "aria-label": `Changed: ${words}` }, mark);
  });
}

/** Names of rooms where they fit, beside any location in the middle. */
function names(
  rooms: Index["rooms"],
  stands: [Location, number][],
  at: (x: number, y: number) => [number, number],
  unit: number,
): SVGElement[] {
  const found: SVGElement[] = [];
  for (const room of rooms) {
    const largest = [...room.outline].sort((a, b) => sizeOf(b) - sizeOf(a))[0];
    if (!largest) continue;
    const box = boxOf(largest);
    const name = roomName(room.name);
    // A letter is about one hundredth of the plan wide; pointing at a room shows its name in any case.
    if (Math.min(flat(name).length, 24) * unit > 1.6 * box.w || box.h < 2 * unit) continue;
    const [x, y] = at(...innermost(room.outline));
    // Beside the middle, or above or below it, if a location is there.
    const taken = ([right, down]: [number, number]): boolean =>
      stands.some(([location]) => {
        const [sx, sy] = at(location.position?.[0] ?? 0, location.position?.[1] ?? 0);
        const [dx, dy] = [sx - x - right * unit, sy - y - (down + 0.5) * unit];
        return Math.abs(dx) < 9 * unit && Math.abs(dy) < 3.2 * unit;
      });
    const wide = box.w > 50 * unit;
    const high = box.h > 16 * unit;
    const places: [number, number][] = [[0, -0.5], ...(wide ? BESIDE : []), ...(high ? ABOVE_BELOW : [])];
    const [right, down] = places.find((place) => !taken(place)) ?? [0, -0.5];
    const [tx, ty] = [x + right * unit, y + down * unit];
    const text = s("text", { class: "name", x: tx, y: ty });
    append(text, [name, s("tspan", { class: "size", x: tx, dy: "1.1em" }, metres2(room.floor_m2))]);
    found.push(text);
  }
  return found;
}

function scale(box: Box, unit: number): SVGElement[] {
  const metre = [1, 2, 5, 10, 20, 50, 100].find((m) => m > box.w / 8) ?? 100;
  const [x, y] = [unit, box.h - unit];
  const text = { class: "scale-text", x: x + metre / 2, y: y - 0.9 * unit };
  return [
    s("path", { class: "scale", d: `M${x},${y}h${metre}`, "stroke-width": 0.4 * unit }),
    s("text", text, `${metre} m`),
  ];
}
