import { launch, open, go } from "./test/lib/browser.mjs";
const [, , folder, ...rest] = process.argv;
const browser = await launch();
const sizes = [[1440, 900], [900, 900], [390, 844]];
const pages = rest.length ? rest : ["#/views", "#/plan", "#/notes"];
for (const [width, height] of sizes)
  for (const scheme of ["light", "dark"]) {
    if (scheme === "dark" && width === 900) continue;
    const { page, close } = await open(browser, folder, "#/notes", { width, height });
    await page.emulateMedia({ colorScheme: scheme });
    for (const [i, hash] of pages.entries()) {
      await go(page, hash);
      if (hash.startsWith("#/space")) {
        await page.waitForSelector("main[data-loaded=all]");
        await page.locator(".tree > summary").click().catch(() => {});
        await page.locator(".tree > details > summary").first().click().catch(() => {});
        await page.waitForTimeout(200);
        await page.locator(".tree > details details > summary").nth(1).click().catch(() => {});
      }
      if (hash.startsWith("#/pano") || hash.startsWith("#/view/")) {
        const box = await page.locator(".viewer canvas").boundingBox();
        await page.mouse.move(box.x + box.width * 0.62, box.y + box.height * 0.6);
      }
      if (hash.startsWith("#/views")) await page.getByText("Filter by numbers").click().catch(() => {});
      await page.waitForTimeout(500);
      await page.screenshot({ path: `/tmp/w2shots/${i}-${width}-${scheme}.png` });
    }
    await close();
  }
await browser.close();
