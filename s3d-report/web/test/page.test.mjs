// The page in a browser, opened from the disk, held against the data set that it shows.
//
// S3D_REPORT and S3D_DATASET name the folders; `run` makes them. Each test fails on any error of the console,
// and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { go, launch, open, readout, ready } from "./browser.mjs";
import { readPng, readXyz } from "./images.mjs";

const report = process.env["S3D_REPORT"];
const dataset = process.env["S3D_DATASET"];
const bare = process.env["S3D_BARE_REPORT"];
const json = (path) => JSON.parse(readFileSync(join(dataset, path), "utf8"));
const index = readIndex(report);

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

function readIndex(folder) {
  const script = readFileSync(join(folder, "data/index.js"), "utf8");
  return JSON.parse(JSON.parse(script.slice('s3dReport("index",'.length, script.lastIndexOf(");"))));
}

/** The data set's own images of a panorama or view. */
function ownImages(area, kind, stem) {
  const path = (folder, ending) => join(dataset, `area_${area}/${kind}/${folder}/${stem}_domain_${ending}`);
  const label = readPng(path("semantic", "semantic.png"));
  const depth = readPng(path("depth", "depth.png"));
  const names = json("assets/semantic_labels.json");
  return {
    width: depth.width,
    height: depth.height,
    pose: JSON.parse(readFileSync(path("pose", "pose.json"), "utf8")),
    xyz: readXyz(path("global_xyz", "global_xyz.exr")),
    depth: (x, y) => depth.at(x, y)[0] / 512,
    label: (x, y) => {
      const [r, g, b] = label.at(x, y);
      return names[r * 65536 + g * 256 + b];
    },
  };
}

const stemOf = (folder, uuid, frame) => {
  const names = readdirSync(join(dataset, folder));
  const found = names.find((name) => name.includes(`_${uuid}_`) && name.includes(`_frame_${frame}_`));
  return found.slice(0, found.indexOf("_domain_"));
};

const times = (m, v) => m.map((row) => row.reduce((sum, a, k) => sum + a * v[k], 0));
const transposed = (m) => m[0].map((_, c) => m.map((row) => row[c]));
/** The camera's axes right, down and forward, from a pose file's matrix. */
const rotationOf = (pose) => pose.camera_rt_matrix.map((row) => row.slice(0, 3));

/** Holds what the page tells under the pointer against the data set's files. */
function hold(told, own, [i, j], [width, height]) {
  const [x, y] = [
    Math.floor(((2 * i + 1) * own.width) / (2 * width)),
    Math.floor(((2 * j + 1) * own.height) / (2 * height)),
  ];
  const name = own.label(x, y);
  const where = `pixel ${i},${j}, of the data set ${x},${y}`;
  assert.equal(told.pixel, `${i},${j}`, where);
  assert.equal(told.class, name.startsWith("<UNK>") ? "no label" : name.split("_")[0], where);
  if (!name.startsWith("<UNK>")) assert.equal(told.instance, name, where);
  const xyz = told["X Y Z"].trim().split(/\s+/).map(Number);
  const ours = own.xyz.at(x, y);
  xyz.forEach((c, axis) => assert.ok(Math.abs(c - ours[axis]) < 0.01, `${where}: ${xyz} and ${ours}`));
  return { x, y, distance: Number.parseFloat(told.distance) };
}

const near = (a, b, tolerance, words) => assert.ok(Math.abs(a - b) <= tolerance, `${words}: ${a} and ${b}`);

/** Points of a box in no line. */
function spread(count, box) {
  return Array.from({ length: count }, (_, k) => [
    Math.round(box.x + box.width * (0.06 + 0.88 * ((k * 0.618034) % 1))),
    Math.round(box.y + box.height * (0.16 + 0.8 * ((k + 0.5) / count))),
  ]);
}

const degrees = Math.PI / 180;
const queryOf = (page) =>
  page.evaluate(() => Object.fromEntries(new URLSearchParams(location.hash.split("?")[1] ?? "")));

/** Which pixel of a reduced panorama a point of the screen shows: by vectors, not by the page's formulas. */
function panoramaPixel(own, gaze, box, [px, py], [width, height]) {
  const f = Math.max(box.width, box.height) / 2 / Math.tan(gaze.fov / 2);
  const [x, y] = [(px - box.x - box.width / 2) / f, (py - box.y - box.height / 2) / f];
  // A level camera that looks along the middle of the panorama, turned to the right by lon and up by lat.
  const forward = rotationOf(own.pose)[2];
  const azimuth = Math.atan2(forward[1], forward[0]) - gaze.lon;
  const [c, s, cl, sl] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(gaze.lat), Math.sin(gaze.lat)];
  const [right, ahead, up] = [
    [s, -c, 0],
    [c * cl, s * cl, sl],
    [-c * sl, -s * sl, cl],
  ];
  const ray = [0, 1, 2].map((k) => ahead[k] + x * right[k] - y * up[k]);
  const centre = Math.atan2(forward[1], forward[0]);
  const u = ((centre - Math.atan2(ray[1], ray[0])) / (2 * Math.PI) + 2.5) % 1;
  const v = 0.5 - Math.atan2(ray[2], Math.hypot(ray[0], ray[1])) / Math.PI;
  return [u * width, v * height];
}

async function holdPanorama(page, at, hover) {
  const location = index.locations[at];
  const stem = stemOf(`area_${location.area}/pano/pose`, location.uuid, "equirectangular");
  const own = ownImages(location.area, "pano", stem);
  const picture = readPicture(report, `pano_${at}`);
  const box = await page.locator(".viewer canvas").boundingBox();
  const query = await queryOf(page);
  const gaze = { lon: query.lon * degrees, lat: query.lat * degrees, fov: query.fov * degrees };
  let held = 0;
  for (const point of spread(40, box)) {
    const [u, v] = panoramaPixel(own, gaze, box, point, picture.size);
    const edge = (c) => Math.min(c - Math.floor(c), Math.ceil(c) - c);
    // On an edge between two pixels both would be right.
    if (edge(u) < 0.02 || edge(v) < 0.02) continue;
    if (!(await hover(point))) continue;
    const pixel = [Math.floor(u), Math.floor(v)];
    const { x, y, distance } = hold(await readout(page), own, pixel, picture.size);
    near(distance, own.depth(x, y), 1 / 512, "distance");
    held += 1;
  }
  assert.ok(held >= 20, `${held} pixels were held`);
}

function readPicture(folder, key) {
  const script = readFileSync(join(folder, `data/${key}.js`), "utf8");
  return JSON.parse(JSON.parse(script.slice(`s3dReport("${key}",`.length, script.lastIndexOf(");"))));
}

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
  // The page takes the address as its own at the first change.
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
  // Whole degrees, so that the address says exactly what is shown.
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
    // At an end half of the handle is hidden.
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
    // The picture of classes has a little of the colours in it, so that shapes can be made out.
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

test("the grid is sorted and filtered, and a view opens large", async () => {
  const { page, faults, close } = await open(browser, report, "#/views");
  const total = async () => Number((await page.locator("[role=status]").textContent()).split(" ")[0]);
  const files = readdirSync(join(dataset, "area_1/data/rgb"));
  assert.equal(await total(), files.length);
  const room = index.locations.find((l) => l.pano).room;
  await page.getByLabel("Room", { exact: true }).selectOption(`1/${room}`);
  assert.equal(await total(), files.filter((name) => name.includes(`_${room}_frame_`)).length);
  await page.getByLabel("Room", { exact: true }).selectOption("");

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
  // What was filtered is in the address.
  await page.getByLabel("Class", { exact: true }).selectOption({ label: "chair" });
  const chairs = await total();
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

async function holdView(page, view) {
  const { uuid } = index.locations[view.location];
  const own = ownImages(view.area, "data", stemOf(`area_${view.area}/data/pose`, uuid, view.frame));
  const picture = readPicture(report, `views_${Math.floor(view.picture / index.views_per_file)}`)[
    view.picture % index.views_per_file
  ];
  const box = await page.locator(".viewer canvas").boundingBox();
  const scale = Math.min(box.width / own.width, box.height / own.height);
  const rotation = rotationOf(own.pose);
  let held = 0;
  for (const point of spread(26, box)) {
    const u = ((point[0] - box.x - box.width / 2) / scale / own.width + 0.5) * picture.size[0];
    const v = ((point[1] - box.y - box.height / 2) / scale / own.height + 0.5) * picture.size[1];
    const edge = (c) => Math.min(c - Math.floor(c), Math.ceil(c) - c);
    if (edge(u) < 0.02 || edge(v) < 0.02) continue;
    await page.mouse.move(...point);
    if (!(await page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.tagName === "CANVAS", point)))
      continue;
    const { x, y, distance } = hold(await readout(page), own, [Math.floor(u), Math.floor(v)], picture.size);
    // Depth along the optical axis is the distance along the ray, less its slant.
    const [[fx, , cx], [, fy, cy]] = own.pose.camera_k_matrix;
    const ray = times(transposed(rotation), [(x + 0.5 - cx) / fx, (y + 0.5 - cy) / fy, 1]);
    near(distance / Math.hypot(...ray), own.depth(x, y), 1 / 512, "depth");
    held += 1;
  }
  assert.ok(held >= 20, `${held} pixels were held`);
}

test("plan, numbers and notes have what the data set's tables have", async () => {
  const { page, faults, close } = await open(browser, report, "#/plan");
  const rooms = json("area_1/3d/rooms.json");
  assert.equal(await page.locator(".plan .room").count(), rooms.length);
  const texts = await page.locator(".plan text.name").allTextContents();
  for (const room of rooms) {
    assert.ok(
      texts.some((text) => text.endsWith(`${room.floor_m2.toFixed(1)} m²`)),
      room.room,
    );
  }
  await page.locator(".plan a").first().focus();
  const was = await page.getAttribute("body", "data-ready");
  await page.keyboard.press("Enter");
  await page.waitForFunction((before) => document.body.dataset.ready !== before, was);
  assert.match(await page.evaluate(() => window.location.hash), /^#\/pano\/1\//);

  await go(page, "#/numbers");
  const statistics = json("statistics.json").areas[0];
  const rows = await page.locator("table").first().locator("tbody tr").allTextContents();
  assert.ok(rows.includes(`Points${statistics.points.toLocaleString("en")}`), rows.join("; "));
  assert.equal(await page.locator("svg.chart").count(), 4);
  await page.locator(".bars a").first().click();
  await page.waitForSelector(".grid");
  assert.match(await page.evaluate(() => window.location.hash), /class=\d+&sort=share/);

  await go(page, "#/notes");
  assert.match(
    await page.locator("main").textContent(),
    /Every file that this report reads is as it was written/,
  );
  const patch = page.locator("main section a[href^='#/pano']").first();
  if ((await patch.count()) > 0) {
    await patch.click();
    await page.waitForSelector(".viewer canvas");
  }
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
    if (hit) await page.touchscreen.tap(x, y);
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
  const folder = join(mkdtempSync(join(tmpdir(), "s3d-report-")), "copy");
  try {
    cpSync(report, folder, { recursive: true });
    const hostile = "<script>alert(1)</script><img src=x onerror=alert(2)> \u202e\"'&amp;";
    const changed = structuredClone(index);
    changed.data_set.name = hostile;
    changed.faults = [{ path: hostile, message: hostile }];
    changed.rooms.forEach((room) => (room.name = hostile));
    changed.locations.forEach((location) => (location.room = hostile));
    changed.labels.forEach((label) => (label.name = hostile));
    changed.classes.forEach((c) => (c.name = hostile));
    changed.views.forEach((view) => Object.assign(view, { photograph: hostile, room: hostile }));
    changed.votes[0].votes.disputed_patches.forEach((patch) => (patch.labels = [hostile, hostile]));
    writeFileSync(
      join(folder, "data/index.js"),
      `s3dReport("index",${JSON.stringify(JSON.stringify(changed))});\n`,
    );
    rmSync(join(folder, "data/views_0.js"));
    const { page, faults, close } = await open(browser, folder, "#/notes");
    assert.equal(await page.locator("header .title").textContent(), hostile);
    assert.equal(await page.locator(".badge").textContent(), "1");
    assert.equal(await page.locator("code").first().textContent(), hostile);
    for (const hash of ["#/pano", "#/views", "#/plan", "#/numbers"]) {
      await go(page, hash);
      assert.equal(await page.locator("#place script, #place img[src=x]").count(), 0, hash);
      assert.ok((await page.locator("#place").innerText()).includes("<script>"), hash);
    }
    assert.deepEqual(faults, []);
    await go(page, "#/view/0");
    assert.match(await page.locator("[role=alert]").textContent(), /data\/views_0\.js cannot be read/);
    await close();
  } finally {
    rmSync(join(folder, ".."), { recursive: true });
  }
});

test(
  "without labels the page is the same without what needs them",
  { skip: bare ? false : "S3D_BARE_REPORT is not set" },
  async () => {
    const { page, faults, close } = await open(browser, bare, "#/pano");
    const sides = await page.getByLabel("Right of the line").locator("option").allTextContents();
    assert.deepEqual(sides, ["Colour", "Depth", "Normals"]);
    const box = await page.locator(".viewer canvas").boundingBox();
    await page.mouse.move(box.x + box.width * 0.3, box.y + box.height * 0.7);
    const told = await readout(page);
    assert.ok(told.class === undefined && told["X Y Z"] !== undefined, JSON.stringify(told));
    for (const hash of ["#/views", "#/view/0", "#/plan", "#/numbers", "#/notes"]) {
      await go(page, hash);
      assert.equal(await page.locator("[role=alert]").count(), 0, hash);
      assert.ok(!/undefined|NaN|null/.test(await page.locator("main").innerText()), hash);
    }
    assert.equal(await page.getByLabel("Class", { exact: true }).count(), 0);
    assert.deepEqual(faults, []);
    await close();
  },
);
