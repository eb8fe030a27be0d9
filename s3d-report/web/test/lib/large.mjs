// The report of an imaginary data set, as large as the published one. `node large.mjs REPORT OUT` writes
// OUT/, with the page and the pictures of REPORT, a small one. The numbers follow from a counter, so every
// run is the same.

import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { deflateSync } from "node:zlib";

/** Locations of the six areas of the published data set; 72 candidates at each. */
const LOCATIONS = [190, 299, 85, 258, 374, 207];
const CANDIDATES = 72;
const ROOM_M = 6;

/** Numbers between 0 and 1, the same in every run (Park and Miller). */
function numbers(seed) {
  let state = seed;
  return () => (state = (state * 48271) % 2147483647) / 2147483647;
}

const read = (folder, key) => {
  const text = readFileSync(join(folder, `data/${key}.js`), "utf8");
  return JSON.parse(JSON.parse(text.slice(`s3dReport("${key}",`.length, text.lastIndexOf(");"))));
};

/** The index of such a report, in the form of the small one's. */
export function largeIndex(small) {
  const next = numbers(17);
  const round = (value, places) => Math.round(value * 10 ** places) / 10 ** places;
  const seen = () => ({
    coverage: round(0.8 + 0.2 * next(), 4),
    unlabelled: round(0.05 * next(), 4),
    instances: 3 + Math.floor(30 * next()),
    classes: small.classes.flatMap((_, c) => (next() < 0.6 ? [[c, round(next() / 8, 4)]] : [])),
  });
  const [rooms, locations, views, dropped] = [[], [], [], []];
  const hex = () => Math.floor(next() * 2 ** 31).toString(16);
  LOCATIONS.forEach((many, a) => {
    const area = a + 1;
    const across = Math.ceil(Math.sqrt(many / 5));
    for (let k = 0; k < many; k++) {
      const at = Math.floor(k / 5);
      const [x, y] = [(at % across) * ROOM_M, Math.floor(at / across) * ROOM_M];
      const room = `office_${at + 1}`;
      if (k % 5 === 0) {
        const corners = [
          [x, y],
          [x + 5.8, y],
          [x + 5.8, y + 5.8],
          [x, y + 5.8],
        ];
        rooms.push({ area, name: room, floor_m2: 33.64, heights: [0, 3], outline: [corners] });
      }
      const uuid = Array.from({ length: 4 }, () => hex().padStart(8, "0")).join("");
      const position = [round(x + 5.8 * next(), 3), round(y + 5.8 * next(), 3), 1.5];
      const location = locations.length;
      locations.push({ area, uuid, room, position, azimuth_rad: 6 * next(), pano: true, seen: seen() });
      let frame = 0;
      for (let candidate = 0; candidate < CANDIDATES; candidate++) {
        const kept = next() < 0.725;
        const view = {
          area,
          location,
          room,
          photograph: null,
          frame: kept ? frame++ : null,
          candidate,
          picture: kept ? views.length : null,
          yaw_deg: round(360 * next() - 180, 2),
          pitch_deg: round(60 * (next() - 0.5), 2),
          fov_deg: round(20 + 55 * next(), 2),
          entropy: round(2.3 * next(), 4),
          place: { reason: kept ? "highest" : "lowest", rank: 1 + candidate, pool: CANDIDATES },
          position: null,
          forward: null,
          up: null,
          seen: kept ? seen() : null,
        };
        (kept ? views : dropped).push(view);
      }
    }
  });
  const areas = LOCATIONS.map((many, a) => ({
    ...small.areas[0],
    area: a + 1,
    locations: many,
    panoramas: many,
  }));
  return {
    ...small,
    data_set: { ...small.data_set, name: "1,413 locations" },
    areas,
    rooms,
    locations,
    views: [...views, ...dropped],
    statistics: { areas: areas.map(({ area }) => ({ ...small.statistics.areas[0], area })) },
    votes: areas.map(({ area }) => ({ area, votes: small.votes[0].votes })),
    meshes: [],
    grounds: [],
  };
}

/** Writes the report: an index, and pictures of the small one for the first locations and views. */
export function writeLarge(report, out) {
  mkdirSync(join(out, "data"), { recursive: true });
  const index = largeIndex(read(report, "index"));
  const write = (key, value) =>
    writeFileSync(
      join(out, `data/${key}.js`),
      `s3dReport("${key}",${JSON.stringify(JSON.stringify(value))});\n`,
    );
  const packed = deflateSync(JSON.stringify(index)).toString("base64");
  writeFileSync(join(out, "data/index.js"), `s3dReport("index","${packed}",true);\n`);
  const keys = ["first", "pano_0", "sharp_0", "panos_0", "views_0", "thumbs_0"];
  const [first, pano, sharp, small, views, thumbs] = keys.map((key) => read(report, key));
  const outline = index.rooms.filter((room) => room.area === 1).flatMap((room) => room.outline);
  write("first", {
    ...first,
    name: index.data_set.name,
    parts: { ...first.parts, meshes: false },
    outline,
  });
  // The page opens the panorama with the richest views first; each location has as many.
  const riches = index.locations.map(() => 0);
  index.views.forEach(({ location, entropy }) => (riches[location] += entropy));
  const best = riches.indexOf(Math.max(...riches));
  for (const at of new Set([best, 0, 1, 2, 3, 4, 5, 700])) {
    write(`pano_${at}`, { ...pano, face: null });
    write(`sharp_${at}`, sharp);
  }
  const dim = Array(48).fill(small[0]);
  for (let k = 0; k * 48 < index.locations.length; k++) write(`panos_${k}`, dim);
  write("views_0", views);
  const kept = index.views.filter((view) => view.picture !== null).length;
  const dot = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7";
  for (let k = 0; k * 48 < kept; k++) write(`thumbs_${k}`, k < 12 ? thumbs : Array(48).fill(dot));
  copyFileSync(join(report, "index.html"), join(out, "index.html"));
  return index;
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? "").href)
  writeLarge(process.argv[2], process.argv[3]);
