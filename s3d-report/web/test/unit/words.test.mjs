// Names in text, and warnings that repeat themselves, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bundled } from "../lib/bundled.mjs";

const { flat, named, roomName } = await bundled("dom.ts");
const { alike, damageOf } = await bundled("pages/notes.ts");

test("a name in an attribute keeps its direction to itself", () => {
  assert.equal(flat(`Enter ${named("office 1")}, 2 m`), "Enter office 1, 2 m");
  assert.equal(flat(`${roomName("conferenceRoom_1")} and ${roomName("WC_2")}`), "conference room 1 and WC 2");
  assert.equal(flat(`Enter ${named("חדר 1")}, 2 m`), "Enter \u2068חדר 1\u2069, 2 m");
  // Marks that would end the isolate, or turn what follows around, are none any more.
  assert.equal(flat(named("a\u202e\u2069\u061cb")), "a\ufffd\ufffd\ufffdb");
  // A name cannot end where it says it does.
  assert.equal(flat(named("a\ufdd1b\ufdd0c")), "abc");
});

test("warnings that differ in numbers alone are one", () => {
  const sees = (uuid, share) => ({ warning: `location ${uuid} sees ${share} % of the mesh` });
  const other = { warning: "8 faces are unlabelled" };
  const uuids = ["0c5a7d1e93b84f62a1d7e0f4b2683c95", "11112222333344445555666677778888"];
  const groups = alike([sees(uuids[0], 3), other, sees(uuids[1], "0.5")]);
  assert.deepEqual(groups, [[sees(uuids[0], 3), sees(uuids[1], "0.5")], [other]]);
});

test("damage is counted without warnings", () => {
  const index = { faults: [{}, {}], verified: null, areas: [{ warnings: ["a", "b"] }] };
  assert.deepEqual(damageOf(index), { count: 2, words: "2 files missing or damaged" });
  const verified = { faults: [{ count: 1 }] };
  assert.equal(
    damageOf({ ...index, verified }).words,
    "2 files missing or damaged, 1 fault found by s3d verify",
  );
});
