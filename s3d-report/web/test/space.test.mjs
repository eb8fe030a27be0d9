// The mesh in 3D, compared with the data set's own mesh, labels and votes.

import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { deflateSync } from "node:zlib";
import { PNG } from "pngjs";
import { drag, go, launch, open, readout, tap } from "./lib/browser.mjs";
import { bare, dataset, index, json, queryOf, readPicture as readFile, report } from "./lib/common.mjs";
import { readPng } from "./lib/images.mjs";
import { readNpz, readObj } from "./lib/mesh.mjs";
import { aim, firstFront, onCanvas, spread, texturedFaces } from "./lib/rays.mjs";

const writeFile = (folder, key, value) =>
  writeFileSync(
    join(folder, `data/${key}.js`),
    `s3dReport("${key}",${JSON.stringify(JSON.stringify(value))});\n`,
  );
const { area } = index.meshes[0];
const threeD = join(dataset, `area_${area}/3d`);
const mesh = readObj(join(threeD, "rgb.obj"));
const textured = texturedFaces(threeD);
const names = json("assets/semantic_labels.json");
const { label: labels, votes, total, ...second } = readNpz(join(threeD, "votes.npz"));
const { runner_up: runnerUp, runner_up_votes: runnerUpVotes } = second;

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const loaded = (page) => page.waitForSelector("[data-loaded=all]");
const canvasOf = (page) => page.locator(".viewer canvas").boundingBox();
const numbers = (text) => text.split(",").map(Number);
const words = (point) => point.map((c) => c.toFixed(3)).join(",");
const distance = (a, b) => Math.hypot(...a.map((c, k) => c - b[k]));
/** Waits until the address stays the same for a while; it follows the display a little later. */
const settle = (page) =>
  page.evaluate(async () => {
    for (let was = null; was !== window.location.hash;) {
      was = window.location.hash;
      await new Promise((done) => setTimeout(done, 450));
    }
  });

/** The viewpoints: each location, level, in a direction of its own. */
const stands = index.locations
  .filter((location) => location.area === area && location.position)
  .map(({ position }, k) => ({
    from: position.map((c) => Number(c.toFixed(3))),
    at: [Math.cos(1 + 2 * k), Math.sin(1 + 2 * k), -0.25].map((c, axis) =>
      Number((position[axis] + c).toFixed(3)),
    ),
  }));

const linkTo = ({ at, from }, more = "") => `#/space/${area}?at=${words(at)}&from=${words(from)}${more}`;

/** Compares the readout of a face with the data set. */
function hold(told, hit) {
  const where = `face ${hit.face} at ${hit.point}`;
  assert.equal(told.face, String(hit.face), where);
  const label = labels[hit.face];
  assert.equal(told.class, label === 0 ? "unlabelled" : names[label].split("_")[0], where);
  if (label !== 0) {
    assert.equal(told.instance, names[label], where);
    const room = names[label].split("_").slice(2, 4).join(" ");
    assert.equal(told.room.replaceAll(" ", "").toLowerCase(), room.replaceAll(" ", "").toLowerCase(), where);
  }
  const xyz = told["X Y Z"].trim().split(/\s+/).map(Number);
  assert.ok(distance(xyz, hit.point) < 0.01, `${where}: ${xyz}`);
  const lead = total[hit.face] === 0 ? null : (votes[hit.face] - runnerUpVotes[hit.face]) / total[hit.face];
  if (lead === null) assert.equal(told.margin, "no votes", where);
  else if (runnerUp[hit.face] !== 0) {
    assert.ok(Math.abs(Number.parseFloat(told.margin) - 100 * lead) < 1, `${where}: ${told.margin}, ${lead}`);
    assert.equal(told["runner-up"], names[runnerUp[hit.face]], where);
  } else assert.equal(told["runner-up"], undefined, where);
}

test("in 3D, what is under the pointer is what the data set's mesh has there", async () => {
  const { page, faults, close } = await open(browser, report, "#/notes");
  let [held, contested] = [0, 0];
  for (const [k, stand] of stands.entries()) {
    // The second half of the viewpoints has a section.
    const section = k % 2 === 0 ? Infinity : 1.2;
    if (k % 2 === 1) stand.from[2] = 4;
    const more = `&marks=&section=${section === Infinity ? "none" : "1.20"}`;
    await go(page, linkTo(stand, more));
    await loaded(page);
    const box = await canvasOf(page);
    for (const place of spread(16)) {
      const { x, y, ray } = aim(box, stand, place);
      const hit = firstFront(mesh, stand.from, ray, section);
      if (!(await onCanvas(page, x, y)) || (hit && !hit.clear)) continue;
      await page.mouse.move(x, y);
      const told = await readout(page);
      if (!hit) assert.deepEqual(told, { pixel: null }, `${x}, ${y}`);
      else {
        hold(told, hit);
        held += 1;
        contested += runnerUp[hit.face] === 0 ? 0 : 1;
      }
    }
  }
  assert.ok(held >= 40, `${held} places were held`);
  assert.ok(contested >= 1, "a contested face was among them");
  assert.deepEqual(faults, []);
  await close();
});

/** A colour is the other one, darkened by the light of the face. */
const isLit = (shown, flat, what) => {
  const light = shown.reduce((sum, c, k) => sum + c * flat[k], 0) / flat.reduce((sum, c) => sum + c * c, 0);
  assert.ok(light > 0.6 && light < 1.01, `${what}: ${shown} of ${flat}`);
  shown.forEach((c, k) => assert.ok(Math.abs(c - light * flat[k]) <= 2.5, `${what}: ${shown} of ${flat}`));
};

test("each colouring has the colours of the data set", async () => {
  const at = index.locations.findIndex((l) => l.area === area && l.pano);
  const location = index.locations[at];
  const stand = stands[index.locations.filter((l) => l.area === area && l.position).indexOf(location)];
  stand.from = location.position.map((c) => Number(c.toFixed(3)));
  const { page, faults, close } = await open(browser, report, "#/notes");
  const shots = {};
  for (const show of ["texture", "class", "instance", "margin", "unlabelled"]) {
    await go(page, linkTo(stand, `&marks=&section=none&show=${show}`));
    await loaded(page);
    await page.mouse.move(2, 2);
    await settle(page);
    assert.equal(await page.getByLabel("Colours").inputValue(), show);
    shots[show] = PNG.sync.read(await page.screenshot());
  }
  await page.getByLabel("Colours").selectOption("margin");
  const stops = await page.evaluate(() =>
    [...document.querySelector(".ramp").style.background.matchAll(/rgb\((\d+), (\d+), (\d+)\)/g)].map(
      (stop) => stop.slice(1).map(Number),
    ),
  );
  assert.equal(stops.length, 9);
  const box = await canvasOf(page);
  const colorAt = (show, x, y) =>
    Array.from(shots[show].data.subarray(4 * (y * shots[show].width + x)).subarray(0, 3));
  const file = readdirSync(join(dataset, `area_${area}/pano/rgb`)).find((name) =>
    name.includes(location.uuid),
  );
  const pano = readPng(join(dataset, `area_${area}/pano/rgb`, file));
  let [held, alike] = [0, 0];
  for (const place of spread(60)) {
    const { x, y, ray } = aim(box, stand, place);
    const hit = firstFront(mesh, stand.from, ray);
    // A pixel shows its middle; where the face is not clear, nothing is compared.
    if (!hit?.clear || hit.edge < 0.08 || !(await onCanvas(page, x, y))) continue;
    const label = index.labels[labels[hit.face]];
    const what = `face ${hit.face}, ${label.name}, at ${x}, ${y}`;
    const of_class = label.class === null ? [128, 128, 128] : index.classes[label.class].color;
    isLit(colorAt("class", x, y), of_class, what);
    isLit(colorAt("instance", x, y), label.class === null ? [128, 128, 128] : label.color, what);
    isLit(colorAt("unlabelled", x, y), label.class === null ? [255, 0, 255] : [209, 209, 209], what);
    const seen = colorAt("texture", x, y);
    const grey = seen[0] * 0.2126 + seen[1] * 0.7152 + seen[2] * 0.0722;
    const lead = total[hit.face] && (votes[hit.face] - runnerUpVotes[hit.face]) / total[hit.face];
    const led = (k) => {
      const [stop, rest] = [Math.floor(8 * lead), (8 * lead) % 1];
      return total[hit.face] === 0 ? 128 : stops[stop][k] * (1 - rest) + (stops[stop + 1]?.[k] ?? 0) * rest;
    };
    colorAt("margin", x, y).forEach((c, k) =>
      assert.ok(Math.abs(c - 0.75 * led(k) - 0.25 * grey) < 7, `${what}: margin ${lead}`),
    );
    // The panorama there shows the same colours, but not as sharp, and without light.
    const azimuth = Math.atan2(ray[1], ray[0]);
    const u = (((location.azimuth_rad - azimuth) / (2 * Math.PI) + 2.5) % 1) * pano.width;
    const v = (0.5 - Math.asin(ray[2]) / Math.PI) * pano.height;
    const own = pano.at(Math.floor(u), Math.floor(v));
    const light = textured[hit.face]
      ? 1
      : (0.2126 * seen[0] + 0.7152 * seen[1] + 0.0722 * seen[2]) /
        Math.max(1, 0.2126 * own[0] + 0.7152 * own[1] + 0.0722 * own[2]);
    const off = Math.max(...own.map((c, k) => Math.abs(light * c - seen[k])));
    if (light > 0.6 && light < 1.05 && off < 25) alike += 1;
    held += 1;
  }
  assert.ok(held >= 25, `${held} places were held`);
  assert.ok(alike >= 0.8 * held, `${alike} of ${held} have the colours of the panorama`);
  assert.deepEqual(faults, []);
  await close();
});

test("a link says what is shown, and follows it", async () => {
  const { page, faults, close } = await open(browser, report, `#/space/${area}`);
  await loaded(page);
  await settle(page);
  const query = await queryOf(page);
  // Without a section in the address, it is just below the ceilings, and they are cut away.
  const ceilings = index.labels.flatMap((label, i) =>
    label.class !== null && index.classes[label.class].name === "ceiling" ? [i] : [],
  );
  const above = mesh.faces.map((corners, f) => {
    const [a, b, c] = corners.map((corner) => mesh.vertices[corner]);
    const sides = [0, 1, 2].map((k) => [b[k] - a[k], c[k] - a[k]]);
    const m2 = Math.hypot(
      sides[0][0] * sides[1][1] - sides[1][0] * sides[0][1],
      sides[1][0] * sides[2][1] - sides[2][0] * sides[1][1],
      sides[2][0] * sides[0][1] - sides[0][0] * sides[2][1],
    );
    return { m2: ceilings.includes(labels[f]) ? m2 : 0, cut: a[2] > Number(query.section) };
  });
  const sum = (which) => above.filter(which).reduce((m2, face) => m2 + face.m2, 0);
  assert.ok(sum(({ cut }) => cut) > 0.85 * sum(() => true) && Number(query.section) > 1.9, query.section);
  assert.equal(query.marks, "rooms,locations");
  const rooms = index.rooms.filter((room) => room.area === area).length;
  assert.equal(await page.locator(".room-name:visible").count(), rooms);
  await page.getByLabel("Colours").selectOption("class");
  await page.getByLabel("Kept views").check();
  await page.getByLabel("Rooms").uncheck();
  const chair = index.classes.findIndex(({ name }) => name === "chair");
  await page.getByLabel("Boxes of instances").selectOption({ label: "Boxes: chair" });
  await page.getByLabel("Cut away what is above").focus();
  await page.keyboard.press("ArrowLeft");
  await settle(page);
  let now = await queryOf(page);
  assert.deepEqual(
    [now.show, now.marks, now.boxes, now.section],
    ["class", "locations,kept", String(chair), (Number(query.section) - 0.01).toFixed(2)],
  );
  assert.equal(await page.locator(".room-name:visible").count(), 0);
  // Arrows turn; plus and minus zoom.
  await page.locator(".viewer canvas").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("+");
  await settle(page);
  const [at, from, was] = [numbers(now.at), numbers(now.from), now];
  now = await queryOf(page);
  const turned = numbers(now.from);
  assert.equal(now.at, was.at);
  assert.ok(Math.abs(distance(at, turned) - distance(at, from) / 1.2) < 0.01, "plus goes closer");
  const angle =
    Math.atan2(turned[1] - at[1], turned[0] - at[0]) - Math.atan2(from[1] - at[1], from[0] - at[0]);
  assert.ok(Math.abs(angle - Math.PI / 24) < 0.001, `an arrow turns by ${angle}`);
  // A drag turns as well, and the address shows the same again.
  const box = await canvasOf(page);
  await page.mouse.move(box.x + box.width * 0.6, box.y + 120);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.5, box.y + 50, { steps: 3 });
  await page.mouse.up();
  await page.mouse.move(2, 2);
  await settle(page);
  await page.evaluate(() => document.activeElement.blur());
  const hash = await page.evaluate(() => window.location.hash);
  assert.notEqual((await queryOf(page)).from, now.from);
  const shot = await page.locator(".viewer canvas").screenshot();
  await go(page, "#/notes");
  await go(page, hash);
  await loaded(page);
  await settle(page);
  const again = await page.locator(".viewer canvas").screenshot();
  const [a, b] = [PNG.sync.read(shot), PNG.sync.read(again)];
  const different = a.data.reduce((sum, c, i) => sum + (Math.abs(c - b.data[i]) > 8 ? 1 : 0), 0);
  assert.ok(different < a.data.length / 200, `${different} of ${a.data.length} numbers differ`);
  assert.deepEqual(faults, []);
  await close();
});

test("boxes and frustums are drawn, and scan locations are entered", async () => {
  const { page, faults, close } = await open(browser, report, `#/space/${area}?marks=`);
  await loaded(page);
  const shot = async () => {
    await page.mouse.move(2, 2);
    await settle(page);
    return PNG.sync.read(await page.locator(".viewer canvas").screenshot());
  };
  let last = await shot();
  const changes = async (what) => {
    const next = await shot();
    const changed = next.data.reduce((sum, c, i) => sum + (Math.abs(c - last.data[i]) > 24 ? 1 : 0), 0);
    assert.ok(changed > 300, `${what} change ${changed} numbers of the picture`);
    last = next;
  };
  for (const mark of ["Rooms", "Kept views", "Dropped views"]) {
    if ((await page.getByLabel(mark).count()) === 0) continue;
    await page.getByLabel(mark).check();
    await changes(mark);
  }
  await page.getByLabel("Boxes of instances").selectOption("all");
  await changes("boxes");
  await page.getByLabel("Boxes of instances").selectOption({ label: "Boxes: table" });
  await changes("fewer boxes");
  assert.equal(await page.locator(".walk:visible").count(), 0);
  await page.getByLabel("Scan locations").check();
  await settle(page);
  const mark = page.locator("a.walk:visible").first();
  const href = await mark.getAttribute("href");
  const was = await page.getAttribute("body", "data-ready");
  await page.evaluate(() => (window.left = document.querySelector(".viewer canvas").getContext("webgl2")));
  await mark.click();
  await page.waitForFunction((before) => document.body.dataset.ready !== before, was);
  assert.ok((await page.evaluate(() => window.location.hash)).startsWith(href));
  assert.ok(await page.evaluate(() => window.left.isContextLost()), "the graphics card has its memory back");
  assert.deepEqual(faults, []);
  await close();
});

test("a disputed patch is flown to, and at rest nothing is drawn", async () => {
  const { page, faults, close } = await open(browser, report, `#/space/${area}`);
  await loaded(page);
  const patches = index.votes.find((v) => v.area === area).votes.disputed_patches;
  const list = page.getByLabel("Disputed patches");
  const listed = (await list.locator("option").allTextContents()).slice(1).map(Number.parseFloat);
  assert.equal(listed.length, patches.length);
  assert.ok(
    listed.every((m2, i) => i === 0 || m2 <= listed[i - 1]),
    "the largest patch is first",
  );
  let seen = 0;
  for (const [i, patch] of patches.slice(0, 6).entries()) {
    await list.selectOption(String(i));
    await page.waitForFunction(
      (to) => new URLSearchParams(window.location.hash.split("?")[1]).get("at") === to,
      words(patch.center),
    );
    await settle(page);
    const { at, from, section } = await queryOf(page);
    // From no place in the floor or below it.
    assert.ok(numbers(from)[2] > 0, from);
    assert.ok(distance(numbers(at), patch.center) < 0.001, `${at} and ${patch.center}`);
    assert.ok(section === "none" || Number(section) > patch.center[2], section);
    const box = await canvasOf(page);
    // The pointer may be there already, and the readout stays empty until it moves.
    await page.mouse.move(box.x + box.width / 2 + 9, box.y + box.height / 2);
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2 + 1);
    const told = await readout(page);
    const xyz = (told["X Y Z"] ?? "").trim().split(/\s+/).map(Number);
    if (distance(xyz, patch.center) < 0.1 + Math.sqrt(patch.m2)) seen += 1;
  }
  assert.ok(seen >= 5, `${seen} of 6 patches are in the middle`);
  const drawn = await page.evaluate(async () => {
    let calls = 0;
    const was = window.requestAnimationFrame;
    window.requestAnimationFrame = (call) => ((calls += 1), was(call));
    await new Promise((done) => setTimeout(done, 700));
    window.requestAnimationFrame = was;
    return calls;
  });
  assert.equal(drawn, 0);
  assert.deepEqual(faults, []);
  await close();
});

test("a line between two clicks is as long as between those places of the mesh", async () => {
  const stand = { from: [...index.locations[0].position], at: [...stands[0].at] };
  const { page, faults, close } = await open(browser, report, linkTo(stand, "&marks=&section=none"));
  await loaded(page);
  const box = await canvasOf(page);
  const ends = [];
  for (const place of spread(40)) {
    const { x, y, ray } = aim(box, stand, place);
    const hit = firstFront(mesh, stand.from, ray);
    if (hit?.clear && (await onCanvas(page, x, y))) ends.push({ x, y, point: hit.point });
  }
  const [a, b] = [ends[0], ends.at(-1)];
  const length = page.locator(".chip[role=status]");
  await page.mouse.click(a.x, a.y);
  assert.equal(await length.textContent(), "", "nothing is measured before the button is on");
  const button = page.getByRole("button", { name: "Measure" });
  await button.click();
  assert.equal(await button.getAttribute("aria-pressed"), "true");
  await page.mouse.click(a.x, a.y);
  await page.mouse.click(b.x, b.y);
  const told = Number.parseFloat(await length.textContent());
  assert.ok(told > 0.3 && Math.abs(told - distance(a.point, b.point)) < 0.01, `${told} m`);
  await page.keyboard.press("Escape");
  assert.equal(await length.textContent(), "");
  assert.equal(await button.getAttribute("aria-pressed"), "false");
  assert.deepEqual(faults, []);
  await close();
});

test("on a phone the 3D view fits, turns by a finger, and a touch reads it", async () => {
  const stand = { from: [...index.locations[0].position], at: [...stands[0].at] };
  const size = { width: 390, height: 844, touch: true };
  const { page, faults, close } = await open(browser, report, linkTo(stand, "&marks=&section=none"), size);
  await loaded(page);
  const box = await canvasOf(page);
  let held = 0;
  for (const place of spread(14)) {
    const { x, y, ray } = aim(box, stand, place);
    const hit = firstFront(mesh, stand.from, ray);
    if (!hit?.clear || !(await onCanvas(page, x, y))) continue;
    await tap(page, x, y);
    hold(await readout(page), hit);
    held += 1;
  }
  assert.ok(held >= 5, `${held} places were held`);
  await drag(page, 120, 220, 400);
  await settle(page);
  const { at, from } = await queryOf(page);
  assert.ok(
    distance(numbers(at), stand.at) < 0.002 && distance(numbers(from), stand.from) > 0.3,
    `${at} ${from}`,
  );
  const wide = await page.evaluate(() => document.scrollingElement.scrollWidth);
  assert.ok(wide <= 390, `it is ${wide} pixels wide`);
  assert.deepEqual(faults, []);
  await close();
});

test("a place is gone to: from a panorama, from Notes, and by the wheel", async () => {
  const location = index.locations.find((l) => l.area === area && l.pano);
  const start = `#/pano/${area}/${location.uuid}?lon=40&lat=-12&fov=80&left=rgb&right=class&split=1`;
  const { page, faults, close } = await open(browser, report, start);
  const xyzOf = async () => (await readout(page))["X Y Z"].trim().split(/\s+/).map(Number);
  let box = await canvasOf(page);
  await page.mouse.click(box.x + box.width * 0.35, box.y + box.height * 0.6);
  const there = await xyzOf();
  const leave = async (link) => {
    const was = await page.getAttribute("body", "data-ready");
    await link.click();
    await page.waitForFunction((before) => document.body.dataset.ready !== before, was);
    await loaded(page);
    await page.mouse.move(2, 2);
    await page.locator(".viewer canvas").focus();
  };
  await leave(page.getByRole("link", { name: "Show in 3D" }));
  box = await canvasOf(page);
  const middle = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(...middle);
  assert.ok(distance(await xyzOf(), there) < 0.05, `${await xyzOf()} and ${there}`);
  assert.ok(await page.locator(".pin").isVisible());
  // The wheel goes to the point under the pointer, and not through it.
  const aside = [box.x + box.width * 0.7, box.y + box.height * 0.75];
  await page.mouse.move(...aside);
  const [target, before_] = [await xyzOf(), Number.parseFloat((await readout(page)).distance)];
  for (let k = 0; k < 4; k++) await page.mouse.wheel(0, -240);
  await settle(page);
  await page.mouse.move(aside[0] + 1, aside[1]);
  await page.mouse.move(...aside);
  const after_ = Number.parseFloat((await readout(page)).distance);
  assert.ok(after_ > 0 && after_ < 0.9 * before_, `${before_} m, then ${after_} m`);
  assert.ok(distance(await xyzOf(), target) < 0.03, `${await xyzOf()} and ${target}`);

  await go(page, "#/notes");
  const patch = index.votes.find((v) => v.area === area).votes.disputed_patches[0];
  await leave(page.locator("main section").getByRole("link", { name: "3D", exact: true }).first());
  assert.equal((await queryOf(page)).at, words(patch.center));
  assert.deepEqual(faults, []);
  await close();
});

/** A copy of the report, changed. */
async function withCopy(change, look) {
  const folder = join(mkdtempSync(join(tmpdir(), "s3d-space-")), "copy");
  try {
    cpSync(report, folder, { recursive: true });
    change(folder);
    await look(folder);
  } finally {
    rmSync(join(folder, ".."), { recursive: true });
  }
}

test("files of the mesh that are missing or damaged are told, and the rest is shown", async () => {
  const change = (folder) => {
    rmSync(join(folder, `data/textures_${area}_0.js`));
    rmSync(join(folder, `data/faces_${area}.js`));
    writeFile(folder, `boxes_${area}`, [{ label: 1, box: [0, 1] }]);
  };
  await withCopy(change, async (folder) => {
    const { page, faults, close } = await open(browser, folder, `#/space/${area}`);
    await loaded(page);
    const told = (await page.locator("[role=alert]").allTextContents()).join("\n");
    for (const key of ["textures", "faces", "boxes"])
      assert.match(told, new RegExp(`data/${key}_${area}`), key);
    const box = await canvasOf(page);
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    const spot = await readout(page);
    assert.ok(spot.face !== undefined && spot.class === undefined, JSON.stringify(spot));
    const part = readFile(report, `mesh_${area}_0`);
    const bad = [
      [{ ...part, position: part.face }, /position has \d+ bytes, and \d+ are needed/],
      [{ ...part, index: "bm8=" }, /index cannot be unpacked/],
      [{ ...part, origin: null }, /origin or step is missing/],
      [{}, /no numbers of vertices/],
    ];
    for (const [value, words_] of bad) {
      writeFile(folder, `mesh_${area}_0`, value);
      await go(page, "#/notes");
      await go(page, `#/space/${area}`);
      await loaded(page);
      const alert = (await page.locator("[role=alert]").allTextContents()).join("\n");
      assert.match(alert, words_);
      assert.match(alert, new RegExp(`data/mesh_${area}_0.js is damaged`));
    }
    // The browsers' own messages about such files.
    const own = /ERR_FILE_NOT_FOUND|Failed to read data from the ReadableStream/;
    assert.deepEqual(
      faults.filter((fault) => !own.test(fault)),
      [],
    );
    await close();
  });
});

test("without textures the vertices have their colours", async () => {
  const own = [200, 40, 120];
  const change = (folder) => {
    const changed = structuredClone(index);
    changed.meshes[0].materials.forEach((material) => (material.texture = null));
    writeFile(folder, "index", changed);
    const part = readFile(report, `mesh_${area}_0`);
    const color = Buffer.from(Array.from({ length: 3 * part.vertices }, (_, i) => own[i % 3]));
    writeFile(folder, `mesh_${area}_0`, { ...part, color: deflateSync(color).toString("base64") });
  };
  await withCopy(change, async (folder) => {
    const stand = { from: [...index.locations[0].position], at: [...stands[0].at] };
    const { page, faults, close } = await open(
      browser,
      folder,
      linkTo(stand, "&show=texture&marks=&section=none"),
    );
    await loaded(page);
    await settle(page);
    const box = await canvasOf(page);
    const shot = PNG.sync.read(await page.screenshot());
    let held = 0;
    for (const place of spread(20)) {
      const { x, y, ray } = aim(box, stand, place);
      if (!firstFront(mesh, stand.from, ray)?.clear || !(await onCanvas(page, x, y))) continue;
      isLit(Array.from(shot.data.subarray(4 * (y * shot.width + x)).subarray(0, 3)), own, `${x}, ${y}`);
      held += 1;
    }
    assert.ok(held >= 8, `${held} places were held`);
    assert.deepEqual(faults, []);
    await close();
  });
});

test("in 3D names are text, a simplified mesh says so, and what cannot be shown is told", async () => {
  const hostile = "<script>alert(1)</script><img src=x onerror=alert(2)> \u202e\"'&amp;";
  const change = (folder) => {
    const changed = structuredClone(index);
    changed.rooms.forEach((room) => (room.name = hostile));
    changed.locations.forEach((location) => (location.room = hostile));
    changed.classes.forEach((c) => (c.name = hostile));
    changed.votes[0].votes.disputed_patches.forEach((patch) => (patch.labels = [hostile, hostile]));
    Object.assign(changed.meshes[0], { shown: 1234, cell_m: 0.025 });
    writeFile(folder, "index", changed);
  };
  await withCopy(change, async (folder) => {
    const { page, faults, close } = await open(browser, folder, `#/space/${area}?show=class&boxes=all`);
    await loaded(page);
    const text = await page.locator("main").innerText();
    assert.ok(text.includes("<script>"));
    assert.match(text, /Simplified: 1,234 of [\d,]+ faces.*2\.5 cm/);
    assert.equal(await page.locator("#place script, #place img").count(), 0);
    await go(page, "#/space/987");
    assert.match(await page.locator("[role=alert]").textContent(), /no such area/);
    await go(page, "#/notes");
    await page.getByText("Licences").click();
    const licences = await page.locator("pre").allTextContents();
    assert.equal(licences.length, 3);
    assert.ok(licences.slice(0, 2).every((licence) => /MIT License/.test(licence)));
    assert.match(licences[2], /IBM Corp[^]*SIL OPEN FONT LICENSE Version 1\.1/);
    await page.evaluate(() => (HTMLCanvasElement.prototype.getContext = () => null));
    await go(page, `#/space/${area}`);
    assert.match(await page.locator("[role=alert]").textContent(), /no WebGL 2/);
    assert.deepEqual(faults, []);
    await close();
  });
});

for (const [form, place] of [
  ["a folder", bare],
  ["one file", bare && `${bare}.html`],
])
  test(
    `without labels the 3D view is the same without what needs them, from ${form}`,
    { skip: place ? false : "S3D_BARE_REPORT is not set" },
    async () => {
      const { page, faults, close } = await open(browser, place, "#/space");
      await loaded(page);
      const box = await canvasOf(page);
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      const told = await readout(page);
      assert.deepEqual(Object.keys(told).sort(), ["X Y Z", "distance", "face", "pixel"]);
      const colors = await page.getByLabel("Colours").locator("option").allTextContents();
      assert.deepEqual(colors, ["Texture", "Normals"]);
      for (const label of ["Rooms", "Boxes of instances", "Disputed patches"])
        assert.equal(await page.getByLabel(label, { exact: true }).count(), 0, label);
      assert.ok(Number(await page.getByLabel("Cut away what is above").inputValue()) > 1.5);
      assert.equal(await page.locator("[role=alert]").count(), 0);
      assert.deepEqual(faults, []);
      await close();
    },
  );
