// What hands do: hints of keys and gestures, the flight into a panorama, and areas that are measured.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { drawn, launch, no3d, open, ready } from "./lib/browser.mjs";
import { dataset, index, report } from "./lib/common.mjs";
import { bundled } from "./lib/bundled.mjs";
import { readObj } from "./lib/mesh.mjs";
import { aim, firstFront, onCanvas } from "./lib/rays.mjs";

const { groups } = await bundled("keys.ts");
const { area } = index.meshes[0];

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const hashOf = (page) => page.evaluate(() => window.location.hash);

test("a question mark shows all keys and gestures, unless one writes", async () => {
  const { page, faults, close } = await open(browser, report, "#/numbers");
  const field = page.getByRole("combobox", { name: "Find anything" });
  await field.focus();
  await page.keyboard.type("?");
  assert.equal(await page.locator("dialog").count(), 0);
  assert.equal(await field.inputValue(), "?");
  await page.keyboard.press("Escape");
  await page.keyboard.press("Escape");
  await field.blur();

  await page.keyboard.press("?");
  const dialog = page.getByRole("dialog", { name: "Keys and gestures" });
  await dialog.waitFor();
  const told = await dialog.locator("dd").allTextContents();
  const known = groups.flatMap(([, { gestures = [], acts }]) => [
    ...gestures.map(([, words]) => words),
    ...Object.values(acts).map(({ words }) => words),
  ]);
  assert.deepEqual(told, known);
  // Keys of the page below do nothing meanwhile.
  await page.keyboard.press("/");
  assert.equal(await page.evaluate(() => document.activeElement.closest("dialog") !== null), true);
  const closed = () => page.waitForFunction(() => !document.querySelector("dialog"));
  await page.keyboard.press("Escape");
  await closed();
  await page.getByRole("button", { name: "Keys and gestures" }).click();
  await page.getByRole("button", { name: "Close" }).click();
  await closed();
  assert.deepEqual(faults, []);
  await close();
});

test("a click on a scan location flies into its panorama, or opens it at once", { skip: no3d }, async () => {
  for (const motion of [true, false]) {
    const { page, faults, close } = await open(browser, report, `#/space/${area}`, { motion });
    await page.waitForSelector("[data-loaded=all]");
    // The address of the viewpoint before is the one that Back leads to.
    await page.waitForFunction(() => window.location.hash.includes("from="));
    const before = await hashOf(page);
    const mark = page.locator("a.walk:not([hidden])").first();
    const href = await mark.getAttribute("href");
    const hashes = await page.evaluate(async (to) => {
      const seen = [];
      const watch = setInterval(() => seen.push(window.location.hash), 10);
      document.querySelector(`a.walk[href="${to}"]`).click();
      const now = window.location.hash;
      while (!window.location.hash.startsWith(to)) await new Promise((done) => setTimeout(done, 20));
      clearInterval(watch);
      return { now, seen: seen.filter((hash) => !hash.startsWith(to)) };
    }, href);
    if (motion) assert.equal(hashes.now, before);
    else assert.equal(hashes.now, href);
    assert.ok(
      hashes.seen.every((hash) => hash === before),
      "the address does not follow the flight",
    );
    await page.waitForSelector(".viewer:not(.space) canvas");
    await page.goBack();
    await ready(page);
    await page.waitForSelector(".viewer.space canvas");
    assert.equal(await hashOf(page), before);
    assert.deepEqual(faults, []);
    await close();
  }
});

test("an area is that between the places of the mesh that were clicked", { skip: no3d }, async () => {
  const mesh = readObj(`${dataset}/area_${area}/3d/rgb.obj`);
  const [x, y, z] = index.locations.find((l) => l.area === area && l.position).position;
  // Straight enough from above for the floor to be seen.
  const stand = { from: [x, y, z], at: [x + 0.6, y, z - 1] };
  const words = (point) => point.map((c) => c.toFixed(3)).join(",");
  const hash = `#/space/${area}?at=${words(stand.at)}&from=${words(stand.from)}&marks=&section=none`;
  const { page, faults, close } = await open(browser, report, hash);
  await page.waitForSelector("[data-loaded=all]");
  const box = await page.locator(".viewer canvas").boundingBox();
  const level = ({ face }) => {
    const [a, b, c] = mesh.faces[face].map((corner) => mesh.vertices[corner][2]);
    return Math.abs(a - b) + Math.abs(b - c) < 1e-6;
  };
  const found = [];
  for (const row of [0.35, 0.5, 0.65, 0.8])
    for (const column of [0.25, 0.35, 0.45, 0.55, 0.65, 0.75]) {
      const { x: px, y: py, ray } = aim(box, stand, [column, row]);
      const hit = firstFront(mesh, stand.from, ray);
      if (hit?.clear && level(hit) && (await onCanvas(page, px, py)))
        found.push({ x: px, y: py, row, column, point: hit.point });
    }
  const height = found.map(({ point }) => point[2]).sort((a, b) => a - b)[found.length >> 1];
  const floor = found.filter(({ point }) => Math.abs(point[2] - height) < 1e-4);
  const [low, high] = [floor[0].row, floor.at(-1).row];
  const ends = (row) => floor.filter((place) => place.row === row);
  const corners = [ends(low)[0], ends(low).at(-1), ends(high).at(-1), ends(high)[0]];
  assert.ok(new Set(corners).size === 4, `${floor.length} places on the floor`);

  const chip = page.locator(".chip[role=status]");
  await page.getByRole("button", { name: "Area", exact: true }).click();
  for (const corner of corners) await page.mouse.click(corner.x, corner.y);
  const twice = corners.reduce((sum, { point: a }, i) => {
    const b = corners[(i + 1) % 4].point;
    return sum + a[0] * b[1] - a[1] * b[0];
  }, 0);
  const told = Number.parseFloat(await chip.textContent());
  assert.ok(told > 0.1 && Math.abs(told - Math.abs(twice) / 2) < 0.02 * told, `${told} and ${twice / 2} m²`);
  await drawn(page);
  assert.equal(await page.locator(".measure line").count(), 4);
  await page.keyboard.press("Backspace");
  await drawn(page);
  assert.equal(await page.locator(".measure-end").count(), 3);
  await page.keyboard.press("Escape");
  assert.equal(await chip.textContent(), "");
  assert.deepEqual(faults, []);
  await close();
});
