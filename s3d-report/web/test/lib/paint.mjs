// Measures when a report shows something: `node test/lib/paint.mjs LOADS REPORT…`, with the hash behind a folder if
// one is wanted ("OUT_report#/pano"). Each load is a new context, so no cache, at 1440 × 900, of a browser that has
// shown a page before: the first page of a new browser waits for its graphics process, whatever the page. A page of
// one word is measured beside the reports, which take turns with it.
// The times are ms since the start of the navigation, as the browser itself tells them: median, lowest and highest.

import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

import { launch } from "./browser.mjs";

/** The first paint of words or pictures, and when the tabs and the outline were handed to the browser. */
const NAMES = ["first-contentful-paint", "sketched"];

/** The times of a load, by name. */
async function timesOf(browser, word, address) {
  const context = await browser.newContext({
    viewport: { width: 1440, height: 900 },
    reducedMotion: "reduce",
  });
  try {
    const page = await context.newPage();
    // The process of the tab has started, too.
    await page.goto(word);
    await page.waitForFunction(() => performance.getEntriesByName("first-contentful-paint").length > 0);
    await page.waitForTimeout(500);

    await page.goto(address, { waitUntil: "commit" });
    const times = await page.waitForFunction((names) => {
      const entries = names.map((name) => performance.getEntriesByName(name)[0]);
      return entries.every(Boolean) && entries.map(({ startTime }) => startTime);
    }, NAMES);
    return await times.jsonValue();
  } finally {
    await context.close();
  }
}

const [loads, ...reports] = process.argv.slice(2);
const folder = await mkdtemp(join(tmpdir(), "paint-"));
const word = pathToFileURL(join(folder, "word.html")).href;
await writeFile(new URL(word), '<!doctype html><p>word<script>performance.mark("sketched")</script>');
const addresses = reports.map((report) => {
  const [place, hash = ""] = report.split(/(?=#)/);
  return pathToFileURL(join(place, "index.html")).href + hash;
});
const pages = [word, ...addresses].map((address) => ({ address, all: [] }));
const browser = await launch();
try {
  for (let load = 0; load < Number(loads); load++)
    for (const { address, all } of pages) all.push(await timesOf(browser, word, address));
} finally {
  await browser.close();
  await rm(folder, { recursive: true });
}

for (const [i, { all }] of pages.entries())
  for (const [k, name] of NAMES.entries()) {
    const sorted = all.map((times) => times[k]).sort((a, b) => a - b);
    const [low, middle, high] = [0, sorted.length >> 1, sorted.length - 1].map((at) =>
      Math.round(sorted[at]),
    );
    console.log(
      `${i ? reports[i - 1] : "one word"} ${name}: ${middle} ms (${low} to ${high}, ${loads} loads)`,
    );
  }
