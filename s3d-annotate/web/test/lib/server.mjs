// The server of `s3d label`, with labels of its own in a folder that is removed again.

import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";

/** Serves the page for a mesh or scene of the built-in scan. `url` is the page's address. */
export async function serve({ scene = "scan/scene.toml" } = {}) {
  const folder = mkdtempSync(join(tmpdir(), "s3d-label-"));
  const labels = join(folder, "scan.labels");
  const at = join(process.env["S3D_DEMO"], scene);
  const child = spawn(process.env["S3D_BIN"], ["--quiet", "label", at, "-o", labels, "--no-open"], {
    stdio: ["ignore", "pipe", "inherit"],
  });
  const ended = new Promise((done) => child.once("exit", done));
  let url = "";
  for await (const line of createInterface({ input: child.stdout })) {
    url = line.trim();
    break;
  }
  if (!url.startsWith("http")) throw new Error(`s3d label has not begun: ${url}`);
  const close = async () => {
    child.kill("SIGINT");
    await ended;
    rmSync(folder, { recursive: true });
  };
  return { url, labels, close, stop: () => child.kill("SIGSTOP"), go: () => child.kill("SIGCONT") };
}
