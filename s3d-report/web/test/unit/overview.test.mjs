// The overview's choices, without a browser: the richest views, the first panorama, what is found,
// and what is said of a data set.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bundled } from "../lib/bundled.mjs";

const { richest, firstLocation } = await bundled("overview/richest.ts");
const { matches, thingsOf } = await bundled("overview/search.ts");
const { numbersOf, sentenceOf } = await bundled("overview/facts.ts");

const classes = ["wall", "floor", "chair"].map((name) => ({ name, color: [1, 2, 3] }));
const view = (picture, more) => ({
  area: 1,
  location: 0,
  room: "office_1",
  photograph: null,
  frame: picture,
  candidate: picture,
  picture,
  yaw_deg: 0,
  pitch_deg: 0,
  fov_deg: 60,
  entropy: 1,
  position: null,
  seen: { coverage: 1, unlabelled: 0, instances: 3, classes: [[0, 1]] },
  ...more,
});
const location = (uuid, room, x, more = {}) => ({
  area: 1,
  uuid,
  room,
  position: [x, 0, 1.5],
  azimuth_rad: 0,
  pano: true,
  seen: { coverage: 1, unlabelled: 0, instances: 3, classes: [] },
  ...more,
});
const made = (more) => ({
  data_set: { name: "a", bytes: 3e6, files: 40, depth_units_per_m: 512 },
  areas: [{ area: 1, faces: 7, points: 12_900_000 }],
  classes,
  labels: [{ name: "<UNK>_0_<UNK>_0_0", class: null, color: [0, 0, 0] }],
  rooms: [],
  locations: [],
  views: [],
  meshes: [],
  pixels_by_class: [5, 5, 5],
  surface_by_class: [],
  ...more,
});
const pictures = (views) => views.map(({ picture }) => picture);

test("the richest views are rich and unlike each other", () => {
  const locations = [location("a", "office_1", 0), location("b", "lounge_1", 8)];
  const views = [
    view(0, { entropy: 1.9 }),
    view(1, { entropy: 1.89, yaw_deg: 2 }),
    view(2, { entropy: 1.5, room: "lounge_1", location: 1 }),
    view(3, { entropy: 1.6, yaw_deg: 180, seen: { ...view(0).seen, classes: [[2, 1]] } }),
    view(4, { entropy: 0.2, room: "lounge_1", location: 1, yaw_deg: 90 }),
    view(null, { entropy: 3, frame: null }),
  ];
  // The second is as the first, the fifth shows little, and the last has no picture.
  assert.deepEqual(pictures(richest(views, made({ locations }), 3)), [0, 2, 3]);
  assert.equal(richest(views, made({ locations }), 9).length, 5);
  assert.deepEqual(richest([], made({}), 3), []);
  // A view that sees little of the mesh is poor, whatever it sees.
  const black = view(0, { entropy: 2, seen: { ...view(0).seen, coverage: 0.4 } });
  assert.deepEqual(pictures(richest([black, view(1, { entropy: 1.2 })], made({ locations }), 1)), [1]);
});

test("photographs and views without labels are chosen by content, depth and place", () => {
  const seen = (depth_m) => ({ coverage: 1, unlabelled: null, instances: null, classes: [], depth_m });
  const locations = [location("a", "", 0), location("b", "", 9)];
  const bare = [0.3, 4, 3.9, 2].map((depth, i) =>
    view(i, { entropy: null, room: "", seen: seen(depth), location: i < 3 ? 0 : 1 }),
  );
  assert.deepEqual(pictures(richest(bare, made({ classes: [], locations }), 2)), [1, 3]);
});

test("the first panorama looks into a room", () => {
  const far = (depth_m, coverage = 1) => ({ seen: { coverage, classes: [], depth_m } });
  const locations = [
    location("door", "office_1", 0, far(0.4)),
    location("middle", "office_1", 2, far(2.5)),
    location("outside", "office_1", 9, far(8, 0.2)),
    location("none", "office_1", 9, { pano: false, ...far(9) }),
  ];
  assert.equal(firstLocation(made({ classes: [], locations })), 1);
  // With labels the entropy of the views decides.
  const views = [view(0, { location: 0, entropy: 1.7 }), view(1, { location: 1, entropy: 1.1 })];
  assert.equal(firstLocation(made({ locations, views })), 0);
  assert.equal(firstLocation(made({ locations: [] })), -1);
  assert.equal(firstLocation(made({ locations: [locations[2]] })), 0);
});

test("things are found by their words, and lead to their pages", () => {
  const labels = [
    { name: "<UNK>_0_<UNK>_0_0", class: null, color: [0, 0, 0] },
    ...[1, 2, 12].map((n) => ({ name: `chair_${n}_conferenceRoom_1_1`, class: 2, color: [1, 1, 1] })),
  ];
  const rooms = [
    {
      area: 1,
      name: "conferenceRoom_1",
      floor_m2: 3,
      floor: 0,
      heights: [0, 2],
      outline: [
        [
          [0, 0],
          [4, 0],
          [4, 4],
        ],
      ],
    },
  ];
  const locations = [location("0c5feed", "conferenceRoom_1", 0)];
  const meshes = [{ area: 1, has_votes: true }];
  const index = made({ labels, rooms, locations, meshes, views: [view(7, { room: "conferenceRoom_1" })] });
  const things = thingsOf(index);
  // Names from data are marked.
  const found = (words) =>
    matches(things, words).map(({ kind, name, href }) => [kind, name.replace(/[\ufdd0\ufdd1]/g, ""), href]);
  assert.deepEqual(found("chair 12"), [
    ["Instance", "chair 12 · conference room 1", "#/space/1?instance=chair_12_conferenceRoom_1_1"],
  ]);
  assert.deepEqual(found("CHAIR")[0].slice(0, 2), ["Class", "chair"]);
  assert.match(found("conference")[0][2], /^#\/space\/1\?at=2\.000%2C2\.000%2C0\.500&from=/);
  assert.deepEqual(found("0c5f")[0], ["Scan location", "conference room 1 · 0c5feed", "#/pano/1/0c5feed"]);
  assert.deepEqual(
    found("view 7").map(([, , href]) => href),
    ["#/view/7"],
  );
  assert.deepEqual(found("piano"), []);
  assert.ok(found("").length >= 5);
  // Without a mesh a room leads to its views, and an instance to those of its class.
  const flat = matches(thingsOf({ ...index, meshes: [] }), "conference 1");
  assert.equal(flat[0].href, "#/views?room=1%2FconferenceRoom_1");
  // However many there are, few are shown.
  const many = Array.from({ length: 5000 }, (_, i) => ({ kind: "Instance", name: `chair ${i}`, href: "" }));
  assert.equal(matches(many, "chair").length, 8);
});

test("a sentence and six numbers say what the index has", () => {
  const room = (name, floor = 0) => ({
    area: 1,
    name,
    floor_m2: 20.4,
    floor,
    heights: [floor, floor + 2.5],
    outline: [],
  });
  const rooms = [
    room("office_1"),
    room("office_2"),
    room("pantry_1"),
    room("pantry_2", 2.9),
    room("hallway_1", 2.9),
  ];
  const index = made({ rooms, locations: [location("a", "office_1", 0)], views: [view(0)] });
  assert.equal(
    sentenceOf(index),
    "Five rooms on two storeys: two offices, two pantries and a hallway, seen from one scan location.",
  );
  assert.deepEqual(numbersOf(index), [
    ["102 m²", "of floor"],
    ["3 of 3", "classes"],
    ["1", "view"],
    ["1", "panorama"],
    ["12.9 M", "points"],
    ["7", "faces"],
  ]);
  assert.equal(sentenceOf(made({})), "A scan without labels.");
});
