// A server to test the page with.

import { spawn } from "node:child_process";
import { createInterface } from "node:readline";

/** Starts a server; `url` is the page's address. */
export async function serve({ fine = false } = {}) {
  const port = 20_000 + Math.floor(20_000 * Math.random());
  const mock = new URL("mock.mjs", import.meta.url).pathname;
  const child = spawn(
    process.execPath,
    [mock, `${process.env["S3D_SCAN"]}/${fine ? "fine" : "rgb"}.obj`, port],
    {
      stdio: ["ignore", "pipe", "inherit"],
    },
  );
  for await (const line of createInterface({ input: child.stdout })) if (line === "ready") break;
  return { url: `http://127.0.0.1:${port}/t/`, close: () => child.kill() };
}
