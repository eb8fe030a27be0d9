// Labels the built-in scene from nothing with a pointer and keys, as a person who knows it would; then the labels
// are saved, exported, and compared with the data set of the labels that the scene was generated with.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { launch } from "../../../s3d-report/web/test/lib/browser.mjs";
import { open } from "./lib/page.mjs";
import { Person } from "./lib/person.mjs";
import { serve } from "./lib/server.mjs";
import { Sight } from "./lib/sight.mjs";
import { classOf, facesOf, readScene, roomOf } from "./lib/truth.mjs";

/** Without a graphics card, a small window of large pixels is drawn much sooner. */
const SIZE = { width: 720, height: 400 };
/** The person ends when so much of the surface is right, or no stroke puts so much right, m². */
const SHARE = 0.978;
const LEAST = 0.005;
const MOST_STROKES = 150;

const demo = process.env["S3D_DEMO"];
const EXPORT = ["--views", "2", "--size", "135", "--pano-width", "512", "--points-per-m2", "100"];

let browser, server;
before(async () => {
  browser = await launch();
  server = await serve();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

/** How much the panels of the page cover at each side. */
const covered = (page) =>
  page.evaluate(() => ({
    left: document.querySelector(".classes").offsetWidth,
    right: document.querySelector(".side").offsetWidth,
    top: 48,
    bottom: 40,
  }));

/** What the page says of the pointer, once it has seen its last move. */
const pointed = (page) =>
  page.evaluate(async () => {
    await new Promise((done) => requestAnimationFrame(done));
    const { face, node, instance } = document.querySelector(".status").dataset;
    return face ? { face: +face, node: +node, instance: +instance } : null;
  });

/** Waits until all gestures are on disk. */
const saved = (page) => page.locator(".saved[data-is=saved]").waitFor();

const told = async () => (await fetch(`${server.url}state.json`)).json();

/** The person's hand: does in the page what the person has in mind. */
class Hand {
  strokes = 0;
  kinds = new Map();
  /** The dearest join in what the page lights up. */
  cost = 0;
  inHand = "";

  constructor(page, person, keys) {
    Object.assign(this, { page, person, keys });
  }

  count(kind) {
    this.strokes += 1;
    this.kinds.set(kind, (this.kinds.get(kind) ?? 0) + 1);
  }

  async look({ at, from }) {
    const { origin } = this.person.scene;
    const words = (place) => place.map((c, k) => (c + origin[k]).toFixed(5)).join();
    this.person.sight.look({ at, from });
    await this.page.evaluate(
      async (hash) => {
        if (window.location.hash === hash) return;
        const there = new Promise((done) => window.addEventListener("hashchange", done, { once: true }));
        window.location.hash = hash;
        await there;
      },
      `#at=${words(at)}&from=${words(from)}`,
    );
  }

  /** Points at a pixel. Returns what the page says of it. */
  async point([x, y]) {
    await this.page.mouse.move(x, y);
    return pointed(this.page);
  }

  /** Takes the labels as the server has them. */
  async read() {
    const { url } = server;
    this.person.instances = new Uint32Array(await (await fetch(`${url}labels.bin`)).arrayBuffer());
  }

  /** Accepts all that is proposed for the room of a face. */
  async accept(face) {
    const { person } = this;
    for (const stand of person.stands(person.thing[face], [face])) {
      person.sight.look(stand);
      const pixel = person.sight.pixel(person.near[face]);
      if (!pixel || person.sight.face(pixel) !== face) continue;
      await this.look(stand);
      const now = await this.point(pixel);
      if (now?.face !== face) continue;
      await this.page.keyboard.press("Enter");
      await saved(this.page);
      this.count("accept");
      return;
    }
    assert.fail("the room's surface is not seen");
  }

  /** Gives rooms their types on the plan. */
  async type(kinds) {
    const { page } = this;
    const { room_types: types } = this.person.scene;
    await page.keyboard.press("p");
    for (const [room, kind] of kinds) {
      const { x, y, width, height } = await page.locator(`[data-key="room ${room}"] text`).boundingBox();
      const choose = () => page.mouse.click(x + width / 2, y + height / 2);
      await choose();
      await page.locator(`[data-key="room ${room}"][aria-pressed=true]`).waitFor();
      await page.keyboard.press(String((types.indexOf(kind) + 1) % 10));
      await saved(page);
      // Two rooms that are chosen would be joined.
      await choose();
      this.count("room");
    }
    await page.keyboard.press("Escape");
    await page.keyboard.press("Escape");
    await page.locator(".plan").waitFor({ state: "hidden" });
  }

  /** Walks from the node that the page has at a face to one whose patch is that of the node. */
  async walk(face, from, node) {
    const { person, page } = this;
    const instance = person.instances[face];
    const size = (at) => person.patch(at, instance).length;
    const up = from < node;
    let at = from;
    let length = size(at);
    const wanted = size(node);
    while (length !== wanted) {
      const chain = person.chain(face);
      let place = chain.indexOf(at);
      do place += up ? 1 : -1;
      while (place > 0 && place < chain.length - 1 && size(chain[place]) === length);
      at = chain[place];
      length = size(at);
      await page.keyboard.press(up ? "]" : "[");
      this.cost = person.scene.cost[at];
    }
    return at;
  }

  /** Makes a stroke. Returns whether the page had under the pointer what the person expected there. */
  async stroke({ kind, thing, stand, path, face, point, node }) {
    const { page, person } = this;
    const name = classOf(person.names[thing]);
    if (kind === "label" && this.inHand !== name) {
      await page.keyboard.press(this.keys.get(name));
      this.inHand = name;
    }
    await this.look(stand);
    const now = await this.point(point);
    if (!now || now.instance !== person.instances[face] || !person.holds(node, now.face)) return false;
    const at = await this.walk(now.face, now.node, node);
    const after = await pointed(page);
    if (after?.node !== at) {
      this.cost = person.scene.cost[after?.node ?? 0];
      return false;
    }
    if (path[0] !== point) await page.mouse.move(...path[0]);
    if (kind === "add") await page.keyboard.down("Shift");
    await page.mouse.down();
    for (const pixel of path.slice(1)) await page.mouse.move(...pixel);
    await page.mouse.up();
    if (kind === "add") await page.keyboard.up("Shift");
    await saved(page);
    this.count(kind);
    return true;
  }
}

test("a hundred gestures label the built-in scene", async (t) => {
  const scene = await readScene(server.url);
  const faces = facesOf(scene, `${demo}/area_1/3d/semantic.obj`);
  assert.ok(faces.filter(({ label }) => label === null).length < 0.01 * faces.length);
  const { page, faults, close } = await open(browser, server.url, { ...SIZE, scale: 0.25 });
  const person = new Person(scene, faces, new Sight(scene, { ...SIZE, ...(await covered(page)) }));
  const keys = new Map(
    await page
      .locator(".classes button")
      .evaluateAll((all) =>
        all.map((one) => [
          one.querySelector(".what").textContent,
          one.querySelector("kbd").textContent.toLowerCase(),
        ]),
      ),
  );
  const hand = new Hand(page, person, keys);

  // The rooms with all that is proposed for them, and their types.
  const { surfaces } = await page.evaluate(async () => (await fetch("structure.json")).json());
  const rooms = new Map();
  for (const { room, faces: runs } of surfaces)
    if (!rooms.has(room)) rooms.set(room, runs[0] + (runs[1] >> 1));
  for (const face of rooms.values()) await hand.accept(face);
  await hand.read();
  const accepted = await told();
  person.meet(new Map(accepted.instances.map(({ number, class: name }) => [number, name])));
  const types = accepted.rooms.map(({ number, is: { parts } }) => [
    number,
    person.roomAt(parts[0].outline).split("_")[0],
  ]);
  await hand.type(types);
  assert.deepEqual(
    (await told()).rooms.map(({ number, is: { kind } }) => [number, kind]),
    types,
  );
  t.diagnostic(`${hand.strokes} gestures for the structure: ${(100 * person.right).toFixed(1)} %`);

  // The objects, the largest first.
  let last = null;
  let missed = 0;
  while (person.right < SHARE && hand.strokes < MOST_STROKES) {
    const stroke = person.next(last, LEAST);
    if (!stroke) break;
    const before = person.instances.reduce((a, b) => Math.max(a, b));
    if (!(await hand.stroke(stroke))) {
      person.fail(stroke);
      missed += 1;
      continue;
    }
    await hand.read();
    const { instances } = await told();
    const born = instances.find(({ number }) => number > before)?.number;
    if (stroke.kind === "label") person.instanceOf[stroke.thing] = born ?? person.instances[stroke.face];
    last = person.instanceOf[stroke.thing];
    if (process.env["S3D_TOLD"])
      console.log(
        Math.round(performance.now() / 1000),
        hand.strokes,
        stroke.kind,
        person.names[stroke.thing],
        stroke.gain.toFixed(2),
        (100 * person.right).toFixed(2),
      );
  }
  const kinds = [...hand.kinds].map(([kind, count]) => `${count} ${kind}`).join(", ");
  t.diagnostic(
    `${hand.strokes} gestures (${kinds}), ${missed} not made: ${(100 * person.right).toFixed(2)} %`,
  );

  // What an export makes of them.
  const files = await page.evaluate(async () => (await fetch("save", { method: "POST" })).json());
  assert.deepEqual(files.saved, ["labels.npz", "rooms.json"]);
  assert.deepEqual(faults, []);
  await close();
  const [labelled, made] = [join(demo, "scan/labelled.toml"), join(demo, "../labelled")];
  const toml = readFileSync(join(demo, "scan/scene.toml"), "utf8");
  writeFileSync(labelled, toml.replace('path = "Area_1"', `path = ${JSON.stringify(server.labels)}`));
  const s3d = (args, status = 0) => {
    try {
      return execFileSync(process.env["S3D_BIN"], ["--quiet", ...args], { encoding: "utf8" });
    } catch (e) {
      if (e.status === status) return e.stdout;
      throw e;
    }
  };
  s3d(["export", labelled, "-o", made, ...EXPORT]);
  const { areas, labels } = JSON.parse(s3d(["compare", demo, made, "--json", "-"], 1));
  rmSync(made, { recursive: true });
  assert.equal(areas[0].geometry, "same");
  const all = faces.reduce((sum, { m2 }) => sum + m2, 0);
  const share = 1 - labels.changed.m2 / all;
  t.diagnostic(
    `${(100 * share).toFixed(2)} % of the surface is as it was generated; ` +
      `${labels.b} instances, ${labels.a} were generated`,
  );
  assert.ok(share >= 0.98, `${share}`);
  assert.ok(hand.strokes <= MOST_STROKES, `${hand.strokes}`);
});
