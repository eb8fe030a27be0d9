// The steps of a presentation, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bundled } from "../lib/bundled.mjs";

const { captionOf, stepsOf, wipeAt, wipeWithoutMotion } = await bundled("present/steps.ts");

const plain = (text) => text.replace(/[\ufdd0\ufdd1]/g, "");
const seen = (classes) => ({ coverage: 1, unlabelled: 0.12, instances: 3, classes });
const view = (picture, room, location, more = {}) => ({
  area: 1,
  location,
  room,
  photograph: null,
  frame: picture,
  candidate: picture,
  picture,
  yaw_deg: 40 * picture,
  pitch_deg: 0,
  fov_deg: 60,
  entropy: 1,
  position: null,
  seen: seen([[picture % 2, 1]]),
  ...more,
});
const location = (uuid, room, x, more = {}) => ({
  area: 1,
  uuid,
  room,
  position: [x, 0, 1.5],
  azimuth_rad: 0,
  pano: true,
  seen: seen([
    [1, 0.6],
    [0, 0.4],
  ]),
  ...more,
});
const room = (name, floor, x) => ({
  area: 1,
  name,
  floor_m2: 9,
  floor,
  heights: [floor, floor + 2.5],
  outline: [
    [
      [x, 0],
      [x + 3, 0],
      [x + 3, 3],
    ],
  ],
});
const made = (more) => ({
  data_set: { name: "a" },
  areas: [{ area: 1 }],
  classes: [
    { name: "wall", color: [1, 2, 3] },
    { name: "dining_chair", color: [4, 5, 6] },
  ],
  labels: [],
  rooms: [room("office_1", 0, 0), room("hallway_1", 0, 4), room("office_2", 3, 0)],
  locations: [
    location("aaaaaaaabb", "office_1", 0),
    location("bbbbbbbbcc", "office_1", 1),
    location("ccccccccdd", "hallway_1", 5),
    location("ddddddddee", "office_2", 0, { position: [0, 0, 4.5] }),
  ],
  views: [view(0, "office_1", 0), view(1, "hallway_1", 2), view(2, "office_2", 3), view(3, "office_1", 1)],
  meshes: [{ area: 1, has_votes: true }],
  surface_by_class: [{ m2: 5 }, { m2: 7 }],
  ...more,
});

test("buildings come storey by storey, then views with panoramas of different rooms between them", () => {
  const index = made({});
  const steps = stepsOf(index);
  const told = steps.map((s) => (s.kind === "building" ? `storey ${s.storey}` : s.kind)).join(", ");
  assert.equal(told, "storey null, storey 0, storey 1, view, view, panorama, view, view, panorama, panorama");
  const rooms = steps.flatMap((s) => (s.kind === "panorama" ? index.locations[s.location].room : []));
  assert.deepEqual([...rooms].sort(), ["hallway_1", "office_1", "office_2"]);
  assert.deepEqual(stepsOf(index, 2), []);
});

test("one storey has one step, and what is missing has none", () => {
  const kinds = (more) => stepsOf(made(more)).map(({ kind }) => kind);
  const rooms = [room("office_1", 0, 0)];
  const locations = [location("a", "office_1", 0)];
  assert.deepEqual(kinds({ rooms, locations, views: [] }), ["building", "panorama"]);
  assert.deepEqual(kinds({ meshes: [], rooms, locations, views: [view(0, "office_1", 0)] }), [
    "view",
    "panorama",
  ]);
  assert.deepEqual(kinds({ meshes: [], rooms, locations: [], views: [] }), []);
  // Rooms without names are told apart by their places.
  const unknown = [0, 1, 6].map((x) => location(`${x}`, "unknown_1", x));
  assert.deepEqual(kinds({ meshes: [], rooms: [], locations: unknown, views: [] }), ["panorama", "panorama"]);
});

test("captions say the room and what is shown", () => {
  const index = made({});
  const caption = (step) => {
    const { title, words, classes } = captionOf(index, step);
    return [plain(title), plain(words), classes.map(({ name }) => name)];
  };
  const [all, ground] = stepsOf(index);
  assert.deepEqual(caption(all), ["a", "2 storeys", ["dining_chair", "wall"]]);
  assert.deepEqual(caption(ground), ["a", "Ground floor · 2 rooms", ["dining_chair", "wall"]]);
  const words = "View · 3 instances · 12 % unlabelled";
  assert.deepEqual(caption({ kind: "view", area: 1, view: index.views[1] }), [
    "hallway 1",
    words,
    ["dining_chair"],
  ]);
  const from = view(4, "", 0, { seen: null });
  assert.deepEqual(caption({ kind: "view", area: 1, view: from }), [
    "a",
    "View · scan location aaaaaaaa",
    [],
  ]);
  assert.deepEqual(caption({ kind: "panorama", area: 1, location: 2 }).slice(0, 2), [
    "hallway 1",
    "Panorama · 3 instances · 12 % unlabelled",
  ]);
});

test("the line goes over the picture and back; without motion there are two steps", () => {
  assert.deepEqual([0, 0.2, 0.6, 1].map(wipeAt), [1, 1, 0, 1]);
  const values = Array.from({ length: 101 }, (_, k) => wipeAt(k / 100));
  assert.ok(values.every((value) => value >= 0 && value <= 1));
  assert.deepEqual([0, 0.49, 0.5, 1].map(wipeWithoutMotion), [1, 1, 0, 0]);
});
