// Storeys, without a browser: which rooms, cameras and heights belong to which, and what each shows.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bundled } from "../lib/bundled.mjs";

const { storeysOf, slabOf, fullest, wordsOf } = await bundled("storeys.ts");
const { belowCeilings } = await bundled("space/ceilings.ts");

const room = (name, floor, top, more = {}) => ({
  area: 1,
  name,
  floor_m2: 12,
  floor,
  heights: [floor, top],
  outline: [],
  ...more,
});
const stand = (room_, z) => ({ area: 1, uuid: `${room_}${z}`, room: room_, position: [1, 1, z], pano: true });
const building = (rooms, locations = []) => storeysOf({ rooms, locations }, 1);
const names = ({ all }) => all.map(({ name, rooms }) => [name, rooms.map((r) => r.name)]);
/** Ceilings as level surfaces: a height and m². */
const slabs = ({ all }, ceilings) =>
  all.map((_, i) => slabOf(all, i, (floor, above) => belowCeilings(ceilings, floor, above)));

test("a stairwell is on the storey of its floor, whatever its height", () => {
  const house = building(
    [
      room("hallway_1", 0, 5.5),
      room("lounge_1", 0.02, 2.7),
      room("storage_1", -0.01, 2.7),
      room("office_1", 2.85, 5.5),
      room("office_2", 2.85, 5.55),
    ],
    [stand("hallway_1", 1.5), stand("hallway_1", 4.35), stand("office_1", 4.3)],
  );
  assert.deepEqual(names(house), [
    ["Ground floor", ["hallway_1", "lounge_1", "storage_1"]],
    ["First floor", ["office_1", "office_2"]],
  ]);
  assert.deepEqual(
    house.all.map((storey) => storey.locations),
    [1, 2],
  );
  // On the landing one stands upstairs.
  assert.deepEqual([house.of(1.5, "hallway_1"), house.of(4.35, "hallway_1")], [0, 1]);
  assert.equal(fullest(house.all), 0);
  assert.equal(wordsOf(house.all[1]), "First floor · 2 rooms");
  const [ground, first] = slabs(house, [
    [2.7, 30],
    [5.5, 40],
    [0.74, 9],
    [2.2, 1],
  ]);
  assert.ok(ground.high < 2.7 && ground.high > 2.5 && ground.low === -Infinity, JSON.stringify(ground));
  assert.ok(first.high < 5.5 && first.high > 5.3, JSON.stringify(first));
  assert.ok(first.low < 2.85 && first.low > 2.5, JSON.stringify(first));
});

test("rooms exactly above each other are on storeys of their own", () => {
  const outline = [
    [
      [0, 0],
      [4, 0],
      [4, 3],
      [0, 3],
    ],
  ];
  const tower = building([2, 0, 1, 3].map((k) => room(`office_${k + 1}`, 3 * k, 3 * k + 2.8, { outline })));
  assert.deepEqual(
    names(tower).map(([name, [only]]) => [name, only]),
    [
      ["Ground floor", "office_1"],
      ["First floor", "office_2"],
      ["Second floor", "office_3"],
      ["Third floor", "office_4"],
    ],
  );
  assert.deepEqual(
    [0.4, 2.9, 3.1, 5.9, 8, 11.5].map((z) => tower.of(z)),
    [0, 1, 1, 2, 2, 3],
  );
  const shown = slabs(
    tower,
    [0, 1, 2, 3].map((k) => [3 * k + 2.8, 12]),
  );
  shown.forEach(({ high }, k) => assert.ok(Math.abs(high - (3 * k + 2.7)) < 1e-9, `${high}`));
});

test("a split level is one storey, and a point is on the storey of its room", () => {
  const split = building(
    [
      room("lounge_1", 0, 2.5),
      room("office_1", 1.4, 3.9),
      room("office_2", 2.8, 5.3),
      room("office_3", 4.2, 6.7),
    ],
    [stand("office_1", 2.9), stand("office_2", 4.3)],
  );
  assert.deepEqual(names(split), [
    ["Ground floor", ["lounge_1", "office_1"]],
    ["First floor", ["office_2", "office_3"]],
  ]);
  assert.deepEqual([split.of(2.9, "office_1"), split.of(2.9, "office_2")], [0, 1]);
  assert.deepEqual(
    split.all.map((storey) => storey.locations),
    [1, 1],
  );
  const [ground] = slabs(split, [
    [2.5, 12],
    [3.9, 12],
    [5.3, 12],
    [6.7, 12],
  ]);
  // The upper half is cut as well, above its floor.
  assert.ok(ground.high > 1.4 + 0.4 && ground.high < 2.5, JSON.stringify(ground));
});

test("what lies below the ground floor is a basement, which opens last", () => {
  const house = building([
    room("openspace_1", -2.6, -0.3),
    ...[1, 2, 3].map((k) => room(`office_${k}`, 0.01 * k, 2.4)),
  ]);
  assert.deepEqual(
    house.all.map(({ name }) => name),
    ["Basement", "Ground floor"],
  );
  assert.equal(fullest(house.all), 1);
  // Without such a hint the lowest storey is the ground floor.
  const high = building([room("a_1", 52, 54.5), room("b_1", 55, 57.5)]);
  assert.deepEqual(
    high.all.map(({ name }) => name),
    ["Ground floor", "First floor"],
  );
});

test("without labels the cameras tell of the storeys", () => {
  const bare = building([], [stand("", 1.4), stand("", 1.7), stand("", 4.4), stand("unknown_1", 4.2)]);
  assert.deepEqual(bare.all.map(wordsOf), [
    "Ground floor · 2 scan locations",
    "First floor · 2 scan locations",
  ]);
  assert.deepEqual([bare.of(1.2), bare.of(4.4)], [0, 1]);
  const nothing = building([]);
  assert.deepEqual([nothing.all.length, nothing.of(7), nothing.ofRoom("x")], [1, 0, 0]);
  // A report of an older version does not have the floors.
  const older = building([
    room("a_1", undefined, 2, { heights: [0, 2] }),
    room("b_1", null, 5, { heights: [3, 5] }),
  ]);
  assert.deepEqual([older.all.length, older.ofRoom("b_1")], [2, 1]);
});

test("a storey without ceilings is cut at a height that shows its rooms", () => {
  const open = building([room("a_1", 0, 2.6), room("b_1", 3, 5.6)]);
  const [ground, first] = slabs(open, []);
  assert.ok(ground.high > 1.5 && ground.high <= 2.75, JSON.stringify(ground));
  assert.equal(first.high, Infinity);
});
