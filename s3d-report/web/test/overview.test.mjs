// The first page: the building and its line, storeys, classes, richest views, and the field that finds.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { USUAL, drawn, go, launch, open, ready } from "./lib/browser.mjs";
import { bare, index, queryOf, report, withCopy } from "./lib/common.mjs";
import { UP, house } from "./lib/house.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const loaded = (page) => page.waitForSelector("[data-loaded=all]");
const hashOf = (page) => page.evaluate(() => window.location.hash);

/** The colours of the stage. */
async function shot(page) {
  await page.mouse.move(2, 2);
  await drawn(page);
  await drawn(page);
  return PNG.sync.read(await page.locator(".stage canvas").screenshot());
}

/** The share of the pixels of a strip of the stage that differ. */
function differs(a, b, from = 0, to = 1) {
  let [n, all] = [0, 0];
  for (let y = 0; y < a.height; y += 2)
    for (let x = Math.ceil(from * a.width); x < to * a.width; x += 2) {
      const at = 4 * (y * a.width + x);
      all += 1;
      n += [0, 1, 2].some((k) => Math.abs(a.data[at + k] - b.data[at + k]) > 12) ? 1 : 0;
    }
  return n / all;
}

test("the overview opens first, and its line, classes and views do what they say", async () => {
  const { page, faults, close } = await open(browser, report, "", USUAL);
  await loaded(page);
  assert.equal(await page.locator("nav a[aria-current]").textContent(), "Overview");
  assert.equal(await page.locator("h1").textContent(), index.data_set.name);
  assert.match(await page.locator(".overview-head p").textContent(), /^Four rooms: .*six scan locations\.$/);
  const numbers = await page.locator(".facts-six dd").allTextContents();
  assert.deepEqual(numbers.slice(1, 2), [String(index.labels.filter((l) => l.class !== null).length)]);
  assert.equal(numbers.length, 6);
  assert.equal(await page.locator(".storeys").count(), 0, "there is one storey");
  assert.equal(await page.locator(".stop:visible").count(), 0, "nothing turns without motion");

  // The line: colours left of it, classes right of it.
  const line = page.getByRole("slider", { name: "Line between the two colourings" });
  await line.focus();
  await page.keyboard.press("Home");
  const classes = await shot(page);
  await page.keyboard.press("End");
  assert.match(await line.getAttribute("aria-valuetext"), /Colour on 100 %, Class on the rest/);
  const colors = await shot(page);
  await page.keyboard.press("Home");
  for (let k = 0; k < 25; k++) await page.keyboard.press("ArrowRight");
  assert.equal(await line.getAttribute("aria-valuenow"), "50");
  const half = await shot(page);
  assert.ok(differs(colors, classes) > 0.1, "colours and classes differ");
  assert.ok(differs(half, colors, 0, 0.48) < 0.01 && differs(half, classes, 0.52, 1) < 0.01);

  // One class alone has its colours.
  await page.keyboard.press("Home");
  const chair = page.getByRole("button", { name: /^chair/ });
  await chair.click();
  assert.equal(await chair.getAttribute("aria-pressed"), "true");
  const own = index.classes.find(({ name }) => name === "chair").color;
  const isOf = (at, data) => {
    const light =
      [0, 1, 2].reduce((sum, k) => sum + data[at + k] * own[k], 0) / own.reduce((s, c) => s + c * c, 0);
    return light > 0.5 && own.every((c, k) => Math.abs(data[at + k] - light * c) < 6);
  };
  const only = await shot(page);
  let [kept, grey, same] = [0, 0, 0];
  for (let at = 0; at < only.data.length; at += 4 * 7) {
    const pixel = only.data.subarray(at, at + 3);
    if (isOf(at, classes.data)) kept += isOf(at, only.data) ? 1 : 0;
    else if (Math.max(...pixel) - Math.min(...pixel) < 12) grey += 1;
    else same += 1;
  }
  assert.ok(kept > 30 && grey > 10 * same, `${kept} kept, ${grey} grey, ${same} others`);
  await chair.click();
  assert.equal(await chair.getAttribute("aria-pressed"), "false");
  assert.ok(differs(await shot(page), classes) < 0.01);
  await page.getByRole("button", { name: "Colour", exact: true }).click();
  assert.ok(differs(await shot(page), colors) < 0.01 && !(await line.isVisible()));

  // The strip has different rooms, and leads to its views.
  const views = page.locator(".richest-views a");
  const shown = await views.evaluateAll((links) =>
    links.map((a) => Number(a.getAttribute("href").split("/")[2])),
  );
  const rooms = new Set(shown.slice(0, 4).map((n) => index.views.find((v) => v.picture === n).room));
  assert.equal(rooms.size, index.rooms.length, "the first views show each room");
  await page.waitForFunction(() =>
    [...document.querySelectorAll(".richest-views img")].every((i) => i.naturalWidth),
  );
  await views.nth(1).click();
  await page.waitForSelector(".view-body");
  assert.equal(await hashOf(page).then((hash) => hash.split("?")[0]), `#/view/${shown[1]}`);
  assert.deepEqual(faults, []);
  await close();
});

test("anything is found by its name, from every page", async () => {
  const { page, faults, close } = await open(browser, report, "#/numbers");
  const field = page.getByRole("combobox", { name: "Find anything" });
  const chosen = () => page.locator("[role=option][aria-selected=true]");
  const leads = async (words, keys, to) => {
    const was = await page.getAttribute("body", "data-ready");
    await page.keyboard.press("Control+k");
    assert.ok(await field.evaluate((element) => element === document.activeElement));
    await page.keyboard.type(words);
    for (const key of keys) await page.keyboard.press(key);
    assert.equal(await field.getAttribute("aria-activedescendant"), await chosen().getAttribute("id"));
    await page.keyboard.press("Enter");
    await page.waitForFunction((before) => document.body.dataset.ready !== before, was);
    await ready(page);
    assert.match(await hashOf(page), to);
  };
  const location = index.locations[0];
  await leads(location.uuid.slice(0, 8), [], new RegExp(`^#/pano/1/${location.uuid}`));
  await leads("class sofa", [], /^#\/views\?.*class=\d+/);
  await leads("lounge", ["ArrowDown", "ArrowUp"], /^#\/space\/1\?/);
  await leads("chair 1 conference", [], /^#\/space\/1\?/);
  await loaded(page);
  // The camera flies there. When it has arrived, the instance is in the middle.
  const box = await page.locator(".viewer canvas").boundingBox();
  const named = page.locator(".readout", { hasText: "chair_1_conferenceRoom_1" });
  for (let tries = 0; tries < 60 && (await named.count()) === 0; tries++) {
    await page.mouse.move(box.x + box.width / 2 + 4 * (tries % 2), box.y + box.height / 2);
    await drawn(page);
  }
  assert.equal(await named.count(), 1, await page.locator(".readout").textContent());

  await go(page, "#/notes");
  await page.keyboard.press("/");
  await page.keyboard.type("zzz");
  assert.equal(await field.getAttribute("aria-expanded"), "false");
  assert.match(await page.locator(".find [aria-live]").textContent(), /Nothing/);
  await field.fill("");
  assert.equal(await field.getAttribute("aria-expanded"), "true");
  await page.keyboard.press("Escape");
  assert.equal(await page.locator("[role=listbox]:visible").count(), 0);
  assert.match(await hashOf(page), /^#\/notes/);
  assert.deepEqual(faults, []);
  await close();
});

test("two storeys: the one with more rooms opens, and each is cut above its own ceilings", async () => {
  await withCopy(
    (write) => Object.entries(house()).forEach(([key, value]) => write(key, value)),
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/space");
      await loaded(page);
      const names = await page.locator(".storeys button").allTextContents();
      assert.deepEqual(names, ["First floor · 2 rooms", "Ground floor · 4 rooms", "All storeys"]);
      const pressed = () => page.locator(".storeys [aria-pressed=true]").allTextContents();
      assert.deepEqual(await pressed(), [names[1]]);
      const cut = async () => {
        await page.waitForTimeout(400);
        const { section, base } = await queryOf(page);
        return [Number(section), base === undefined ? null : Number(base)];
      };
      const roomsShown = (count) =>
        page.waitForFunction(
          (n) => [...document.querySelectorAll(".room-name")].filter((name) => !name.hidden).length === n,
          count,
        );
      const [ground, none] = await cut();
      assert.ok(ground > 1.9 && ground < UP && none === null, `${ground}`);
      await roomsShown(4);
      await page.getByRole("button", { name: names[0] }).click();
      const [first, base] = await cut();
      assert.ok(Math.abs(first - ground - UP) < 0.02 && base > ground && base < UP, `${first}, ${base}`);
      await roomsShown(2);
      assert.deepEqual(await pressed(), [names[0]]);
      const hash = await hashOf(page);
      await page.getByRole("button", { name: names[2] }).click();
      assert.deepEqual([await cut(), await pressed()], [[first, null], [names[2]]]);
      await go(page, "#/plan");
      assert.deepEqual(await page.locator("h3").allTextContents(), ["Ground floor", "First floor"]);
      // The address remembers the storey, and the overview has the same ones.
      await go(page, hash);
      await loaded(page);
      assert.deepEqual(await pressed(), [names[0]]);
      await go(page, "#/overview");
      await loaded(page);
      assert.deepEqual(
        [await page.locator(".storeys button").allTextContents(), await pressed()],
        [names, [names[1]]],
      );
      assert.match(await page.locator(".overview-head p").textContent(), /^Six rooms on two storeys/);
      const lower = await shot(page);
      await page.getByRole("button", { name: names[0] }).click();
      assert.ok(differs(await shot(page), lower) > 0.02);
      assert.deepEqual(faults, []);
      await close();
    },
  );
});

test("the overview fits every width, light and dark, with and without labels, views and areas", async () => {
  const change = (write) => {
    const changed = structuredClone(index);
    changed.views = [];
    changed.areas.push({ ...changed.areas[0], area: 2 });
    changed.meshes.push({
      ...changed.meshes[0],
      area: 2,
      files: 0,
      texture_files: 0,
      has_votes: false,
      has_boxes: false,
    });
    write("index", changed);
  };
  await withCopy(change, async (folder) => {
    for (const [where, width, dark] of [
      [report, 390, false],
      [bare, 900, true],
      [folder, 390, true],
    ]) {
      const { page, faults, close } = await open(browser, where, "#/overview", { width, height: 860, dark });
      await loaded(page);
      const sizes = await page.evaluate(() => {
        const boxes = [".overview-head", ".stage", ".overview-bar"].map((name) =>
          document.querySelector(name).getBoundingClientRect().toJSON(),
        );
        return { wide: document.scrollingElement.scrollWidth, boxes };
      });
      assert.ok(sizes.wide <= width, `${where} is ${sizes.wide} pixels wide`);
      const [about, stage, bar] = sizes.boxes;
      assert.ok(about.bottom <= stage.top + 1 && stage.height > 300, JSON.stringify(sizes));
      assert.ok(bar.top > stage.top && bar.bottom <= stage.bottom + 1 && bar.width <= width);
      const hasLabels = where !== bare;
      assert.equal(await page.locator(".classes-legend").count(), hasLabels ? 1 : 0);
      assert.equal(await page.locator(".richest").count(), where === folder ? 0 : 1);
      const text = await page.locator("[role=slider]").first().getAttribute("aria-valuetext");
      assert.match(text, hasLabels ? /Class on the rest/ : /Normals on the rest/);
      if (where === folder) {
        await page.getByLabel("Area", { exact: true }).selectOption({ label: "Area 2" });
        await page.waitForFunction(() => window.location.hash === "#/overview/2");
        await loaded(page);
      }
      assert.deepEqual(faults, []);
      await close();
    }
  });
});

test("the building turns slowly until it is touched", async () => {
  const { page, faults, close } = await open(browser, report, "#/overview", { motion: true });
  await loaded(page);
  const stop = page.getByRole("button", { name: "Stop turning" });
  const [first, second] = [await shot(page), (await page.waitForTimeout(900), await shot(page))];
  assert.ok(differs(first, second) > 0.005, "it turns");
  await page.locator(".stage canvas").focus();
  await page.keyboard.press("ArrowLeft");
  assert.equal(await stop.isVisible(), false);
  const still = await shot(page);
  await page.waitForTimeout(500);
  assert.equal(differs(still, await shot(page)), 0);
  assert.deepEqual(faults, []);
  await close();
});

for (const [width, dark] of [
  [1440, false],
  [900, true],
  [390, false],
]) {
  test(`the address has what the overview shows at ${width}, and opens it again`, async () => {
    await withCopy(
      (write) => Object.entries(house()).forEach(([key, value]) => write(key, value)),
      async (folder) => {
        const { page, faults, close } = await open(browser, folder, "", { width, dark });
        await loaded(page);
        await page.waitForTimeout(400);
        assert.equal(await hashOf(page), "", "nothing was chosen yet");
        const wait = (words) => page.waitForFunction((w) => window.location.hash.includes(w), words);
        await page.getByRole("button", { name: /^First floor/ }).click();
        await wait("storey=1");
        await page.getByRole("button", { name: "Instance", exact: true }).click();
        await wait("right=instance");
        await page.getByRole("button", { name: /^wall/ }).click();
        await wait(`only=${index.classes.findIndex(({ name }) => name === "wall")}`);
        await page.getByRole("slider").focus();
        for (let k = 0; k < 5; k++) await page.keyboard.press("ArrowLeft");
        await wait("line=0.400");
        assert.ok(!(await hashOf(page)).includes("from="), "the viewpoint was not touched");
        await page.locator(".stage canvas").focus();
        await page.keyboard.press("ArrowLeft");
        await page.keyboard.press("+");
        await wait("from=");
        await page.getByRole("slider").focus();
        await page.waitForTimeout(400);
        const hash = await hashOf(page);
        const before = await shot(page);

        // Back and forth.
        await go(page, "#/numbers");
        await page.goBack();
        await loaded(page);
        assert.equal(await hashOf(page), hash);
        assert.ok(differs(await shot(page), before) < 0.02, "the same picture as before");
        await close();

        const other = await open(browser, folder, hash, { width, dark });
        await loaded(other.page);
        const shown = other.page.locator("[aria-pressed=true]");
        const pressed = await shown.allTextContents();
        assert.deepEqual(pressed.map((words) => words.split(/ [·\d]|\d/)[0]).sort(), [
          "First floor",
          "Instance",
          "wall",
        ]);
        assert.ok(differs(await shot(other.page), before) < 0.02, "the same picture elsewhere");
        // A storey that one chooses is seen from where all of it is seen.
        await other.page.getByRole("button", { name: /^Ground floor/ }).click();
        await other.page.waitForFunction(() => !window.location.hash.includes("from="));
        assert.deepEqual([...faults, ...other.faults], []);
        await other.close();
      },
    );
  });
}

test("an overview's address that says nonsense shows what is shown at first", async () => {
  const { page, faults, close } = await open(
    browser,
    report,
    "#/overview/1?storey=7&right=x&line=y&only=99&at=1",
  );
  await loaded(page);
  assert.equal(await page.getByRole("slider").getAttribute("aria-valuenow"), "50");
  assert.deepEqual(await page.locator("[aria-pressed=true]").allTextContents(), ["Class"]);
  assert.deepEqual(faults, []);
  await close();
});
