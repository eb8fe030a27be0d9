// Objects of a view, images that share surface with it, and the graph on the plan, compared with the data
// set. Each test fails on any error of the console, and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { drawn, go, isFirefox, launch, open, ready } from "../lib/browser.mjs";
import {
  axeFinds,
  bare,
  json,
  near,
  ownImages,
  readIndex,
  readPicture,
  rotationOf,
  times,
  withCopy,
} from "../lib/common.mjs";

const dataset = process.env["S3D_RELATED"];
const report = process.env["S3D_RELATED_REPORT"];
const index = readIndex(report);

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

/** The name of a view's files, or of a panorama's if `frame` is that. */
function stemOf(kind, uuid, frame) {
  const names = readdirSync(join(dataset, `area_1/${kind}/pose`));
  const found = names.find((name) => name.includes(`_${uuid}_`) && name.includes(`_frame_${frame}_`));
  return found.slice(0, found.indexOf("_domain_"));
}

const stemOfView = (view) => stemOf("data", index.locations[view.location].uuid, view.frame);
const objectsOf = (view) =>
  json(`area_1/data/objects/${stemOfView(view)}_domain_objects.json`, dataset).objects;
const pictures = index.views.filter((view) => view.picture !== null);
/** The view with the object that others hide most without hiding it. */
const crowded = pictures
  .map((view) => ({
    view,
    most: Math.max(...objectsOf(view).map((o) => (o.visible_pixels > 200 ? o.occlusion : 0))),
  }))
  .sort((a, b) => b.most - a.most)[0].view;

test("the objects of a view are outlined, and tell what hides them", async () => {
  const { page, faults, close } = await open(browser, report, `#/view/${crowded.picture}`, { width: 1440 });
  const objects = objectsOf(crowded).sort((a, b) => b.visible_pixels - a.visible_pixels);
  const outlines = page.locator(".objects g");
  const [button, list] = [page.getByRole("button", { name: "Objects" }), page.locator(".object-list")];
  assert.equal(await button.getAttribute("aria-pressed"), "false");
  assert.ok((await list.isHidden()) && (await outlines.count()) === 0);

  await button.click();
  await page.waitForSelector(".object-rows button");
  assert.ok((await page.evaluate(() => location.hash)).includes("objects=on"));
  assert.equal(await outlines.count(), objects.length);
  const rows = page.locator(".object-rows button");
  assert.equal(await rows.count(), objects.length);
  for (const { label_index, occlusion } of objects) {
    const mark = page.locator(`.objects g[data-label="${label_index}"]`);
    // What nothing hides has no dashes.
    if (occlusion === 0) assert.equal(await mark.locator(".object-hidden").count(), 0);
  }
  // Outlines lie where the picture is.
  const [canvas, overlay] = [page.locator(".viewer canvas"), page.locator("svg.objects")];
  const [box, over] = [await canvas.boundingBox(), await overlay.boundingBox()];
  for (const side of ["x", "y", "width", "height"]) near(over[side], box[side], 0.6, side);

  const told = page.locator(".object-told");
  const hold = async ({
    label_index,
    label,
    visible_pixels,
    amodal_pixels,
    occlusion,
    hidden_by,
    beyond,
  }) => {
    const words = await told.textContent();
    const count = (n) => n.toLocaleString("en");
    assert.ok(words.startsWith(label), words);
    assert.ok(words.includes(`${count(visible_pixels)} of ${count(amodal_pixels)} pixels`), words);
    const share = (s) => Number(/Hidden([\d.]+) %/.exec(words)?.[1]) / 100 - s;
    if (occlusion >= 0.001) assert.ok(Math.abs(share(occlusion)) <= 0.0051, words);
    for (const { pixels } of hidden_by.slice(0, 3))
      assert.ok(words.includes(`${count(pixels)} pixel`), words);
    if (beyond.truncation >= 0.001) assert.ok(words.includes("by the frame"), words);
    const labels = (of) =>
      page.locator(`.objects g.${of}`).evaluateAll((all) => all.map((g) => Number(g.dataset.label)).sort());
    assert.deepEqual(await labels("is-chosen"), [label_index]);
    const drawnHiders = hidden_by
      .map((h) => h.label_index)
      .filter((l) => objects.some((o) => o.label_index === l));
    assert.deepEqual(await labels("is-hider"), drawnHiders.sort());
  };

  // By the keyboard: one row is reached by Tab, the others by arrows.
  await button.focus();
  await rows.first().focus();
  await hold(objects[0]);
  for (const object of objects.slice(1, 6)) {
    await page.keyboard.press("ArrowDown");
    await hold(object);
  }
  await page.keyboard.press("ArrowUp");
  await hold(objects[4]);
  assert.equal(await page.locator('.object-rows button[tabindex="0"]').count(), 1);

  // By the pointer, in the list and in the picture.
  const most = objects.reduce((a, b) => (b.occlusion > a.occlusion ? b : a));
  await rows.nth(objects.indexOf(most)).hover();
  await hold(most);
  const own = ownImages(1, "data", stemOfView(crowded), dataset);
  let held = 0;
  for (let k = 0; k < 12; k++) {
    const [x, y] = [own.width * (0.07 + 0.86 * ((k * 0.618) % 1)), own.height * (0.25 + (0.7 * k) / 12)];
    const object = objects.find((one) => one.label === own.label(Math.floor(x), Math.floor(y)));
    const around = [-4, 4].map((d) => own.label(Math.floor(x) + d, Math.floor(y) + d));
    if (!object || around.some((label) => label !== object.label)) continue;
    const at = [box.x + (x / own.width) * box.width, box.y + (y / own.height) * box.height];
    await page.mouse.move(...at);
    if (!(await page.evaluate(([px, py]) => document.elementFromPoint(px, py)?.tagName === "CANVAS", at)))
      continue;
    await hold(object);
    held += 1;
  }
  assert.ok(held >= 4, `${held} points`);

  // The next view has them, too, and the address brings them back.
  await page
    .getByRole("link", { name: /^(Next|Previous) view$/ })
    .first()
    .click();
  await page.waitForFunction((was) => !location.hash.startsWith(was), `#/view/${crowded.picture}?`);
  await ready(page);
  await page.waitForSelector(".object-rows button");
  await button.click();
  assert.ok(await list.isHidden());
  assert.ok(!(await page.evaluate(() => location.hash)).includes("objects=on"));
  assert.deepEqual(faults, []);
  await close();
});

/** A projection into an image of the data set: the pixel of a world point, and its distance as in depth. */
function projection(own, isPanorama) {
  const rt = own.pose.camera_rt_matrix;
  const camera = (point) =>
    rt.map((row) => row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3]);
  if (!isPanorama) {
    const [[fx, , cx], [, fy, cy]] = own.pose.camera_k_matrix;
    return (point) => {
      const [x, y, z] = camera(point);
      return [(fx * x) / z + cx, (fy * y) / z + cy, z];
    };
  }
  return (point) => {
    const [x, y, z] = camera(point);
    const far = Math.hypot(x, y, z);
    const u = (Math.atan2(x, z) / (2 * Math.PI) + 1.5) % 1;
    return [u * own.width, (0.5 + Math.asin(y / far) / Math.PI) * own.height, far];
  };
}

test("a view has partners, and lines join the same places in both images", async () => {
  const at = pictures.find((view) => {
    const partners = readPicture(report, `pairs_${Math.floor(view.picture / 12)}`)[view.picture % 12];
    return (
      partners.some((one) => one.pano !== undefined) && partners.some((one) => one.picture !== undefined)
    );
  });
  const partners = readPicture(report, `pairs_${Math.floor(at.picture / 12)}`)[at.picture % 12];
  const { page, faults, close } = await open(browser, report, `#/view/${at.picture}`, {
    width: 1440,
    height: 900,
  });
  const cards = page.locator(".partners .card a");
  const links = await cards.evaluateAll((all) => all.map((a) => a.getAttribute("href")));
  const linkOf = (one) =>
    `#/view/${at.picture}/${one.pano === undefined ? `with/${one.picture}` : `pano/${one.pano}`}`;
  assert.deepEqual([...links].sort(), partners.map(linkOf).sort());
  for (const partner of partners) {
    const words = await page.locator(`.partners a[href="${linkOf(partner)}"]`).textContent();
    near(
      Number.parseFloat(/shows (?:< )?([\d.]+) % of this view/.exec(words)[1]),
      100 * partner.shared[0],
      0.51,
      words,
    );
  }
  await page.waitForFunction(() =>
    [...document.querySelectorAll(".partners img")].every((image) => image.naturalWidth > 0),
  );

  const own = ownImages(1, "data", stemOfView(at), dataset);
  const kinds = [
    partners.find((one) => one.pano !== undefined),
    partners.find((one) => one.picture !== undefined),
  ];
  for (const partner of kinds) {
    await page.locator(`.partners a[href="${linkOf(partner)}"]`).click();
    await page.waitForSelector(".matches");
    await ready(page);
    const isPanorama = partner.pano !== undefined;
    const view = index.views.find((one) => one.picture === partner.picture);
    const other = isPanorama
      ? ownImages(1, "pano", stemOf("pano", index.locations[partner.pano].uuid, "equirectangular"), dataset)
      : ownImages(1, "data", stemOfView(view), dataset);
    const project = projection(other, isPanorama);
    const images = await page
      .locator(".matches image")
      .evaluateAll((all) =>
        all.map((image) => ["x", "y", "width", "height"].map((name) => Number(image.getAttribute(name)))),
      );
    const lines = await page.locator(".match-line").evaluateAll((all) =>
      all.map((path) =>
        path
          .getAttribute("d")
          .match(/-?[\d.]+/g)
          .map(Number),
      ),
    );
    assert.ok(lines.length === partner.points.length && lines.length >= 10, `${lines.length} lines`);
    const pixel = ([x, y], [left, top, width, height], of) => [
      ((x - left) / width) * of.width,
      ((y - top) / height) * of.height,
    ];
    for (const line of lines) {
      const [x, y] = pixel(line.slice(0, 2), images[0], own).map((c) => Math.floor(c));
      const [u, v] = pixel(line.slice(2), images[1], other);
      // The point of the view's pixel is that of the world coordinates, and where the other image has it.
      const [[fx, , cx], [, fy, cy]] = own.pose.camera_k_matrix;
      const depth = own.depth(x, y);
      const rotation = rotationOf(own.pose);
      const less = [((x + 0.5 - cx) / fx) * depth, ((y + 0.5 - cy) / fy) * depth, depth].map(
        (c, k) => c - own.pose.camera_rt_matrix[k][3],
      );
      const point = times(
        rotation[0].map((_, c) => rotation.map((row) => row[c])),
        less,
      );
      own.xyz.at(x, y).forEach((c, axis) => near(point[axis], c, 0.012, "world"));
      const [pu, pv, away] = project(point);
      near(pu, u, 0.6, "column");
      near(pv, v, 0.6, "row");
      // Nothing is in front of it there: one of the pixels around shows this place.
      const shown = [-1, 0, 1].flatMap((dx) =>
        [-1, 0, 1].map((dy) => {
          const [i, j] = [(Math.floor(u) + dx + other.width) % other.width, Math.floor(v) + dy];
          if (j < 0 || j >= other.height) return Infinity;
          return Math.hypot(...other.xyz.at(i, j).map((c, axis) => c - point[axis]));
        }),
      );
      assert.ok(Math.min(...shown) < 0.02 + 0.03 * away, `${shown} at ${away} m`);
    }

    // A place that has the focus is told, and its line stands out.
    await page.locator(".match").nth(3).focus();
    assert.match(await page.locator("[role=status]").textContent(), /^Place 4 of \d+: pixel \d+, \d+/);
    assert.equal(await page.locator(".match.is-chosen").count(), 1);
    await page.goBack();
    await page.waitForSelector(".partners .card");
    await ready(page);
  }
  await go(page, `#/view/${at.picture}/with/999`);
  assert.match(await page.locator("main").textContent(), /There is no such view/);
  assert.deepEqual(faults, []);
  await close();
});

test("the plan joins places whose images share surface", async () => {
  const graph = readPicture(report, "graph_1");
  const { page, faults, close } = await open(browser, report, "#/plan", { width: 1440, height: 900 });
  const lines = page.locator(".plan .share");
  assert.equal(await lines.count(), 0);
  await page.getByLabel("Shared surface").check();
  await page.waitForSelector(".plan .share");
  await drawn(page);
  assert.ok((await page.evaluate(() => location.hash)).includes("graph=on"));
  const stands = await page.locator(".plan a:has(.stand)").evaluateAll((all) =>
    all.map((a) => {
      const dot = a.querySelector(".stand");
      return {
        uuid: a.getAttribute("href").split("/")[3],
        at: [Number(dot.getAttribute("cx")), Number(dot.getAttribute("cy"))],
      };
    }),
  );
  const shown = await lines.evaluateAll((all) =>
    all.map((line) => ({
      ends: line
        .getAttribute("d")
        .match(/-?[\d.]+(e-?\d+)?/g)
        .map(Number),
      width: Number(line.getAttribute("stroke-width")),
      title: line.textContent,
    })),
  );
  assert.equal(shown.length, graph.edges.length);
  const atOf = ({ location }) => stands.find(({ uuid }) => uuid === index.locations[location].uuid).at;
  const lineOf = ({ ends }) => {
    const [a, b] = ends.map(atOf);
    return shown.find((line) => [...a, ...b].every((c, i) => Math.abs(c - line.ends[i]) < 1e-6));
  };
  graph.edges.forEach((edge, i) => {
    const line = lineOf(edge);
    assert.ok(line.title.includes(`${edge.pairs} pair`), line.title);
    // The more is shared, the thicker is the line.
    if (i > 0) assert.ok(lineOf(graph.edges[i - 1]).width >= line.width);
  });

  // The lines of a scan location that has the focus stand out.
  const first = page.locator(".plan a:has(.stand)").first();
  await first.focus();
  const location = index.locations.findIndex(({ uuid }) => uuid === stands[0].uuid);
  const own = graph.edges.filter(({ ends }) => ends.some((end) => end.location === location)).length;
  assert.equal(await page.locator(".plan .share.is-near").count(), own);
  if (own > 0)
    assert.match(
      await page.locator(".area-plan [role=status]").textContent(),
      new RegExp(`shares surface with ${own} place`),
    );
  await page.getByLabel("Shared surface").uncheck();
  assert.ok(await lines.first().isHidden());
  assert.deepEqual(faults, []);
  await close();
});

test("axe finds nothing in these pages", { skip: isFirefox && "axe is run in Chromium" }, async () => {
  const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
  const { page, faults, close } = await open(browser, report, "#/notes", { width: 1440, dark: true });
  await page.evaluate(`${axe};0`);
  const at = `#/view/${crowded.picture}`;
  const [partner] = readPicture(report, `pairs_${Math.floor(crowded.picture / 12)}`)[crowded.picture % 12];
  const other = partner.pano === undefined ? `with/${partner.picture}` : `pano/${partner.pano}`;
  const found = [];
  for (const [hash, needed] of [
    [`${at}?objects=on`, ".object-rows button"],
    [`${at}/${other}`, ".match"],
    ["#/plan?graph=on", ".share"],
  ]) {
    await go(page, hash);
    await page.waitForSelector(needed);
    if (needed === ".object-rows button") await page.locator(needed).nth(2).focus();
    found.push(...(await axeFinds(page, hash)));
  }
  assert.deepEqual(found, []);
  assert.deepEqual(faults, []);
  await close();
});

test("a file of the report that is damaged is named, and the rest is shown", async () => {
  const damaged = ["objects_0", "pairs_0", "graph_1"];
  const change = (_, folder) => {
    for (const key of damaged) writeFileSync(join(folder, `data/${key}.js`), `s3dReport("${key}","{");\n`);
  };
  await withCopy(
    change,
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/view/0?objects=on");
      await page.getByText("data/objects_0.js is damaged").waitFor();
      assert.match(await page.locator("[role=alert]").textContent(), /data\/pairs_0\.js is damaged/);
      assert.ok(await page.locator(".viewer canvas").isVisible());
      await go(page, "#/plan?graph=on");
      await page.getByText("data/graph_1.js is damaged").waitFor();
      assert.ok((await page.locator(".plan .room").count()) > 0);
      assert.deepEqual(faults, []);
      await close();
    },
    report,
  );
});

test("a report without objects and pairs has no switch for them", async () => {
  const { page, faults, close } = await open(browser, bare, "#/view/0");
  assert.equal(await page.getByRole("button", { name: "Objects" }).count(), 0);
  assert.equal(await page.locator(".partners, .object-list").count(), 0);
  await go(page, "#/plan");
  assert.equal(await page.getByLabel("Shared surface").count(), 0);
  assert.ok(!readFileSync(join(bare, "data/index.js"), "utf8").includes("objects_"));
  assert.deepEqual(faults, []);
  await close();
});
