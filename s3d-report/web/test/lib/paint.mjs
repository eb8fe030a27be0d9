// Measures when a report shows something: `node test/lib/paint.mjs LOADS REPORT…`, with the hash behind a folder if
// one is wanted ("OUT_report#/pano"). Each load has a new browser, so no cache, at 1440 × 900; reports take turns.
// The times are ms since the start of the navigation, as the browser itself tells them: median, lowest and highest.

import { launch, open } from "./browser.mjs";

/** The first paint of words or pictures, and when the tabs and the outline were handed to the browser. */
const NAMES = ["first-contentful-paint", "sketched"];

/** The times of a load, by name. */
async function timesOf(folder, hash) {
  const browser = await launch();
  try {
    const { page } = await open(browser, folder, hash, { waits: false });
    const times = await page.waitForFunction((names) => {
      const entries = names.map((name) => performance.getEntriesByName(name)[0]);
      return entries.every(Boolean) && entries.map(({ startTime }) => startTime);
    }, NAMES);
    return await times.jsonValue();
  } finally {
    await browser.close();
  }
}

const [loads, ...reports] = process.argv.slice(2);
const all = reports.map(() => []);
for (let load = 0; load < Number(loads); load++)
  for (const [i, report] of reports.entries()) {
    const [folder, hash = ""] = report.split(/(?=#)/);
    all[i].push(await timesOf(folder, hash));
  }
for (const [i, report] of reports.entries())
  for (const [k, name] of NAMES.entries()) {
    const sorted = all[i].map((times) => times[k]).sort((a, b) => a - b);
    const [low, middle, high] = [0, sorted.length >> 1, sorted.length - 1].map((at) =>
      Math.round(sorted[at]),
    );
    console.log(`${report} ${name}: ${middle} ms (${low} to ${high}, ${loads} loads)`);
  }
