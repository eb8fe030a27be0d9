// The other pages, hostile names, a phone, and a data set without labels.
// Each test fails on any error of the console, and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { go, launch, open, readout, tap } from "./lib/browser.mjs";
import { bare, holdPanorama, index, json, report, withCopy } from "./lib/common.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test("notes tell that all is well, and lead to what labels dispute", async () => {
  const { page, faults, close } = await open(browser, report, "#/notes");
  assert.match(
    await page.locator("main").textContent(),
    /Every file that this report reads is as it was written/,
  );
  const patches = page.locator("main section a[href^='#/pano']");
  assert.equal(await patches.count(), Math.min(12, json("area_1/3d/votes.json").disputed_patches.length));
  await patches.first().click();
  await page.waitForSelector(".viewer canvas");
  await go(page, "#/nowhere");
  assert.match(await page.locator("[role=alert]").textContent(), /no such page/);
  assert.deepEqual(faults, []);
  await close();
});

test("on a phone every page fits, and a touch reads the panorama", async () => {
  const at = index.locations.findIndex((l) => l.pano);
  const { uuid, area } = index.locations[at];
  const { page, faults, close } = await open(
    browser,
    report,
    `#/pano/${area}/${uuid}?lon=75&lat=-10&fov=80`,
    { width: 390, height: 844, touch: true },
  );
  await holdPanorama(page, at, async ([x, y]) => {
    const hit = await page.evaluate(
      ([px, py]) => document.elementFromPoint(px, py)?.tagName === "CANVAS",
      [x, y],
    );
    if (hit) await tap(page, x, y);
    return hit;
  });
  for (const hash of ["#/views", "#/view/0", "#/plan", "#/numbers", "#/notes"]) {
    await go(page, hash);
    const wide = await page.evaluate(() => document.scrollingElement.scrollWidth);
    assert.ok(wide <= 390, `${hash} is ${wide} pixels wide`);
  }
  assert.deepEqual(faults, []);
  await close();
});

test("names are text, whatever they are, and files that are missing are told", async () => {
  const hostile = "<script>alert(1)</script><img src=x onerror=alert(2)> \u202e\"'&amp;";
  const { uuid } = index.locations.find((location) => location.pano);
  const hostileIndex = (write, folder) => {
    const changed = structuredClone(index);
    changed.data_set.name = hostile;
    changed.faults = [{ path: hostile, message: hostile }];
    changed.areas[0].warnings = [`location ${uuid} sees nothing: ${hostile}`, hostile];
    changed.rooms.forEach((room) => (room.name = hostile));
    changed.locations.forEach((location) => (location.room = hostile));
    changed.labels.forEach((label) => (label.name = hostile));
    changed.classes.forEach((c) => (c.name = hostile));
    changed.views.forEach((view) => Object.assign(view, { photograph: hostile, room: hostile }));
    const { votes } = changed.votes[0];
    votes.disputed_patches.forEach((patch) => (patch.labels = [hostile, hostile]));
    votes.disputing_classes.forEach((pair) => (pair.classes = [hostile, hostile]));
    [...votes.classes, ...votes.rooms].forEach((part) => (part.name = hostile));
    write("index", changed);
    rmSync(join(folder, "data/views_0.js"));
  };
  await withCopy(hostileIndex, async (folder) => {
    const { page, faults, close } = await open(browser, folder, "#/notes");
    assert.equal(await page.locator("header .title").textContent(), hostile);
    // The badge counts the damage alone, and its name says so. A name keeps its direction to itself.
    assert.equal(await page.locator(".badge").textContent(), "1 (1 file missing or damaged)");
    assert.equal(await page.locator("header .title > bdi").textContent(), hostile);
    assert.equal(await page.locator("code").first().textContent(), hostile);
    // A warning links to its place.
    const warnings = page.locator("section", { hasText: "Warnings of the export" }).locator("li");
    assert.equal(await warnings.nth(1).textContent(), hostile);
    assert.equal(await warnings.nth(0).locator("a").getAttribute("href"), `#/pano/1/${uuid}`);
    for (const hash of ["#/pano", "#/views", "#/plan", "#/numbers"]) {
      await go(page, hash);
      assert.equal(await page.locator("#place script, #place img[src=x]").count(), 0, hash);
      assert.ok((await page.locator("#place").innerText()).includes("<script>"), hash);
    }
    assert.deepEqual(faults, []);
    await go(page, "#/view/0");
    assert.match(await page.locator("[role=alert]").textContent(), /data\/views_0\.js cannot be read/);
    await close();
  });
});

test("the page runs its own program alone, and takes its data from its own folder", async () => {
  const inject = (_, folder) => {
    const file = join(folder, "index.html");
    const foreign = `<base href="https://example.org/"><script>document.title = "foreign"</script>`;
    writeFileSync(file, readFileSync(file, "utf8").replace("<!-- data -->", foreign));
  };
  await withCopy(inject, async (folder) => {
    const { page, faults, close } = await open(browser, folder, "#/notes");
    assert.match(await page.title(), /^Notes · /);
    assert.ok(
      faults.length >= 2 && faults.every((words) => /Content.Security.Policy/i.test(words)),
      faults[0],
    );
    await close();
  });
});

for (const [form, place] of [
  ["a folder", bare],
  ["one file", bare && `${bare}.html`],
]) {
  test(
    `without labels the page is the same without what needs them, from ${form}`,
    { skip: place ? false : "S3D_BARE_REPORT is not set" },
    async () => {
      const { page, faults, close } = await open(browser, place, "#/pano");
      const sides = await page.getByLabel("Right of the line").locator("option").allTextContents();
      assert.deepEqual(sides, ["Colour", "Depth", "Normals"]);
      const box = await page.locator(".viewer canvas").boundingBox();
      await page.mouse.move(box.x + box.width * 0.3, box.y + box.height * 0.7);
      const told = await readout(page);
      assert.ok(told.class === undefined && told["X Y Z"] !== undefined, JSON.stringify(told));
      for (const hash of ["#/space/1", "#/views", "#/view/0", "#/plan", "#/numbers", "#/notes"]) {
        await go(page, hash);
        assert.equal(await page.locator("[role=alert]").count(), 0, hash);
        assert.ok(!/undefined|NaN|null/.test(await page.locator("main").innerText()), hash);
      }
      assert.equal(await page.getByLabel("Class", { exact: true }).count(), 0);
      assert.deepEqual(faults, []);
      await close();
    },
  );
}
