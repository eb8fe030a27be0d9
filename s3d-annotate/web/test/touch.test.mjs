// Fingers on the page to label on: one paints and cuts, two turn and zoom.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { isFirefox, launch } from "../../../s3d-report/web/test/lib/browser.mjs";
import { drawn, find, labels, open, settled, state } from "./lib/page.mjs";
import { serve } from "./lib/server.mjs";

let browser, server, opened, page, hand;
before(async () => {
  if (!isFirefox) browser = await launch();
});
after(() => browser?.close());
beforeEach(async () => {
  if (!browser) return;
  server = await serve();
  opened = await open(browser, server.url, { touch: true });
  page = opened.page;
  hand = await page.context().newCDPSession(page);
});
afterEach(async () => {
  await opened?.close();
  await server?.close();
});

/** Only Chromium lets a test move fingers. */
const options = { skip: isFirefox && "fingers are moved in Chromium alone" };

const small = ({ m2, instance }) => instance === 0 && m2 > 0.05 && m2 < 3;
const large = ({ m2, instance }) => instance === 0 && m2 > 0.8;

/** Shift, as the browser counts keys that are held. The page's keyboard does not hold them for fingers. */
const shift = 8;
let held = 0;

/** Puts fingers down, moves them, or lifts those that are left out. */
const touch = (type, ...points) =>
  hand.send("Input.dispatchTouchEvent", {
    type,
    modifiers: held,
    touchPoints: points.map(([x, y], id) => ({ x: Math.round(x), y: Math.round(y), id })),
  });

/** Moves one finger over places, and lifts it. */
async function stroke(...places) {
  await touch("touchStart", places[0]);
  let [x, y] = places[0];
  for (const [u, v] of places.slice(1)) {
    for (let k = 1; k <= 6; k++) await touch("touchMove", [x + (k / 6) * (u - x), y + (k / 6) * (v - y)]);
    [x, y] = [u, v];
  }
  await touch("touchEnd");
  await settled(page);
}

/** Waits until the eye stands still, and returns where. The address follows it within half a second. */
async function eye() {
  let [before, now] = [null, null];
  do {
    before = now;
    await page.waitForTimeout(600);
    await drawn(page);
    now = await page.evaluate(() => window.location.hash);
  } while (now !== before);
  return now;
}

test("one finger labels what it is drawn over", options, async () => {
  const first = await find(page, small);
  const second = await find(page, (it) => small(it) && it.node !== first.node);
  await page.keyboard.press("9");
  await stroke([first.x, first.y], [second.x, second.y]);
  const { instances } = await state(page);
  assert.deepEqual(
    instances.map((instance) => instance.class),
    ["chair"],
  );
  const all = await labels(page);
  for (const { face } of [first, second]) assert.equal(all[face], instances[0].number);
  assert.deepEqual(opened.faults, []);
});

test("a second finger turns and zooms, and takes back what the first began", options, async () => {
  const at = await find(page, small);
  await page.mouse.move(5, 450);
  const before = await eye();
  await touch("touchStart", [at.x, at.y]);
  await touch("touchMove", [at.x + 20, at.y]);
  await touch("touchStart", [at.x + 20, at.y], [at.x + 120, at.y]);
  for (let k = 1; k <= 8; k++)
    await touch("touchMove", [at.x + 20 - 6 * k, at.y + 4 * k], [at.x + 120 + 6 * k, at.y + 4 * k]);
  await touch("touchEnd");
  assert.notEqual(await eye(), before);
  await settled(page);
  assert.deepEqual((await state(page)).instances, []);
  // One finger labels again.
  const there = await find(page, small);
  await stroke([there.x, there.y]);
  assert.equal((await state(page)).instances.length, 1);
  assert.deepEqual(opened.faults, []);
});

test("a finger cuts by a line and with the brush, and Shift adds", options, async () => {
  const at = await find(page, large, 37, [
    [-12, -8],
    [12, 8],
  ]);
  const cut = async (way, ...places) => {
    await page.locator(".cuts button", { hasText: way }).tap();
    await stroke(...places);
    return (await state(page)).instances;
  };
  await page.keyboard.press("s");
  const lined = await cut("Line", [at.x - 40, at.y - 25], [at.x + 40, at.y + 25]);
  assert.equal(lined.length, 1);
  await page.keyboard.press("z");
  await settled(page);
  const brushed = await cut("Brush", [at.x, at.y], [at.x + 10, at.y]);
  assert.equal(brushed.length, 1);
  held = shift;
  const [more, ...others] = await cut("Brush", [at.x, at.y], [at.x + 40, at.y + 10]);
  held = 0;
  assert.equal(others.length, 0);
  assert.ok(more.number === brushed[0].number && more.area_m2 > brushed[0].area_m2);
  assert.deepEqual(opened.faults, []);
});

test(
  "a finger that presses on a colour shows what is cut, and cuts it when it is lifted",
  options,
  async () => {
    const at = await find(page, large);
    await page.keyboard.press("s");
    await page.locator(".cuts button", { hasText: "Colour" }).tap();
    const told = () => page.locator(".cuts .quiet").textContent();
    const before = await told();
    await page.locator(".cuts button", { hasText: "+" }).tap();
    assert.notEqual(await told(), before);
    const asked = page.waitForResponse("**/cut");
    await touch("touchStart", [at.x, at.y]);
    const { faces } = await (await asked).json();
    assert.deepEqual((await state(page)).instances, []);
    await touch("touchEnd");
    await page.waitForFunction(async () => (await (await fetch("state.json")).json()).instances.length === 1);
    const [{ number }] = (await state(page)).instances;
    const count = faces.reduce((sum, run, i) => sum + (i % 2 ? run : 0), 0);
    assert.equal((await labels(page)).filter((of) => of === number).length, count);
    assert.deepEqual(opened.faults, []);
  },
);
