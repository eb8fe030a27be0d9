// Modules of the page, bundled for Node: for tests of what needs no browser.

import { build } from "esbuild";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

globalThis.window ??= globalThis;

/** The exports of `src/NAME`. */
export async function bundled(name) {
  const folder = mkdtempSync(join(tmpdir(), "s3d-unit-"));
  try {
    const outfile = join(folder, "module.mjs");
    const entry = new URL(`../../src/${name}`, import.meta.url).pathname;
    // Sources outside this folder find their packages here.
    const nodePaths = [new URL("../../node_modules", import.meta.url).pathname];
    await build({ entryPoints: [entry], bundle: true, format: "esm", outfile, nodePaths });
    return await import(outfile);
  } finally {
    rmSync(folder, { recursive: true });
  }
}
