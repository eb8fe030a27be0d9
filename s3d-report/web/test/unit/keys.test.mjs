// The table of keys: no key does two things in one place, and each key of the table is found in it.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bundled } from "../lib/bundled.mjs";

const { actOf, groups, shortcutsOf, signsOf } = await bundled("keys.ts");

/** An event as the browser makes it. */
const event = (key, more = {}) => ({ key, ctrlKey: false, metaKey: false, altKey: false, ...more });

test("each key of the table does what the table says", () => {
  let keys = 0;
  for (const [name, { acts }] of groups) {
    const all = Object.values(acts).flatMap((act) => act.keys);
    assert.equal(new Set(all).size, all.length, `${name} has a key twice`);
    for (const [act, { keys: own }] of Object.entries(acts))
      for (const key of own) {
        const [control, letter] = key.startsWith("Control+") ? [true, key.slice(8)] : [false, key];
        assert.equal(actOf(name, event(letter, { ctrlKey: control })), act, `${name} ${key}`);
        assert.equal(actOf(name, event(letter, { ctrlKey: control, altKey: true })), null);
        if (!control)
          assert.equal(actOf(name, event(letter, { ctrlKey: true })), null, `${name} Control ${key}`);
        keys += 1;
      }
  }
  assert.ok(keys > 30, `${keys} keys`);
  assert.equal(actOf("page", event("K", { metaKey: true })), "find");
  assert.equal(actOf("space", event("q")), null);
});

test("keys are told to people and to programs that read the page aloud", () => {
  assert.equal(shortcutsOf("page", "find"), "/ Control+K Meta+K");
  assert.equal(shortcutsOf("present", "hold"), "Space");
  assert.deepEqual(signsOf(["f", "F"]), ["F"]);
  assert.deepEqual(signsOf(["ArrowLeft", "-", "Control+k"]), ["←", "−", "Ctrl K"]);
});
