// The page stays quick on a mesh of more than 300,000 faces: the durations are told, and held to generous limits.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch } from "../../../s3d-report/web/test/lib/browser.mjs";
import { drag, find, open, settled } from "./lib/page.mjs";
import { serve } from "./lib/server.mjs";

/**
 * No task may hold the page up for longer, ms. On a machine without a graphics card, tasks wait for pictures that
 * its processors draw.
 */
const LIMIT = 1500;

let browser, server;
before(async () => {
  browser = await launch();
  server = await serve({ scene: "scan/fine.obj" });
});
after(async () => {
  await browser?.close();
  await server?.close();
});

test("gestures do not hold the page up", async (t) => {
  const { page, close } = await open(browser, server.url);
  const { faces } = await page.evaluate(async () => (await fetch("scene.json")).json());
  assert.ok(faces > 300_000);
  await page.evaluate(() => {
    window.held = [];
    const seen = new PerformanceObserver((list) => {
      for (const { duration } of list.getEntries()) window.held.push(Math.round(duration));
    });
    seen.observe({ type: "longtask" });
  });
  const longest = async (what, limit = LIMIT) => {
    await page.waitForTimeout(300);
    const held = await page.evaluate(() => window.held.splice(0));
    const most = Math.max(0, ...held);
    t.diagnostic(`${what}: ${held.length} tasks over 50 ms, the longest ${most} ms`);
    assert.ok(most < limit, `${what}: ${most} ms`);
  };
  // The first picture that lights up a patch waits for all that was drawn before.
  await find(page, ({ m2 }) => m2 > 5);
  await longest("starting", Infinity);
  const at = await find(page, ({ m2 }) => m2 > 5);
  await longest("hovering");
  await page.mouse.move(at.x, at.y);
  for (let k = 0; k < 8; k++) await page.keyboard.press("]");
  await longest("to larger patches");
  for (let k = 0; k < 8; k++) await page.keyboard.press("[");
  await longest("to smaller patches");
  await page.mouse.click(at.x, at.y);
  await settled(page);
  await longest("labelling");
  await drag(page, [
    [at.x, at.y],
    [at.x + 150, at.y + 60],
    [at.x + 200, at.y - 60],
  ]);
  await longest("dragging");
  await page.keyboard.press("Enter");
  await settled(page);
  await longest("accepting");
  await page.keyboard.press("z");
  await settled(page);
  await longest("undoing");
  for (let k = 0; k < 4; k++) await page.keyboard.press("s");
  await drag(page, [
    [at.x, at.y],
    [at.x + 60, at.y + 20],
  ]);
  await longest("brushing");
  await close();
});
