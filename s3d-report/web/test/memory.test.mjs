// What the page remembers on the way there and back. Each test fails on any error of the console, and on any
// request that leaves the report's folder.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { go, launch, no3d, open, ready } from "./lib/browser.mjs";
import { index, queryOf, report } from "./lib/common.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const hash = (page) => page.evaluate(() => window.location.hash);
/** Does something that opens a page, and waits for the page. */
async function and(page, act) {
  const was = await page.getAttribute("body", "data-ready");
  await act();
  await page.waitForFunction((before) => document.body.dataset.ready !== before, was);
  await page.waitForTimeout(100);
}
const tab = (page, name) => and(page, () => page.locator(`nav a[data-page=${name}]`).click());

test("the grid keeps its filter, its place and the focus, and filters are cleared", async () => {
  const { page, faults, close } = await open(browser, report, "#/views?sort=entropy", { height: 420 });
  await page.getByLabel("Which views").selectOption("dropped");
  await page.getByLabel("Which views").selectOption("pictures");
  await page.getByText("Filter by numbers").click();
  await page.getByLabel("Entropy, at least").fill("0.2");
  const address = await hash(page);
  const card = page.locator(".card a").nth(30);
  await card.scrollIntoViewIfNeeded();
  const [there, href] = [await page.evaluate(() => window.scrollY), await card.getAttribute("href")];
  assert.ok(there > 100);
  await and(page, () => card.click());
  assert.equal(await page.title(), `${await page.locator("h1").textContent()} · demo · s3d report`);
  const isBack = async (words) => {
    assert.equal(await hash(page), address, words);
    const focused = () => document.activeElement.getAttribute("href");
    assert.deepEqual(await page.evaluate(focused), href, words);
    assert.ok(Math.abs((await page.evaluate(() => window.scrollY)) - there) < 2, words);
    assert.equal(await page.getByLabel("Entropy, at least").isVisible(), true, words);
  };
  await and(page, () => page.goBack());
  await isBack("by the browser's way back");
  await and(page, () => page.goForward());
  await tab(page, "views");
  await isBack("by the tab");
  assert.match(await page.title(), /^Views · /);
  // The open tab does nothing, and a way out of the filter can be gone back.
  await page.locator("nav a[data-page=views]").click();
  assert.equal(await hash(page), address);
  await and(page, () => page.getByRole("button", { name: "Clear filters" }).click());
  assert.deepEqual(await queryOf(page), { sort: "entropy" });
  assert.equal(await page.getByRole("button", { name: "Clear filters" }).isVisible(), false);
  await and(page, () => page.goBack());
  assert.equal(await hash(page), address);
  assert.deepEqual(faults, []);
  await close();
});

test("panoramas, views and 3D are left and found as they were", { skip: no3d }, async () => {
  const [{ area, uuid }, other] = index.locations.filter((l) => l.pano);
  const { page, faults, close } = await open(browser, report, `#/pano/${area}/${uuid}?lon=31&lat=-9&fov=70`);
  await page.getByLabel("Left of the line").selectOption("depth");
  await page.locator(".split").focus();
  await page.keyboard.press("Home");
  const address = await hash(page);
  assert.match(address, /lon=31.0&lat=-9.0&fov=70.0&left=depth&right=class&split=0.000/);
  await tab(page, "space");
  await page.waitForSelector("main[data-loaded]");
  await page.getByLabel("Scan locations").uncheck();
  await page.waitForTimeout(400);
  const space = await hash(page);
  await tab(page, "notes");
  await tab(page, "pano");
  assert.equal(await hash(page), address);
  await tab(page, "space");
  assert.equal(await hash(page), space);
  assert.equal(await page.getByLabel("Scan locations").isChecked(), false);
  // Another panorama has the same layers, and the first still looks where it did.
  await tab(page, "pano");
  const to = await page
    .getByLabel("Scan location")
    .locator(`option[value$="${other.uuid}"]`)
    .getAttribute("value");
  await and(page, () => page.getByLabel("Scan location").selectOption(to));
  const { left, right, split } = await queryOf(page);
  assert.deepEqual([left, right, split], ["depth", "class", "0.000"]);
  await go(page, `#/pano/${area}/${uuid}`);
  await page.locator(".split").focus();
  await page.keyboard.press("End");
  const { lon, lat, fov } = await queryOf(page);
  assert.deepEqual([lon, lat, fov], ["31.0", "-9.0", "70.0"]);
  // So does the next view.
  await go(page, "#/view/0?left=normal&right=depth&split=0.25");
  await and(page, () => page.getByLabel("Next view").click());
  assert.equal(await page.getByLabel("Left of the line").inputValue(), "normal");
  assert.match(await hash(page), /^#\/view\/1\?left=normal&right=depth&split=0.250/);
  await ready(page);
  assert.deepEqual(faults, []);
  await close();
});
