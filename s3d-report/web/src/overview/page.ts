// The first page: the building from above with a line between two colourings, what the data set is, its
// storeys and classes, and its richest views.

import { type Index, type Mesh, loadThumb } from "../data.js";
import { divider } from "../picture/divider.js";
import { append, choice, h, named, percent } from "../dom.js";
import { nameOf } from "../pages/names.js";
import { key } from "../picture/readout.js";
import { type Page, type Route, link, replaceRoute } from "../route/route.js";
import { storeyButtons } from "../space/levels.js";
import { type Look, showsOf } from "../space/look.js";
import type { Show } from "../space/paint.js";
import { SpaceView } from "../space/view.js";
import { numbersOf, sentenceOf } from "./facts.js";
import { overviewLook, overviewQuery, storeyIn } from "./look.js";
import { richest } from "./richest.js";

/** The number of views in the strip. */
const STRIP = 12;
/** Browsers limit the changes of the address in a minute; this is the time between two, ms. */
const PAUSE = 250;

const BEYOND_NAMES: Partial<Record<Show, string>> = {
  texture: "Colour",
  class: "Class",
  instance: "Instance",
  normal: "Normals",
};

export async function overviewPage(index: Index, route: Route): Promise<Page> {
  const [area] = route.path;
  const mesh = area === undefined ? index.meshes[0] : index.meshes.find((m) => String(m.area) === area);
  if (!mesh) {
    const words = "The mesh of this area is not in this report.";
    const element = h("main", { class: "page" }, h("h1", {}, "Overview"), h("p", { role: "alert" }, words));
    return { element, close: () => {} };
  }
  const stage = h("div", { class: "stage" });
  const element = h("main", { class: "overview" }, stage, head(index, mesh));
  const strip = richestViews(index, mesh);
  if (!strip) element.classList.add("without-views");
  try {
    const close = fillStage(index, mesh, route, stage, element);
    append(element, [strip]);
    return { element, close };
  } catch (e) {
    // Without WebGL the rest is shown.
    stage.append(h("p", { role: "alert" }, e instanceof Error ? e.message : String(e)));
    append(element, [strip]);
    return { element, close: () => {} };
  }
}

function head(index: Index, mesh: Mesh): HTMLElement {
  const numbers = h("dl", { class: "facts-six" });
  for (const [value, name] of numbersOf(index))
    numbers.append(h("div", {}, h("dt", {}, name), h("dd", {}, value)));
  const areas = index.meshes.map((m): [string, string] => [link("overview", [m.area]), `Area ${m.area}`]);
  const place = choice("Area", areas, link("overview", [mesh.area]), (to) => (window.location.hash = to));
  const about = h("div", { class: "overview-head" });
  append(about, [
    h("h1", {}, h("bdi", {}, index.data_set.name)),
    h("p", {}, sentenceOf(index)),
    numbers,
    areas.length > 1 && place,
  ]);
  return about;
}

/** Fills the stage with the building, its buttons and its legend. Returns what closes it. */
function fillStage(
  index: Index,
  mesh: Mesh,
  route: Route,
  stage: HTMLElement,
  element: HTMLElement,
): () => void {
  const shows = showsOf(mesh, false).filter((show) => show in BEYOND_NAMES);
  const look: Look = overviewLook(index, mesh, shows, route.query);
  const status = h("p", { class: "quiet progress", role: "status" });
  let timer = 0;
  let address = window.location.hash;
  /** The address says what is shown, once this is not what is shown at first. */
  const tellAddress = (): void => {
    timer = 0;
    const query = overviewQuery(shows, view);
    const now = link("overview", [mesh.area], query);
    const isFirst = Object.keys(query).length === 0 && !address.includes("?");
    if (now === address || isFirst || !element.isConnected || element.inert) return;
    address = now;
    replaceRoute("overview", [mesh.area], query);
  };
  const view = new SpaceView(index, mesh, look, {
    against: null,
    turns: true,
    storey: storeyIn(index, mesh, route.query),
    covered: () => coveredBy(element),
    changed: () => {
      press();
      timer ||= window.setTimeout(tellAddress, PAUSE);
    },
    progress: (words) => {
      status.textContent = words;
      status.hidden = words === "";
    },
    fault: (words) => stage.append(h("p", { class: "fault", role: "alert" }, words)),
  });
  const wipe = divider(
    "Line between the two colourings",
    () => view.canvas,
    (share) => {
      look.line = share;
      place();
      view.refresh();
    },
  );
  const place = (): void => {
    const beyond = BEYOND_NAMES[look.beyond ?? "texture"] ?? "";
    const share = Math.round(100 * look.line);
    wipe.put(look.line, `Colour on ${share} %, ${beyond} on the rest`);
    wipe.line.hidden = look.beyond === null;
  };
  place();
  const { buttons, press } = storeyButtons(view);
  view.readout.classList.add("over");
  // It lies over the building, so that it goes with the pointer or the focus.
  for (const event of ["pointerleave", "blur"])
    view.canvas.addEventListener(event, () => view.readout.replaceChildren());
  stage.append(view.canvas, view.overlay, wipe.line, status, view.readout);
  const side = h("div", { class: "overview-side" });
  append(side, [buttons, legend(index, mesh, view)]);
  element.append(side, colourings(shows, view, place));
  const fill = async (): Promise<void> => {
    await view.load();
    element.dataset["loaded"] = "mesh";
    await view.loadTextures();
    element.dataset["loaded"] = "all";
  };
  void fill();
  return () => {
    window.clearTimeout(timer);
    view.close();
  };
}

/** The pixels at the sides of the stage that something lies over, half of wide ones: they are not full. */
function coveredBy(element: HTMLElement): { left: number; right: number; top: number; bottom: number } {
  const stage = element.querySelector(".stage")?.getBoundingClientRect();
  const none = { left: 0, right: 0, top: 0, bottom: 0 };
  if (!stage) return none;
  const over = (name: string): DOMRect | undefined => element.querySelector(name)?.getBoundingClientRect();
  const isStacked = getComputedStyle(element).display !== "block";
  if (isStacked) return { ...none, bottom: over(".overview-bar")?.height ?? 0 };
  return {
    left: 0.6 * (over(".overview-head")?.width ?? 0),
    right: 0.6 * (over(".overview-side")?.width ?? 0),
    top: 0,
    bottom: stage.bottom - Math.min(stage.bottom, over(".overview-bar")?.top ?? stage.bottom),
  };
}

/** Buttons for what is shown right of the line, and one that stops the turning. */
function colourings(shows: Show[], view: SpaceView, changed: () => void): HTMLElement {
  const bar = h("div", { class: "overview-bar", role: "group", "aria-label": "Right of the line" });
  const made = shows.map((show) => {
    const button = h("button", { type: "button" }, BEYOND_NAMES[show] ?? "");
    button.addEventListener("click", () => {
      view.look.beyond = show === "texture" ? null : show;
      press();
      changed();
      view.refresh();
    });
    return { show, button };
  });
  const press = (): void => {
    for (const { show, button } of made)
      button.setAttribute("aria-pressed", String((view.look.beyond ?? "texture") === show));
  };
  press();
  const stop = h("button", { type: "button", class: "stop", "aria-label": "Stop turning" }, "Stop");
  stop.addEventListener("click", () => {
    view.eye.touched = true;
    view.eye.land();
    view.refresh();
  });
  view.eye.turned = (on) => (stop.hidden = !on);
  stop.hidden = true;
  bar.append(...made.map(({ button }) => button), stop);
  return bar;
}

/** The classes of a mesh; a click greys all others. */
function legend(index: Index, mesh: Mesh, view: SpaceView): HTMLElement | null {
  const surface = index.surface_by_class.map(({ m2 }) => m2);
  const all = surface.reduce((sum, m2) => sum + m2, 0);
  if (!mesh.has_votes || all === 0) return null;
  const classes = surface.map((m2, i) => ({ m2, i })).filter(({ m2 }) => m2 > 0);
  classes.sort((a, b) => b.m2 - a.m2);
  const list = h("ul", { class: "classes-legend", "aria-label": "Classes, by their share of the surface" });
  const buttons = classes.flatMap(({ m2, i }) => {
    const of = index.classes[i];
    if (!of) return [];
    const share = h("span", { class: "quiet" }, percent(m2 / all));
    const button = h(
      "button",
      { type: "button", "aria-pressed": String(view.look.only === i) },
      key(of.color),
      named(of.name),
      share,
    );
    button.addEventListener("click", () => {
      view.look.only = view.look.only === i ? null : i;
      for (const other of buttons)
        other.setAttribute("aria-pressed", String(other === button && view.look.only === i));
      view.refresh();
    });
    list.append(h("li", {}, button));
    return [button];
  });
  return list;
}

/** Links to the richest views of an area. */
function richestViews(index: Index, mesh: Mesh): HTMLElement | null {
  const views = richest(
    index.views.filter((view) => view.area === mesh.area),
    index,
    STRIP,
  );
  if (views.length === 0) return null;
  const strip = h("ul", { class: "richest-views" });
  for (const view of views) {
    const name = nameOf(index, view);
    const image = h("img", { alt: "", decoding: "async" });
    const to = h("a", { href: link("view", [view.picture ?? 0]), "aria-label": name, title: name }, image);
    if (view.picture !== null)
      loadThumb(index, view.picture).then(
        (url) => url !== null && (image.src = url),
        () => to.classList.add("missing"),
      );
    strip.append(h("li", {}, to));
  }
  const all = h("a", { href: link("views", [], { sort: "entropy" }) }, "All views");
  return h(
    "section",
    { class: "richest", "aria-label": "Richest views" },
    strip,
    h("p", {}, "Richest views · ", all),
  );
}
