import { launch, open } from "./test/lib/browser.mjs";
const browser = await launch();
const { page, faults, close } = await open(browser, "/tmp/w2data/demo_report", "#/views?show=dropped&sort=fov");
await page.waitForTimeout(3000);
console.log(await page.locator(".no-thumb").allTextContents(), await page.locator(".card canvas").count(), faults);
console.log(await page.locator(".card", {has: page.locator(".no-thumb")}).first().innerHTML());
await page.screenshot({ path: "/tmp/w2shots/dropped.png" });
await browser.close();
