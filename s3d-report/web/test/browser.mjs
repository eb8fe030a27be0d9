// A browser without a window, and a page in it that tells of everything that must not happen.

import { existsSync } from "node:fs";
import { chromium } from "playwright-core";
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

const PATIENCE_MS = 120_000;

export function launch() {
  const named = process.env["S3D_CHROMIUM"];
  const executablePath =
    named ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find((path) => existsSync(path));
  if (!executablePath) throw new Error("no Chromium: install Debian's package, or name one by S3D_CHROMIUM");
  return chromium.launch({ executablePath, args: QUIET });
}

/** Opens a report from the disk. `faults` fills with errors, and with requests that leave the folder. */
export async function open(browser, folder, hash, { width = 1440, height = 900, touch = false } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, hasTouch: touch });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  const faults = [];
  const root = pathToFileURL(`${folder}/`).href;
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) faults.push(message.text());
  });
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("request", (request) => {
    const url = request.url();
    if (!url.startsWith(root) && !url.startsWith("data:")) faults.push(`request of ${url.slice(0, 200)}`);
  });
  page.on("dialog", (dialog) => {
    faults.push(`dialog: ${dialog.message()}`);
    dialog.dismiss();
  });
  await page.goto(`${root}index.html${hash}`);
  await ready(page);
  return { page, faults, close: () => context.close() };
}

/** Waits until the page shows what the address asks for. */
export async function ready(page) {
  await page.waitForSelector("body[data-ready]");
  await page.waitForTimeout(100);
}

/** Changes the part behind `#`, and waits for the page of it. */
export async function go(page, hash) {
  const before = await page.getAttribute("body", "data-ready");
  await page.evaluate((to) => {
    window.location.hash = to;
  }, hash);
  await page.waitForFunction((was) => document.body.dataset.ready !== was, before);
  await page.waitForTimeout(100);
}

/** What the line under a picture tells, by name. */
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
