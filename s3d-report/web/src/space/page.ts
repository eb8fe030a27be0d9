// The page of a mesh in 3D: its controls, and the list of disputed patches.

import type { Index, Mesh } from "../data.js";
import { append, choice, count, h, named, several } from "../dom.js";
import { actOf } from "../keys.js";
import type { Modality } from "../picture/gl.js";
import type { Measured } from "../picture/measure.js";
import { legendOf } from "../picture/readout.js";
import {
  type Against,
  type Side,
  changedWords,
  groupOf,
  loadAgainst,
  loadChanges,
  nameOf,
} from "../compare/data.js";
import { type Page, type Route, link, replaceRoute } from "../route/route.js";
import { type Look, type Mark, lookFrom, marksOf, queryOf, showsOf } from "./look.js";
import type { Show } from "./paint.js";
import { pictureTools } from "../tools.js";
import { storeyButtons } from "./levels.js";
import { treePanel } from "./tree.js";
import { SpaceView } from "./view.js";

/** Browsers limit the changes of the address in a minute; this is the time between two, ms. */
const PAUSE = 250;

const SHOW_NAMES: Record<Show, string> = {
  texture: "Texture",
  class: "Class",
  instance: "Instance",
  margin: "Disputed",
  unlabelled: "Unlabelled",
  changed: "Changed",
  normal: "Normals",
};

const LEGENDS: Record<Show, Modality[]> = {
  texture: [],
  class: ["class"],
  instance: [],
  margin: ["contested"],
  unlabelled: ["unlabelled"],
  changed: ["changed"],
  normal: [],
};

const MARK_NAMES: Record<Mark, string> = {
  rooms: "Rooms",
  locations: "Scan locations",
  kept: "Kept views",
  dropped: "Dropped views",
};

function sentence(words: string): Page {
  const element = h("main", { class: "page" }, h("h1", {}, "3D"), h("p", { role: "alert" }, words));
  return { element, close: () => {} };
}

export async function spacePage(index: Index, route: Route): Promise<Page> {
  let trouble = "";
  const against = await (loadAgainst(index) ?? Promise.resolve(null)).catch((e: unknown) => {
    trouble = e instanceof Error ? e.message : String(e);
    return null;
  });
  const area = route.path[0] ?? (against ? await areaOfChange(against, route.query) : undefined);
  const mesh = area === undefined ? index.meshes[0] : index.meshes.find((m) => String(m.area) === area);
  if (!mesh)
    return sentence(
      index.areas.some((a) => String(a.area) === area || area === undefined)
        ? "The mesh of this area could not be read when the report was made; see Notes."
        : "There is no such area in this report.",
    );
  try {
    const changed = against?.changed_faces.includes(mesh.area) ?? false;
    const page = pageOf(index, mesh, lookFrom(index, mesh, route.query, changed), against);
    if (trouble !== "") page.element.prepend(h("p", { role: "alert" }, trouble));
    return page;
  } catch (e) {
    return sentence(e instanceof Error ? e.message : String(e));
  }
}

/** The first area with the changed faces that an address names. */
async function areaOfChange(against: Against, query: URLSearchParams): Promise<string | undefined> {
  if (!query.has("was") && !query.has("is")) return undefined;
  for (const area of against.changed_faces) {
    // A file that cannot be read is reported when its area is shown.
    const changes = await loadChanges(against, area).catch(() => null);
    if (changes && groupOf(against, changes, query.get("was"), query.get("is"))) return String(area);
  }
  return undefined;
}

function pageOf(index: Index, mesh: Mesh, look: Look, against: Against | null): Page {
  const status = h("p", { class: "quiet progress", role: "status" });
  const faults = h("div", {});
  const legend = h("div", { class: "legend" });
  let timer = 0;
  const view = new SpaceView(index, mesh, look, {
    against,
    changed: () => {
      slide();
      press();
      legend.replaceChildren(...legendOf(index, LEGENDS[look.show], [0, 0]));
      window.clearTimeout(timer);
      timer = window.setTimeout(() => {
        if (element.isConnected && !element.inert)
          replaceRoute("space", [mesh.area], queryOf(look, view.stand));
      }, PAUSE);
    },
    progress: (words) => {
      status.textContent = words;
      status.hidden = words === "";
    },
    fault: (words) => faults.append(h("p", { role: "alert" }, words)),
  });
  const { buttons, press } = storeyButtons(view);
  const { slider, slide } = section(mesh, look, () => view.refresh());
  const areas = index.meshes.map((m): [string, string] => [link("space", [m.area]), `Area ${m.area}`]);
  const place = choice("Area", areas, link("space", [mesh.area]), (to) => (window.location.hash = to));
  const tools = h("div", { class: "tools" }, h("h1", { class: "hidden" }, `Area ${mesh.area} in 3D`));
  append(tools, [areas.length > 1 && place, buttons, slider, ...switches(index, view)]);
  const changed = against?.changed_faces.includes(mesh.area) ?? false;
  const colors = showsOf(mesh, changed).map((show): [string, string] => [show, SHOW_NAMES[show]]);
  const bar = h("div", { class: "viewer-bar" });
  const show = choice("Colours", colors, look.show, (to) => {
    look.show = to as Show;
    view.refresh();
  });
  const above = h("button", { type: "button", title: "See all of what is shown" }, "From above");
  above.addEventListener("click", () => view.lookFromAbove());
  append(bar, [colors.length > 1 && show, ...measureButtons(view), above]);
  const hint =
    "Drag to turn, scroll to zoom, double-click to go closer, point at something to know what it is.";
  view.readout.append(h("span", { class: "quiet" }, hint));
  const frame = h("div", { class: "frame" }, view.canvas, view.overlay, status);
  const viewer = h("section", { class: "viewer space" }, bar, frame, view.readout, legend, simplified(mesh));
  const { canvas } = view;
  const draw = (): void => view.drawPlain();
  frame.append(pictureTools({ element: viewer, canvas, dataSet: index.data_set.name, draw }));
  const element = h("main", { class: "look in-space" }, tools, faults, viewer);
  const fill = async (): Promise<void> => {
    await view.load();
    element.dataset["loaded"] = "mesh";
    append(frame, [tree(index, view)]);
    append(tools, [boxChoice(index, view), patchList(index, view), against && changeList(against, view)]);
    await view.loadTextures();
    element.dataset["loaded"] = "all";
  };
  void fill();
  return {
    element,
    close: () => {
      window.clearTimeout(timer);
      view.close();
    },
  };
}

/** A slider for the height above which all is cut away. */
function section(mesh: Mesh, look: Look, moved: () => void): { slider: HTMLElement; slide: () => void } {
  const [low, high] = [Math.floor(100 * mesh.min[2]) / 100, Math.ceil(100 * mesh.max[2]) / 100];
  const value = h("output", { class: "section-height" });
  const range = h("input", { type: "range", min: low, max: high, step: 0.01, value: high });
  range.setAttribute("aria-label", "Cut away what is above, metres");
  range.addEventListener("input", () => {
    const height = Number(range.value);
    look.section = height >= high ? Infinity : height;
    moved();
  });
  const slide = (): void => {
    const height = look.section ?? Infinity;
    range.value = String(Math.min(high, height));
    const words = Number.isFinite(height) ? `${height.toFixed(2)} m` : "nothing";
    value.textContent = words;
    range.setAttribute("aria-valuetext", words);
  };
  slide();
  return { slider: h("label", { class: "tool" }, "Cut above", range, value), slide };
}

function switches(index: Index, view: SpaceView): HTMLElement[] {
  return marksOf(index, view.mesh).map((mark) => {
    const box = h("input", { type: "checkbox", checked: view.look.marks.has(mark) });
    box.addEventListener("change", () => {
      if (box.checked) view.look.marks.add(mark);
      else view.look.marks.delete(mark);
      view.refresh(true);
    });
    return h("label", { class: "tool" }, box, MARK_NAMES[mark]);
  });
}

/** Buttons that measure distances and areas. One of them is on at most. */
function measureButtons(view: SpaceView): HTMLButtonElement[] {
  const made = (["distance", "area"] as const).map((what) => {
    const words = what === "distance" ? "Measure" : "Area";
    const title = what === "distance" ? "Distance of two points" : "Area of an outline: click its corners";
    return { what, button: h("button", { type: "button", "aria-pressed": "false", title }, words) };
  });
  const turn = (to: Measured | null): void => {
    for (const { what, button } of made) button.setAttribute("aria-pressed", String(what === to));
    view.measure(to);
  };
  for (const { what, button } of made)
    button.addEventListener("click", () => {
      turn(button.getAttribute("aria-pressed") === "true" ? null : what);
    });
  for (const element of [...made.map(({ button }) => button), view.canvas])
    element.addEventListener("keydown", (event) => {
      const act = actOf("space", event as KeyboardEvent);
      if (act === "stop") turn(null);
      if (act === "undo") view.undoCorner();
    });
  return made.map(({ button }) => button);
}

function boxChoice(index: Index, view: SpaceView): HTMLElement | null {
  const found = new Set(view.boxes.map(({ label }) => index.labels[label]?.class ?? null));
  const classes = index.classes
    .map(({ name }, i): [string, string] => [String(i), `Boxes: ${named(name)}`])
    .filter(([i]) => found.has(Number(i)));
  if (classes.length === 0) return null;
  const entries: [string, string][] = [["", "No boxes"], ["all", "Boxes: all instances"], ...classes];
  const { look } = view;
  return choice("Boxes of instances", entries, look.boxes === null ? "" : String(look.boxes), (value) => {
    look.boxes = value === "" ? null : value === "all" ? "all" : Number(value);
    view.refresh(true);
  });
}

/** The rooms and their instances, if the mesh has labels. */
function tree(index: Index, view: SpaceView): HTMLElement | null {
  const { look } = view;
  return treePanel(index, view.mesh.has_votes ? view.boxes : [], {
    only: look.only,
    isolate: (of) => {
      look.only = of;
      view.refresh();
    },
    light: (label) => view.light(label),
    visit: ({ box: [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] }) =>
      view.visit(
        [(x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2],
        Math.hypot(x1 - x0, y1 - y0, z1 - z0) / 2,
        true,
      ),
  });
}

/** The disputed patches with the largest surface; each is a link to its place. */
function patchList(index: Index, view: SpaceView): HTMLElement | null {
  const found = index.votes.find(({ area }) => area === view.mesh.area)?.votes.disputed_patches ?? [];
  const patches = [...found].sort((a, b) => b.m2 - a.m2);
  if (patches.length === 0) return null;
  const entries = patches.map(({ labels, faces, m2 }, i): [string, string] => [
    String(i),
    `${m2.toFixed(4)} m² · ${labels.map(named).join(" or ")} · ${several(faces, "face")}`,
  ]);
  const list = choice("Disputed patches", [["", "Disputed patches…"], ...entries], "", (value) => {
    const patch = patches[Number(value)];
    if (value !== "" && patch) view.visit(patch.center, 0, true);
  });
  list.classList.add("patches");
  return list;
}

/** The number of changes in the list. */
const CHANGES = 50;

/** The changes, those of class first; each is a link to its place. */
function changeList(against: Against, view: SpaceView): HTMLElement | null {
  const groups = view.changes?.groups.slice(0, CHANGES) ?? [];
  if (groups.length === 0) return null;
  const name = (label: number, side: Side): string => nameOf(against, label, "instance", side);
  const entries = groups.map(({ a, b, faces }, i): [string, string] => [
    String(i),
    `${changedWords(name(a, "a"), name(b, "b"))} · ${several(faces.length, "face")}`,
  ]);
  const list = choice("Changed labels", [["", "Changed labels…"], ...entries], "", (value) => {
    const group = groups[Number(value)];
    if (value !== "" && group) view.visitFaces(group.faces, true);
  });
  list.classList.add("patches");
  return list;
}

function simplified(mesh: Mesh): HTMLElement {
  const words =
    mesh.cell_m === null
      ? `All ${count(mesh.faces)} faces of the mesh.`
      : `Simplified: ${count(mesh.shown)} of ${count(mesh.faces)} faces. The vertices in each cube of ` +
        `${(100 * mesh.cell_m).toFixed(1)} cm were merged, and collapsed faces were left out.`;
  return h("p", { class: "quiet" }, words);
}
