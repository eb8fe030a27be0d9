// Labels the built-in scene from nothing with a pointer and keys, as a person who knows it would: points at a patch of an
// object, takes as much of it as belongs to the object, labels it, and adds the rest.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch } from "../../../s3d-report/web/test/lib/browser.mjs";
import { drawn, labels, open, settled, state } from "./lib/page.mjs";
import { serve } from "./lib/server.mjs";
import { classOf, facesIn, facesOf, nodesOf, readScene } from "./lib/truth.mjs";

/** Smaller patches are not worth a gesture, m²; and an object gets so many gestures at most. */
const SMALL_M2 = 0.02;
const MOST_PATCHES = 12;

let browser, server;
before(async () => {
  browser = await launch();
  server = await serve();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

/** Goes to a viewpoint, and points at its middle. Returns what lies there. */
async function lookAt(page, at, from) {
  const words = (place) => place.map((c) => c.toFixed(4)).join();
  return page.evaluate(
    async ([hash]) => {
      window.location.hash = hash;
      const frames = async (count) => {
        for (let k = 0; k < count; k++) await new Promise((done) => requestAnimationFrame(done));
      };
      await frames(2);
    },
    [`at=${words(at)}&from=${words(from)}`],
  );
}

const pointed = (page) =>
  page.evaluate(() => {
    const { face, node, instance, faces } = document.querySelector(".status").dataset;
    return face ? { face: +face, node: +node, instance: +instance, faces: +faces } : null;
  });

test("a hundred gestures label the built-in scene", async (t) => {
  const scene = await readScene(server.url);
  const faces = facesOf(scene, `${process.env["S3D_DEMO"]}/area_1/3d/semantic.obj`);
  assert.ok(faces.filter(({ label }) => label === null).length < 0.01 * faces.length);
  const wanted = nodesOf(scene, faces);
  const inside = facesIn(scene, new Set([...wanted.values()].flat().map(({ node }) => node)));
  const { page, faults, close } = await open(browser, server.url);
  const middle = await page.evaluate(() => {
    const box = (name) => document.querySelector(name)?.offsetWidth ?? 0;
    return [(window.innerWidth + box(".classes") - box(".side")) / 2, (window.innerHeight + 8) / 2];
  });
  await page.mouse.move(...middle);

  /** Points at a face of a node so that all of its faces light up. Returns whether that was possible. */
  const point = async (node) => {
    const all = [...inside.get(node)].sort((a, b) => faces[b].m2 - faces[a].m2);
    for (const face of [all[0], all[1], all[2], all[Math.floor(all.length / 2)]].filter(
      (f) => f !== undefined,
    ))
      for (const away of [1.2, 0.5, 0.2]) {
        const { middle: at, normal } = faces[face];
        // From above the normal a little, so that the direction of view is not straight down.
        const from = at.map((c, k) => c + away * (normal[k] + [0.02, 0.03, 0.01][k]));
        await lookAt(page, at, from);
        await page.mouse.move(middle[0] + 0.5, middle[1]);
        await page.mouse.move(...middle);
        await drawn(page);
        let now = await pointed(page);
        const isIn = () => now && inside.get(node).includes(now.face);
        for (let k = 0; k < 40 && isIn() && now.node !== node; k++) {
          const size = now.faces;
          const isBelow = (() => {
            for (let up = now.node; up !== undefined; up = scene.parent[up]) if (up === node) return true;
            return false;
          })();
          await page.keyboard.press(isBelow ? "]" : "[");
          await drawn(page);
          now = await pointed(page);
          if (now && now.faces === size) break;
        }
        if (isIn() && inside.get(node).length >= now.faces && now.instance === 0) return true;
      }
    return false;
  };

  let gestures = 0;
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
  const order = [...wanted].sort(([, a], [, b]) => b[0].m2 - a[0].m2);
  for (const [label, nodes] of order) {
    await page.keyboard.press(keys.get(classOf(label)));
    let isBegun = false;
    for (const { node, m2 } of nodes.slice(0, MOST_PATCHES)) {
      if (m2 < SMALL_M2 && isBegun) break;
      if (!(await point(node))) continue;
      if (isBegun) await page.keyboard.down("Shift");
      await page.mouse.down();
      await page.mouse.up();
      if (isBegun) await page.keyboard.up("Shift");
      await settled(page);
      isBegun = true;
      gestures += 1;
    }
  }
  t.diagnostic(`${gestures} gestures`);

  const instances = await labels(page);
  const named = new Map((await state(page)).instances.map(({ number, class: name }) => [number, name]));
  const votes = new Map();
  instances.forEach((number, face) => {
    const of = votes.get(number) ?? new Map();
    votes.set(number, of.set(faces[face].label, (of.get(faces[face].label) ?? 0) + faces[face].m2));
  });
  const meaning = new Map(
    [...votes].map(([n, of]) => [n, [...of].reduce((a, b) => (b[1] > a[1] ? b : a))[0]]),
  );
  let [all, right, classRight] = [0, 0, 0];
  faces.forEach(({ label, m2 }, face) => {
    if (classOf(label) === null) return;
    all += m2;
    if (instances[face] === 0) return;
    if (named.get(instances[face]) === classOf(label)) classRight += m2;
    if (meaning.get(instances[face]) === label) right += m2;
  });
  t.diagnostic(
    `${((100 * right) / all).toFixed(2)} % of the surface has its instance, ${((100 * classRight) / all).toFixed(2)} % its class`,
  );
  assert.ok(classRight >= 0.98 * all && right >= 0.98 * all);
  assert.deepEqual(faults, []);
  await close();
});
