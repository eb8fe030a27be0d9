// Faces of the mesh in panoramas and views: which face a pixel sees, how its votes went, and how far places
// are apart. Each test fails on any error of the console, and on any request that leaves the report's
// folder.

import assert from "node:assert/strict";
import { rmSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { drawn, go, launch, open, readout } from "./lib/browser.mjs";
import {
  dataset,
  degrees,
  index,
  json,
  near,
  queryOf,
  readPicture,
  report,
  spread,
  withCopy,
} from "./lib/common.mjs";
import { distanceTo, readNpz, readObj } from "./lib/mesh.mjs";

const NO_FACE = 0xffffff;
const votes = readNpz(join(dataset, "area_1/3d/votes.npz"));
const mesh = readObj(join(dataset, "area_1/3d/rgb.obj"));
const names = json("assets/semantic_labels.json");
/** The margin of a face as a share of its votes; null without votes. */
const margin = (face) =>
  votes.total[face] === 0 ? null : (votes.votes[face] - votes.runner_up_votes[face]) / votes.total[face];

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

/** The faces of a panorama's pixels. */
function facesOf(at) {
  const png = PNG.sync.read(Buffer.from(readPicture(report, `pano_${at}`).face.split(",")[1], "base64"));
  const of = (x, y) => {
    const [r, g, b] = png.data.subarray(4 * (y * png.width + x), 4 * (y * png.width + x) + 3);
    return r * 65536 + g * 256 + b;
  };
  return { width: png.width, height: png.height, of };
}

/** Pixels in the middle of three by three that show one wanted face, far from the poles. */
function pixelsOf(faces, wanted, count) {
  const found = [];
  const seen = new Set();
  for (let y = Math.floor(faces.height * 0.25); y < faces.height * 0.75; y++) {
    for (let x = 1; x < faces.width - 1 && found.length < count; x++) {
      const face = faces.of(x, y);
      if (face === NO_FACE || seen.has(face) || !wanted(face)) continue;
      const around = [-1, 0, 1].flatMap((dy) => [-1, 0, 1].map((dx) => faces.of(x + dx, y + dy)));
      if (!around.every((other) => other === face)) continue;
      seen.add(face);
      found.push({ x, y, face });
    }
  }
  return found;
}

const gazeAt = (faces, { x, y }) =>
  `lon=${(360 * ((x + 0.5) / faces.width - 0.5)).toFixed(1)}&lat=${(180 * (0.5 - (y + 0.5) / faces.height)).toFixed(1)}&fov=20`;

/** The panorama that shows the most contested faces. */
const [at, faces] = index.locations
  .flatMap((location, i) => (location.pano ? [[i, facesOf(i)]] : []))
  .sort(([, a], [, b]) => contestedIn(b) - contestedIn(a))[0];
const { area, uuid, position } = index.locations[at];

function contestedIn(of) {
  return pixelsOf(of, (face) => margin(face) !== null && margin(face) < 0.95, 1000).length;
}

test("the read-out names the face, and where votes differ the margin and the runner-up", async () => {
  const contested = pixelsOf(faces, (face) => margin(face) !== null && margin(face) < 0.95, 8);
  const sure = pixelsOf(faces, (face) => margin(face) === 1, 6);
  assert.ok(contested.length >= 3 && sure.length === 6, `${contested.length} contested faces are seen`);
  const { page, faults, close } = await open(browser, report, `#/pano/${area}/${uuid}`);
  for (const pixel of [...contested, ...sure]) {
    await go(page, `#/pano/${area}/${uuid}?${gazeAt(faces, pixel)}&left=contested&right=rgb&split=0.2`);
    const box = await page.locator(".viewer canvas").boundingBox();
    // The pointer may be there already, and the readout stays empty until it moves.
    await page.mouse.move(box.x + box.width / 2 + 3, box.y + box.height / 2);
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.waitForFunction(() => document.querySelector(".legend .ramp"));
    await page.waitForTimeout(400);
    const told = await readout(page);
    assert.equal(told.face, String(pixel.face));
    const triangle = mesh.faces[pixel.face].map((vertex) => mesh.vertices[vertex]);
    const away = distanceTo(told["X Y Z"].trim().split(/\s+/).map(Number), triangle);
    assert.ok(away < 0.01, `face ${pixel.face} is ${away} m from the point that is told`);
    const label = names[votes.label[pixel.face]];
    assert.equal(told.instance ?? "none", label.startsWith("<UNK>") ? "none" : label);
    if (margin(pixel.face) === 1) assert.equal(told.margin, undefined);
    else {
      near(Number.parseFloat(told.margin), 100 * margin(pixel.face), 0.8, `margin of face ${pixel.face}`);
      assert.equal(told["runner-up"], names[votes.runner_up[pixel.face]]);
    }
  }
  assert.deepEqual(faults, []);
  await close();
});

test("contested faces have the legend's colours", async () => {
  const contested = pixelsOf(faces, (face) => margin(face) !== null && margin(face) < 1, 1000);
  contested.sort((a, b) => margin(a.face) - margin(b.face));
  const sure = pixelsOf(faces, (face) => margin(face) === 1, 2);
  const wanted = [
    ...[0, 0.25, 0.5, 0.75, 1].map((t) => contested[Math.floor(t * (contested.length - 1))]),
    ...sure,
  ];
  const bare = pixelsOf(faces, (face) => margin(face) === null, 1);
  const look = `#/pano/${area}/${uuid}`;
  const { page, faults, close } = await open(browser, report, `${look}?left=contested&right=contested`);
  const stops = await page.evaluate(() =>
    [...document.querySelector(".legend .ramp").style.background.matchAll(/rgb\(([^)]*)\)/g)].map((found) =>
      found[1].split(/[ ,]+/).map(Number),
    ),
  );
  assert.equal(stops.length, 9);
  const colorAt = (share) => {
    const place = Math.min(7, Math.floor(share * 8));
    const t = share * 8 - place;
    return stops[place].map((c, k) => c + t * (stops[place + 1][k] - c));
  };
  const middle = async () => {
    await drawn(page);
    const box = await page.locator(".viewer canvas").boundingBox();
    const clip = { x: box.x + box.width / 2, y: box.y + box.height / 2, width: 1, height: 1 };
    return [...PNG.sync.read(await page.screenshot({ clip })).data.subarray(0, 3)];
  };
  for (const pixel of [...wanted, ...bare]) {
    await go(page, `${look}?${gazeAt(faces, pixel)}&left=rgb&right=contested`);
    await page.locator(".split").press("End");
    const light = (await middle()).reduce((sum, c, k) => sum + c * [0.2126, 0.7152, 0.0722][k], 0);
    await page.locator(".split").press("Home");
    const [shown, share] = [await middle(), margin(pixel.face)];
    const flat = share === null ? [128, 128, 128] : colorAt(share);
    shown.forEach((c, k) => near(c, 0.8 * flat[k] + 0.2 * light, 9, `face ${pixel.face}, margin ${share}`));
  }
  assert.deepEqual(faults, []);
  await close();
});

test("the votes of faces are read when somebody looks at them, and not before", async () => {
  const { page, faults, close } = await open(browser, report, "#/views");
  await page.evaluate(() => {
    window.asked = 0;
    new MutationObserver((changes) => {
      for (const { addedNodes } of changes)
        for (const node of addedNodes) window.asked += node.src?.endsWith("faces_1.js") ? 1 : 0;
    }).observe(document.head, { childList: true });
  });
  const asked = () => page.evaluate(() => window.asked);
  const [pixel] = pixelsOf(faces, (face) => margin(face) === 1, 1);
  await go(page, `#/pano/${area}/${uuid}?${gazeAt(faces, pixel)}`);
  await page.waitForTimeout(600);
  assert.equal(await asked(), 0);
  const box = await page.locator(".viewer canvas").boundingBox();
  await page.mouse.move(box.x + box.width / 2 + 30, box.y + box.height / 2);
  await page.waitForTimeout(600);
  assert.equal(await asked(), 1, "the pointer rests");
  await page.getByLabel("Left of the line").selectOption("contested");
  await page.waitForTimeout(300);
  assert.equal(await asked(), 1, "it is there already");
  assert.deepEqual(faults, []);
  await close();
});

test("votes that are missing or damaged are told, and the rest is shown", async () => {
  const packed = { faces: mesh.faces.length, label: "AAAA", runner_up: "AAAA", margin: "AAAA" };
  for (const [change, words] of [
    [(write, folder) => rmSync(join(folder, "data/faces_1.js")), /data\/faces_1\.js cannot be read/],
    [(write) => write("faces_1", packed), /data\/faces_1\.js is damaged/],
    [(write) => write("faces_1", { ...packed, margin: "<b>" }), /data\/faces_1\.js is damaged/],
  ]) {
    await withCopy(change, async (folder) => {
      const { page, close } = await open(browser, folder, `#/pano/${area}/${uuid}?right=contested`);
      await page.waitForSelector(".legend [role=alert]");
      assert.match(await page.locator(".legend [role=alert]").textContent(), words);
      const box = await page.locator(".viewer canvas").boundingBox();
      const [[x, y]] = await twoPlaces(page, box);
      await page.mouse.move(box.x + x, box.y + y);
      assert.notEqual((await readout(page)).face, undefined);
      await close();
    });
  }
});

/** The positions of the measuring line's ends, in pixels of the canvas; null if they are not shown. */
/** Where the ends on the screen are drawn. */
const endsOf = async (page) => {
  await drawn(page);
  return page.evaluate(() =>
    [...document.querySelectorAll(".measure-end")].map((end) =>
      end
        .getAttribute("transform")
        .match(/[-\d.]+/g)
        .map(Number),
    ),
  );
};

const worldOf = async (page) => (await readout(page))["X Y Z"].trim().split(/\s+/).map(Number);

/** Two places of the canvas, apart, that show something, without an obstacle. */
async function twoPlaces(page, box) {
  const found = [];
  for (const [x, y] of spread(40, box)) {
    const hit = await page.evaluate(([px, py]) => document.elementFromPoint(px, py)?.tagName, [x, y]);
    if (hit !== "CANVAS" || x - box.x > box.width * 0.8 || x - box.x < box.width * 0.2) continue;
    await page.mouse.move(x, y);
    if (!(await readout(page))["X Y Z"]) continue;
    const place = [x - box.x, y - box.y];
    if (found.length === 0) found.push(place);
    else if (Math.hypot(place[0] - found[0][0], place[1] - found[0][1]) > 0.2 * box.width)
      return [...found, place];
  }
  throw new Error("there are no two places to measure between");
}

test("a line measures what lies between two clicks, and stays there", async () => {
  const { page, faults, close } = await open(
    browser,
    report,
    `#/pano/${area}/${uuid}?lon=75&lat=-10&fov=80&split=1`,
  );
  const box = await page.locator(".viewer canvas").boundingBox();
  const places = await twoPlaces(page, box);
  const button = page.getByRole("button", { name: "Measure" });
  await button.click();
  const points = [];
  for (const [x, y] of places) {
    await page.mouse.click(box.x + x, box.y + y);
    points.push(await worldOf(page));
  }
  // Other tests compare the points with the data set's images.
  const length = Math.hypot(...points[0].map((c, k) => c - points[1][k]));
  assert.ok(length > 0.1);
  near(Number.parseFloat(await page.locator(".chip[role=status]").textContent()), length, 0.002, "length");
  const f = box.width / 2 / Math.tan(40 * degrees);
  // The largest width of a pixel of the reduced panorama on the screen: points belong to the middles of
  // pixels.
  const coarse = ((2 * Math.PI) / faces.width) * f * 2.2;
  let ends = await endsOf(page);
  assert.equal(ends.length, 2);
  ends.forEach((end, i) => end.forEach((c, k) => near(c, places[i][k], coarse, "an end")));
  // After a drag the line is still at its points.
  const mid = [box.x + box.width * 0.5, box.y + box.height * 0.3];
  await page.mouse.move(...mid);
  await page.mouse.down();
  await page.mouse.move(mid[0] + 140, mid[1] + 60, { steps: 5 });
  await page.mouse.up();
  const query = await queryOf(page);
  ends = await endsOf(page);
  assert.equal(ends.length, 2);
  const azimuth = index.locations[at].azimuth_rad - query.lon * degrees;
  const [c, s, cl, sl] = [Math.cos(azimuth), Math.sin(azimuth)].concat(
    Math.cos(query.lat * degrees),
    Math.sin(query.lat * degrees),
  );
  ends.forEach((end, i) => {
    const ray = points[i].map((v, k) => v - position[k]);
    const dot = (axis) => axis.reduce((sum, v, k) => sum + v * ray[k], 0);
    const [right, ahead, up] = [dot([s, -c, 0]), dot([c * cl, s * cl, sl]), dot([-c * sl, -s * sl, cl])];
    near(end[0], box.width / 2 + (f * right) / ahead, 2, "across");
    near(end[1], box.height / 2 - (f * up) / ahead, 2, "down");
  });
  assert.equal(await button.getAttribute("aria-pressed"), "true");
  await page.keyboard.press("Escape");
  assert.deepEqual(await endsOf(page), []);
  assert.equal(await button.getAttribute("aria-pressed"), "false");
  assert.equal(await page.locator(".chip[role=status]").textContent(), "");
  assert.deepEqual(faults, []);
  await close();
});

test("in a view, too, a line measures, and a click leads to its place in 3D", async () => {
  const view = index.views.find((v) => v.picture !== null && v.seen?.coverage > 0.9);
  const { page, faults, close } = await open(browser, report, `#/view/${view.picture}?split=1`);
  const box = await page.locator(".viewer canvas").boundingBox();
  const places = await twoPlaces(page, box);
  const link = page.getByRole("link", { name: "Show in 3D" });
  assert.equal(await link.isVisible(), false);
  await page.mouse.click(box.x + places[0][0], box.y + places[0][1]);
  const point = await worldOf(page);
  const to = new URLSearchParams((await link.getAttribute("href")).split("?")[1]);
  assert.match(await link.getAttribute("href"), new RegExp(`^#/space/${view.area}\\?`));
  to.get("at")
    .split(",")
    .forEach((v, k) => near(Number(v), point[k], 0.002, "at"));
  to.get("from")
    .split(",")
    .forEach((v, k) => near(Number(v), index.locations[view.location].position[k], 0.002, "from"));
  await page.getByRole("button", { name: "Measure" }).click();
  const points = [];
  for (const [x, y] of places) {
    await page.mouse.click(box.x + x, box.y + y);
    points.push(await worldOf(page));
  }
  const length = Math.hypot(...points[0].map((c, k) => c - points[1][k]));
  near(Number.parseFloat(await page.locator(".chip[role=status]").textContent()), length, 0.002, "length");
  const coarse = (1.2 * box.width) / readPicture(report, "views_0")[0].size[0];
  const ends = await endsOf(page);
  assert.equal(ends.length, 2);
  ends.forEach((end, i) => end.forEach((c, k) => near(c, places[i][k], coarse, "an end")));
  // The keyboard marks the middle.
  await page.keyboard.press("Escape");
  await page.locator(".viewer canvas").focus();
  await page.keyboard.press("Enter");
  assert.equal(await link.isVisible(), true);
  await link.click();
  await page.waitForSelector("[data-loaded=all]");
  assert.match(await page.evaluate(() => window.location.hash), /^#\/space\/1\?/);
  assert.deepEqual(faults, []);
  await close();
});
