// The differences between the shown data set, A, and another, B.

import { type Index, type Picture, load, loadThumb } from "../data.js";
import { append, count, h, named, percent, several } from "../dom.js";
import { type Page, type Route, link } from "../route/route.js";
import { type Against, type ChangedPicture, loadAgainst } from "./data.js";
import { changedLink } from "./matrix.js";
import { type Change, changeOf, changeWords, mostChanged, orderOf } from "./order.js";
import { MODALITY_NAMES, pairPage, shownBy } from "./picture.js";
import {
  faultsSection,
  filesSection,
  instancesSection,
  labelsSection,
  madeWith,
  modalitiesSection,
  posesSection,
  viewsSection,
} from "./tables.js";

/** The number of images that are shown at first, and added each time. */
const BATCH = 24;

const still = (element: HTMLElement): Page => ({ element, close: () => {} });

export async function comparePage(index: Index, route: Route): Promise<Page> {
  const against = await loadAgainst(index);
  if (!against)
    return still(
      h(
        "main",
        { class: "page" },
        h("h1", {}, "Compared"),
        h(
          "p",
          {},
          "This report was made of one data set. ",
          h("code", {}, "s3d report A --against B"),
          " compares two.",
        ),
      ),
    );
  return route.path.length > 0 ? pairPage(index, against, route) : overview(index, against, changeOf(route));
}

function overview(index: Index, against: Against, change: Change | null): Page {
  const { comparison } = against;
  const { a, b, equal, full } = comparison;
  const element = h(
    "main",
    { class: "page compared" },
    h("h1", {}, `${named(a.folder)} against ${named(b.folder)}`),
  );
  const read = full ? "every file of both was read" : "by their checksums";
  const words = equal
    ? `Both are equal: the same files with the same bytes (${read}).`
    : "A is the data set that this report shows, B the other.";
  const { grid, close } = images(index, against, change);
  append(element, [
    h("p", equal ? { class: "equal" } : { class: "quiet" }, words),
    equal ? null : labelsSection(against),
    grid,
    equal ? null : instancesSection(against),
    viewsSection(index, comparison),
    equal ? null : modalitiesSection(comparison),
    posesSection(index, comparison),
    filesSection(comparison),
    faultsSection(against),
    h("section", {}, h("h2", {}, "How they were made"), madeWith(comparison)),
  ]);
  return { element, close, ...(change && grid && { start: grid }) };
}

/** The heading of the list of images: all that differ, or those that show a change. */
function heading(against: Against, change: Change | null, images: number): HTMLElement[] {
  if (!change) {
    const words = `${several(images, "image")} with different pixels, the most different first.`;
    const labels = against.comparison.modalities.find((m) => m.modality === "semantic");
    const renumbered = labels?.renumbered ?? 0;
    const more = ` In ${several(renumbered, "image")}, labels differ in their numbers alone.`;
    return [
      h("h2", {}, "Images that differ"),
      h("p", { class: "quiet" }, renumbered > 0 ? words + more : words),
    ];
  }
  const counts = against.comparison.labels?.matrix.find(({ a, b }) => a === change.was && b === change.is);
  const solid = counts && changedLink(against, counts, { ...change });
  const words =
    images === 0
      ? "No image shows this change."
      : `${several(images, "image")} with this change, in ${several(counts?.pixels ?? 0, "pixel")}, ` +
        "the image with the most first.";
  const places = h("p", { class: "places" });
  append(places, [
    h("a", { href: link("compare") }, "All images that differ"),
    solid && h("a", { href: solid }, "This change in 3D"),
  ]);
  const title = `Images that differ: ${changeWords(change)}`;
  return [h("h2", {}, title), h("p", { class: "quiet" }, words), places];
}

/** The images that differ, or those that show a change. */
function images(
  index: Index,
  against: Against,
  change: Change | null,
): { grid: HTMLElement | null; close: () => void } {
  const { numbers: order, pixels } = orderOf(against, change);
  if (order.length === 0 && !change) return { grid: null, close: () => {} };
  const grid = h("div", { class: "grid", role: "list" });
  const thumbs = new IntersectionObserver(
    (seen) => {
      for (const { isIntersecting, target } of seen) {
        if (!isIntersecting) continue;
        thumbs.unobserve(target);
        const changed = against.pictures[Number((target as HTMLElement).dataset["number"])];
        if (changed) void fill(index, changed, target as HTMLImageElement);
      }
    },
    { rootMargin: "300px" },
  );
  const more = h("button", { type: "button", class: "show-more" });
  let shown = 0;
  const add = (): void => {
    for (const number of order.slice(shown, shown + BATCH)) {
      const changed = against.pictures[number];
      if (changed) append(grid, [card(index, [changed, number], change, pixels?.get(number), thumbs)]);
    }
    shown = Math.min(order.length, shown + BATCH);
    more.hidden = shown === order.length;
    more.textContent = `Show more of ${count(order.length)}`;
  };
  more.addEventListener("click", () => {
    const first = grid.children.length;
    add();
    grid.children[first]?.querySelector("a")?.focus();
  });
  add();
  return {
    grid: h("section", {}, ...heading(against, change, order.length), grid, more),
    close: () => thumbs.disconnect(),
  };
}

async function fill(
  index: Index,
  { picture, pano }: ChangedPicture,
  target: HTMLImageElement,
): Promise<void> {
  try {
    const url =
      pano === null
        ? await loadThumb(index, picture ?? Number.NaN)
        : ((await load<Picture | null>(`pano_${pano}`))?.rgb ?? null);
    if (url !== null) target.src = url;
    else target.replaceWith(h("span", { class: "no-thumb" }, "no colours"));
  } catch {
    target.replaceWith(h("span", { class: "no-thumb" }, "missing"));
  }
}

function card(
  index: Index,
  [changed, number]: [ChangedPicture, number],
  change: Change | null,
  ofChange: number | undefined,
  thumbs: IntersectionObserver,
): HTMLElement | null {
  const name = shownBy(index, changed)?.name;
  if (name === undefined) return null;
  const image = h("img", { alt: "", "data-number": number, decoding: "async" });
  thumbs.observe(image);
  const [modality, pixels] = mostChanged(changed) ?? ["", null];
  const share = pixels ? (ofChange ?? pixels.pixels_changed) / Math.max(1, pixels.pixels) : 0;
  const what = ofChange === undefined ? (MODALITY_NAMES[modality] ?? modality) : several(ofChange, "pixel");
  const words = `${what}: ${percent(share)}`;
  const strip = h(
    "span",
    { class: "strip", "aria-hidden": "true" },
    h("span", { class: "differs" }),
    h("span", {}),
  );
  [share, 1 - share].forEach((part, i) => ((strip.children[i] as HTMLElement).style.flexGrow = String(part)));
  const label = `${name}. ${words} of the pixels ${change ? "show this change" : "differ"}`;
  const href = link("compare", [number], { ...change });
  const body = [image, strip, h("span", { class: "card-name" }, name), h("span", { class: "quiet" }, words)];
  return h(
    "div",
    { class: "card", role: "listitem" },
    h("a", { href, "aria-label": label, title: label }, ...body),
  );
}
