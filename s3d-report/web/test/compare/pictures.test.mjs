// Images of two data sets beside each other. Each test fails on any error of the console, and on any request
// that leaves the report's folder.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { drawn, go, launch, open, readout, ready } from "../lib/browser.mjs";
import { classOf } from "../lib/changes.mjs";
import { degrees, near, panoramaPixel, queryOf } from "../lib/common.mjs";
import { report, index, compare, mostChanged, pictureOf, samples, words, colorsAt } from "./shared.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test("a changed view shows A and B, and tells both", async () => {
  const { k, own } = mostChanged("data");
  const { size } = pictureOf(k);
  const link = (modality, split) => `#/compare/${k}?modality=${modality}&split=${split}`;
  const { page, faults, close } = await open(browser, report, link("changed", 0.5));
  const shot = async (modality, split) => {
    await go(page, link(modality, split));
    await drawn(page);
    return PNG.sync.read(await page.screenshot());
  };
  const shots = {
    rgb: await shot("rgb", 1),
    a: await shot("class", 1),
    b: await shot("class", 0),
    changed: await shot("changed", 0.5),
  };
  const box = await page.locator(".viewer canvas").boundingBox();
  const line = box.x + box.width / 2;
  const held = { none: 0, renumbered: 0, instance: 0, class: 0 };
  for (const { i, j, a, b, kind } of samples(own, size, 30)) {
    const at = [
      Math.round(box.x + ((i + 0.5) / size[0]) * box.width),
      Math.round(box.y + ((j + 0.5) / size[1]) * box.height),
    ];
    const isCanvas = ([x, y]) => document.elementFromPoint(x, y)?.tagName === "CANVAS";
    // The line and its grip lie over the picture, and so do the names of A and B.
    if (!(await page.evaluate(isCanvas, at)) || Math.abs(at[0] - line) < 16 || at[1] < box.y + 60) continue;
    await page.mouse.move(...at);
    const told = await readout(page);
    assert.equal(told.pixel, `${i},${j}`);
    assert.equal(told.A, words(a));
    assert.equal(told.B, words(b));
    const seen = colorsAt(shots.rgb, at);
    [
      [shots.a, a],
      [shots.b, b],
    ].forEach(([png, name]) => {
      const color = index.classes.find((c) => c.name === classOf(name))?.color ?? [128, 128, 128];
      colorsAt(png, at).forEach((c, n) => near(c, 0.7 * color[n] + 0.3 * seen[n], 4, `${name} at ${at}`));
    });
    const shown = colorsAt(shots.changed, at);
    const flat = { class: [255, 0, 255], instance: [255, 190, 40] }[kind];
    if (flat) shown.forEach((c, n) => near(c, 0.75 * flat[n] + 0.25 * seen[n], 4, `changed at ${at}`));
    else {
      const light = 0.2126 * seen[0] + 0.7152 * seen[1] + 0.0722 * seen[2];
      shown.forEach((c, n) => near(c, 0.25 * light + 0.25 * seen[n], 4, `dimmed at ${at}`));
    }
    held[kind] += 1;
  }
  assert.ok(held.class >= 5 && held.none >= 10, JSON.stringify(held));
  assert.deepEqual(faults, []);
  await close();
});

test("a changed panorama turns, and tells both", async () => {
  const { k, own } = mostChanged("pano");
  const { size } = pictureOf(k);
  const { page, faults, close } = await open(browser, report, `#/compare/${k}`);
  const box = await page.locator(".viewer canvas").boundingBox();
  // The panorama is turned to pixels of another class. The address follows the first key.
  await page.locator(".viewer canvas").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction(() => location.hash.includes("lon="));
  const query = await queryOf(page);
  const first = panoramaPixel(
    own[0],
    { lon: query.lon * degrees, lat: query.lat * degrees, fov: query.fov * degrees },
    box,
    [box.x + box.width / 2, box.y + box.height / 2],
    size,
  );
  const nearest = samples(own, size, 4000)
    .filter(({ kind }) => kind === "class")
    .map(({ i, j }) => Math.hypot(i + 0.5 - first[0], j + 0.5 - first[1]));
  assert.ok(Math.min(...nearest) < size[0] / 30, `${Math.min(...nearest)} pixels away`);
  const held = { none: 0, renumbered: 0, instance: 0, class: 0 };
  for (const { i, j, a, b, kind } of samples(own, size, 8)) {
    const [lon, lat] = [360 * ((i + 0.5) / size[0] - 0.5), 180 * (0.5 - (j + 0.5) / size[1])];
    await go(
      page,
      `#/compare/${k}?modality=instance&split=0.1&lon=${lon.toFixed(2)}&lat=${lat.toFixed(2)}&fov=40`,
    );
    await page.mouse.move(box.x + box.width / 2 + 1, box.y + box.height / 2 + 1);
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    const told = await readout(page);
    const apart = told.pixel.split(",").map((c, n) => Math.abs(Number(c) - [i, j][n]));
    assert.ok(Math.max(...apart) <= 1, `${told.pixel} and ${i},${j}`);
    assert.deepEqual([told.A, told.B], [words(a), words(b)]);
    held[kind] += 1;
  }
  assert.ok(held.class >= 4 && held.none >= 4 && held.renumbered >= 4, JSON.stringify(held));
  // By the keyboard.
  const before = await queryOf(page);
  await page.locator(".viewer canvas").focus();
  await page.keyboard.press("ArrowRight");
  near(Number((await queryOf(page)).lon) - Number(before.lon), 40 / 12, 0.2, "a turn");
  assert.deepEqual(faults, []);
  await close();
});

test("the line moves, its place is in the link, and one goes from image to image", async () => {
  const { page, faults, close } = await open(browser, report, "#/compare");
  await page.locator(".card a").nth(1).click();
  await page.waitForSelector(".viewer canvas");
  await ready(page);
  const line = page.locator(".split");
  await line.focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowRight");
  assert.equal(await line.getAttribute("aria-valuetext"), "A on 2 %, B on the rest");
  const box = await page.locator(".viewer canvas").boundingBox();
  const grip = await line.boundingBox();
  await page.mouse.move(grip.x + grip.width / 2, grip.y + grip.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.75 * box.width, box.y + box.height / 2, { steps: 3 });
  await page.mouse.up();
  near(Number((await queryOf(page)).split), 0.75, 0.01, "the line");
  await page.getByLabel("What of both is shown").selectOption("instance");
  const query = await queryOf(page);
  assert.equal(query.modality, "instance");
  await page.reload();
  await ready(page);
  assert.deepEqual(await queryOf(page), query);
  assert.equal(await page.getByLabel("What of both is shown").inputValue(), "instance");
  near(Number(await line.getAttribute("aria-valuenow")), 100 * query.split, 1, "the line");
  const name = await page.locator("h1").textContent();
  await page.getByLabel("Image that differs less").click();
  await page.waitForFunction((was) => document.querySelector("h1").textContent !== was, name);
  assert.equal((await queryOf(page)).modality, "instance");
  await page.getByLabel("Image that differs more").click();
  await page.waitForFunction((was) => document.querySelector("h1").textContent === was, name);
  await go(page, "#/compare/9999");
  assert.match(await page.locator("[role=alert]").textContent(), /not among those that differ/);
  assert.deepEqual(faults, []);
  await close();
});
