// A headless browser, and a page in it that reports every forbidden event.

import { createHash } from "node:crypto";
import { existsSync } from "node:fs";
import { chromium, firefox } from "playwright-core";
import { pathToFileURL } from "node:url";

const QUIET = [
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-gl=angle",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
];

const PATIENCE_MS = 60_000;

/**
 * The driver adds this style to a page before it takes a picture. The page's policy does not allow it, and
 * Firefox says so.
 */
const STYLE_OF_DRIVER = createHash("sha256").update("body {}").digest("base64");

const CHROMIUM = ["/usr/bin/chromium", "/usr/bin/chromium-browser"];
const FIREFOX = ["/usr/bin/firefox-esr", "/usr/bin/firefox"];

/** WebGL even without a graphics card. */
const DRAWN = { "webgl.force-enabled": true };

/** The installed Firefox, by WebDriver BiDi, or else Chromium. Firefox has WebGL only with a display. */
export const isFirefox = process.env["S3D_BROWSER"] === "firefox";

/** Why the 3D view is not tested, if it is not: Firefox without a graphics card stops in it now and then. */
export const no3d = isFirefox && !process.env["S3D_FIREFOX_3D"] && "S3D_FIREFOX_3D is not set";

export function launch() {
  const [name, named, places] = isFirefox
    ? ["Firefox", process.env["S3D_FIREFOX"], FIREFOX]
    : ["Chromium", process.env["S3D_CHROMIUM"], CHROMIUM];
  const executablePath = named ?? places.find((path) => existsSync(path));
  if (!executablePath)
    throw new Error(`no ${name}: install Debian's package, or name one by S3D_${name.toUpperCase()}`);
  return isFirefox
    ? firefox.launch({ executablePath, channel: "moz-firefox", headless: false, firefoxUserPrefs: DRAWN })
    : chromium.launch({ executablePath, args: QUIET });
}

/** A usual screen. Pages are smaller elsewhere: without a graphics card, half the pixels take half the time. */
export const USUAL = { width: 1440, height: 900 };

/**
 * Opens a report (a folder or one file) from the disk, for a user who wants no motion unless `motion`.
 * `faults` collects errors, and requests that leave the folder. With `waits` false it need not be complete.
 */
export async function open(browser, folder, hash, options = {}) {
  const { width = 1024, height = 640, touch = false, motion = false, dark = false, waits = true } = options;
  // Without motion the overview does not turn, which would keep a processor busy.
  const still = isFirefox || motion ? {} : { reducedMotion: "reduce" };
  const colorScheme = dark ? "dark" : "light";
  const context = await browser.newContext({
    viewport: { width, height },
    hasTouch: touch,
    colorScheme,
    ...still,
  });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  const faults = [];
  const isFile = folder.endsWith(".html");
  const root = pathToFileURL(isFile ? folder : `${folder}/`).href;
  const fault = (text) => {
    if (!isFirefox || !text.includes(STYLE_OF_DRIVER)) faults.push(text);
  };
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) fault(message.text());
  });
  page.on("pageerror", (error) => fault(String(error)));
  page.on("request", (request) => {
    const url = request.url();
    if (!url.startsWith(root) && !url.startsWith("data:")) faults.push(`request of ${url.slice(0, 200)}`);
  });
  page.on("dialog", (dialog) => {
    faults.push(`dialog: ${dialog.message()}`);
    dialog.dismiss();
  });
  await page.goto(`${root}${isFile ? "" : "index.html"}${hash}`);
  if (waits) await ready(page);
  return { page, faults, close: () => context.close() };
}

/** Waits until the page shows what the address asks for. */
export async function ready(page) {
  await page.waitForSelector("body[data-ready]");
  await page.waitForTimeout(100);
}

/** Changes the part after `#`, and waits for its page. */
export async function go(page, hash) {
  const before = await page.getAttribute("body", "data-ready");
  await page.evaluate((to) => {
    window.location.hash = to;
  }, hash);
  await page.waitForFunction((was) => document.body.dataset.ready !== was, before);
  await page.waitForTimeout(100);
}

/** The entries of the line under a picture, by name. */
export async function readout(page) {
  return page.evaluate(() => {
    const line = document.querySelector(".readout");
    const told = { pixel: line.dataset.pixel ?? null };
    for (const entry of line.querySelectorAll("[data-is]")) {
      const name = entry.querySelector(".name")?.textContent ?? "";
      told[entry.dataset.is] = entry.textContent.slice(name.length);
    }
    return told;
  });
}

/** Waits until the request is drawn. */
export async function drawn(page) {
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

/** Taps with a finger, or clicks if the browser's driver has no touch. */
export async function tap(page, x, y) {
  if (!isFirefox) return page.touchscreen.tap(x, y);
  // The pointer may be there already, and only a move counts.
  await page.mouse.move(x + 3, y);
  return page.mouse.click(x, y);
}

/** Drags a finger, or else the pointer, from one x to another at the height y. */
export async function drag(page, from, to, y) {
  const steps = [0.2, 0.6, 1].map((t) => from + t * (to - from));
  if (isFirefox) {
    await page.mouse.move(from, y);
    await page.mouse.down();
    for (const x of steps) await page.mouse.move(x, y);
    return page.mouse.up();
  }
  const touches = await page.context().newCDPSession(page);
  const touch = (type, touchPoints) => touches.send("Input.dispatchTouchEvent", { type, touchPoints });
  await touch("touchStart", [{ x: from, y }]);
  for (const x of steps) await touch("touchMove", [{ x, y }]);
  await touch("touchEnd", []);
}
