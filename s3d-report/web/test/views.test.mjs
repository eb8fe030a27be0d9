// The grid of views, and a view, compared with the data set. Each test fails on any error of the console,
// and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { launch, open, ready } from "./lib/browser.mjs";
import { dataset, holdView, index, json, report } from "./lib/common.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test("the grid is sorted and filtered, and a view opens large", async () => {
  const { page, faults, close } = await open(browser, report, "#/views");
  const total = async () => Number((await page.locator("[role=status]").textContent()).split(" ")[0]);
  const files = readdirSync(join(dataset, "area_1/data/rgb"));
  assert.equal(await total(), files.length);
  const room = index.locations.find((l) => l.pano).room;
  await page.getByLabel("Room", { exact: true }).selectOption(`1/${room}`);
  assert.equal(await total(), files.filter((name) => name.includes(`_${room}_frame_`)).length);
  await page.getByLabel("Room", { exact: true }).selectOption("");

  const { uuid } = index.locations[1];
  await page.getByLabel("Scan location").selectOption("1");
  assert.equal(await total(), files.filter((name) => name.includes(`_${uuid}_`)).length);
  await page.getByLabel("Scan location").selectOption("");
  await page.getByLabel("Sort by").selectOption("room");
  const rooms = [...new Set(index.locations.map((l) => l.room))].sort();
  const words = (name) =>
    name
      .replace(/([a-z])([A-Z])/g, "$1 $2")
      .replaceAll("_", " ")
      .toLowerCase();
  assert.equal(await page.locator(".card-name").first().textContent(), words(rooms[0]));

  await page.getByLabel("Sort by").selectOption("entropy");
  await page.getByLabel("Order").selectOption("up");
  const kept = json("area_1/views.json").filter((view) => view.frame_num !== null);
  const lowest = Math.min(...kept.map((view) => view.entropy));
  assert.match(await page.locator(".card").first().textContent(), new RegExp(`entropy ${lowest.toFixed(2)}`));
  await page.getByText("Filter by numbers").click();
  await page.getByLabel("Entropy, at least").fill("1.2");
  assert.equal(
    await total(),
    index.views.filter((view) => view.picture !== null && view.entropy >= 1.2).length,
  );
  await page.getByLabel("Entropy, at least").fill("");
  await page.getByLabel("Which views").selectOption("dropped");
  assert.equal(await total(), json("area_1/views.json").length - kept.length);
  await page.getByLabel("Which views").selectOption("pictures");
  // The filter is in the address.
  await page.getByLabel("Class", { exact: true }).selectOption({ label: "chair" });
  const chairs = await total();
  await page.getByLabel("Sort by").selectOption("share");
  await page.getByLabel("Order").selectOption("");
  const chair = index.classes.findIndex((c) => c.name === "chair");
  const shareOf = (view) => view.seen.classes.find(([c]) => c === chair)?.[1] ?? 0;
  const most = index.views.filter((v) => v.picture !== null).sort((a, b) => shareOf(b) - shareOf(a))[0];
  const first = await page.locator(".card a").first().getAttribute("href");
  assert.equal(shareOf(index.views.find((v) => v.picture === Number(first.split("/")[2]))), shareOf(most));
  const link = await page.evaluate(() => window.location.href);
  assert.ok(chairs > 0 && chairs < files.length && link.includes("class="));
  await page.reload();
  await ready(page);
  assert.equal(await total(), chairs);

  await page.locator(".card a").first().click();
  await page.waitForSelector(".viewer canvas");
  await ready(page);
  const at = Number((await page.evaluate(() => window.location.hash)).split("?")[0].split("/")[2]);
  await holdView(
    page,
    index.views.find((view) => view.picture === at),
  );
  assert.match(await page.locator("aside").textContent(), /Kept: its entropy is number \d+ of \d+/);
  assert.deepEqual(faults, []);
  await close();
});
