// The page's own modules, for tests without a browser.

import { build } from "esbuild";

/** The module `src/NAME`, bundled with what it needs. */
export async function source(name) {
  const entry = new URL(`../../src/${name}`, import.meta.url).pathname;
  const options = { bundle: true, format: "esm", write: false, logLevel: "error" };
  const { outputFiles } = await build({ entryPoints: [entry], ...options });
  const text = Buffer.from(outputFiles[0].contents).toString("base64");
  return import(`data:text/javascript;base64,${text}`);
}
