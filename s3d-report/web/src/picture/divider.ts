// The line between two pictures of the same place, which is dragged, or moved by keys.

import { h } from "../dom.js";
import { type ActOf, actOf } from "../keys.js";

export interface Divider {
  line: HTMLElement;
  /** Moves the line to this share of the width; `words` says what is on its sides. */
  put: (share: number, words: string) => void;
}

/** A line over `frame`; `moved` gets the share of the width. */
export function divider(label: string, frame: () => Element, moved: (share: number) => void): Divider {
  let at = 0.5;
  const line = h(
    "div",
    {
      class: "split",
      role: "slider",
      tabindex: 0,
      "aria-label": label,
      "aria-valuemin": 0,
      "aria-valuemax": 100,
    },
    h("span", { class: "grip", "aria-hidden": "true" }),
  );
  const move = (to: number): void => moved(Math.min(1, Math.max(0, to)));
  line.addEventListener("keydown", (event) => {
    const places: Record<ActOf<"line">, number> = { left: at - 0.02, right: at + 0.02, start: 0, end: 1 };
    const act = actOf("line", event);
    if (!act) return;
    event.preventDefault();
    move(places[act]);
  });
  line.addEventListener("pointerdown", (down) => {
    down.preventDefault();
    line.setPointerCapture(down.pointerId);
    line.focus();
    const drag = (event: PointerEvent): void => {
      const box = frame().getBoundingClientRect();
      move((event.clientX - box.left) / box.width);
    };
    const ends = ["pointerup", "pointercancel"] as const;
    const end = (): void => {
      line.removeEventListener("pointermove", drag);
      for (const name of ends) line.removeEventListener(name, end);
    };
    line.addEventListener("pointermove", drag);
    for (const name of ends) line.addEventListener(name, end);
  });
  const put = (share: number, words: string): void => {
    at = share;
    line.style.left = `${100 * share}%`;
    line.setAttribute("aria-valuenow", String(Math.round(100 * share)));
    line.setAttribute("aria-valuetext", words);
  };
  return { line, put };
}
