// Two images side by side, with places that both show.

import { css, oklch } from "../colors.js";
import { type Index, type Picture, type View, load, loadPicture } from "../data.js";
import { append, h, percent, pointed, s, say, several } from "../dom.js";
import { nameOf } from "../pages/names.js";
import { type Page, link } from "../route/route.js";
import { type Partner, loadPartners } from "./data.js";
import { apartWords, partnerLink, partnerName } from "./partners.js";

/** The height of both pictures side by side, and the gap between them, in units of the drawing. */
const [HEIGHT, GAP] = [1000, 24];
/** The radius of a place, in the same units, and of what the pointer hits. */
const [RADIUS, TARGET] = [9, 26];

/** A picture in the drawing: its place, and the factor from pixels of the data set. */
interface Put {
  x: number;
  y: number;
  scale: number;
}

/** Colours of places by where they are among all in the first picture, so that neighbours differ little. */
function colorsOf(points: Partner["points"]): string[] {
  const share = (axis: 0 | 1): ((point: Partner["points"][number]) => number) => {
    const all = points.map((point) => point[axis]);
    const [least, most] = [Math.min(...all), Math.max(...all)];
    return (point) => (point[axis] - least) / Math.max(1, most - least);
  };
  const [across, down] = [share(0), share(1)];
  return points.map((point) => css(oklch(0.88 - 0.26 * down(point), 0.17, 20 + 300 * across(point))));
}

function draw(
  pictures: [Picture, Picture],
  names: [string, string],
  points: Partner["points"],
  isStacked: boolean,
  told: (words: string | null) => void,
): SVGSVGElement {
  const [a, b] = pictures.map(({ of }) => of) as [[number, number], [number, number]];
  const puts: [Put, Put] = isStacked
    ? [
        { x: 0, y: 0, scale: HEIGHT / a[0] },
        { x: 0, y: (HEIGHT * a[1]) / a[0] + GAP, scale: HEIGHT / b[0] },
      ]
    : [
        { x: 0, y: 0, scale: HEIGHT / a[1] },
        { x: (HEIGHT * a[0]) / a[1] + GAP, y: 0, scale: HEIGHT / b[1] },
      ];
  const [width, height] = isStacked
    ? [HEIGHT, puts[1].y + b[1] * puts[1].scale]
    : [puts[1].x + b[0] * puts[1].scale, HEIGHT];
  const drawing = s("svg", {
    class: "matches",
    viewBox: `0 0 ${width.toFixed(1)} ${height.toFixed(1)}`,
    role: "group",
    "aria-label": "Places that both images show",
  });
  pictures.forEach(({ rgb, of }, i) => {
    const { x, y, scale } = puts[i] as Put;
    const place = { x, y, width: of[0] * scale, height: of[1] * scale };
    drawing.append(s("rect", { class: "no-picture", ...place }));
    if (rgb === null) return;
    const image = s("image", { ...place, href: rgb, role: "img", "aria-label": names[i] });
    image.setAttribute("preserveAspectRatio", "none");
    drawing.append(image);
  });

  const at = ({ x, y, scale }: Put, px: number, py: number): [string, string] => [
    (x + scale * px).toFixed(2),
    (y + scale * py).toFixed(2),
  ];
  const words = (i: number, point: number[]): string => {
    const [x, y, u, v] = point.map((c) => Math.floor(c));
    const sides = isStacked ? ["above", "below"] : ["left", "right"];
    return `Place ${i + 1} of ${points.length}: pixel ${x}, ${y} ${sides[0]}, and ${u}, ${v} ${sides[1]}.`;
  };
  const colors = colorsOf(points);
  points.forEach((point, i) => {
    const [from, to] = [at(puts[0], point[0], point[1]), at(puts[1], point[2], point[3])];
    const match = s("g", { class: "match", tabindex: 0, role: "img", "aria-label": words(i, point) });
    match.style.color = colors[i] ?? "";
    match.append(s("path", { class: "match-line", d: `M${from.join(",")}L${to.join(",")}` }));
    for (const [cx, cy] of [from, to]) {
      match.append(s("circle", { class: "match-target", cx, cy, r: TARGET }));
      match.append(s("circle", { class: "match-place", cx, cy, r: RADIUS }));
    }
    const show = (): void => {
      drawing.classList.add("chosen");
      match.classList.add("is-chosen");
      told(words(i, point));
    };
    const hide = (): void => {
      drawing.classList.remove("chosen");
      match.classList.remove("is-chosen");
      told(null);
    };
    pointed(match, show, hide);
    drawing.append(match);
  });
  return drawing;
}

function facts(partner: Partner): string {
  const [mine, others] = partner.shared.map(percent);
  const shares = `The second image shows ${mine} of the first, and the first ${others} of the second`;
  return `${shares} · ${apartWords(partner)}`;
}

/** The page of a view and a partner; null if they are none. `kind` and `number` name the partner. */
export async function matchPage(
  index: Index,
  view: View,
  kind: string,
  number: number,
): Promise<Page | null> {
  const at = view.picture;
  if (at === null) return null;
  const partners = await loadPartners(index, view.area, at);
  const place = partners.findIndex((one) => (kind === "pano" ? one.pano : one.picture) === number);
  const partner = partners[place];
  if (!partner) return null;

  const other = kind === "pano" ? load<Picture>(`pano_${number}`) : loadPicture(index, number);
  const pictures = await Promise.all([loadPicture(index, at), other]);
  const names: [string, string] = [nameOf(index, view), partnerName(index, partner)];
  const location = index.locations[partner.pano ?? -1];
  const links = [
    link("view", [at]),
    location ? link("pano", [location.area, location.uuid]) : link("view", [number]),
  ];

  const head = h("div", { class: "look-head" }, h("h1", {}, "The same surface in two images"));
  for (const [by, words, sign] of [
    [-1, "Previous image that shares surface", "←"],
    [1, "Next image that shares surface", "→"],
  ] as const) {
    const to = partners[place + by];
    if (to) append(head, [h("a", { class: "step", "aria-label": words, href: partnerLink(at, to) }, sign)]);
  }
  const titles = h("p", { class: "match-told" });
  names.forEach((name, i) =>
    append(titles, [i > 0 && h("span", { class: "quiet" }, " and "), h("a", { href: links[i] }, name)]),
  );
  const element = h(
    "main",
    { class: "look" },
    head,
    titles,
    h("p", { class: "quiet match-told" }, facts(partner)),
  );
  const [left, right] = pictures;
  if (!left || !right) {
    append(element, [h("p", { role: "alert" }, "Images are missing or damaged; see Notes.")]);
    return { element, close: () => {} };
  }

  const { points } = partner;
  const summary =
    points.length > 0
      ? `${several(points.length, "place")} that both show, found by rays. Point at one to follow its line.`
      : "There are no common places: the mesh or a pose could not be read.";
  const told = h("p", { class: "quiet match-told", role: "status" }, summary);
  const sheet = h("div", { class: "match-sheet" });
  append(element, [told, sheet]);
  const narrow = window.matchMedia("(max-width: 700px)");
  const put = (): void => {
    const tell = (words: string | null): void => say(told, words ?? summary);
    sheet.replaceChildren(draw([left, right], names, points, narrow.matches, tell));
  };
  put();
  narrow.addEventListener("change", put);
  return { element, close: () => narrow.removeEventListener("change", put) };
}
