// The whole page: its tabs, and the open one.

import { comparePage } from "./compare/page.js";
import { FORM, type First, type Index, type Parts, load } from "./data.js";
import { append, count, h, isPlain, tamed } from "./dom.js";
import { headerOf, tabsOf } from "./first.js";
import { hintsButton } from "./hints.js";
import { comeBack, leave, pointTabs, remember } from "./route/memory.js";
import { findField } from "./overview/find.js";
import { overviewPage } from "./overview/page.js";
import { damageOf, notesPage } from "./pages/notes.js";
import { numbersPage } from "./pages/numbers.js";
import { panoPage, panoSight } from "./pages/pano.js";
import { planPage } from "./pages/plan.js";
import { scoresPage } from "./pages/scores.js";
import { paletteOf } from "./palette.js";
import { fillScreen, isPresentable, presentPage } from "./present/page.js";
import { type Page, type Sight, link, parseRoute } from "./route/route.js";
import { spacePage } from "./space/page.js";
import { viewPage, viewSight } from "./pages/view.js";
import { viewsPage } from "./pages/views.js";

/** A page that takes longer is told to be on its way, ms. */
const SLOW = 250;

const still = (element: HTMLElement): Page => ({ element, close: () => {} });

/** The parts of the report that an index tells of. */
const partsOf = (index: Index): Parts => ({
  meshes: index.meshes.length > 0,
  panoramas: index.locations.some((l) => l.pano),
  views: index.views.length > 0,
  plan: index.rooms.length > 0 || index.locations.length > 0 || index.views.some((v) => v.position),
  against: index.against != null,
  scores: index.scores > 0,
});

/** What is shown of a page while its file is read, if it has anything. */
async function sightOf(index: Index): Promise<Sight | null> {
  const route = parseRoute(window.location.hash);
  const page = route.page || (tabsOf(partsOf(index))[0] ?? "");
  const sight = page === "pano" ? panoSight(index, route) : page === "view" ? viewSight(index, route) : null;
  // The page tells what is wrong with a file.
  return (await sight?.catch(() => null)) ?? null;
}

async function open(index: Index): Promise<Page> {
  const route = parseRoute(window.location.hash);
  switch (route.page || tabsOf(partsOf(index))[0]) {
    case "overview":
      return overviewPage(index, route);
    case "pano":
      return panoPage(index, route);
    case "space":
      return spacePage(index, route);
    case "views":
      return viewsPage(index, route);
    case "view":
      return viewPage(index, route);
    case "plan":
      return still(await planPage(index, route));
    case "compare":
      return comparePage(index, route);
    case "present":
      return presentPage(index, route);
    case "scores":
      return still(await scoresPage(index, route));
    case "numbers":
      return still(numbersPage(index));
    case "notes":
      return still(notesPage(index));
    default:
      return still(failure("There is no such page in this report."));
  }
}

/** The link to the presentation, which fills the screen. */
function presentLink(): HTMLElement {
  const to = h("a", { class: "present-link", href: link("present") }, "Present");
  to.addEventListener("click", (event) => {
    if (isPlain(event)) fillScreen();
  });
  return to;
}

function failure(words: string): HTMLElement {
  return h("main", { class: "page" }, h("h1", {}, "Nothing to show"), h("p", { role: "alert" }, words));
}

async function start(): Promise<void> {
  performance.mark("started");
  const begun = window.s3dBegun;
  if (!begun) throw new Error("The page is damaged: make the report again");
  const { first, header: sketched, place } = begun;

  const index = await load<Index>("index");
  performance.mark("read");
  if (index.form !== FORM)
    throw new Error(
      `data/index.js has form ${index.form}, and this page reads ${FORM}: make the report again`,
    );
  const colors = paletteOf(index.classes.map(({ name }) => name));
  index.classes.forEach((each, i) => (each.color = colors[i] ?? each.color));
  // Photographs are numbered in the natural order of their names.
  const numbered = new Intl.Collator("en", { numeric: true });
  if (index.views.some((view) => view.photograph !== null))
    index.views.sort((a, b) => numbered.compare(a.photograph ?? "", b.photograph ?? ""));
  const damage = damageOf(index);
  const badge = h(
    "span",
    { class: "badge", title: damage.words },
    h("span", { "aria-hidden": "true" }, count(damage.count)),
    h("span", { class: "hidden" }, ` (${damage.words})`),
  );
  const parts = partsOf(index);
  const isSame = (other: First | null): boolean =>
    other?.name === index.data_set.name && tabsOf(other.parts).join() === tabsOf(parts).join();
  const header = isSame(first) && sketched ? sketched : headerOf(index.data_set.name, parts);
  if (damage.count > 0) header.querySelector('a[data-page="notes"]')?.append(badge);
  const present = isPresentable(index) ? presentLink() : null;
  append(header, [present, findField(index), hintsButton()]);
  if (header !== sketched) {
    document.querySelectorAll("body > :not(script)").forEach((element) => element.remove());
    document.body.prepend(header, place);
  }
  const nav = header.querySelector("nav") ?? header;
  let now: Page | null = null;
  let turn = 0;
  const show = async (): Promise<void> => {
    const mine = ++turn;
    if (now) leave(now);
    const hasPresented = now !== null && header.hidden;
    now?.element.setAttribute("inert", "");
    // What takes long is told.
    const slow = window.setTimeout(() => place.setAttribute("aria-busy", "true"), SLOW);
    const sight = await sightOf(index);
    if (mine !== turn) return;
    if (sight) {
      place.replaceChildren(sight.element);
      sight.draw();
      performance.mark("sighted");
    }
    const page = await open(index).catch((e: unknown) =>
      still(failure(e instanceof Error ? e.message : String(e))),
    );
    window.clearTimeout(slow);
    if (mine !== turn) {
      page.close();
      return;
    }
    place.removeAttribute("aria-busy");
    now?.close();
    now = page;
    header.hidden = page.element.classList.contains("present");
    document.body.classList.toggle("presenting", header.hidden);
    place.replaceChildren(page.element);
    const heading = page.element.querySelector("h1")?.textContent ?? "";
    document.title = tamed([heading, index.data_set.name, "s3d report"].filter(Boolean).join(" · "));
    const address = window.location.hash || link("");
    const route = parseRoute(address);
    const current = route.page || (tabsOf(parts)[0] ?? "");
    remember({ ...route, page: current }, address);
    comeBack(page, address);
    pointTabs(nav, route, current);
    if (hasPresented && !header.hidden) present?.focus();
    document.body.dataset["ready"] = String(mine);
    performance.mark("shown");
  };
  history.scrollRestoration = "manual";
  window.addEventListener("hashchange", () => void show());
  await show();
}

start().catch((e: unknown) => {
  document.body.replaceChildren();
  append(document.body, [failure(e instanceof Error ? e.message : String(e))]);
});
