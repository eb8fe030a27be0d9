// The page of `s3d label` with a pointer and keys: every gesture, as the server then has it.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { launch } from "../../../s3d-report/web/test/lib/browser.mjs";
import { drag, drawn, elsewhere, find, labels, open, settled, state, under } from "./lib/page.mjs";
import { serve } from "./lib/server.mjs";

let browser, server, opened, page;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());
beforeEach(async () => {
  server = await serve();
  opened = await open(browser, server.url, { width: 1120, height: 760 });
  page = opened.page;
});
afterEach(async () => {
  await opened?.close();
  await server?.close();
});

const classOf = async (number) => (await state(page)).instances.find((i) => i.number === number)?.class;
const facesOf = async (number) => (await labels(page)).flatMap((of, face) => (of === number ? [face] : []));
/** Small patches without a label, far from the panels. */
const small = ({ m2, instance }) => instance === 0 && m2 > 0.05 && m2 < 3;
const large = ({ m2, instance }) => instance === 0 && m2 > 0.8;
const said = () => page.locator(".said").textContent();

test("the patch under the pointer lights up, and the brackets walk the tree", async () => {
  let at = null;
  // Not every patch has others to grow by.
  for (let k = 0; !at; k++) {
    let seen = 0;
    const it = await find(page, (there) => small(there) && seen++ === k);
    await page.keyboard.press("]");
    if ((await under(page, it.x, it.y)).m2 > it.m2) at = it;
    await page.keyboard.press("[");
  }
  const lit = await page.screenshot();
  await page.mouse.move(5, 450);
  await drawn(page);
  const dark = await page.screenshot();
  assert.notDeepEqual(lit, dark);
  await under(page, at.x, at.y);
  await page.keyboard.press("]");
  const up = await under(page, at.x, at.y);
  assert.ok(up.m2 > at.m2, `${up.m2} ${at.m2}`);
  assert.match(up.words, /joins? up/);
  await page.keyboard.press("[");
  assert.equal((await under(page, at.x, at.y)).m2, at.m2);
  await page.keyboard.down("Shift");
  await page.mouse.wheel(0, -100);
  await page.keyboard.up("Shift");
  assert.ok((await under(page, at.x, at.y)).m2 > at.m2);
  assert.deepEqual(opened.faults, []);
});

test("a click labels a patch with the class in hand; undo and redo", async () => {
  const at = await find(page, small);
  await page.keyboard.press("9");
  await page.mouse.click(at.x, at.y);
  await settled(page);
  const now = await under(page, at.x, at.y);
  assert.ok(now.instance > 0);
  assert.equal(await classOf(now.instance), "chair");
  assert.ok((await facesOf(now.instance)).includes(at.face));
  await page.keyboard.press("z");
  await settled(page);
  assert.equal((await labels(page))[at.face], 0);
  assert.equal((await under(page, at.x, at.y)).instance, 0);
  await page.keyboard.press("Shift+Z");
  await settled(page);
  assert.equal((await labels(page))[at.face], now.instance);
  await page.keyboard.press("Control+z");
  await settled(page);
  assert.equal((await labels(page))[at.face], 0);
  assert.deepEqual(opened.faults, []);
});

test("a drag makes one object of all patches on its way; Shift adds, Alt erases", async () => {
  const first = await find(page, small);
  const second = await find(page, (it) => small(it) && it.node !== first.node);
  await page.keyboard.press("8");
  await drag(page, [
    [first.x, first.y],
    [second.x, second.y],
  ]);
  const one = (await state(page)).instances;
  assert.equal(one.length, 1);
  const all = await labels(page);
  assert.equal(all[first.face], one[0].number);
  assert.equal(all[second.face], one[0].number);
  const where = await find(page, (it) => it.instance === 0 && it.m2 > 0.05);
  await drag(page, [[where.x, where.y]], ["Shift"]);
  assert.equal((await labels(page))[where.face], one[0].number);
  assert.equal((await state(page)).instances.length, 1);
  await drag(page, [[where.x, where.y]], ["Alt"]);
  assert.equal((await labels(page))[where.face], 0);
  assert.deepEqual(opened.faults, []);
});

test("cut by a line, a box, colour and a brush: a part of the patch becomes another object", async () => {
  const at = await find(page, large, 37, [
    [-12, -8],
    [12, -8],
    [12, 8],
    [-12, 8],
  ]);
  for (let k = 0; k < 30 && (await under(page, at.x, at.y)).m2 < 8; k++) await page.keyboard.press("]");
  await page.keyboard.press("3");
  await page.mouse.click(at.x, at.y);
  await settled(page);
  const { instance } = await under(page, at.x, at.y);
  await page.keyboard.press("w");
  const ways = {
    line: () =>
      drag(page, [
        [at.x - 40, at.y - 25],
        [at.x + 40, at.y + 25],
      ]),
    box: async () => {
      for (const [u, v] of [
        [-12, -8],
        [12, -8],
        [12, 8],
        [-12, 8],
      ])
        await page.mouse.click(at.x + u, at.y + v);
      await settled(page);
    },
    color: async () => {
      await page.mouse.click(at.x, at.y);
      await settled(page);
    },
    brush: () =>
      drag(page, [
        [at.x, at.y],
        [at.x + 10, at.y],
      ]),
  };
  for (const [way, act] of Object.entries(ways)) {
    await page.mouse.move(at.x, at.y);
    await page.keyboard.press("s");
    const shown = await page.locator(".cuts [aria-pressed=true]").textContent();
    assert.match(shown.toLowerCase(), new RegExp(way === "color" ? "colour" : way));
    const before = await facesOf(instance);
    const known = new Set((await state(page)).instances.map(({ number }) => number));
    await act();
    const born = (await state(page)).instances.filter(({ number }) => !known.has(number));
    assert.equal(born.length, 1, `${way}: ${await said()}`);
    assert.equal(born[0].class, "board");
    const cut = await facesOf(born[0].number);
    assert.ok(cut.length > 0 && cut.every((face) => before.includes(face)), way);
    await elsewhereUndo();
  }
  await page.keyboard.press("Escape");
  assert.ok(await page.locator(".cuts").isHidden());
  assert.deepEqual(opened.faults, []);
});

async function elsewhereUndo() {
  await page.keyboard.press("z");
  await settled(page);
}

test("a cut by colour is shown before it is made, and the wheel changes it", async () => {
  const at = await find(page, large);
  for (let k = 0; k < 3; k++) await page.keyboard.press("s");
  const lit = async (act) => {
    const answer = page.waitForResponse("**/cut");
    await act();
    const { faces } = await (await answer).json();
    return faces.reduce((sum, run, i) => sum + (i % 2 ? run : 0), 0);
  };
  const few = await lit(() => page.mouse.move(at.x + 1, at.y));
  const many = await lit(() => page.mouse.wheel(0, -2000));
  assert.ok(many >= few && few > 0, `${few} ${many}`);
  await drawn(page);
  const shown = await page.screenshot();
  await page.mouse.move(5, 450);
  await drawn(page);
  assert.notDeepEqual(await page.screenshot(), shown);
  assert.deepEqual((await state(page)).instances, []);
  await page.mouse.click(at.x + 1, at.y);
  await settled(page);
  const [cut] = (await state(page)).instances;
  assert.equal(cut.faces, many);
  assert.deepEqual(opened.faults, []);
});

test("Shift and the brush add to an object, across the borders of others", async () => {
  const first = await find(page, small);
  await page.mouse.click(first.x, first.y);
  await settled(page);
  const [{ number }] = (await state(page)).instances;
  const before = (await facesOf(number)).length;
  for (let k = 0; k < 4; k++) await page.keyboard.press("s");
  await drag(
    page,
    [
      [first.x, first.y],
      [first.x + 80, first.y + 30],
    ],
    ["Shift"],
  );
  assert.equal((await state(page)).instances.length, 1);
  assert.ok((await facesOf(number)).length > before);
  assert.deepEqual(opened.faults, []);
});

test("a line is drawn where two objects meet, and none within one", async () => {
  const pixels = async () => {
    const file = (await page.locator("canvas").screenshot()).toString("base64");
    return page.evaluate(async (data) => {
      const image = new Image();
      image.src = `data:image/png;base64,${data}`;
      await image.decode();
      const sheet = new OffscreenCanvas(image.width, image.height).getContext("2d");
      sheet.drawImage(image, 0, 0);
      const { data: bytes } = sheet.getImageData(0, 0, image.width, image.height);
      let dark = 0;
      for (let k = 0; k < bytes.length; k += 4) if (bytes[k] + bytes[k + 1] + bytes[k + 2] < 210) dark++;
      return dark;
    }, file);
  };
  // All floors and walls of the scene, first as objects of their own, then as one.
  const { surfaces } = await page.evaluate(async () => (await fetch("structure.json")).json());
  const some = surfaces.flatMap(({ class: name }, i) => (["floor", "wall"].includes(name) ? [i] : []));
  assert.equal(await elsewhere(page, { accept: { surfaces: some, rooms: [] } }), 200);
  await page.reload();
  await page.waitForSelector("body[data-loaded][data-proposed]");
  await page.keyboard.press("v");
  await page.mouse.move(5, 450);
  await drawn(page);
  const apart = await pixels();
  const [into, ...instances] = (await state(page)).instances.map((it) => it.number);
  assert.equal(await elsewhere(page, { join: { into, instances } }), 200);
  await page.reload();
  await page.waitForSelector("body[data-loaded][data-proposed]");
  await page.keyboard.press("v");
  await page.mouse.move(5, 450);
  await drawn(page);
  const joined = await pixels();
  assert.ok(apart > joined + 300, `${apart} ${joined}`);
});

test("two objects are joined, one gets another class, and one is erased", async () => {
  const first = await find(page, small);
  const second = await find(page, (it) => small(it) && it.node !== first.node);
  await page.keyboard.press("9");
  await page.mouse.click(first.x, first.y);
  await settled(page);
  await page.keyboard.press("8");
  await page.mouse.click(second.x, second.y);
  await settled(page);
  assert.equal((await state(page)).instances.length, 2);
  await under(page, first.x, first.y);
  await page.keyboard.press("m");
  await settled(page);
  const [joined] = (await state(page)).instances;
  assert.equal((await state(page)).instances.length, 1);
  assert.equal(joined.class, "table");
  await page.keyboard.press("0");
  await under(page, first.x, first.y);
  await page.keyboard.press("c");
  await settled(page);
  assert.equal(await classOf(joined.number), "sofa");
  await page.keyboard.press("x");
  await settled(page);
  assert.ok((await labels(page)).every((of) => of === 0));
  assert.deepEqual(opened.faults, []);
});

test("without a pointer, the middle of the view is pointed at, and Space labels it", async () => {
  await page.locator(".classes input").focus();
  await page.keyboard.press("Escape");
  await page.keyboard.press("ArrowUp");
  await page.waitForFunction(() => document.querySelector(".status").dataset.face !== "");
  await page.keyboard.press("8");
  await page.keyboard.press(" ");
  await settled(page);
  const { instances } = await state(page);
  assert.deepEqual(
    instances.map((instance) => instance.class),
    ["table"],
  );
});

test("a class is found by its name", async () => {
  const canvas = page.locator("canvas");
  await page.keyboard.press("/");
  await page.keyboard.type("bo");
  assert.deepEqual(await page.locator(".classes li:visible .what").allTextContents(), ["bookcase", "board"]);
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  assert.equal(await page.locator(".status strong").textContent(), "board");
  assert.ok(await canvas.evaluate((it) => it === document.activeElement));
  assert.ok((await page.locator(".classes li:visible").count()) >= 13);
});

test("Enter accepts what is proposed for a room, and Z takes all of it back", async () => {
  const at = await find(page, ({ words }) => words.startsWith("proposed"));
  await page.keyboard.press("Enter");
  await settled(page);
  const now = await state(page);
  assert.ok(now.instances.length >= 1);
  assert.ok((await labels(page))[at.face] > 0);
  await page.keyboard.press("z");
  await settled(page);
  const back = await state(page);
  assert.deepEqual([back.instances.length, back.rooms.length], [0, 0]);
});

test("Tab goes to doubts, Enter accepts a guess, and Escape leaves", async () => {
  const at = await find(page, small);
  await page.keyboard.press("9");
  await page.mouse.click(at.x, at.y);
  await settled(page);
  let guess = "";
  for (let k = 0; k < 12 && !/^Perhaps /.test(guess); k++) {
    await page.keyboard.press("Tab");
    await page.waitForTimeout(400);
    guess = await page.locator(".todo [role=status]").textContent();
    assert.ok(guess.length > 0);
  }
  if (/^Perhaps chair/.test(guess)) {
    const before = (await state(page)).instances.length;
    await page.keyboard.press("Enter");
    await page.waitForTimeout(400);
    await settled(page);
    assert.equal((await state(page)).instances.length, before + 1);
  }
  await page.keyboard.press("Escape");
  assert.equal(await page.locator(".todo [role=status]").textContent(), "");
  assert.deepEqual(opened.faults, []);
});

test("rooms are accepted, split, joined, named and measured on the plan", async () => {
  await page.keyboard.press("p");
  await page.keyboard.press("Enter");
  await settled(page);
  const accepted = (await state(page)).rooms;
  assert.ok(accepted.length >= 2);
  const room = page.locator(".room").first();
  const box = await room.locator("polygon").first().boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await drag(page, [
    [box.x - 8, y],
    [box.x + box.width + 8, y],
  ]);
  assert.equal((await state(page)).rooms.length, accepted.length + 1, await said());
  await page.mouse.click(x, y - 0.2 * box.height);
  await page.mouse.click(x, y + 0.2 * box.height);
  assert.equal(await page.locator(".room.chosen").count(), 2);
  await page.locator(".form button", { hasText: "Join" }).click();
  await settled(page);
  assert.equal((await state(page)).rooms.length, accepted.length, await said());
  if ((await page.locator(".room.chosen").count()) === 0) await page.mouse.click(x, y);
  await page.locator(".room-form select").selectOption({ index: 2 });
  await settled(page);
  const kinds = await page.locator(".room-form option").evaluateAll((all) => all.map((o) => o.value));
  assert.ok(
    (await state(page)).rooms.some(({ is }) => is.kind === kinds[2]),
    await said(),
  );
  // The room keeps the focus, so that another digit is another type of it.
  await page.locator(".room.chosen").focus();
  for (const digit of ["1", "2"]) {
    await page.keyboard.press(digit);
    await settled(page);
  }
  assert.ok(
    (await state(page)).rooms.some(({ is }) => is.kind === kinds[2]),
    await said(),
  );
  await page.locator(".room-form input").nth(1).fill("3.21");
  await page.keyboard.press("Enter");
  await settled(page);
  assert.ok((await state(page)).rooms.some(({ is }) => is.parts.some(({ heights }) => heights[1] === 3.21)));
  await page.keyboard.press("Escape");
  await page.locator(".plan").press("Escape");
  assert.ok(await page.locator(".plan").isHidden());
  assert.deepEqual(opened.faults, []);
});

test("when another window changed the labels, they are shown, and the gesture is not lost unseen", async () => {
  const at = await find(page, small);
  const other = await find(page, (it) => small(it) && it.node !== at.node);
  const what = { patches: [{ face: other.face, node: other.node }] };
  assert.equal(await elsewhere(page, { label: { what, class: "sofa" } }), 200);
  await page.keyboard.press("9");
  await page.mouse.click(at.x, at.y);
  await page.waitForFunction(() => /Another window/.test(document.querySelector(".said").textContent));
  await settled(page);
  assert.equal((await state(page)).instances.length, 1);
  assert.ok((await under(page, other.x, other.y)).instance > 0);
  await page.mouse.click(at.x, at.y);
  await settled(page);
  assert.equal((await state(page)).instances.length, 2);
});

test("when the server is gone, a banner says so, and the gesture arrives when it is back", async () => {
  await page.context().setOffline(true);
  const at = await find(page, small);
  await page.keyboard.press("9");
  await page.mouse.click(at.x, at.y);
  await page.waitForSelector(".banner:not([hidden])");
  assert.match(await page.locator(".saved").textContent(), /gone/);
  await page.context().setOffline(false);
  await page.waitForSelector(".banner", { state: "hidden" });
  await settled(page);
  const { instances } = await state(page);
  assert.equal(instances.length, 1);
  assert.equal(instances[0].class, "chair");
});

test("the server's sentence is said when a gesture does not fit", async () => {
  // In the page itself: Chromium begins to hand requests to the driver a moment after it says so.
  await page.evaluate(() => {
    const { fetch } = window;
    const refused = () => Response.json({ error: "This does <b>not</b> fit." }, { status: 422 });
    window.fetch = async (path, init) => (path === "gesture" ? refused() : fetch(path, init));
  });
  const at = await find(page, small);
  await page.mouse.click(at.x, at.y);
  await page.waitForFunction(
    () => document.querySelector(".said").textContent === "This does <b>not</b> fit.",
  );
  assert.equal((await under(page, at.x, at.y)).instance, 0);
});

test("one goes into a photograph, labels in it, and walks to another", async () => {
  await opened.close();
  await server.close();
  server = await serve({ scene: "scan/photographed.toml" });
  opened = await open(browser, server.url);
  page = opened.page;
  const { photographs } = await page.evaluate(async () => (await fetch("scene.json")).json());
  assert.equal(photographs.length, 6);
  const outside = await page.screenshot();
  await page.keyboard.press("g");
  await page.waitForSelector("body[data-photograph]");
  const at = await find(page, ({ instance }) => instance === 0);
  await page.mouse.click(at.x, at.y);
  await settled(page);
  assert.ok((await labels(page))[at.face] > 0);
  // Two photographs see each other, at least.
  const there = [];
  for (let k = 0; k < 6 && there.length === 0; k++) {
    for (let turn = 0; turn < 12; turn++) {
      await page.keyboard.press("ArrowRight");
      await page.keyboard.press("ArrowRight");
      await drawn(page);
      there.push(...(await page.locator(".walk:visible").all()));
      if (there.length > 0) break;
    }
  }
  if (there.length > 0) {
    const before = await page.getAttribute("body", "data-photograph");
    await there[0].focus();
    await page.keyboard.press("Enter");
    await page.waitForFunction((was) => document.body.dataset.photograph !== was, before);
  }
  await page.locator("canvas").focus();
  await page.keyboard.press("Escape");
  await page.waitForSelector("body:not([data-photograph])");
  assert.notDeepEqual(await page.screenshot(), outside);
  assert.deepEqual(opened.faults, []);
});
