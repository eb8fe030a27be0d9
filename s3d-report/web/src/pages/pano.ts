// A scan location: its panorama, its neighbours, and its position on the plan.

import { type Index, type Location, type Picture, load, loadSmallPano } from "../data.js";
import { append, choice, h, percent, roomName, several } from "../dom.js";
import {
  type Gaze,
  directionIn,
  drawn,
  panoramaPoint,
  panoramaScreen,
  screenAt,
} from "../picture/geometry.js";
import { decoded } from "../picture/images.js";
import { gazes } from "../route/memory.js";
import { firstLocation } from "../overview/richest.js";
import { type Storeys, storeysOf } from "../storeys.js";
import { plan } from "./floor.js";
import { type Route, type Sight, link, numberOf, replaceRoute } from "../route/route.js";
import { Viewer, gazeQuery, layersOf, lookFrom, modalitiesOf, queryOf } from "../picture/viewer.js";

const RADIANS = Math.PI / 180;

/** One walks to a location that is this close to the direction of view at most, radians. */
const AHEAD = 40 * RADIANS;

/** Links to the panoramas of other storeys that are nearest to a location; null if there are none. */
function otherStoreys(index: Index, here: Location, storeys: Storeys): HTMLElement | null {
  if (storeys.all.length < 2 || !here.position) return null;
  const [x, y, z] = here.position;
  const current = storeys.of(z, here.room);
  const links = storeys.all.flatMap(({ name }, storey) => {
    if (storey === current) return [h("span", { "aria-current": "true" }, name)];
    const away = (l: Location): number => Math.hypot((l.position?.[0] ?? 0) - x, (l.position?.[1] ?? 0) - y);
    const there = index.locations.filter(
      (l) => l.area === here.area && l.pano && l.position && storeys.of(l.position[2], l.room) === storey,
    );
    const nearest = there.sort((a, b) => away(a) - away(b))[0];
    return nearest ? [h("a", { href: link("pano", [nearest.area, nearest.uuid]) }, name)] : [];
  });
  if (links.length < 2) return null;
  return h("nav", { class: "storeys", "aria-label": "Storeys" }, ...links.reverse());
}

/** A neighbour may be this much farther than the seen surface, in metres, since pixels are coarse. */
const SLACK = 0.3;

export function locationAt(index: Index, route: Route): number {
  const [area, uuid] = route.path;
  const named = index.locations.findIndex((l) => String(l.area) === area && l.uuid === uuid);
  return route.path.length === 0 ? firstLocation(index) : named;
}

/** The visible other locations of the area, with direction and distance, the farthest first. */
function neighbours(
  index: Index,
  from: Location,
  depthAt: (u: number, v: number) => number | null,
): { location: Location; lon: number; lat: number; distance: number }[] {
  const here = from.position;
  if (!here || from.azimuth_rad === null) return [];
  const found = [];
  for (const location of index.locations) {
    if (location === from || location.area !== from.area || !location.pano || !location.position) continue;
    const [x, y, z] = location.position.map((c, axis) => c - (here[axis] ?? 0)) as [number, number, number];
    const distance = Math.hypot(x, y, z);
    const [lon, lat] = directionIn(from, [x, y, z]);
    const units = depthAt(lon / (2 * Math.PI) + 0.5, 0.5 - lat / Math.PI);
    const free = units === null ? 10 : units / index.data_set.depth_units_per_m;
    if (distance > 1e-3 && distance < free + SLACK) found.push({ location, lon, lat, distance });
  }
  return found.sort((a, b) => b.distance - a.distance);
}

/** The direction of view that an address asks for, or the one before, or the first. */
function gazeOf(location: Location, route: Route): Gaze {
  const before = route.query.has("lon") ? undefined : gazes.get(location.uuid);
  const asked = before ? new URLSearchParams(before) : route.query;
  return {
    lon: numberOf(asked, "lon", -360, 360, location.look_deg ?? 0) * RADIANS,
    lat: numberOf(asked, "lat", -90, 90, -4) * RADIANS,
    fov: numberOf(asked, "fov", 8, 120, 90) * RADIANS,
  };
}

/** The name of a location, links to other storeys, and what its panorama sees. */
function headOf(location: Location, name: HTMLElement, storeys: HTMLElement | null = null): HTMLElement {
  const facts = [
    location.seen?.coverage != null && `scan coverage ${percent(location.seen.coverage)}`,
    location.seen?.instances != null && several(location.seen.instances, "instance"),
    location.seen?.unlabelled != null && `${percent(location.seen.unlabelled)} unlabelled`,
  ].filter(Boolean);
  const title = `${roomName(location.room)} · ${location.uuid.slice(0, 8)}`;
  const head = h("div", { class: "look-head" }, h("h1", { class: "hidden" }, title), name);
  append(head, [storeys, h("p", { class: "quiet" }, facts.join(" · "))]);
  return head;
}

/** The width of the first sight, pixels. */
const SIGHT = 480;

/** What is shown of a panorama while its file is read: its small image. Null if there is none. */
export async function panoSight(index: Index, route: Route): Promise<Sight | null> {
  const at = locationAt(index, route);
  const location = index.locations[at];
  const url = location?.pano ? await loadSmallPano(index, at) : null;
  const small = url === null ? null : await decoded(url);
  if (!location || !small) return null;

  const canvas = h("canvas", { "aria-hidden": "true" });
  const name = h("span", {}, `${roomName(location.room)} · ${location.uuid.slice(0, 8)}`);
  const frame = h("section", { class: "viewer" }, h("div", { class: "frame" }, canvas));
  const element = h("main", { class: "look", "aria-busy": "true" }, headOf(location, name), frame);
  const draw = (): void => {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const scale = Math.min(1, SIGHT / Math.max(1, width, height));
    canvas.width = Math.max(1, Math.round(scale * width));
    canvas.height = Math.max(1, Math.round(scale * height));
    const context = canvas.getContext("2d");
    const pixels = context?.createImageData(canvas.width, canvas.height);
    if (!context || !pixels) return;
    pixels.data.set(drawn(small, gazeOf(location, route), canvas.width, canvas.height));
    context.putImageData(pixels, 0, 0);
  };
  return { element, draw };
}

export async function panoPage(
  index: Index,
  route: Route,
): Promise<{ element: HTMLElement; close: () => void }> {
  const at = locationAt(index, route);
  const location = index.locations[at];
  if (!location) {
    const words =
      route.path.length === 0 ? "This data set has no panoramas." : "There is no such scan location.";
    return {
      element: h("main", { class: "page" }, h("h1", {}, "Panoramas"), h("p", {}, words)),
      close: () => {},
    };
  }
  const entries = index.locations
    .filter((l) => l.pano)
    .map((l): [string, string] => {
      const area = index.areas.length > 1 ? `area ${l.area}, ` : "";
      return [link("pano", [l.area, l.uuid]), `${area}${roomName(l.room)} · ${l.uuid.slice(0, 8)}`];
    });
  let layers: Record<string, string> = {};
  const name = choice("Scan location", entries, link("pano", [location.area, location.uuid]), (to) => {
    window.location.hash = `${to}?${new URLSearchParams(layers)}`;
  });
  const storeys = storeysOf(index, location.area);
  const element = h(
    "main",
    { class: "look" },
    headOf(location, name, otherStoreys(index, location, storeys)),
  );
  if (!location.pano) {
    append(element, [h("p", {}, "This location has no panorama in the report.")]);
    return { element, close: () => {} };
  }
  const picture = await load<Picture>(`pano_${at}`);
  const gaze = gazeOf(location, route);
  const storey = location.position && storeys.of(location.position[2], location.room);
  const map =
    storey === null
      ? null
      : plan(index, location.area, {
          small: true,
          current: at,
          hasRoom: (room) => storeys.ofRoom(room) === storey,
          hasHeight: (z, room) => storeys.of(z, room) === storey,
        });
  const marks: { button: HTMLElement; lon: number; lat: number; distance: number }[] = [];
  const look = lookFrom(route.query, modalitiesOf(index, location.area, picture), gaze);
  layers = layersOf(look);
  let viewer: Viewer | null = null;
  const opened = await Viewer.open(index, picture, look, {
    title: `Panorama of ${roomName(location.room)}; arrow keys turn, plus and minus zoom, W and S walk`,
    area: location.area,
    room: location.room,
    point: (i, j, distance) => panoramaPoint(location, picture, i, j, distance),
    position: location.position,
    screen: (point, now, width, height) => panoramaScreen(location, now ?? gaze, width, height, point),
    changed: (now) => {
      layers = layersOf(now);
      if (now.gaze) gazes.set(location.uuid, gazeQuery(now.gaze));
      replaceRoute("pano", [location.area, location.uuid], queryOf(now));
      if (now.gaze) map?.look((location.azimuth_rad ?? 0) - now.gaze.lon, now.gaze.fov);
    },
    drawn: (width, height) => {
      for (const { button, lon, lat } of marks) {
        const place = viewer?.gaze ? screenAt(viewer.gaze, width, height, lon, lat) : null;
        const inside = place && place[0] > 0 && place[0] < width && place[1] > 0 && place[1] < height;
        button.hidden = !inside;
        if (inside) button.style.transform = `translate(${place[0]}px, ${place[1]}px)`;
      }
    },
  });
  viewer = opened;
  for (const { location: other, lon, lat, distance } of neighbours(index, location, (u, v) =>
    opened.depthAt(u, v),
  )) {
    const words = `${roomName(other.room)}, ${distance.toFixed(1)} m`;
    // Walking keeps the direction of view.
    const walk = (): void => {
      const now = opened.gaze ?? gaze;
      const turned = now.lon + (other.azimuth_rad ?? 0) - (location.azimuth_rad ?? 0);
      window.location.hash = link(
        "pano",
        [other.area, other.uuid],
        queryOf({ ...look, gaze: { ...now, lon: turned } }),
      );
    };
    const button = h("button", { class: "walk", "aria-label": `Walk to ${words}`, click: walk });
    button.append(h("span", { class: "walk-name" }, words));
    marks.push({ button, lon, lat, distance });
    opened.overlay.append(button);
  }
  /** Walks to the nearest location ahead, or behind. */
  opened.element.addEventListener("keydown", (event) => {
    const turned = { w: 0, s: Math.PI }[event.key.toLowerCase()];
    const isTyping = (event.target as Element).matches("select, input");
    if (turned === undefined || isTyping || event.ctrlKey || event.metaKey || event.altKey) return;
    const off = (lon: number): number => {
      const angle = lon - (opened.gaze ?? gaze).lon - turned;
      return Math.abs(Math.atan2(Math.sin(angle), Math.cos(angle)));
    };
    const ahead = marks.filter(({ lon }) => off(lon) < AHEAD).sort((a, b) => a.distance - b.distance)[0];
    ahead?.button.click();
  });
  if (map) opened.overlay.append(h("div", { class: "inset" }, map.element));
  map?.look((location.azimuth_rad ?? 0) - gaze.lon, gaze.fov);
  element.append(opened.element);
  if (picture.sharp) void opened.sharpen(load<string>(`sharp_${at}`));
  return { element, close: () => opened.close() };
}
