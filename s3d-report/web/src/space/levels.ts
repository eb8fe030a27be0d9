// Buttons for the storeys of an area.

import { h } from "../dom.js";
import { wordsOf } from "../storeys.js";
import { slabIn } from "./look.js";
import type { SpaceView } from "./view.js";

/** A button for each storey, the highest first, and one for all; null if there is only one storey. */
export function storeyButtons(view: SpaceView): { buttons: HTMLElement | null; press: () => void } {
  const { all } = view.storeys;
  if (all.length < 2) return { buttons: null, press: () => {} };
  const entries = all.map((storey, i): [number | null, string] => [i, wordsOf(storey)]);
  const made = [...entries.reverse(), [null, "All storeys"] as const].map(([storey, words]) => {
    const button = h("button", { type: "button", "aria-pressed": "false" }, words);
    button.addEventListener("click", () => view.showStorey(storey));
    return { storey, button };
  });
  const press = (): void => {
    const { low, high } = slabIn(view.look);
    for (const { storey, button } of made) {
      const slab = view.slabOf(storey);
      const is = Math.abs(slab.high - high) < 0.005 || slab.high === high;
      button.setAttribute(
        "aria-pressed",
        String(is && (slab.low === low || Math.abs(slab.low - low) < 0.01)),
      );
    }
  };
  const buttons = h("div", { class: "storeys", role: "group", "aria-label": "Storeys" });
  buttons.append(...made.map(({ button }) => button));
  return { buttons, press };
}
