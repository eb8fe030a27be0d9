// Makes one file of the page: markup, style and program. `node bundle.mjs FILE`.

import { build, transform } from "esbuild";
import { readFile, writeFile } from "node:fs/promises";

const here = (name) => new URL(name, import.meta.url);
const target = ["chrome111", "firefox113", "safari16.4"];

// The legend of depth has the colours of the pictures.
const colors = await build({
  entryPoints: [here("src/colors.ts").pathname],
  bundle: true,
  format: "esm",
  write: false,
});
const { depthRamp } = await import(`data:text/javascript,${encodeURIComponent(colors.outputFiles[0].text)}`);
const ramp = depthRamp(9);
const stops = Array.from({ length: 9 }, (_, i) => `rgb(${ramp.subarray(4 * i, 4 * i + 3).join(" ")})`);

const style = (await readFile(here("style.css"), "utf8")).replace("RAMP", stops.join(", "));
const css = await transform(style, { loader: "css", minify: true, target });
const js = await build({
  entryPoints: [here("src/main.ts").pathname],
  bundle: true,
  format: "iife",
  minify: true,
  write: false,
  legalComments: "inline",
  charset: "ascii",
  target,
});
const page = (await readFile(here("page.html"), "utf8"))
  .replace("STYLE", () => css.code.trim())
  .replace("SCRIPT", () => js.outputFiles[0].text.trim());
await writeFile(process.argv[2], page);
