// Names of files, the tree of instances, and ranges of a histogram, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bundled } from "../lib/bundled.mjs";

const { fileName } = await bundled("tools.ts");
const { treeOf } = await bundled("space/tree.ts");
const { rangeOf } = await bundled("pages/brush.ts");

test("a picture is named after what it shows", () => {
  assert.equal(
    fileName("demo", "#/pano/1/ab?lon=3.0&left=rgb", "png"),
    "demo_pano_1_ab_lon_3.0_left_rgb.png",
  );
  assert.equal(fileName("../my set", "", "png"), "my_set.png");
  assert.equal(fileName("é房", "#/view/0", "svg"), "view_0.svg");
  assert.ok(fileName("d", `#/${"x".repeat(500)}`, "png").length < 150);
});

test("instances stand by room and class, in the order of their numbers", () => {
  const names = ["<UNK>", "chair_10_office_1_1", "chair_2_office_1_1", "wall_1_office_1_1", "chair_1_WC_1_1"];
  const classes = { chair: 1, wall: 0 };
  const labels = names.map((name) => ({ name, class: classes[name.split("_")[0]] ?? null }));
  const box = (label) => ({ label, box: [] });
  const tree = treeOf({ labels }, [0, 1, 2, 3, 4].map(box));
  assert.deepEqual(
    tree.map(({ room, classes: all }) => [room, all.map((c) => [c.class, c.instances.map((b) => b.label)])]),
    [
      [
        "office_1",
        [
          [0, [3]],
          [1, [2, 1]],
        ],
      ],
      ["WC_1", [[1, [4]]]],
    ],
  );
});

test("a drag to an edge leaves that end open, and numbers are round", () => {
  assert.deepEqual(rangeOf(0.25, 0, 0, 1.37), [null, 0.34]);
  assert.deepEqual(rangeOf(0.5, 1, -180, 180), [0, null]);
  assert.deepEqual(rangeOf(0.2, 0.4, 10, 75), [23, 36]);
});
