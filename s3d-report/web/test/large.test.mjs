// A report as large as for the published data set: every page of it opens, and takes less than 1 GB; its grid shows a part
// at a time. How long each takes is printed. Each test fails on any error of the console, and on any request that leaves
// the report's folder.

import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { drawn, go, isFirefox, launch, open } from "./lib/browser.mjs";
import { report } from "./lib/common.mjs";
import { writeLarge } from "./lib/large.mjs";

let [browser, folder, index] = [];
before(async () => {
  folder = mkdtempSync(join(tmpdir(), "s3d-report-large-"));
  index = writeLarge(report, folder);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true });
});

/** The memory of all processes that this one started, in bytes; shared memory counts once. */
function memory() {
  const parents = new Map();
  for (const pid of readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const stat = readFileSync(`/proc/${pid}/stat`, "utf8");
      parents.set(pid, stat.slice(stat.lastIndexOf(")") + 2).split(" ")[1]);
    } catch {
      // It has ended meanwhile.
    }
  }
  const isMine = (pid) => pid !== undefined && (pid === String(process.pid) || isMine(parents.get(pid)));
  let sum = 0;
  for (const pid of parents.keys()) {
    if (pid === String(process.pid) || !isMine(pid)) continue;
    try {
      sum += Number(readFileSync(`/proc/${pid}/smaps_rollup`, "utf8").match(/^Pss: +(\d+)/m)[1]) * 1024;
    } catch {
      // Likewise.
    }
  }
  return sum;
}

const GB = 1e9;
test("a report of 1,413 locations opens in less than 1 GB", async (t) => {
  const empty = memory();
  assert.equal(index.locations.length, 1413);
  const { page, faults, close } = await open(browser, folder, "#/pano");
  const opened = await page.evaluate(() => performance.getEntriesByName("shown")[0].startTime);
  t.diagnostic(`opened in ${Math.round(opened)} ms`);
  let most = memory();
  for (const hash of ["#/views", "#/plan", "#/numbers", "#/notes", "#/pano"]) {
    const start = Date.now();
    await go(page, hash);
    t.diagnostic(`${hash} in ${Date.now() - start} ms, ${Math.round(memory() / 1e6)} MB`);
    most = Math.max(most, memory());
  }
  t.diagnostic(
    `${Math.round(most / 1e6)} MB at most, of which the empty browser has ${Math.round(empty / 1e6)} MB`,
  );
  // An empty Firefox takes half of that where it draws without a graphics card.
  assert.ok(most - (isFirefox ? empty : 0) < GB, `${most} bytes`);
  assert.deepEqual(faults, []);
  await close();
});

test("the grid of 101,736 candidates is shown in parts, and its list of locations is searched", async (t) => {
  const { page, faults, close } = await open(browser, folder, "#/views");
  const timed = async (words, act) => {
    const start = Date.now();
    await act();
    await drawn(page);
    t.diagnostic(`${words} in ${Date.now() - start} ms`);
  };
  const total = async () =>
    Number((await page.locator("[role=status]").textContent()).split(" ")[0].replaceAll(",", ""));
  assert.equal(await total(), index.views.filter((view) => view.frame !== null).length);
  assert.equal(await page.locator(".card").count(), 60);
  await timed("sorted", () => page.getByLabel("Sort by").selectOption("entropy"));
  const highest = index.views.reduce(
    (most, view) => (view.frame === null ? most : Math.max(most, view.entropy)),
    0,
  );
  const first = await page.locator(".card").first().textContent();
  assert.ok(first.includes(`entropy ${highest.toFixed(2)}`), first);
  const at = 700;
  const uuid = index.locations[at].uuid.slice(0, 8);
  const field = page.getByLabel("Scan location");
  const name = await page
    .locator("datalist option")
    .evaluateAll((all, part) => all.find((o) => o.value.includes(part)).value, uuid);
  await timed("one location", () => field.fill(name));
  const there = index.views.filter((view) => view.location === at && view.frame !== null);
  assert.equal(await total(), there.length);
  assert.match(await page.evaluate(() => window.location.hash), /location=700/);
  await timed("all locations", () => field.fill("All locations"));
  await page.evaluate(() => window.scrollTo(0, document.body.scrollHeight));
  await page.waitForFunction(() => document.querySelectorAll(".card").length === 120);
  assert.deepEqual(faults, []);
  await close();
});

test("the plan has every location, and one is entered from it", async () => {
  const { page, faults, close } = await open(browser, folder, "#/plan");
  assert.equal(await page.locator("svg.plan").count(), 6);
  assert.equal(await page.locator("svg.plan a .stand").count(), 1413);
  const at = 2;
  const link = page.locator(`a[href="#/pano/1/${index.locations[at].uuid}"]`);
  await link.focus();
  const kept = index.views.filter((view) => view.location === at && view.frame !== null).length;
  assert.equal(await page.locator(".cone").count(), kept);
  await page.keyboard.press("Enter");
  await page.waitForSelector(".viewer canvas");
  assert.deepEqual(faults, []);
  await close();
});
