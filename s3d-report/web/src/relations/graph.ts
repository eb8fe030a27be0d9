// The overlap graph on a plan: lines between the places of cameras whose images share surface.

import { percent, s, several } from "../dom.js";
import { type Graph, type Place, loadGraph } from "./data.js";

/** Whether plans have the graph: the last choice. */
export const shown = { graph: false };

/** The key of a place. */
export const placeKey = ({ location, picture }: Place): string =>
  location === undefined ? `picture ${picture}` : `location ${location}`;

export interface GraphLayer {
  element: SVGElement;
  /** Loads the lines, once, and returns the graph. */
  fill: () => Promise<Graph>;
  /** Highlights the lines of a place; none with null. */
  near: (key: string | null) => void;
  /** Words for the lines of a place; empty if there are none. */
  words: (key: string) => string;
}

/** The width of a line and its opacity, by share. */
const widthOf = (share: number): number => 0.2 + 0.8 * share;
const opacityOf = (share: number): number => 0.45 + 0.5 * share;

/** The graph of an area. `at` returns where a place is on the plan, or null if it is not there. */
export function graphLayer(
  area: number,
  unit: number,
  at: (key: string) => [number, number] | null,
): GraphLayer {
  const element = s("g", { class: "graph" });
  const lines: { ends: string[]; line: SVGElement }[] = [];
  let coming: Promise<Graph> | null = null;

  const get = async (): Promise<Graph> => {
    const graph = await loadGraph(area);
    // Thick lines lie on thin ones.
    for (const { ends, share, pairs } of [...graph.edges].reverse()) {
      const keys = ends.map(placeKey);
      const [a, b] = keys.map(at);
      if (!a || !b) continue;
      const line = s("path", {
        class: "share",
        d: `M${a.join(",")}L${b.join(",")}`,
        "stroke-width": (widthOf(share) * unit).toFixed(4),
        "stroke-opacity": opacityOf(share).toFixed(3),
      });
      line.append(s("title", {}, `up to ${percent(share)} shared, ${several(pairs, "pair")} of images`));
      lines.push({ ends: keys, line });
      element.append(line);
    }
    return graph;
  };

  return {
    element,
    fill: () => (coming ??= get()),
    near: (key) => {
      element.classList.toggle("chosen", key !== null && lines.some(({ ends }) => ends.includes(key)));
      for (const { ends, line } of lines)
        line.classList.toggle("is-near", key !== null && ends.includes(key));
    },
    words: (key) => {
      const n = lines.filter(({ ends }) => ends.includes(key)).length;
      return n === 0 ? "" : `shares surface with ${several(n, "place")}`;
    },
  };
}
