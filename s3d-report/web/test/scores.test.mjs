// The page of scores shows what `s3d eval` wrote.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { launch, open } from "./lib/browser.mjs";

const report = process.env["S3D_SCORES_REPORT"];
const scores = JSON.parse(readFileSync(process.env["S3D_SCORES"], "utf8"));
let browser;
before(async () => (browser = await launch()));
after(() => browser?.close());

test("tables and confusion are those of the evaluation", async () => {
  const { page, faults, close } = await open(browser, report, "#/scores");
  const [table] = scores.tables;
  const rows = page.locator("section", { hasText: table.title }).first().locator("tbody tr");
  assert.equal(await rows.count(), table.rows.length);
  const mean = table.rows.findIndex(({ name }) => name === "mean");
  const cells = await rows.nth(mean).locator("td").allTextContents();
  const [iou] = table.rows[mean].scores;
  const [low, high] = iou.interval.map((value) => value.toFixed(4));
  assert.equal(cells[1], `${iou.value.toFixed(4)} [${low}, ${high}]`);

  const { classes, counts } = scores.confusion;
  const told = await page
    .locator(".confusion td span")
    .evaluateAll((all) => all.map((cell) => cell.getAttribute("aria-label")));
  const grouped = (n) => n.toLocaleString("en");
  const wall = classes.indexOf("wall");
  const all = counts[wall].reduce((sum, n) => sum + n, 0);
  const expected = `wall predicted as beam: ${grouped(counts[wall][wall + 1])} of ${grouped(all)} (`;
  assert.ok(
    told.some((words) => words.startsWith(expected)),
    expected,
  );
  assert.deepEqual(faults, []);
  await close();
});

test("rooms are listed by a score that is chosen", async () => {
  const { page, faults, close } = await open(browser, report, "#/scores");
  const { rows, units } = scores.units;
  await page.getByLabel("Row", { exact: true }).selectOption(String(rows.indexOf("overall")));
  await page.getByLabel("Column", { exact: true }).selectOption("1");
  await page.getByLabel("Order", { exact: true }).selectOption("highest");
  const shown = await page
    .locator("section", { hasText: "Rooms" })
    .last()
    .locator("td .number")
    .allTextContents();
  const overall = units.map((unit) => unit.scores[rows.indexOf("overall")][1]);
  const expected = overall.sort((a, b) => b - a).map((value) => value.toFixed(4));
  assert.deepEqual(shown, expected);
  assert.deepEqual(faults, []);
  await close();
});
