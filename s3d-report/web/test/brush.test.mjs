// Histograms that filter, dropped views, and the plan as a file. Each test fails on any error of the
// console, and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { isFirefox, launch, open } from "./lib/browser.mjs";
import { bundled } from "./lib/bundled.mjs";
import { index, queryOf, report } from "./lib/common.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test("a drag over a histogram filters, and a click lifts the filter", async () => {
  const { page, faults, close } = await open(browser, report, "#/views");
  await page.getByText("Filter by numbers").click();
  const chart = page.locator(".range", { hasText: "Entropy" });
  await chart.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await chart.locator("svg").boundingBox();
  const drag = async (from, to) => {
    await page.mouse.move(x + from * width, y + height / 2);
    await page.mouse.down();
    await page.mouse.move(x + ((from + to) / 2) * width, y + height / 2);
    await page.mouse.move(x + to * width, y + height / 2);
    await page.mouse.up();
  };
  await drag(0.3, 0.8);
  const query = await queryOf(page);
  const [low, high] = [Number(query.entropy_min), Number(query.entropy_max)];
  const all = index.views.flatMap((view) => view.entropy ?? []);
  const [least, most] = [Math.min(...all), Math.max(...all)];
  const near = (share, value) => Math.abs(least + share * (most - least) - value) < 0.03 * (most - least);
  assert.ok(near(0.3, low) && near(0.8, high), JSON.stringify(query));
  const kept = index.views.filter((v) => v.picture !== null && v.entropy >= low && v.entropy <= high);
  const total = () => page.locator("[role=status]").textContent();
  assert.equal((await total()).split(" ")[0], String(kept.length));
  assert.equal(await page.getByLabel("Entropy, at least").inputValue(), query.entropy_min);
  await drag(0.5, 0.5);
  assert.deepEqual(await queryOf(page), {});
  assert.equal(await page.getByLabel("Entropy, at most").inputValue(), "");
  assert.deepEqual(faults, []);
  await close();
});

test("a dropped view is drawn as its panorama shows it", async () => {
  const { page, faults, close } = await open(browser, report, "#/views?show=dropped&sort=fov");
  const canvases = page.locator(".card canvas");
  assert.ok((await canvases.count()) > 0);
  // Also where the locations of the views alternate. An empty canvas is a short file.
  await page.waitForFunction(() =>
    [...document.querySelectorAll(".card canvas")].every((canvas) => canvas.toDataURL().length > 2500),
  );
  const colors = await canvases
    .first()
    .evaluate((canvas) => [...canvas.getContext("2d").getImageData(0, 0, 128, 128).data]);
  assert.ok(new Set(colors).size > 20, "the picture has one colour");
  assert.match(await page.locator(".card").first().textContent(), /dropped: (lowest entropy|not drawn)/);
  assert.equal(await page.locator(".no-thumb").count(), 0);
  assert.deepEqual(faults, []);
  await close();
});

test("a cut through a panorama looks where the view looks", async () => {
  const { cut } = await bundled("picture/geometry.ts");
  // A panorama whose colours are longitude and latitude.
  const [width, height] = [360, 180];
  const data = new Uint8ClampedArray(4 * width * height);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++)
      data.set([(x * 255) / width, (y * 255) / height, 0, 255], 4 * (y * width + x));
  const pixels = cut({ width, height, data }, 30, 20, 40, 101);
  const at = (x, y) => [...pixels.subarray(4 * (101 * y + x), 4 * (101 * y + x) + 2)];
  const wanted = (lon, lat) => [((lon + 180) / 360) * 255, ((90 - lat) / 180) * 255];
  // Yaw is to the left: 30° of it is 30° left of the middle column.
  at(50, 50).forEach((c, k) => assert.ok(Math.abs(c - wanted(-30, 20)[k]) < 2, `${at(50, 50)}`));
  const [top] = [at(50, 0)];
  assert.ok(Math.abs(top[1] - wanted(-30, 40)[1]) < 2, `${top}`);
});

const noFiles = isFirefox && "Firefox's driver has no downloads";
test("the plan is saved as SVG and as PNG", { skip: noFiles }, async () => {
  const { page, faults, close } = await open(browser, report, "#/plan");
  const saved = async (words) => {
    const arrives = page.waitForEvent("download");
    await page.getByRole("button", { name: words }).click();
    const file = await arrives;
    return { name: file.suggestedFilename(), bytes: readFileSync(await file.path()) };
  };
  const svg = await saved(/Save SVG/);
  assert.equal(svg.name, "demo_Plan_of_area_1.svg");
  const text = svg.bytes.toString();
  assert.match(text, /^<svg xmlns="http:\/\/www.w3.org\/2000\/svg"/);
  // Each location has a dot and, on the ground, a rim.
  assert.equal(text.match(/<circle/g).length, 2 * index.locations.filter((l) => l.position).length);
  assert.ok(!/class=|var\(|style=/.test(text));
  // The ground and its mask are in the file.
  assert.deepEqual(
    [...text.matchAll(/href="(.{16})/g)].map(([, to]) => to),
    ["data:image/png;b", "data:image/jpeg;"],
  );
  const png = PNG.sync.read((await saved(/Save PNG/)).bytes);
  assert.equal(png.width, 2000);
  assert.ok(new Set(png.data).size > 20, "the picture is empty");
  const many = (file) => {
    const colors = new Set();
    for (let at = 0; at < file.data.length; at += 4 * 97) colors.add(file.data.readUInt32BE(at) >> 12);
    return colors.size;
  };
  await page.getByLabel("Mesh from above").uncheck();
  const plain = (await saved(/Save SVG/)).bytes.toString();
  assert.ok(!/href|<mask|<image/.test(plain) && plain.length < text.length / 5);
  // Its letters are the page's, and the file has their font in it.
  assert.equal(plain.match(/@font-face/g).length, 1);
  const alone = await page.context().newPage();
  await alone.goto(`data:image/svg+xml,${encodeURIComponent(plain)}`);
  const fonts = await alone.evaluate(async () => {
    await document.fonts.ready;
    return [...document.fonts].map(({ family, status }) => [family.replaceAll('"', ""), status]);
  });
  assert.deepEqual(fonts, [["IBM Plex Sans", "loaded"]]);
  await alone.close();
  const bare = PNG.sync.read((await saved(/Save PNG/)).bytes);
  assert.ok(many(png) > 5 * many(bare), `${many(png)} colours with the ground, ${many(bare)} without`);
  assert.deepEqual(faults, []);
  await close();
});
