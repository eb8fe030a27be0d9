// What is shown before all is there, in the order in which it comes; no test asks how fast the machine is.
// And the colours and borders of panoramas, which are sharper than their smaller images.

import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { USUAL, isFirefox, launch, open } from "../lib/browser.mjs";
import { index, report, withCopy } from "../lib/common.mjs";
import { writeLarge } from "../lib/large.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const marksOf = (page) =>
  page.evaluate(() =>
    Object.fromEntries(
      [...performance.getEntriesByType("mark"), ...performance.getEntriesByType("paint")].map(
        ({ name, startTime }) => [name, startTime],
      ),
    ),
  );

/**
 * A report whose file waits before it gives its data: a picture of the page is taken meanwhile. `use` gets
 * the page, and a call that lets the file go on.
 */
async function withSlow(key, hash, use, from = report) {
  await withCopy(
    (_, folder) => {
      const path = join(folder, `data/${key}.js`);
      // What the file says comes when the test says so. The page takes it for a file that is still read.
      const text = readFileSync(path, "utf8").trim();
      writeFileSync(
        path,
        `const s=document.currentScript,l=s.onload;s.onload=null;window.goOn=()=>{${text}l()};`,
      );
    },
    async (folder) => {
      const opened = open(browser, folder, hash, { ...USUAL, waits: false });
      const { page, faults, close } = await opened;
      await page.waitForFunction(() => "goOn" in window);
      await use(page);
      await page.evaluate(() => window.goOn());
      await page.waitForSelector("body[data-ready]");
      assert.deepEqual(faults, []);
      await close();
    },
    from,
  );
}

test("tabs and outline are there before the index", async () => {
  for (const [hash, tab] of [
    ["", "Overview"],
    ["#/pano", "Panoramas"],
    ["#/plan", "Plan"],
    ["#/numbers", "Numbers"],
  ])
    await withSlow("index", hash, async (page) => {
      assert.equal(await page.locator("header .title").textContent(), index.data_set.name);
      assert.equal(await page.locator("nav a[aria-current]").textContent(), tab);
      assert.equal(await page.locator("main[aria-busy]").count(), 1);
      const outlines = await page.locator(".sketch path.room").count();
      assert.equal(outlines, tab === "Numbers" ? 0 : 1);
      const tabs = await page.locator("nav a").allTextContents();
      assert.deepEqual(tabs, ["Overview", "Panoramas", "3D", "Views", "Plan", "Numbers", "Notes"]);
      if (outlines === 0) return;
      // The rooms are on the screen.
      const png = PNG.sync.read(await page.locator(".sketch .plan").screenshot());
      const colors = new Set(
        Array.from({ length: png.width * png.height }, (_, i) => png.data.readUInt32BE(4 * i)),
      );
      assert.ok(colors.size > 2, `${colors.size} colours`);
    });
});

test("what is shown first is painted before the index is read, also if it is large", async () => {
  const folder = mkdtempSync(join(tmpdir(), "s3d-report-first-"));
  try {
    writeLarge(report, folder);
    for (const from of [report, folder]) {
      const { page, faults, close } = await open(browser, from, "#/pano");
      const marks = await marksOf(page);
      const order = ["sketched", "read", "sighted", "shown"].map((name) => marks[name]);
      assert.ok(
        order.every((time, i) => time > (order[i - 1] ?? 0)),
        JSON.stringify(marks),
      );
      // The compositor tells when it showed the first words; reading the large index takes longer than that.
      if (!isFirefox && from === folder)
        assert.ok(marks["first-contentful-paint"] < marks.read, JSON.stringify(marks));
      assert.deepEqual(faults, []);
      await close();
    }
  } finally {
    rmSync(folder, { recursive: true });
  }
});

test("a panorama and a view are small at first, and look in the same direction", async () => {
  const at = index.locations.findIndex((l) => l.pano);
  const { uuid, area } = index.locations[at];
  const shots = [];
  await withSlow(
    `pano_${at}`,
    `#/pano/${area}/${uuid}?lon=75&lat=-10&fov=80&left=rgb&right=rgb`,
    async (page) => {
      assert.equal(await page.locator("main[aria-busy] .viewer canvas").count(), 1);
      shots.push(PNG.sync.read(await page.locator(".viewer .frame").screenshot()));
    },
  );
  const { page, faults, close } = await open(
    browser,
    report,
    `#/pano/${area}/${uuid}?lon=75&lat=-10&fov=80&left=rgb&right=rgb&split=1`,
    USUAL,
  );
  await page.waitForSelector(".viewer[data-sharp]");
  shots.push(PNG.sync.read(await page.locator(".viewer .frame").screenshot()));
  // Means of large squares, away from buttons and the plan.
  const [before, then] = shots;
  let off = 0;
  let places = 0;
  for (let x = 80; x < before.width - 340; x += 80)
    for (let y = 90; y < before.height - 90; y += 60, places++)
      for (let c = 0; c < 3; c++) {
        const mean = (png) => {
          let sum = 0;
          for (let i = 0; i < 40; i++)
            for (let j = 0; j < 40; j++) sum += png.data[4 * ((y + j) * png.width + x + i) + c];
          return sum / 1600;
        };
        off += Math.abs(mean(before) - mean(then)) / 3;
      }
  assert.ok(places > 50 && off / places < 8, `${off / places} levels at ${places} places`);
  assert.deepEqual(faults, []);
  await close();

  const { picture } = index.views.find((view) => view.picture !== null);
  await withSlow("views_0", `#/view/${picture}`, async (page) => {
    const size = await page.locator("main[aria-busy] .frame img").evaluate((img) => img.naturalWidth);
    assert.ok(size > 16);
  });
});
