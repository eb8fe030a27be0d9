// The labels of a pixel in A and in B, in words.

import { entry, key } from "../picture/readout.js";
import { type Against, nameOf } from "./data.js";

/** Words for the label under the pointer in A and in B. */
export function tellBoth(against: Against, a: number | null, b: number | null): HTMLElement[] {
  const sides = [
    ["a", a],
    ["b", b],
  ] as const;
  return sides.map(([side, label]) => {
    const words =
      label === null
        ? "nothing seen"
        : [nameOf(against, label, "class", side), nameOf(against, label, "instance", side)]
            .filter((word, i, all) => all.indexOf(word) === i)
            .join(" · ");
    const element = entry(side.toUpperCase(), words);
    const of = against.both.labels[label ?? -1]?.class;
    const color = of === null || of === undefined ? undefined : against.both.classes[of]?.color;
    if (color) element.querySelector(".name")?.after(key(color));
    return element;
  });
}
