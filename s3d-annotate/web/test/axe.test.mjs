// The page is usable by everybody, as far as axe-core can tell, in light and dark, wide and narrow.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { launch } from "../../../s3d-report/web/test/lib/browser.mjs";
import { find, open, settled } from "./lib/page.mjs";
import { serve } from "./lib/server.mjs";

let browser, server;
before(async () => {
  browser = await launch();
  server = await serve();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

const packages = createRequire(new URL("../../../s3d-report/web/package.json", import.meta.url));
const axe = readFileSync(packages.resolve("axe-core/axe.min.js"), "utf8");

for (const [dark, width, height] of [
  [false, 1440, 900],
  [true, 1440, 900],
  [true, 900, 700],
])
  test(`axe finds nothing in ${dark ? "dark" : "light"} at ${width}`, async () => {
    const { page, faults, close } = await open(browser, server.url, { dark, width, height, card: true });
    await page.evaluate(`${axe};0`);
    const found = [];
    const check = async (when) => {
      const { violations } = await page.evaluate(() => window.axe.run());
      for (const { id, help, nodes } of violations)
        found.push(`${when}: ${id} (${help}): ${nodes.length} times, ${nodes[0].html.slice(0, 160)}`);
    };
    await check("the first card");
    await page.locator("dialog summary").first().click();
    await check("all keys");
    await page.keyboard.press("Escape");
    const at = await find(page, ({ instance, m2 }) => instance === 0 && m2 > 0.05);
    await page.mouse.click(at.x, at.y);
    await settled(page);
    for (const summary of await page.locator(".side summary").all())
      if (!(await summary.evaluate((it) => it.parentElement.open))) await summary.click();
    await page.locator(".menu summary").click();
    await check("all parts open");
    await page.keyboard.press("Escape");
    await page.locator("canvas").focus();
    await page.keyboard.press("s");
    await check("cutting");
    await page.keyboard.press("Escape");
    await page.keyboard.press("p");
    await page.keyboard.press("Enter");
    await settled(page);
    await page.locator(".room").first().focus();
    await page.keyboard.press(" ");
    await check("the plan");
    assert.deepEqual(found, []);
    assert.deepEqual(faults, []);
    await close();
  });

test("all of the page is reached by keys, backwards from the scene", async () => {
  const { page, close } = await open(browser, server.url);
  const reached = new Set();
  for (let k = 0; k < 60; k++) {
    await page.keyboard.press("Shift+Tab");
    reached.add(
      await page.evaluate(() => document.activeElement?.closest("header, .classes, .side")?.className),
    );
  }
  for (const part of ["top", "classes panel", "side panel"]) assert.ok(reached.has(part), part);
  await close();
});

test("the card of the first use is shown once", async () => {
  const { page, close } = await open(browser, server.url, { card: true });
  assert.ok(await page.locator("dialog").isVisible());
  assert.equal(await page.locator(".five li").count(), 5);
  await page.keyboard.press("Escape");
  assert.ok(await page.locator("dialog").isHidden());
  await page.reload();
  await page.waitForSelector("body[data-ready]");
  assert.ok(await page.locator("dialog").isHidden());
  await page.keyboard.press("?");
  assert.ok(await page.locator("dialog").isVisible());
  await close();
});
