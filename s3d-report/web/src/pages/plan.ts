// The plan: each area, storey by storey, from above.

import { depthRamp, gradient } from "../colors.js";
import { type ChangeMark, changeMarks } from "../compare/marks.js";
import type { Index } from "../data.js";
import { append, h, metres2, named, say, several } from "../dom.js";
import { storeysOf } from "../storeys.js";
import { saves } from "./export.js";
import { plan } from "./floor.js";

function areaPlan(index: Index, area: number, changes: ChangeMark[]): HTMLElement {
  const section = h("section", { class: "area-plan" }, h("h2", {}, `Area ${area}`));
  const storeys = storeysOf(index, area);
  const { all, of, ofRoom } = storeys;
  const there = {
    rooms: index.rooms.filter((room) => room.area === area),
    stands: index.locations.filter((location) => location.area === area),
    photographs: index.views.filter((view) => view.area === area && view.photograph !== null),
  };
  if (there.rooms.length + there.stands.length + there.photographs.length === 0) {
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
    const words = [
      rooms.length > 0 && `${several(rooms.length, "room")}, ${metres2(floor)}`,
      stands > 0 && several(stands, "scan location"),
      photographs > 0 && several(photographs, "photograph"),
    ].filter(Boolean);
    const summary = words.join(" · ");
    const told = h("p", { class: "quiet", role: "status" }, summary);
    const { element } = plan(index, area, {
      hasRoom: (room) => ofRoom(room) === storey,
      hasHeight: on,
      changes,
      told: (now) => {
        say(told, now ?? summary);
      },
    });
    if (all.length > 1) element.setAttribute("aria-label", `Plan of area ${area}: ${name}`);
    append(section, [
      all.length > 1 && h("h3", {}, name),
      told,
      h("div", { class: "sheet" }, element),
      saves(element, index.data_set.name, element.getAttribute("aria-label") ?? "Plan"),
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

export async function planPage(index: Index): Promise<HTMLElement> {
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
  for (const { area } of index.areas) page.append(areaPlan(index, area, marks.get(area) ?? []));
  return page;
}
