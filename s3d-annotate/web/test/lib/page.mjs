// The page of `s3d label` in a browser, and what tests ask and do in it.

import { ready } from "../../../../s3d-report/web/test/lib/browser.mjs";

const SEEN = "s3d-label-card";

/**
 * Opens a page of a server. `faults` collects errors, and requests of other servers. Unless `card`, the card of
 * the first use has been seen.
 */
export async function open(browser, url, options = {}) {
  const {
    width = 960,
    height = 640,
    dark = false,
    card = false,
    hash = "",
    touch = false,
    scale = 1,
  } = options;
  const context = await browser.newContext({
    viewport: { width, height },
    deviceScaleFactor: scale,
    colorScheme: dark ? "dark" : "light",
    reducedMotion: "reduce",
    hasTouch: touch,
  });
  if (!card) await context.addInitScript((key) => window.localStorage.setItem(key, "1"), SEEN);
  // The page of the sources, for a server that was built before.
  const path = process.env["S3D_PAGE"];
  if (path) await context.route(url, (route) => route.fulfill({ path, contentType: "text/html" }));
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  const faults = [];
  page.on("console", (message) => {
    // 503: what was asked for is not worked out yet. The page asks again, and the browser tells it as an error.
    const isNotYet = / status of 503 /.test(message.text());
    if (["error", "warning"].includes(message.type()) && !isNotYet) faults.push(message.text());
  });
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("request", (request) => {
    const to = request.url();
    if (!to.startsWith(url) && !/^(data|blob):/.test(to)) faults.push(`request of ${to}`);
  });
  await page.goto(url + hash);
  await ready(page);
  await page.waitForSelector("body[data-loaded][data-proposed]");
  return { page, faults, close: () => context.close() };
}

/** The labels as the server has them. */
export const state = (page) => page.evaluate(async () => (await fetch("state.json")).json());

/** The instance of each face, as the server has it. */
export const labels = (page) =>
  page.evaluate(async () => [...new Uint32Array(await (await fetch("labels.bin")).arrayBuffer())]);

/** Waits until all gestures are on disk, and their labels are shown. */
export async function settled(page) {
  await page.waitForSelector(".saved[data-is=saved]");
  await drawn(page);
}

/** Waits until two pictures are drawn. */
export const drawn = (page) =>
  page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

/** What the page says lies under the pointer; null without a face. */
export async function under(page, x, y) {
  await page.mouse.move(x, y);
  await drawn(page);
  return page.evaluate(() => {
    const { face, node, instance } = document.querySelector(".status").dataset;
    const words = document.querySelector(".patch").textContent;
    return face
      ? { face: +face, node: +node, instance: +instance, words, m2: parseFloat(/([\d.]+) m²/.exec(words)[1]) }
      : null;
  });
}

/**
 * The first place of a grid in the middle of the window where what lies under the pointer is wanted, and is the
 * same at some places around it.
 */
export async function find(page, wanted, step = 37, around = []) {
  const { width, height } = page.viewportSize();
  for (let y = 0.3 * height; y < 0.8 * height; y += step)
    for (let x = 0.3 * width; x < 0.75 * width; x += step) {
      const found = await under(page, x, y);
      if (!found || !wanted(found)) continue;
      let same = true;
      for (const [u, v] of around) same &&= (await under(page, x + u, y + v))?.node === found.node;
      if (same) return { x, y, ...found };
    }
  throw new Error("nothing of this kind is seen");
}

/** Drags with the first button, with keys held. */
export async function drag(page, points, held = []) {
  const [first, ...rest] = points;
  await page.mouse.move(...first);
  for (const key of held) await page.keyboard.down(key);
  await page.mouse.down();
  for (const point of rest) await page.mouse.move(...point, { steps: 8 });
  await page.mouse.up();
  for (const key of held) await page.keyboard.up(key);
  await settled(page);
}

/** Sends a gesture as another window would. */
export const elsewhere = (page, gesture) =>
  page.evaluate(async (asked) => {
    const { revision } = await (await fetch("state.json")).json();
    const answer = await fetch("gesture", {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify({ revision, gesture: asked }),
    });
    return answer.status;
  }, gesture);
