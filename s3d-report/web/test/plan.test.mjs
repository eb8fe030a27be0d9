// The plan, compared with the data set: rooms, coverage, cones of views, disputed patches, storeys. Each
// test fails on any error of the console, and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { drawn, go, launch, open, ready } from "./lib/browser.mjs";
import { dataset, degrees, index, json, near, report, stemOf, withCopy } from "./lib/common.mjs";
import { readPng } from "./lib/images.mjs";
import { PNG } from "pngjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const stands = ".plan a:has(.stand)";

test("the plan has the rooms, and the locations in the colour of what they see", async () => {
  const { page, faults, close } = await open(browser, report, "#/plan");
  const rooms = json("area_1/3d/rooms.json");
  assert.equal(await page.locator(".plan .room").count(), rooms.length);
  const texts = await page.locator(".plan text.name").allTextContents();
  for (const room of rooms)
    assert.ok(
      texts.some((text) => text.endsWith(`${room.floor_m2.toFixed(1)} m²`)),
      room.room,
    );
  // A room links to the panorama in it that sees the most.
  for (const room of rooms) {
    const to = await page
      .locator(".plan a:has(.room)", { hasText: `, ${room.floor_m2.toFixed(1)} m²` })
      .getAttribute("href");
    const within = index.locations.filter((l) => l.room === room.room && l.pano);
    const best = Math.max(...within.map((l) => l.seen.coverage));
    assert.ok(
      within.some((l) => to === `#/pano/1/${l.uuid}` && l.seen.coverage === best),
      to,
    );
  }
  const stops = await page.evaluate(() =>
    [...document.querySelector(".legend .ramp").style.background.matchAll(/rgb\(([^)]*)\)/g)].map((found) =>
      found[1].split(/[ ,]+/).map(Number),
    ),
  );
  const shown = await page.locator(stands).evaluateAll((links) =>
    links.map((a) => ({
      uuid: a.getAttribute("href").split("/")[3],
      words: a.getAttribute("aria-label"),
      fill: a.querySelector("circle").style.fill.match(/\d+/g).map(Number),
    })),
  );
  assert.equal(shown.length, index.locations.length);
  for (const { uuid, words, fill } of shown) {
    const stem = stemOf("area_1/pano/pose", uuid, "equirectangular");
    const depth = readPng(join(dataset, `area_1/pano/depth/${stem}_domain_depth.png`));
    let seen = 0;
    for (let y = 0; y < depth.height; y++)
      for (let x = 0; x < depth.width; x++) seen += depth.at(x, y)[0] === 65535 ? 0 : 1;
    const share = seen / (depth.width * depth.height);
    near(Number.parseFloat(words.split("coverage ")[1]), 100 * share, 0.51, `${uuid} sees`);
    const place = Math.min(7, Math.floor(share * 8));
    const color = stops[place].map((c, k) => c + (share * 8 - place) * (stops[place + 1][k] - c));
    fill.forEach((c, k) => near(c, color[k], 8, `colour of ${uuid}`));
  }
  assert.deepEqual(faults, []);
  await close();
});

/** The shown cones: the heading of their right side, and their angle, in radians. */
const conesOf = (page) =>
  page.locator(".cone").evaluateAll((paths) =>
    paths.map((path) => {
      const [x, y, ax, ay, , , , , , bx, by] = path
        .getAttribute("d")
        .match(/-?[\d.]+(e-?\d+)?/g)
        .map(Number);
      const [a, b] = [Math.atan2(y - ay, ax - x), Math.atan2(y - by, bx - x)];
      return { from: b, fov: (a - b + 4 * Math.PI) % (2 * Math.PI) };
    }),
  );

test("a location that has the focus shows where its kept views look", async () => {
  const { page, faults, close } = await open(browser, report, "#/plan");
  const links = page.locator(stands);
  for (const i of [0, 2]) {
    await links.nth(i).focus();
    const uuid = (await links.nth(i).getAttribute("href")).split("/")[3];
    const kept = json("area_1/views.json").filter((v) => v.camera_uuid === uuid && v.frame_num !== null);
    const cones = await conesOf(page);
    assert.equal(cones.length, kept.length);
    assert.match(
      await page.locator(".area-plan [role=status]").textContent(),
      new RegExp(`${kept.length} kept`),
    );
    for (const view of kept) {
      const stem = stemOf("area_1/data/pose", uuid, view.frame_num);
      const pose = JSON.parse(
        readFileSync(join(dataset, `area_1/data/pose/${stem}_domain_pose.json`), "utf8"),
      );
      const [x, y] = pose.camera_rt_matrix[2];
      const heading = Math.atan2(y, x);
      const found = cones.some(({ from, fov }) => {
        const off = Math.abs(((heading - from - fov / 2 + 5 * Math.PI) % (2 * Math.PI)) - Math.PI);
        return off < 0.5 * degrees && Math.abs(fov - pose.field_of_view_rads) < 0.5 * degrees;
      });
      assert.ok(found, `view ${view.frame_num} looks along ${heading / degrees}°`);
    }
  }
  await page.locator("header a").first().focus();
  assert.equal(await page.locator(".cone").count(), 0);
  await links.first().focus();
  const was = await page.getAttribute("body", "data-ready");
  await page.keyboard.press("Enter");
  await page.waitForFunction((before) => document.body.dataset.ready !== before, was);
  assert.match(await page.evaluate(() => window.location.hash), /^#\/pano\/1\//);
  assert.deepEqual(faults, []);
  await close();
});

test("photographs are on the plan, and show where they look", async () => {
  const changed = structuredClone(index);
  const [x, y, z] = changed.locations[0].position;
  const forwards = [
    [0.6, 0.8, 0],
    [-0.8, 0, -0.6],
    [0, 0, -1],
  ];
  changed.views = forwards.map((forward, i) => ({
    ...changed.views[i],
    location: null,
    photograph: `photo ${i}`,
    position: [x + i / 2, y, z],
    forward,
    up: [0, 0, 1],
    fov_deg: 50,
    picture: i,
  }));
  await withCopy(
    (write) => write("index", changed),
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/plan");
      const photographs = page.locator(".plan a:has(.photograph)");
      assert.equal(await photographs.count(), forwards.length);
      for (const [i, [fx, fy]] of forwards.entries()) {
        await photographs.nth(i).focus();
        const cones = await conesOf(page);
        // A view straight down has no heading.
        assert.equal(cones.length, Math.hypot(fx, fy) > 0 ? 1 : 0);
        for (const { from, fov } of cones) {
          near(fov, 50 * degrees, 0.01, "angle of view");
          near(Math.cos(from + fov / 2 - Math.atan2(fy, fx)), 1, 1e-3, "heading");
        }
      }
      assert.equal(await photographs.nth(1).getAttribute("href"), "#/view/1");
      assert.deepEqual(faults, []);
      await close();
    },
  );
});

test("a disputed patch leads to the panorama nearest to it", async () => {
  const { page, faults, close } = await open(browser, report, "#/plan");
  const { disputed_patches: patches } = json("area_1/3d/votes.json");
  const marks = page.locator(".plan a:has(.patch)");
  assert.equal(await marks.count(), patches.length);
  const at = patches.length - 1;
  const away = (l) => Math.hypot(...l.position.map((c, k) => c - patches[at].center[k]));
  const nearest = index.locations.filter((l) => l.pano).sort((a, b) => away(a) - away(b))[0];
  await marks.nth(at).focus();
  await page.keyboard.press("Enter");
  await page.waitForSelector(".viewer canvas");
  await ready(page);
  const hash = await page.evaluate(() => window.location.hash);
  assert.ok(hash.startsWith(`#/pano/1/${nearest.uuid}?`), hash);
  const query = new URLSearchParams(hash.split("?")[1]);
  assert.equal(query.get("right"), "contested");
  const [lon, lat] = [query.get("lon") * degrees, query.get("lat") * degrees];
  const azimuth = nearest.azimuth_rad - lon;
  const looks = [Math.cos(azimuth) * Math.cos(lat), Math.sin(azimuth) * Math.cos(lat), Math.sin(lat)];
  const ray = patches[at].center.map((c, k) => (c - nearest.position[k]) / away(nearest));
  assert.ok(
    looks.reduce((sum, c, k) => sum + c * ray[k], 0) > Math.cos(0.2 * degrees),
    "it is in the middle",
  );
  assert.deepEqual(faults, []);
  await close();
});

test("storeys of an area are apart, also rooms that nobody stands in", async () => {
  const changed = structuredClone(index);
  const up = 3.2;
  const [above, empty] = ["office_1", "lounge_1"];
  // The lounge's storey follows from its floor, the office's from its location, and the floors below from both.
  for (const room of changed.rooms) {
    if (room.name === empty) room.floor += up;
    if (room.name === above) [room.floor, room.heights] = [null, null];
  }
  changed.locations = changed.locations.filter((l) => l.room !== empty);
  for (const l of changed.locations) if (l.room === above) l.position[2] += up;
  changed.views = [];
  // A patch on the ceiling below does not belong to the storey above.
  const { disputed_patches: patches } = changed.votes[0].votes;
  patches.forEach((patch, i) => (patch.center[2] = [2.9, up, up + 0.01, up + 2.9][i % 4]));
  await withCopy(
    (write) => write("index", changed),
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/plan");
      assert.deepEqual(await page.locator("h3").allTextContents(), ["Ground floor", "First floor"]);
      const storeys = await page.locator("svg.plan").evaluateAll((plans) =>
        plans.map((p) => ({
          rooms: [...p.querySelectorAll(".room title")].map((t) => t.textContent.split(",")[0]).sort(),
          standing: p.querySelectorAll("a .stand").length,
          patches: p.querySelectorAll(".patch").length,
        })),
      );
      const standing = changed.locations.filter((l) => l.room === above).length;
      const on = patches.filter((_, i) => i % 4 === 0).length;
      assert.deepEqual(storeys, [
        {
          rooms: ["conference room 1", "hallway 1"],
          standing: changed.locations.length - standing,
          patches: on,
        },
        { rooms: ["lounge 1", "office 1"], standing, patches: patches.length - on },
      ]);
      assert.deepEqual(faults, []);
      await close();
    },
  );
});

/** The contrast of two colours as the page computes them (WCAG 2.2). */
function contrast(a, b) {
  const light = (color) => {
    const [r, g, blue] = color
      .match(/[\d.]+/g)
      .slice(0, 3)
      .map((word) => Number(word) / 255)
      .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * blue;
  };
  const [high, low] = [light(a), light(b)].sort((x, y) => y - x);
  return (high + 0.05) / (low + 0.05);
}

for (const [width, dark] of [
  [1440, false],
  [900, true],
  [390, false],
]) {
  test(`the mesh from above lies under the plan at ${width}, and can be put away`, async () => {
    const { page, faults, close } = await open(browser, report, "#/plan", { width, dark });
    const image = page.locator(".plan .ground > image");
    await image.waitFor({ state: "attached" });
    const [ground] = index.grounds;
    const room = index.rooms.find(({ name }) => name.startsWith("conference"));
    // The places of the rooms and of the ground on the screen are those of the world.
    const placed = await page.evaluate(() => {
      const box = (selector, text) => {
        const all = [...document.querySelectorAll(selector)];
        const { x, y, width, height } = all
          .find((e) => e.textContent.startsWith(text))
          .getBoundingClientRect();
        return { x, y, width, height };
      };
      return { room: box(".plan .room", "conference"), ground: box(".plan .ground > image", "") };
    });
    const [xs, ys] = [0, 1].map((k) => room.outline.flat().map((point) => point[k]));
    const scale = placed.ground.width / (ground.size[0] * ground.pixel_m);
    near((placed.room.x - placed.ground.x) / scale, Math.min(...xs) - ground.west, 0.06, "west");
    near((placed.room.y - placed.ground.y) / scale, ground.north - Math.max(...ys), 0.06, "north");
    near(placed.ground.height / scale, ground.size[1] * ground.pixel_m, 0.02, "height");

    const colors = async () => {
      await page.mouse.move(2, 2);
      await drawn(page);
      const png = PNG.sync.read(await page.locator(".plan").first().screenshot());
      const found = new Set();
      for (let at = 0; at < png.data.length; at += 4 * 7) found.add(png.data.readUInt32BE(at) >> 12);
      return found.size;
    };
    await page.waitForTimeout(300);
    const many = await colors();
    const styles = await page.evaluate(() => {
      const of = (selector) => getComputedStyle(document.querySelector(selector));
      const [name, size, wall, rim] = [".name", ".size", ".room", ".casing"].map((s) => of(`.plan ${s}`));
      return {
        name: [name.fill, name.stroke],
        size: [size.fill, name.stroke],
        wall: [wall.stroke, rim.stroke],
        widths: [wall.strokeWidth, rim.strokeWidth].map(parseFloat),
      };
    });
    assert.ok(contrast(...styles.name) >= 4.5 && contrast(...styles.size) >= 4.5, JSON.stringify(styles));
    assert.ok(contrast(...styles.wall) >= 3, JSON.stringify(styles));
    assert.ok(styles.widths[1] > 2 * styles.widths[0], "the rim is wider than the line");

    const box = page.getByLabel("Mesh from above");
    await box.uncheck();
    assert.equal(await page.evaluate(() => window.location.hash), "#/plan?ground=none");
    const few = await colors();
    assert.ok(many > 4 * few, `${many} colours with the ground, ${few} without`);
    // The choice is remembered, and part of the address.
    await go(page, "#/numbers");
    await page.locator("nav").getByText("Plan", { exact: true }).click();
    await ready(page);
    assert.equal(await page.evaluate(() => window.location.hash), "#/plan?ground=none");
    assert.ok(!(await page.getByLabel("Mesh from above").isChecked()));
    assert.equal(await page.locator(".plan .ground > image").count(), 0, "what is not shown is not loaded");
    await page.getByLabel("Mesh from above").check();
    await image.waitFor({ state: "attached" });
    assert.deepEqual(faults, []);
    await close();
  });
}

test("a ground that cannot be read is told of, and the plan is shown", async () => {
  await withCopy(
    (write) => write("ground_0", 7),
    async (folder) => {
      const { page, close } = await open(browser, folder, "#/plan");
      await page.getByRole("alert").waitFor();
      assert.match(await page.getByRole("alert").textContent(), /ground_0\.js is damaged/);
      assert.equal(await page.locator(".plan .room").count(), index.rooms.length);
      await close();
    },
  );
});
