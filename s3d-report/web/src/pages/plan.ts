// The plan: each area, storey by storey, from above.

import { depthRamp, gradient } from "../colors.js";
import { type ChangeMark, changeMarks } from "../compare/marks.js";
import type { Index } from "../data.js";
import { append, h, metres2, named, say, several } from "../dom.js";
import { storeysOf } from "../storeys.js";
import { type GraphLayer, shown as shownGraph } from "../relations/graph.js";
import { type Route, replaceRoute } from "../route/route.js";
import { saves } from "./export.js";
import { plan } from "./floor.js";
import { type GroundLayer, groundOf, pixelWords, shown } from "./ground.js";

/** A plan on the page, and what lies under it. */
interface Sheet {
  element: SVGSVGElement;
  ground: GroundLayer | null;
  graph: GraphLayer | null;
}

/** The part of an address with what lies under plans and on them. */
const layersQuery = (): Record<string, string> => ({
  ...(shown.ground ? {} : { ground: "none" }),
  ...(shownGraph.graph ? { graph: "on" } : {}),
});

function areaPlan(index: Index, area: number, changes: ChangeMark[], sheets: Sheet[]): HTMLElement {
  const section = h("section", { class: "area-plan" }, h("h2", {}, `Area ${area}`));
  const storeys = storeysOf(index, area);
  const { all, of, ofRoom } = storeys;
  const there = {
    rooms: index.rooms.filter((room) => room.area === area),
    stands: index.locations.filter((location) => location.area === area),
    photographs: index.views.filter((view) => view.area === area && view.photograph !== null),
  };
  const hasGround = index.grounds?.some((ground) => ground.area === area) ?? false;
  if (there.rooms.length + there.stands.length + there.photographs.length === 0 && !hasGround) {
    append(section, [h("p", { class: "quiet" }, "It has no rooms, scan locations or photographs.")]);
    return section;
  }
  for (const [storey, { name, rooms }] of all.entries()) {
    const on = (z: number, room?: string): boolean => of(z, room) === storey;
    const floor = rooms.reduce((sum, room) => sum + room.floor_m2, 0);
    const stands = there.stands.filter((l) => (l.position ? on(l.position[2], l.room) : storey === 0)).length;
    const photographs = there.photographs.filter((v) =>
      v.position ? on(v.position[2], v.room) : storey === 0,
    ).length;
    const ground = groundOf(index, area, storeys, storey);
    const under = index.grounds?.[ground ?? -1];
    const words = [
      rooms.length > 0 && `${several(rooms.length, "room")}, ${metres2(floor)}`,
      stands > 0 && several(stands, "scan location"),
      photographs > 0 && several(photographs, "photograph"),
      under && `ground: ${pixelWords(under)}`,
    ].filter(Boolean);
    const summary = words.join(" · ");
    const told = h("p", { class: "quiet", role: "status" }, summary);
    const drawn = plan(index, area, {
      ground,
      hasRoom: (room) => ofRoom(room) === storey,
      hasHeight: on,
      hasGraph: index.pairs?.includes(area) ?? false,
      changes,
      told: (now) => {
        say(told, now ?? summary);
      },
    });
    const { element } = drawn;
    sheets.push({ element, ground: drawn.ground, graph: drawn.graph });
    if (all.length > 1) element.setAttribute("aria-label", `Plan of area ${area}: ${name}`);
    append(section, [
      all.length > 1 && h("h3", {}, name),
      told,
      h("div", { class: "sheet" }, element),
      saves(element, index.data_set.name, element.getAttribute("aria-label") ?? "Plan", async () => {
        if (shown.ground) await drawn.ground?.fill();
      }),
    ]);
  }
  return section;
}

function legend(index: Index, changes: ChangeMark[]): HTMLElement {
  const line = h("p", { class: "legend" });
  if (index.locations.some((l) => l.position && l.seen?.coverage != null)) {
    const ramp = h("span", { class: "ramp" });
    ramp.style.background = gradient(depthRamp);
    append(line, ["Scan coverage of a panorama: 0 %", ramp, "100 %"]);
  }
  if (index.votes.some(({ votes }) => votes.disputed_patches.length > 0))
    append(line, [h("span", { class: "entry" }, h("span", { class: "key patch-key" }), "disputed patch")]);
  for (const [isClass, words] of [
    [true, "another class"],
    [false, "another instance of the class"],
  ] as const) {
    if (!changes.some((mark) => mark.isClass === isClass)) continue;
    const key = h("span", { class: isClass ? "key change-key class" : "key change-key" });
    append(line, [h("span", { class: "entry" }, key, `${words} in ${named(index.against ?? "B")}`)]);
  }
  return line;
}

/** A switch for the ground of all plans, which are loaded when they come into sight. */
function groundSwitch(all: Sheet[], fault: (words: string) => void): HTMLElement | null {
  const sheets = all.filter(({ ground }) => ground !== null);
  if (sheets.length === 0) return null;
  const seen = new IntersectionObserver(
    (entries) => {
      for (const { isIntersecting, target } of entries) {
        const sheet = sheets.find(({ element }) => element === target);
        if (!isIntersecting || !sheet || !shown.ground) continue;
        seen.unobserve(target);
        sheet.ground?.fill().catch((e: unknown) => fault(e instanceof Error ? e.message : String(e)));
      }
    },
    { rootMargin: "300px" },
  );
  const put = (): void => {
    for (const { element } of sheets) {
      element.classList.toggle("on-ground", shown.ground);
      seen.unobserve(element);
      if (shown.ground) seen.observe(element);
    }
  };
  put();
  const box = h("input", { type: "checkbox", checked: shown.ground });
  box.addEventListener("change", () => {
    shown.ground = box.checked;
    put();
    replaceRoute("plan", [], layersQuery());
  });
  return h("label", { class: "tool" }, box, "Mesh from above");
}

/** A switch for the graphs of all plans, with what its lines mean. */
function graphSwitch(sheets: Sheet[], fault: (words: string) => void): HTMLElement[] {
  const graphs = sheets.flatMap(({ element, graph }) => (graph ? [{ element, graph }] : []));
  if (graphs.length === 0) return [];
  const told = h("p", { class: "quiet", hidden: true });
  const put = async (): Promise<void> => {
    for (const { element } of graphs) element.classList.toggle("with-graph", shownGraph.graph);
    told.hidden = !shownGraph.graph;
    if (!shownGraph.graph) return;
    // The storeys of an area have one graph.
    const filled = new Set(await Promise.all(graphs.map(({ graph }) => graph.fill())));
    const leftOut = [...filled].reduce((sum, graph) => sum + graph.left_out, 0);
    const words = "The thicker a line, the more its two places share: the best of all pairs of their images.";
    const less =
      leftOut > 0 &&
      ` ${several(leftOut, "weak line")} among many at a place ${leftOut === 1 ? "is" : "are"} left out.`;
    say(told, [words, less].filter(Boolean).join(""));
  };
  const start = (): void => {
    put().catch((e: unknown) => fault(e instanceof Error ? e.message : String(e)));
  };
  start();
  const box = h("input", { type: "checkbox", checked: shownGraph.graph });
  box.addEventListener("change", () => {
    shownGraph.graph = box.checked;
    start();
    replaceRoute("plan", [], layersQuery());
  });
  return [h("label", { class: "tool" }, box, "Shared surface"), told];
}

export async function planPage(index: Index, route: Route): Promise<HTMLElement> {
  const asked = route.query.get("ground");
  if (asked !== null) shown.ground = asked !== "none";
  if (route.query.has("graph")) shownGraph.graph = route.query.get("graph") === "on";
  let trouble = "";
  const marks = await changeMarks(index).catch((e: unknown) => {
    trouble = e instanceof Error ? e.message : String(e);
    return new Map<number, ChangeMark[]>();
  });
  const page = h(
    "main",
    { class: "page" },
    h("h1", {}, "Plan"),
    trouble === "" ? null : h("p", { role: "alert" }, trouble),
    legend(index, [...marks.values()].flat()),
  );
  const sheets: Sheet[] = [];
  const plans = index.areas.map(({ area }) => areaPlan(index, area, marks.get(area) ?? [], sheets));
  const fault = (words: string): void => page.prepend(h("p", { role: "alert" }, words));
  const [graph, told] = graphSwitch(sheets, fault);
  const ground = groundSwitch(sheets, fault);
  const switches = graph ? h("div", { class: "tools" }, ground, graph) : ground;
  append(page, [switches, told, ...plans]);
  return page;
}
