// What the pointer names lights up; the tree of a mesh; the link and the picture of what is shown. Each test
// fails on any error of the console, and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { drawn, isFirefox, launch, no3d, open, readout } from "./lib/browser.mjs";
import { index, json, queryOf, report, spread } from "./lib/common.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

/** The colour of a point of the screen, without the pointer's own picture. */
async function colorsAt(page, points) {
  const shot = PNG.sync.read(await page.screenshot());
  return points.map(([x, y]) => [
    ...shot.data.subarray(4 * (shot.width * y + x), 4 * (shot.width * y + x) + 3),
  ]);
}

/** A point of the canvas that shows an instance, and its name. */
async function instanceIn(page, box) {
  for (const [x, y] of spread(30, box)) {
    if (!(await page.evaluate(([a, b]) => document.elementFromPoint(a, b)?.tagName === "CANVAS", [x, y])))
      continue;
    await page.mouse.move(x, y);
    const { instance } = await readout(page);
    if (instance) return { point: [x, y], instance };
  }
  return assert.fail("no instance was found");
}

const { area, uuid } = index.locations.find((l) => l.pano);

for (const hash of [
  `#/pano/${area}/${uuid}?lon=40&lat=-8&fov=80&left=rgb&right=rgb&split=1`,
  "#/view/0?left=depth&right=rgb&split=1",
  `#/space/${area}?show=texture&marks=`,
]) {
  const skip = hash.includes("space") && no3d;
  test(`what the pointer names lights up: ${hash.split("?")[0]}`, { skip }, async () => {
    const { page, faults, close } = await open(browser, report, hash);
    if (hash.includes("space")) await page.waitForSelector("main[data-loaded=all]");
    const box = await page.locator(".viewer canvas").boundingBox();
    const { point } = await instanceIn(page, box);
    // Neighbours of the pointer, since it may have a picture of its own.
    const beside = [[point[0] - 3, point[1]], point, [point[0] + 3, point[1]]];
    await drawn(page);
    const lit = await colorsAt(page, beside);
    await page.mouse.move(box.x + box.width / 2, 3);
    await drawn(page);
    const plain = await colorsAt(page, beside);
    // The tint is yellow: more red and green than blue.
    const yellow = ([r, g, b]) => r + g - 2 * b;
    const more = lit.map((color, i) => yellow(color) - yellow(plain[i]));
    assert.ok(Math.max(...more) > 60, `${JSON.stringify(lit)} and ${JSON.stringify(plain)}`);
    assert.deepEqual(faults, []);
    await close();
  });
}

test("the tree leads to instances, and one class alone has its colours", { skip: no3d }, async () => {
  const { page, faults, close } = await open(browser, report, `#/space/${area}?show=class`);
  await page.waitForSelector("main[data-loaded=all]");
  const labels = json("assets/semantic_labels.json");
  const ofRoom = labels.filter((name) => name.split("_").slice(2, 4).join("_") === "conferenceRoom_1");
  const chairs = ofRoom.filter((name) => name.startsWith("chair_"));
  await page.getByText("Rooms and instances").click();
  const room = page.locator(".tree > details", { hasText: "conference room 1" });
  await room.locator("summary").first().click();
  const chair = room.locator("details", { hasText: "chair" });
  assert.equal(await chair.locator("summary").textContent(), `chair ${chairs.length}`);
  await chair.locator("summary").click();
  const buttons = chair.getByRole("button");
  await buttons.first().waitFor();
  assert.equal(await buttons.count(), chairs.length);
  const before = await queryOf(page);
  await buttons.first().click();
  await page.waitForTimeout(1500);
  const now = await queryOf(page);
  assert.notEqual(now.at, before.at);
  // It is in the middle of the canvas.
  const box = await page.locator(".viewer canvas").boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  assert.equal((await readout(page)).class, "chair");

  await page.getByLabel("Classes in colour").selectOption({ label: "Only chair" });
  await page.waitForTimeout(500);
  const of = index.classes.findIndex(({ name }) => name === "chair");
  assert.equal((await queryOf(page)).only, String(of));
  await page.mouse.move(box.x + box.width / 2, 3);
  await drawn(page);
  const grey = ([r, g, b]) => Math.max(r, g, b) - Math.min(r, g, b) < 8;
  const colors = await colorsAt(page, spread(60, { ...box, x: box.x + 280, width: box.width - 360 }));
  assert.ok(colors.filter(grey).length > 30, JSON.stringify(colors));
  assert.deepEqual(faults, []);
  await close();
});

const noFiles = isFirefox && "Firefox's driver has no downloads";
test("the link is copied, and the picture saved under the route's name", { skip: noFiles }, async () => {
  const { page, faults, close } = await open(browser, report, "#/view/0?left=rgb&right=rgb&split=0.500");
  await page
    .context()
    .grantPermissions(["clipboard-read", "clipboard-write"])
    .catch(() => {});
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.locator(".tools-told", { hasText: "Link copied" }).waitFor();
  const arrives = page.waitForEvent("download");
  await page.getByRole("button", { name: "Save picture" }).click();
  const file = await arrives;
  assert.equal(file.suggestedFilename(), "demo_view_0_left_rgb_right_rgb_split_0.500.png");
  const { width, height, data } = PNG.sync.read(readFileSync(await file.path()));
  const canvas = await page.locator(".viewer canvas").evaluate(({ width: w, height: h }) => [w, h]);
  assert.deepEqual([width, height], canvas);
  const values = new Set(data.filter((_, i) => i % 4 === 0));
  assert.ok(values.size > 20, "the picture is empty");
  await page.getByRole("button", { name: "Full screen" }).click();
  await page.waitForFunction(() => document.fullscreenElement?.classList.contains("viewer"));
  assert.deepEqual(faults, []);
  await close();
});
