// Makes one file of a page: markup, style and program. `node bundle.mjs report|label FILE`.

import { build, transform } from "esbuild";
import { createHash } from "node:crypto";
import { readFile, writeFile } from "node:fs/promises";

const here = (name) => new URL(name, import.meta.url);
const target = ["chrome111", "firefox113", "safari16.4"];

/** The pages: that of `s3d report`, and that of `s3d label`, which shares sources and packages with it. */
const PAGES = {
  report: {
    boot: "src/boot.ts",
    program: "src/main.ts",
    styles: ["base.css", "style.css", "relations.css", "present.css"],
    markup: "page.html",
  },
  label: {
    program: "../../s3d-annotate/web/src/main.ts",
    styles: ["base.css", "../../s3d-annotate/web/label.css"],
    markup: "../../s3d-annotate/web/label.html",
  },
};
const [name, output] = process.argv.slice(2);
const { boot, program, styles, markup } = PAGES[name];

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

const sheets = await Promise.all(styles.map((path) => readFile(here(path), "utf8")));
const css = await transform([...faces, ...sheets].join("\n"), { loader: "css", minify: true, target });

// The page shows the terms of all that is bundled.
const licences = [];
for (const dependency of [...Object.keys((await json("package.json")).dependencies), FONT]) {
  const { version } = await json(`node_modules/${dependency}/package.json`);
  const text = (await readFile(here(`node_modules/${dependency}/LICENSE`), "utf8")).trim();
  licences.push({ name: dependency, version, text });
}

const bundled = async (entry) => {
  const js = await build({
    entryPoints: [here(entry).pathname],
    bundle: true,
    format: "iife",
    minify: true,
    write: false,
    legalComments: "inline",
    charset: "ascii",
    // Sources outside this folder find their packages here.
    nodePaths: [here("node_modules").pathname],
    define: { LICENCES: JSON.stringify(licences) },
    target,
  });
  return js.outputFiles[0].text.trim();
};
const ofStyle = css.code.trim();
const ofProgram = await bundled(program);
const ofBoot = boot ? await bundled(boot) : "";

// The page runs this program, what starts it, and no other: the policy names both by their hashes.
const hash = (text) => `sha256-${createHash("sha256").update(text).digest("base64")}`;
const page = (await readFile(here(markup), "utf8"))
  .replace("STYLE_HASH", hash(ofStyle))
  .replace("BOOT_HASH", hash(ofBoot))
  .replace("SCRIPT_HASH", hash(ofProgram))
  // The last one first, since what is put in may hold such a word.
  .replace("SCRIPT", () => ofProgram)
  .replace("BOOT", () => ofBoot)
  .replace("STYLE", () => ofStyle);
await writeFile(output, page);
