// Modules of the page, bundled for Node: for tests of what needs no browser.

import { build } from "esbuild";

/** The exports of `src/NAME`. */
export async function bundled(name) {
  const { outputFiles } = await build({
    entryPoints: [new URL(`../../src/${name}`, import.meta.url).pathname],
    bundle: true,
    format: "esm",
    write: false,
  });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
}
