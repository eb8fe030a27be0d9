// Makes one file of the page: markup, style and program. `node bundle.mjs FILE`.

import { build, transform } from "esbuild";
import { createHash } from "node:crypto";
import { readFile, writeFile } from "node:fs/promises";

const here = (name) => new URL(name, import.meta.url);
const target = ["chrome111", "firefox113", "safari16.4"];

// The font's Latin letters. Those of other scripts are the system's.
const FONT = "@fontsource-variable/ibm-plex-sans";
const json = async (path) => JSON.parse(await readFile(here(path), "utf8"));
const ranges = await json(`node_modules/${FONT}/unicode.json`);
const face = async (script) => {
  const file = `node_modules/${FONT}/files/ibm-plex-sans-${script}-wght-normal.woff2`;
  const bytes = (await readFile(here(file))).toString("base64");
  return (
    `@font-face { font-family: "IBM Plex Sans"; font-weight: 100 700; font-display: block; ` +
    `src: url(data:font/woff2;base64,${bytes}) format("woff2"); unicode-range: ${ranges[script]}; }`
  );
};
const faces = await Promise.all(["latin", "latin-ext"].map(face));

const styles = ["style.css", "present.css"].map((name) => readFile(here(name), "utf8"));
const style = [...faces, ...(await Promise.all(styles))].join("\n");
const css = await transform(style, { loader: "css", minify: true, target });

// The page shows the terms of all that is bundled.
const licences = [];
for (const name of [...Object.keys((await json("package.json")).dependencies), FONT]) {
  const { version } = await json(`node_modules/${name}/package.json`);
  const text = (await readFile(here(`node_modules/${name}/LICENSE`), "utf8")).trim();
  licences.push({ name, version, text });
}

const js = await build({
  entryPoints: [here("src/main.ts").pathname],
  bundle: true,
  format: "iife",
  minify: true,
  write: false,
  legalComments: "inline",
  charset: "ascii",
  define: { LICENCES: JSON.stringify(licences) },
  target,
});
const [ofStyle, program] = [css.code.trim(), js.outputFiles[0].text.trim()];

// The page runs this program and no other: the policy names it by its hash.
const hash = (text) => `sha256-${createHash("sha256").update(text).digest("base64")}`;
const page = (await readFile(here("page.html"), "utf8"))
  .replace("STYLE_HASH", hash(ofStyle))
  .replace("SCRIPT_HASH", hash(program))
  .replace("STYLE", () => ofStyle)
  .replace("SCRIPT", () => program);
await writeFile(process.argv[2], page);
