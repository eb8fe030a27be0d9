// A report against another data set: the scan with a chair that became a table. The differences are counted
// here from the files of both data sets. Each test fails on any error of the console, and on any request
// that leaves the report's folder.

import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { go, launch, open, readout, ready, tap } from "../lib/browser.mjs";
import {
  changedFaces,
  classOf,
  ofFaces,
  ofImage,
  other,
  partners,
  patches,
  pixelPairs,
  surfaceOf,
} from "../lib/changes.mjs";
import { degrees, near, queryOf, readPicture, stemOf, withCopy } from "../lib/common.mjs";
import {
  report,
  equal,
  index,
  compare,
  grouped,
  stemOfPicture,
  mostChanged,
  pictureOf,
  samples,
  words,
  colorsAt,
} from "./shared.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test("the matrix has what both data sets' meshes and images have", async () => {
  const { page, faults, close } = await open(browser, report, "#/compare");
  assert.equal(await page.locator("h1").textContent(), "demo against other");
  const counted = new Map();
  for (const face of changedFaces) {
    const pair = ofFaces.map((labels) => classOf(labels[face])).join(" ");
    const sum = counted.get(pair) ?? { faces: 0, m2: 0 };
    counted.set(pair, { faces: sum.faces + 1, m2: sum.m2 + surfaceOf(face) });
  }
  assert.ok(counted.get("chair table").faces > 100, "a chair became a table");
  const cells = await page
    .locator(".matrix tbody a")
    .evaluateAll((all) => all.map((a) => a.getAttribute("aria-label")));
  const shown = cells.map((words) => {
    const found =
      /^(\S+?)(?:, another instance| in A, (\S+) in B): ([\d,]+) faces?, ([\d.]+) m², ([\d,]+) pixels?/.exec(
        words,
      );
    assert.ok(found, words);
    const [, a, b, faces, m2, pixels] = found;
    const number = (text) => Number(text.replaceAll(",", ""));
    return [`${a} ${b ?? a}`, { faces: number(faces), m2: number(m2), pixels: number(pixels) }];
  });
  assert.deepEqual(shown.map(([pair]) => pair).sort(), [...counted.keys()].sort());
  for (const [pair, { faces, m2, pixels }] of shown) {
    assert.equal(faces, counted.get(pair).faces, pair);
    near(m2, counted.get(pair).m2, 0.006 * counted.get(pair).m2, pair);
    assert.equal(pixels, pixelPairs.get(pair), pair);
  }
  const sum = [...pixelPairs].filter(([pair]) => new Set(pair.split(" ")).size === 2);
  const classes = grouped(sum.reduce((all, [, n]) => all + n, 0));
  assert.ok(
    (await page.locator("main").textContent()).includes(`${classes} pixels. Another instance or class`),
  );
  // The images that differ most come first.
  const shares = await page
    .locator(".card .quiet")
    .evaluateAll((all) => all.map((e) => Number.parseFloat(e.textContent.split(":")[1].replace("<", ""))));
  assert.equal(shares.length, compare.pictures.length);
  assert.deepEqual(
    shares,
    [...shares].sort((a, b) => b - a),
  );
  assert.deepEqual(faults, []);
  await close();
});

test("instances with another number are one line, and each change is told", async () => {
  const { page, faults, close } = await open(browser, report, "#/compare");
  const renumbered = [...partners].filter(([a, b]) => a !== b && classOf(a) === classOf(b));
  const moved = changedFaces.length;
  const faces = ofFaces[0].filter((a, face) => a !== ofFaces[1][face]).length - moved;
  assert.ok(renumbered.length > 5 && faces > 400, `${renumbered.length} ${faces} ${moved}`);
  const line = page.locator(".renamed summary");
  const words = `${renumbered.length} instances renumbered, otherwise the same: `;
  assert.ok((await line.textContent()).startsWith(`${words}${grouped(faces)} faces, `));
  await line.click();
  const listed = await page.locator(".renamed li").allTextContents();
  assert.deepEqual(listed.sort(), renumbered.map(([a, b]) => `${a} in A, ${b} in B`).sort());

  const rows = page.locator("section", { hasText: "Instances that changed" }).locator("tbody tr");
  const cells = await rows.evaluateAll((all) =>
    all.map((row) => [...row.cells].map((cell) => cell.textContent)),
  );
  const [chair, table] = [...partners].find(([a, b]) => classOf(a) !== classOf(b));
  assert.deepEqual(cells[0].slice(0, 3), ["Another class", chair, table]);
  assert.deepEqual(cells[1].slice(0, 3), [
    "Merged",
    "sofa_1_lounge_1_1 + sofa_2_lounge_1_1",
    "sofa_1_lounge_1_1",
  ]);
  assert.equal(cells.length, 2);

  // Images that only show other numbers are counted apart.
  const all = [...ofImage.values()];
  const numbers = all.filter((own) => own.changed === 0 && own.renumbered > 0).length;
  assert.equal(compare.pictures.length, all.filter((own) => own.changed > 0).length);
  assert.ok(
    numbers > 5 && (await page.locator("main").textContent()).includes(`In ${numbers} images, labels`),
  );
  await rows.getByRole("link", { name: "Merged" }).click();
  await page.waitForSelector("[data-loaded=all]");
  assert.match(await page.evaluate(() => location.hash), /show=changed/);
  assert.deepEqual(faults, []);
  await close();
});

/** The folder and the name of the image in a changed picture, and its location. */
test("a cell of the matrix leads to the images that show the change, and back", async () => {
  const { page, faults, close } = await open(browser, report, "#/compare");
  const all = await page.locator(".card").count();
  const cell = page.locator(".matrix td:not(.same) a").first();
  assert.match(await cell.getAttribute("aria-label"), /^chair in A, table in B: /);
  await cell.click();
  await page.waitForFunction(() => location.hash === "#/compare?was=chair&is=table");
  await ready(page);
  const list = page.locator("section", { has: page.locator(".grid") });
  await list.getByRole("heading", { name: "Images that differ: chair in A, table in B" }).waitFor();
  const box = await list.boundingBox();
  assert.ok(box.y >= -1 && box.y < 450, `the list is at ${box.y}`);
  assert.ok(await list.evaluate((section) => document.activeElement === section));
  // The images that show the change, and their numbers of pixels, counted from the labels of both data
  // sets.
  const wanted = [...ofImage.values()].filter((pixels) => pixels.chair_table > 0).length;
  const more = list.getByRole("button", { name: /Show more/ });
  while (await more.isVisible()) await more.click();
  const cards = await list
    .locator(".card a")
    .evaluateAll((links) => links.map((a) => [a.getAttribute("href"), a.getAttribute("aria-label")]));
  assert.ok(wanted > 3 && wanted < compare.pictures.length, `${wanted} of ${compare.pictures.length}`);
  assert.equal(cards.length, wanted);
  const pixels = cards.map(([href, label]) => {
    const [, k] = /^#\/compare\/(\d+)\?was=chair&is=table$/.exec(href);
    const shown = Number(/\. ([\d,]+) pixels: /.exec(label)[1].replaceAll(",", ""));
    assert.equal(shown, ofImage.get(stemOfPicture(compare.pictures[k])[1]).chair_table, label);
    return shown;
  });
  assert.deepEqual(
    pixels,
    [...pixels].sort((a, b) => b - a),
  );
  const sum = pixels.reduce((a, b) => a + b, 0);
  assert.equal(sum, pixelPairs.get("chair table"));
  assert.ok((await list.textContent()).includes(`with this change, in ${grouped(sum)} pixels`));
  // From one of these images to the next, and back.
  await list.locator(".card a").first().click();
  await page.waitForSelector(".viewer canvas");
  await ready(page);
  for (let k = 1; k < wanted; k++) {
    await page.getByLabel("Image that differs less").click();
    const name = cards[k][1].split(". ")[0];
    await page.waitForFunction((to) => document.querySelector("h1").textContent === to, name);
    assert.equal((await queryOf(page)).is, "table");
  }
  assert.equal(await page.getByLabel("Image that differs less").count(), 0);
  await page.getByRole("link", { name: "Images: chair in A, table in B" }).click();
  await list.getByRole("link", { name: "All images that differ" }).click();
  await page.getByRole("heading", { name: "Images that differ", exact: true }).waitFor();
  assert.equal(await page.evaluate(() => location.hash), "#/compare");
  assert.equal(await page.locator(".card").count(), all);
  await go(page, "#/compare?was=sofa&is=<script>");
  assert.match(
    await page.locator("main").textContent(),
    /sofa in A, <script> in BNo image shows this change/,
  );
  assert.deepEqual(faults, []);
  await close();
});

test("in 3D and on the plan, what changed is where it changed", async () => {
  const { page, faults, close } = await open(browser, report, "#/compare");
  await page
    .locator(".matrix a", { hasText: "147 faces" })
    .or(page.locator(".matrix td:not(.same) a"))
    .first()
    .click();
  await page.getByRole("link", { name: "This change in 3D" }).click();
  await page.waitForSelector("[data-loaded=all]");
  const changed = new Set(changedFaces);
  const middle = async () => {
    const box = await page.locator(".viewer canvas").boundingBox();
    const at = [Math.round(box.x + box.width / 2), Math.round(box.y + box.height / 2)];
    await page.mouse.move(at[0] + 1, at[1]);
    await page.mouse.move(...at);
    return { told: await readout(page), at };
  };
  const { told, at } = await middle();
  const face = Number(told.face);
  assert.ok(changed.has(face), `face ${told.face}`);
  const [a, b] = ofFaces.map((labels) => labels[face]);
  assert.deepEqual([classOf(a), classOf(b)], ["chair", "table"]);
  assert.deepEqual([told.A, told.B], [words(a), words(b)]);
  // Beside the mark of the place, the face has its colour.
  const png = PNG.sync.read(await page.screenshot());
  const [r, g, blue] = colorsAt(png, [at[0] + 12, at[1]]);
  assert.ok(r > 150 && g < 20 && near(r, blue, 3, "magenta") === undefined, `${r} ${g} ${blue}`);
  await page.waitForFunction(() => location.hash.includes("from="));
  assert.equal((await queryOf(page)).show, "changed");
  // From the list: another instance.
  const list = page.getByLabel("Changed labels");
  const entries = await list.locator("option").allTextContents();
  const pairs = new Map();
  for (const face of changedFaces) {
    const pair = `${ofFaces.map((labels) => labels[face]).join(" in A, ")} in B`;
    pairs.set(pair, (pairs.get(pair) ?? 0) + 1);
  }
  const wanted = [...pairs].map(([pair, n]) => `${pair} · ${n} face${n === 1 ? "" : "s"}`);
  assert.deepEqual(entries.slice(1).sort(), wanted.sort());
  assert.equal(entries[1], `${a} in A, ${b} in B · ${pairs.get(`${a} in A, ${b} in B`)} faces`);
  const next = entries.findIndex((entry) => entry.startsWith("sofa_"));
  await list.selectOption({ index: next });
  await page.waitForTimeout(1200);
  const second = (await middle()).told;
  const pair = `${ofFaces.map((labels) => labels[second.face]).join(" in A, ")} in B`;
  assert.ok(entries[next].startsWith(`${pair} `), `${entries[next]}, and it is ${pair}`);

  await go(page, "#/plan");
  const label = ({ was, is, faces }) =>
    `Changed: ${was} in A, ${is} in B: ${grouped(faces)} face${faces === 1 ? "" : "s"}, `;
  const marks = await page
    .locator(".plan a:has(.change)")
    .evaluateAll((all) => all.map((mark) => mark.getAttribute("aria-label").replace(/[\d.]+ m²$/, "")));
  assert.deepEqual(marks.sort(), patches.map(label).sort());
  const ofClass = patches.filter(({ was, is }) => classOf(was) !== classOf(is));
  assert.equal(await page.locator(".plan a:has(.change.class)").count(), ofClass.length);
  const mark = page.locator(".plan a:has(.change.class)").last();
  assert.ok((await mark.getAttribute("aria-label")).startsWith(`Changed: ${a} in A, ${b} in B: `));
  await mark.focus();
  await page.keyboard.press("Enter");
  await page.waitForSelector("[data-loaded=all]");
  assert.equal(classOf(ofFaces[1][(await middle()).told.face]), "table");
  assert.deepEqual(faults, []);
  await close();
});

test("faces without a label in A are marked on the plan, too", async () => {
  const changed = readPicture(report, "changed_1");
  const [x, y, z] = index.locations[0].position;
  changed.patches = [{ a: 0, b: 1, faces: 1234, m2: 0.5, center: [x + 0.3, y, z - 1] }];
  const none = structuredClone(index);
  for (const mesh of none.meshes) mesh.has_boxes = false;
  await withCopy(
    (write) => {
      write("changed_1", changed);
      write("index", none);
    },
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/plan");
      const mark = page.locator(".plan a:has(.change)");
      const name = compare.labels[1].name;
      assert.equal(
        await mark.getAttribute("aria-label"),
        `Changed: unlabelled in A, ${name} in B: 1,234 faces, 0.500 m²`,
      );
      const circle = page.locator(".plan .stand").first();
      const [at, stand] = [await mark.boundingBox(), await circle.boundingBox()];
      assert.ok(Math.abs(at.y + at.height / 2 - stand.y - stand.height / 2) < 2, "north of the location");
      assert.ok(at.x + at.width / 2 > stand.x + stand.width / 2, "east of it");
      await mark.click();
      await page.waitForSelector("[data-loaded=all]");
      const query = await queryOf(page);
      assert.equal(query.show, "changed");
      near(Number(query.at.split(",")[0]), x + 0.3, 0.01, "x");
      assert.deepEqual(faults, []);
      await close();
    },
    report,
  );
});

test("views, poses, settings and faults are told, with links to their places", async () => {
  const changed = structuredClone(compare);
  const { comparison } = changed;
  const of = (view) => ({ area: 1, uuid: index.locations[view.location].uuid, candidate: view.candidate });
  const kept = index.views.find((view) => view.frame !== null);
  const dropped = index.views.find((view) => view.frame === null);
  comparison.views.lost = [of(kept)];
  comparison.views.gained = [of(dropped)];
  comparison.views.locations_lost = [{ area: 1, uuid: index.locations[2].uuid }];
  const pose = `area_1/data/pose/${stemOf("area_1/data/pose", of(kept).uuid, kept.frame)}_domain_pose.json`;
  comparison.poses.moved = [{ a: pose, b: pose, m: 0.0123, degrees: 1.5, k_px: null }];
  comparison.settings = [{ name: "options.size", a: 270, b: null }];
  comparison.unread = [{ side: "b", path: "area_1/views.json", message: "it is damaged" }];
  comparison.notes = ["Nothing else was compared."];
  const rgb = { pixels: 1000, pixels_changed: 250, psnr_db: 31.25, mean: null, largest: null };
  changed.pictures[0].pixels = { rgb };
  Object.assign(comparison.modalities[0], { changed: 1, same: 57, ...rgb });
  const depth = comparison.modalities.find((m) => m.modality === "depth");
  Object.assign(depth, { changed: 2, pixels: 100, pixels_changed: 3, mean: 0.5, largest: 1.25 });
  await withCopy(
    (write) => write("compare", changed),
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/compare");
      const text = await page.locator("main").textContent();
      for (const words of [
        "PSNR 31.3 dB",
        "largest 1.3 m",
        "options.size",
        "it is damaged",
        "Nothing else was",
      ])
        assert.ok(text.includes(words), words);
      assert.equal(await page.locator(".card .quiet", { hasText: "Colour: 25 %" }).count(), 1);
      const hrefs = async (title) => {
        await page.locator("summary", { hasText: title }).click();
        return page.locator("details", { hasText: title }).locator("a").first().getAttribute("href");
      };
      assert.equal(await hrefs("Kept in A alone"), `#/view/${kept.picture}`);
      assert.ok((await hrefs("Kept in B alone")).startsWith(`#/pano/1/${of(dropped).uuid}?lon=`));
      assert.equal(await hrefs("Scan locations in A alone"), `#/pano/1/${index.locations[2].uuid}`);
      const moved = page.locator("tr", { hasText: "0.0123 m" });
      assert.equal(await moved.locator("a").getAttribute("href"), `#/view/${kept.picture}`);
      // An image that differs in colours is shown in colours.
      await go(page, "#/compare/0");
      assert.equal(await page.getByLabel("What of both is shown").inputValue(), "rgb");
      assert.deepEqual(faults, []);
      await close();
    },
    report,
  );
});

test("files of the comparison that are damaged are told of, and the rest is shown", async () => {
  await withCopy(
    (write) => write("changed_1", { ...readPicture(report, "changed_1"), faces: 7 }),
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/space");
      await page.waitForSelector("[data-loaded=all]");
      assert.match(await page.locator("[role=alert]").textContent(), /data\/changed_1\.js is damaged/);
      await go(page, "#/plan");
      assert.match(await page.locator("[role=alert]").textContent(), /data\/changed_1\.js is damaged/);
      assert.ok((await page.locator(".plan .room").count()) > 0);
      assert.deepEqual(faults, []);
      await close();
    },
    report,
  );
  await withCopy(
    (_, folder) => writeFileSync(join(folder, "data/compare.js"), "// cut off"),
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/compare");
      assert.match(await page.locator("[role=alert]").textContent(), /data\/compare\.js is damaged/);
      await go(page, "#/space");
      await page.waitForSelector("[data-loaded=all]");
      assert.match(await page.locator("[role=alert]").first().textContent(), /data\/compare\.js is damaged/);
      assert.deepEqual(faults, []);
      await close();
    },
    report,
  );
});

test("two equal data sets are said to be equal", async () => {
  const { page, faults, close } = await open(browser, equal, "#/compare");
  assert.match(await page.locator("main").textContent(), /Both are equal/);
  assert.equal(await page.locator(".card, .matrix").count(), 0);
  await go(page, "#/space");
  await page.waitForSelector("[data-loaded=mesh], [data-loaded=all]");
  assert.ok(!(await page.getByLabel("Colours").locator("option").allTextContents()).includes("Changed"));
  assert.equal(await page.getByLabel("Changed labels").count(), 0);
  assert.deepEqual(faults, []);
  await close();
});

test("at 390 pixels all of it can be read", async () => {
  const { k } = mostChanged("data");
  const { page, faults, close } = await open(browser, report, "#/compare", {
    width: 390,
    height: 844,
    touch: true,
  });
  for (const hash of ["#/compare", `#/compare/${k}`, "#/compare/0"]) {
    await go(page, "#/notes");
    await go(page, hash);
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390, hash);
  }
  const box = await page.locator(".viewer canvas").boundingBox();
  await tap(page, box.x + 0.3 * box.width, box.y + 0.6 * box.height);
  assert.match((await readout(page)).A, /·|unlabelled|nothing/);
  assert.deepEqual(faults, []);
  await close();
});

test("hostile names of the other data set and of its labels are text", async () => {
  const evil = '"><script>alert(1)</script>\u202e';
  const label = "chair_<img src=x onerror=alert(2)>_1_1";
  const [changedIndex, changed] = [structuredClone(index), structuredClone(compare)];
  changedIndex.against = evil;
  changed.comparison.b.folder = evil;
  const { k, own } = mostChanged("data");
  const place = samples(own, pictureOf(k).size, 4).find(({ kind }) => kind === "class");
  changed.labels.find(({ name }) => name === place.b).name = label;
  changed.comparison.labels.instances[0].a = [label];
  changed.comparison.labels.renumbered[0].b = label;
  changed.comparison.labels.matrix[0].b = evil;
  changed.comparison.labels.added = [label];
  changed.comparison.settings = [{ name: evil, a: evil, b: [evil] }];
  changed.comparison.files[0].first = [evil];
  changed.comparison.notes = [evil];
  await withCopy(
    (write) => {
      write("index", changedIndex);
      write("compare", changed);
    },
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/compare");
      assert.equal(await page.locator("h1").textContent(), `demo against ${evil}`);
      const text = await page.locator("main").textContent();
      assert.ok(text.includes(label) && text.split(evil).length > 6);
      await go(page, `#/compare/${k}?split=0.9`);
      const box = await page.locator(".viewer canvas").boundingBox();
      const [width, height] = pictureOf(k).size;
      const at = [((place.i + 0.5) / width) * box.width, ((place.j + 0.5) / height) * box.height];
      await page.mouse.move(box.x + at[0], box.y + at[1]);
      assert.equal((await readout(page)).B, `chair · ${label}`.replace("chair ·", "table ·"));
      await go(page, "#/plan");
      await go(page, "#/space?show=changed");
      await page.waitForSelector("[data-loaded=mesh], [data-loaded=all]");
      assert.equal(await page.locator("main script, main img[src=x]").count(), 0);
      assert.deepEqual(faults, []);
      await close();
    },
    report,
  );
});
