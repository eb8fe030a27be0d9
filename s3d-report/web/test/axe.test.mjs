// Every page is usable by everybody, as far as axe-core can tell, in light and dark, on a desk and on a
// phone.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { go, isFirefox, launch, open } from "./lib/browser.mjs";
import { axeFinds, index, report } from "./lib/common.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const { area, uuid } = index.locations.find((l) => l.pano);
const PAGES = [
  `#/overview/${area}?right=instance&line=0.3`,
  `#/pano/${area}/${uuid}`,
  `#/space/${area}`,
  "#/views?show=pictures",
  "#/views?entropy_min=0.1",
  "#/view/0",
  "#/plan",
  "#/plan?ground=none",
  "#/present?step=1",
  "#/present?step=3",
  "#/numbers",
  "#/notes",
];

// Axe reads the page alone: one browser is enough.
const skip = isFirefox && "axe is run in Chromium";

for (const [scheme, width] of [
  ["light", 1440],
  ["light", 900],
  ["dark", 390],
]) {
  test(`axe finds nothing in ${scheme} at ${width}`, { skip }, async () => {
    const { page, faults, close } = await open(browser, report, "#/notes", { width });
    await page.emulateMedia({ colorScheme: scheme });
    await page.evaluate(`${axe};0`);
    const found = [];
    for (const hash of PAGES) {
      await go(page, hash);
      if (hash.startsWith("#/space")) await page.waitForSelector("main[data-loaded=all]");
      found.push(...(await axeFinds(page, hash)));
    }
    assert.deepEqual(found, []);
    assert.deepEqual(faults, []);
    await close();
  });
}

/** The contrast of two colours as the page computes them (WCAG 2.2). */
function contrast(a, b) {
  const light = (color) => {
    const [r, g, blue] = color
      .match(/[\d.]+/g)
      .slice(0, 3)
      .map((word) => Number(word) / 255)
      .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * blue;
  };
  const [high, low] = [light(a), light(b)].sort((x, y) => y - x);
  return (high + 0.05) / (low + 0.05);
}

test("borders of controls, rooms and dots on the plan stand out by 3:1 at least", { skip }, async () => {
  const { page, faults, close } = await open(browser, report, "#/views");
  const styleOf = (selector, ...names) =>
    page
      .locator(selector)
      .first()
      .evaluate((element, all) => all.map((name) => getComputedStyle(element)[name]), names);
  for (const scheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme: scheme });
    const [paper] = await styleOf("body", "backgroundColor");
    await go(page, scheme === "light" ? "#/views?sort=yaw" : "#/views?sort=pitch");
    const [edge, sheet] = await styleOf("select", "borderTopColor", "backgroundColor");
    await go(page, "#/plan?ground=none");
    const [room, wall] = await styleOf(".plan .room", "fill", "stroke");
    const [rim] = await styleOf(".plan .stand", "stroke");
    for (const [a, b, what] of [
      [edge, paper, "border on the page"],
      [edge, sheet, "border of a list"],
      [wall, room, "wall"],
      [rim, room, "rim of a dot"],
    ])
      assert.ok(contrast(a, b) >= 3, `${scheme}, ${what}: ${contrast(a, b).toFixed(2)}`);
  }
  assert.deepEqual(faults, []);
  await close();
});
