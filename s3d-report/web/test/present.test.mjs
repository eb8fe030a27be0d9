// The presentation: it goes by itself, stops, steps, leads back, and shows what there is.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { PNG } from "pngjs";
import { drawn, go, launch, open, ready } from "./lib/browser.mjs";
import { bare, index, report, withCopy } from "./lib/common.mjs";
import { house } from "./lib/house.mjs";

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

const hashOf = (page) => page.evaluate(() => window.location.hash);
const at = (page, step) => page.waitForSelector(`main.present[data-step="${step}"]:not([aria-busy])`);
const kindOf = (page) => page.locator("main.present").getAttribute("data-kind");
const title = (page) => page.locator(".present-title").textContent();

/** The share of the pixels of two pictures that differ. */
function differs(a, b) {
  let n = 0;
  for (let k = 0; k < a.data.length; k += 4 * 11)
    n += [0, 1, 2].some((c) => Math.abs(a.data[k + c] - b.data[k + c]) > 16) ? 1 : 0;
  return n / (a.data.length / 44);
}

/** The scene without what lies over it, which comes and goes. */
async function shot(page) {
  const over = (visibility) =>
    page.evaluate((to) => {
      for (const name of [".present-controls", ".present-progress"])
        document.querySelector(name).style.visibility = to;
    }, visibility);
  await over("hidden");
  await drawn(page);
  const file = await page.locator(".present-stage").screenshot();
  await over("");
  return PNG.sync.read(file);
}

for (const [width, height, dark] of [
  [1440, 900, false],
  [900, 700, true],
  [390, 844, false],
]) {
  test(`the presentation fills the window at ${width}, steps, stops, and leads back`, async () => {
    const { page, faults, close } = await open(browser, report, "#/numbers", { width, height, dark });
    await page.getByRole("link", { name: "Present", exact: true }).click();
    await at(page, 1);
    assert.ok(!(await page.locator("header").isVisible()), "there is nothing but the presentation");
    const box = await page.locator("main.present").boundingBox();
    const size = await page.evaluate(() => [window.innerWidth, window.innerHeight]);
    assert.deepEqual([box.x, box.y, box.width, box.height], [0, 0, ...size]);
    assert.equal(await kindOf(page), "building");
    assert.equal(await title(page), index.data_set.name);
    assert.match(await page.locator(".present-caption").textContent(), /4 rooms.*wall/);
    const picture = await shot(page);
    assert.ok(new Set(picture.data).size > 40, "the building is drawn");

    // Steps by keys and by buttons; the pictures show different rooms.
    await page.keyboard.press("ArrowRight");
    await at(page, 2);
    assert.equal(await hashOf(page), "#/present?step=2");
    const rooms = new Set([await title(page)]);
    for (const step of [3, 4, 5]) {
      await page.getByRole("button", { name: "Next step" }).click();
      await at(page, step);
      rooms.add(await title(page));
    }
    assert.ok(rooms.size >= 3, [...rooms].join());
    await page.keyboard.press("ArrowLeft");
    await at(page, 4);
    await page.keyboard.press("End");
    const last = Number(/of (\d+)/.exec(await page.locator(".present-count").textContent())[1]);
    await at(page, last);
    assert.equal(await kindOf(page), "panorama");

    // Space holds it, and it stands still.
    await page.locator("main.present").focus();
    await page.keyboard.press(" ");
    const play = page.getByRole("button", { name: "Play" });
    await play.waitFor();
    assert.equal(await page.locator("[aria-roledescription=step]").getAttribute("aria-live"), "polite");
    const bar = page.locator(".present-progress");
    const held = await bar.evaluate((element) => element.style.width);
    await page.waitForTimeout(900);
    assert.equal(await bar.evaluate((element) => element.style.width), held);
    await play.focus();
    await page.keyboard.press(" ");
    await page.getByRole("button", { name: "Pause" }).waitFor();

    // Escape leads back to where one was.
    await page.keyboard.press("Escape");
    await page.waitForSelector("main:not(.present)");
    await ready(page);
    assert.equal(await hashOf(page), "#/numbers");
    assert.ok(await page.locator("header").isVisible());
    const focused = await page.evaluate(() => document.activeElement.textContent);
    assert.equal(focused, "Present");
    assert.deepEqual(faults, []);
    await close();
  });
}

test("a link opens a step, the controls go and come, and one leaves to the first page", async () => {
  const { page, faults, close } = await open(browser, report, "#/present?step=3");
  await at(page, 3);
  const opacity = () =>
    page.locator(".present-controls").evaluate((e) => Number(getComputedStyle(e).opacity));
  await page.waitForSelector(".present.idle");
  assert.equal(await opacity(), 0);
  await page.keyboard.press("Tab");
  assert.equal(await opacity(), 1, "the focus shows them");
  assert.ok(await page.getByRole("button", { name: "Previous step" }).evaluate((e) => e.matches(":focus")));
  await page.evaluate(() => document.activeElement.blur());
  await page.waitForSelector(".present.idle");
  await page.mouse.move(300, 300);
  assert.equal(await opacity(), 1, "the pointer shows them");
  await page.getByRole("button", { name: "Leave the presentation" }).click();
  await page.waitForSelector("main.overview");
  assert.deepEqual(faults, []);
  await close();
});

test("without motion nothing moves: colours, then classes, then the next step", async () => {
  const { page, faults, close } = await open(browser, report, "#/present?step=2");
  await at(page, 2);
  const first = await shot(page);
  await page.waitForTimeout(1500);
  assert.ok(differs(await shot(page), first) < 0.002, "it stands still");
  assert.equal(await page.locator(".present-line:visible").count(), 0);
  await page.waitForFunction(() => document.querySelector(".present-progress").style.width === "50%");
  assert.ok(differs(await shot(page), first) > 0.1, "the classes are shown");
  await at(page, 3);
  assert.deepEqual(faults, []);
  await close();
});

test("with motion the building turns and the line goes over it; then comes the next step", async () => {
  const { page, faults, close } = await open(browser, report, "#/present", {
    motion: true,
    width: 640,
    height: 400,
  });
  await at(page, 1);
  const first = await shot(page);
  await page.locator(".present-line:visible").waitFor();
  assert.ok(differs(await shot(page), first) > 0.02, "it turns");
  await at(page, 2);
  assert.deepEqual(faults, []);
  await close();
});

test("each storey has its step", async () => {
  await withCopy(
    (write) => Object.entries(house()).forEach(([key, value]) => write(key, value)),
    async (folder) => {
      const { page, faults, close } = await open(browser, folder, "#/present");
      const told = [];
      for (let step = 1; step <= 4; step++) {
        await at(page, step);
        told.push([await kindOf(page), await page.locator(".present-caption p").nth(1).textContent()]);
        await page.keyboard.press("ArrowRight");
      }
      assert.deepEqual(told.slice(0, 3), [
        ["building", "2 storeys"],
        ["building", "Ground floor · 4 rooms"],
        ["building", "First floor · 2 rooms"],
      ]);
      assert.equal(told[3][0], "view");
      assert.deepEqual(faults, []);
      await close();
    },
  );
});

test("a scan without labels, and reports that lack meshes, panoramas or all, are presented", async () => {
  const { page, faults, close } = await open(browser, bare, "#/present");
  await at(page, 1);
  assert.match(await page.locator(".present-layers").textContent(), /^Colour \| Normals$/);
  await page.keyboard.press("ArrowRight");
  await at(page, 2);
  assert.match(await page.locator(".present-caption").textContent(), /View · scan location [0-9a-f]{8}/);
  assert.match(await page.locator(".present-layers").textContent(), /^Colour \| Depth$/);
  assert.deepEqual(faults, []);
  await close();

  const less = (change) => (write) => {
    const changed = structuredClone(index);
    change(changed);
    write("index", changed);
  };
  const steps = async (folder) => {
    const opened = await open(browser, folder, "#/present");
    await at(opened.page, 1);
    const kind = await kindOf(opened.page);
    assert.deepEqual(opened.faults, []);
    await opened.close();
    return kind;
  };
  await withCopy(
    less((i) => (i.meshes = [])),
    async (folder) => assert.equal(await steps(folder), "view"),
  );
  const none = less((i) => {
    [i.meshes, i.views] = [[], []];
    for (const l of i.locations) l.pano = false;
  });
  await withCopy(none, async (folder) => {
    const opened = await open(browser, folder, "#/present");
    assert.match(await opened.page.locator("main").textContent(), /nothing to present/);
    assert.equal(await opened.page.getByRole("link", { name: "Present", exact: true }).count(), 0);
    await go(opened.page, "#/numbers");
    assert.deepEqual(opened.faults, []);
    await opened.close();
  });
});

test("a picture that cannot be read is passed over", async () => {
  await withCopy(
    (write) => write("views_0", new Array(12).fill(null)),
    async (folder) => {
      const { page, close } = await open(browser, folder, "#/present");
      await at(page, 1);
      await page.keyboard.press("ArrowRight");
      await page.waitForFunction(() => document.querySelector(".present").dataset.step !== "1");
      const step = Number(await page.locator(".present").getAttribute("data-step"));
      assert.ok(step >= 2, `${step}`);
      await close();
    },
  );
});
