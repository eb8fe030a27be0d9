// Numbers and their links, compared with the data set's tables. Each test fails on any error of the
// console, and on any request that leaves the report's folder.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { go, launch, open } from "./lib/browser.mjs";
import { bare, dataset, degrees, index, json, near, report } from "./lib/common.mjs";
import { readNpz, readObj } from "./lib/mesh.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const statistics = json("statistics.json").areas[0];
const votes = json("area_1/3d/votes.json");
const mesh = readObj(join(dataset, "area_1/3d/rgb.obj"));
const ofFaces = readNpz(join(dataset, "area_1/3d/votes.npz"));
const labels = json("assets/semantic_labels.json");

const areas = mesh.faces.map((corners) => {
  const [a, b, c] = corners.map((vertex) => mesh.vertices[vertex]);
  const [u, v] = [b, c].map((p) => p.map((x, k) => x - a[k]));
  const cross = [0, 1, 2].map((k) => u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
  return Math.hypot(...cross) / 2;
});

/** The number of faces of a kind, and their surface in m², counted again. */
function surfaceOf(is) {
  const faces = areas.flatMap((_, face) => (is(face) ? [face] : []));
  return { faces: faces.length, m2: faces.reduce((sum, face) => sum + areas[face], 0) };
}

const grouped = (n) => n.toLocaleString("en");

/** The cells of a table's rows, for the table after a heading. */
const rowsAfter = (page, heading, nth = 0) =>
  page
    .locator("section", { has: page.getByRole("heading", { name: heading, exact: true }) })
    .last()
    .locator("table")
    .nth(nth)
    .locator("tbody tr")
    .evaluateAll((rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent)));

test("tables have what the data set's tables have", async () => {
  const { page, faults, close } = await open(browser, report, "#/numbers");
  assert.deepEqual((await rowsAfter(page, "Data"))[0], ["Points", grouped(statistics.points)]);
  const rows = await rowsAfter(page, "Classes");
  const classes = Object.entries(statistics.instances_per_class).filter(([, instances]) => instances > 0);
  assert.equal(rows.length, classes.length);
  for (const [name, instances] of classes) {
    const [, , , pixels, faces, m2, instances_] = rows.find((row) => row[0] === name);
    assert.equal(pixels, grouped(index.pixels_by_class[index.classes.findIndex((c) => c.name === name)]));
    assert.equal(faces, grouped(votes.classes.find((c) => c.name === name).faces_voted));
    assert.equal(
      m2,
      `${surfaceOf((face) => labels[ofFaces.label[face]].split("_")[0] === name).m2.toFixed(1)} m²`,
    );
    assert.equal(instances_, String(instances));
  }
  await page.locator(".classes a").first().click();
  await page.waitForSelector(".grid");
  assert.match(await page.evaluate(() => window.location.hash), /class=\d+&sort=share/);
  assert.deepEqual(faults, []);
  await close();
});

test("votes, margins and disputes are those of votes.json", async () => {
  const { page, faults, close } = await open(browser, report, "#/numbers");
  const { total } = votes;
  const won = await rowsAfter(page, "Votes", 0);
  const close34 = total.faces_won_with_less_than_three_quarters;
  assert.deepEqual(
    won.map((row) => row[1]),
    [
      total.faces_voted - total.faces_contested,
      total.faces_contested - close34,
      close34 - total.faces_won_with_less_than_half,
      total.faces_won_with_less_than_half,
      votes.faces_without_votes,
    ].map(grouped),
  );
  const byClass = await rowsAfter(page, "Votes", 1);
  for (const part of votes.classes.filter((c) => c.points > 0)) {
    const [, points, faces, each] = byClass.find(([name]) => name === part.name);
    assert.deepEqual([points, faces], [part.points, part.faces_voted].map(grouped));
    near(Number(each), part.votes_per_voted_face, 0.051, part.name);
  }
  const cells = await page
    .locator(".matrix tbody td [title]")
    .evaluateAll((all) => all.map((cell) => cell.getAttribute("title")).sort());
  const pairs = votes.disputing_classes.map(
    (d) => `${d.classes.join(" and ")}: ${grouped(d.faces)} faces, ${d.m2.toFixed(3)} m²`,
  );
  assert.deepEqual(cells, pairs.sort());
  if (pairs.length > 0) {
    await page.locator(".matrix a").first().click();
    await page.waitForSelector(".viewer canvas");
  }
  assert.deepEqual(faults, []);
  await close();
});

test("the spread of votes and of margins is that of votes.npz", async () => {
  const { total, votes: first, runner_up_votes: second } = ofFaces;
  const { page, faults, close } = await open(browser, report, "#/numbers");
  const charts = page.locator("svg.chart:has(.column)");
  assert.equal(await charts.count(), 2);
  const percent = (text) => (text === "< 0.1" ? 0 : Number(text));
  const within = {
    votes: (face, low, high) => total[face] >= low && total[face] <= high,
    // The last bin includes its upper end.
    margin: (face, low, high) => {
      const margin = (first[face] - second[face]) / total[face];
      return total[face] > 0 && margin >= low / 100 && (margin < high / 100 || high === 100);
    },
  };
  for (const [at, kind] of ["votes", "margin"].entries()) {
    const columns = charts.nth(at).locator(".column");
    const bars = await columns.evaluateAll((all) =>
      all.map((bar) => [
        bar.getAttribute("aria-label"),
        [...bar.querySelectorAll(".bar")].map((rect) => rect.height.baseVal.value),
      ]),
    );
    const all = surfaceOf((face) => kind === "votes" || total[face] > 0);
    const sum = { faces: 0, m2: 0 };
    const ratios = [];
    for (const [words, heights] of bars) {
      const form = /^([\d,]+)(?: to ([\d,]+))? (?:votes?|%): ([\d,]+) faces \((.*) %\), (.*) m² \((.*) %\)$/;
      const found = form.exec(words);
      assert.ok(found, words);
      const [low, high, faces] = [found[1], found[2] ?? found[1], found[3]].map((text) =>
        Number(text.replaceAll(",", "")),
      );
      const counted = surfaceOf((face) => within[kind](face, low, high));
      assert.equal(faces, counted.faces, words);
      near(Number(found[5]), counted.m2, 0.051, words);
      near(percent(found[4]), (100 * counted.faces) / all.faces, 0.51, words);
      near(percent(found[6]), (100 * counted.m2) / all.m2, 0.51, words);
      [counted.faces / all.faces, counted.m2 / all.m2].forEach((share, k) => {
        if (share > 0.02) ratios.push(heights[k] / share);
        else assert.ok(heights[k] < 0.1 * 102, words);
      });
      sum.faces += faces;
      sum.m2 += counted.m2;
    }
    // Every face is in one bar, and bars of one chart have one scale.
    assert.equal(sum.faces, all.faces);
    near(sum.m2, all.m2, 1e-6, kind);
    assert.ok(ratios.length >= 2);
    ratios.forEach((ratio) => near(ratio, ratios[0], 1e-6 * ratios[0], kind));
    // By the pointer, and by the keyboard.
    const told = page
      .locator("figure", { has: page.locator(".column") })
      .nth(at)
      .locator(".told");
    await columns.last().hover();
    assert.equal(await told.textContent(), bars.at(-1)[0]);
    await columns.first().focus();
    await page.keyboard.press("ArrowRight");
    assert.equal(await told.textContent(), bars[1][0]);
    assert.equal(await page.evaluate(() => document.activeElement.getAttribute("aria-label")), bars[1][0]);
  }
  assert.equal(surfaceOf((face) => total[face] > 0).faces, votes.total.faces_voted);
  await close();
  // Without labels none of it is shown.
  const none = await open(browser, bare, "#/numbers");
  assert.equal(await none.page.locator(".column").count(), 0);
  assert.ok(!(await none.page.locator("main").textContent()).includes("Votes"));
  assert.deepEqual([...faults, ...none.faults], []);
  await none.close();
});

test("a bar of a histogram leads to its views", async () => {
  const { page, faults, close } = await open(browser, report, "#/numbers");
  const candidates = json("area_1/views.json");
  const keys = ["yaw", "pitch", "fov", "entropy"];
  const rounded = (value, places) => Math.round(value * 10 ** places) / 10 ** places;
  const valueOf = (view, key) =>
    key === "entropy" ? rounded(view.entropy, 4) : rounded(view[`${key}_rad`] / degrees, 2);
  const charts = await page
    .locator("svg.chart:has(a)")
    .evaluateAll((all) =>
      all.map((svg) =>
        [...svg.querySelectorAll("a")].map((a) => [a.getAttribute("href"), a.getAttribute("aria-label")]),
      ),
    );
  assert.equal(charts.length, 4);
  for (const [at, bars] of charts.entries()) {
    let [kept, dropped] = [0, 0];
    for (const [href, words] of bars) {
      const query = new URLSearchParams(href.split("?")[1]);
      const [min, max] = ["min", "max"].map((end) => query.get(`${keys[at]}_${end}`));
      const many = Number(words.match(/: (\d+) /)[1]);
      const of_kind = (view) => (view.frame_num === null) === (query.get("show") === "dropped");
      const within = (v) => (min === null || v >= Number(min)) && (max === null || v <= Number(max));
      const counted = candidates.filter((view) => of_kind(view) && within(valueOf(view, keys[at])));
      assert.equal(many, counted.length, `${keys[at]}: ${words}`);
      if (query.get("show") === "dropped") dropped += many;
      else kept += many;
    }
    // Every candidate is in one bar.
    assert.equal(kept, candidates.filter((view) => view.frame_num !== null).length);
    assert.equal(kept + dropped, candidates.length);
    const [href, words] = bars[Math.floor(bars.length / 2)];
    await go(page, href);
    const total = await page.locator("[role=status]").textContent();
    assert.equal(total.split(" ")[0], words.match(/: (\d+) /)[1]);
  }
  await go(page, "#/numbers");
  const links = page.locator("svg.chart").nth(1).locator("a");
  await links.first().focus();
  await page.keyboard.press("ArrowRight");
  const wanted = await links.nth(1).getAttribute("href");
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute("href")), wanted);
  await page.keyboard.press("Enter");
  await page.waitForSelector(".grid");
  assert.equal(await page.evaluate(() => window.location.hash), wanted);
  assert.deepEqual(faults, []);
  await close();
});

test("text has the page's own font, and its figures are equally wide", async () => {
  const { page, faults, close } = await open(browser, report, "#/numbers");
  const loaded = await page.evaluate(async () => {
    await document.fonts.ready;
    return [...document.fonts].filter(({ status }) => status === "loaded").map(({ family }) => family);
  });
  assert.ok(
    loaded.some((family) => family.includes("IBM Plex Sans")),
    `${loaded}`,
  );
  const widths = await page.evaluate(() => {
    const measure = document.createElement("canvas").getContext("2d");
    measure.font = getComputedStyle(document.body).font;
    return [..."0123456789"].map((figure) => measure.measureText(figure.repeat(10)).width);
  });
  assert.ok(Math.max(...widths) - Math.min(...widths) < 0.01, `${widths}`);
  assert.deepEqual(faults, []);
  await close();
});
