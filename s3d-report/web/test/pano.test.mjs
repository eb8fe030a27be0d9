// Panoramas in a browser, opened from the disk and compared with the data set. Each test fails on any error
// of the console, and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { go, launch, open, readout } from "./lib/browser.mjs";
import { degrees, holdPanorama, index, near, queryOf, report, spread } from "./lib/common.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test("the panorama tells what is under the pointer, and is dragged and zoomed", async () => {
  const at = index.locations.findIndex((l) => l.pano);
  const { uuid, area } = index.locations[at];
  const { page, faults, close } = await open(
    browser,
    report,
    `#/pano/${area}/${uuid}?lon=40&lat=-12&fov=80&left=rgb&right=class&split=0.5`,
  );
  const canvas = page.locator(".viewer canvas");
  const box = await canvas.boundingBox();
  const middle = [box.x + box.width * 0.3, box.y + box.height * 0.6];
  // The page writes the address from the first change on.
  await page.mouse.move(...middle);
  await page.mouse.down();
  await page.mouse.move(middle[0] + 120, middle[1] + 40, { steps: 4 });
  await page.mouse.up();
  let query = await queryOf(page);
  const f = box.width / 2 / Math.tan(40 * degrees);
  near(Number(query.lon), 40 - 120 / f / degrees, 0.11, "longitude after a drag");
  near(Number(query.lat), -12 + 40 / f / degrees, 0.11, "latitude after a drag");
  await page.mouse.wheel(0, 300);
  query = await queryOf(page);
  near(Number(query.fov), 80 * Math.exp(1 / 3), 0.11, "angle of view after the wheel");
  // Whole degrees, so that the address is exact.
  await go(page, `#/pano/${area}/${uuid}?lon=75&lat=-10&fov=80&left=rgb&right=class&split=0.5`);
  await holdPanorama(page, at, async ([x, y]) => {
    await page.mouse.move(x, y);
    return page.evaluate(([px, py]) => document.elementFromPoint(px, py)?.tagName === "CANVAS", [x, y]);
  });
  await canvas.focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("+");
  query = await queryOf(page);
  near(Number(query.lon), 75 + 80 / 12, 0.11, "longitude after a key");
  near(Number(query.fov), 80 / 1.2, 0.11, "angle of view after a key");
  assert.deepEqual(faults, []);
  await close();
});

test("the line between two modalities moves, and each side shows its own", async () => {
  const at = index.locations.findIndex((l) => l.pano);
  const { uuid, area } = index.locations[at];
  const { page, faults, close } = await open(
    browser,
    report,
    `#/pano/${area}/${uuid}?lon=75&lat=-10&fov=80&left=rgb&right=class&split=0.5`,
  );
  const canvas = page.locator(".viewer canvas");
  const box = await canvas.boundingBox();
  const line = page.locator(".split");
  const shot = async () => PNG.sync.read(await page.screenshot());
  const colorAt = (png, [x, y]) =>
    Array.from(png.data.subarray(4 * (y * png.width + x), 4 * (y * png.width + x) + 3));
  const drag = async (share) => {
    const handle = await line.boundingBox();
    // At an end, half of the handle is hidden.
    const x = Math.min(Math.max(handle.x + handle.width / 2, box.x + 4), box.x + box.width - 4);
    await page.mouse.move(x, handle.y + handle.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + share * box.width, box.y + box.height / 2, { steps: 3 });
    await page.mouse.up();
    await page.waitForTimeout(200);
    near(Number(await line.getAttribute("aria-valuenow")), 100 * share, 1, "the line");
  };
  await drag(1);
  const colors = await shot();
  await drag(0);
  const classes = await shot();
  let held = 0;
  for (const [x, y] of spread(20, box)) {
    await page.mouse.move(x, y);
    if (!(await page.evaluate(([px, py]) => document.elementFromPoint(px, py)?.tagName === "CANVAS", [x, y])))
      continue;
    const told = await readout(page);
    const flat = index.classes.find((c) => c.name === told.class)?.color;
    if (!flat) continue;
    const [seen, shown] = [colorAt(colors, [x, y]), colorAt(classes, [x, y])];
    // The picture of classes mixes in a little of the colours, so that shapes can be made out.
    shown.forEach((c, k) => near(c, 0.7 * flat[k] + 0.3 * seen[k], 3, `${told.class} at ${x}, ${y}`));
    held += 1;
  }
  assert.ok(held >= 15, `${held} places were held`);
  await line.focus();
  await page.keyboard.press("End");
  assert.equal(await line.getAttribute("aria-valuenow"), "100");
  await page.keyboard.press("ArrowLeft");
  assert.equal(await line.getAttribute("aria-valuenow"), "98");
  await page.getByLabel("Left of the line").selectOption("depth");
  assert.equal((await queryOf(page)).left, "depth");
  assert.deepEqual(faults, []);
  await close();
});

test("neighbours are walked to", async () => {
  const { page, faults, close } = await open(browser, report, "#/pano");
  let walked = false;
  for (const location of index.locations.filter((l) => l.pano)) {
    for (const lon of [0, 90, 180, -90]) {
      await go(page, `#/pano/${location.area}/${location.uuid}?lon=${lon}&lat=0&fov=100`);
      const marks = page.locator(".walk:visible");
      if ((await marks.count()) === 0) continue;
      const words = await marks.first().getAttribute("aria-label");
      const was = await page.getAttribute("body", "data-ready");
      await marks.first().focus();
      await page.keyboard.press("Enter");
      await page.waitForFunction((before) => document.body.dataset.ready !== before, was);
      const uuid = (await page.evaluate(() => window.location.hash)).split("?")[0].split("/")[3];
      const to = index.locations.find((l) => l.uuid === uuid);
      const away = Math.hypot(...to.position.map((c, k) => c - location.position[k]));
      assert.ok(
        uuid !== location.uuid && words.endsWith(`${away.toFixed(1)} m`),
        `${words}, and it is ${away} m`,
      );
      walked = true;
      break;
    }
    if (walked) break;
  }
  assert.ok(walked, "there are neighbours");
  assert.deepEqual(faults, []);
  await close();
});
