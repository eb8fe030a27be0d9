// What runs before the program: it shows the tabs and a sketch, lets the browser paint them, and starts the
// program then. Reading the program alone takes as long as all of this.

import { type First, load } from "./data.js";
import { painted, sketch } from "./first.js";

/** The program, a text that is not run where it stands. */
const program = (): HTMLElement | null => document.getElementById("program");

async function begin(): Promise<void> {
  const place = document.createElement("div");
  place.id = "place";
  // A folder without this file is damaged, and the index tells more of that.
  const first = await load<First>("first").catch(() => null);
  let header: HTMLElement | null = null;
  if (first) {
    const shell = document.querySelectorAll("body > :not(script)");
    header = sketch(first, place);
    shell.forEach((element) => element.remove());
    document.body.prepend(header, place);
    performance.mark("sketched");
    await painted();
  }
  window.s3dBegun = { first, header, place };

  if (!program() || document.readyState === "loading")
    await new Promise((done) => document.addEventListener("DOMContentLoaded", done, { once: true }));
  const script = document.createElement("script");
  script.textContent = program()?.textContent ?? "";
  program()?.remove();
  document.body.append(script);
}

void begin();
