// Changed labels by class in A and class in B.

import { append, count, h, metres2, several, table } from "../dom.js";
import { link } from "../route/route.js";
import { type Against, type Counts, classWords } from "./data.js";
import { changeWords, imagesByChange, imagesOf } from "./order.js";

/** The largest number of classes in a matrix; more are shown as a list. */
const MATRIX = 16;

export const number = (words: string | number): HTMLElement => h("span", { class: "number" }, words);

export const surface = (m2: number): string =>
  m2 === 0 ? "0" : m2 >= 10 ? metres2(m2) : `${m2.toPrecision(3)} m²`;

export const countsWords = ({ faces, m2, pixels }: Counts): string =>
  `${several(faces, "face")}, ${surface(m2)}, ${several(pixels, "pixel")}`;

/** The link to changed faces of a class or instance in A (`was`) and in B (`is`). */
export function changedLink(
  against: Against,
  { faces }: Counts,
  query: { was?: string; is?: string },
): string | null {
  if (faces === 0 || against.changed_faces.length === 0 || against.both.meshes.length === 0) return null;
  return link("space", [], { show: "changed", ...query });
}

export function matrix(against: Against): HTMLElement | null {
  const pairs = against.comparison.labels?.matrix ?? [];
  if (pairs.length === 0) return null;
  const order = against.both.classes.map((c) => c.name);
  // Entries that are no class come last.
  const places = (names: string[]): string[] => {
    const place = (name: string): number => (order.indexOf(name) + order.length + 1) % (order.length + 1);
    return [...new Set(names)].sort((x, y) => place(x) - place(y));
  };
  const [rows, columns] = [places(pairs.map((p) => p.a)), places(pairs.map((p) => p.b))];
  const images = imagesByChange(against);
  const linked = (pair: (typeof pairs)[number], ...children: (Node | string)[]): HTMLElement => {
    const change = { was: pair.a, is: pair.b };
    const words = `${changeWords(change)}: ${countsWords(pair)}`;
    const pictures = images.get(pairs.indexOf(pair)) ?? 0;
    // Changes that no image shows are shown in 3D.
    const href = pictures > 0 ? imagesOf(change) : changedLink(against, pair, change);
    const where = pictures > 0 ? several(pictures, "image") : "in 3D";
    return href
      ? h("a", { href, title: `${words}; ${where}`, "aria-label": `${words}; show ${where}` }, ...children)
      : h("span", { title: words }, ...children);
  };
  if (Math.max(rows.length, columns.length) > MATRIX)
    return table(
      ["Class in A", "Class in B", "Faces", "Surface", "Pixels"],
      pairs.map((pair) => [
        linked(pair, classWords(pair.a)),
        pair.a === pair.b ? `another ${classWords(pair.b)}` : classWords(pair.b),
        number(count(pair.faces)),
        number(surface(pair.m2)),
        number(count(pair.pixels)),
      ]),
    );
  const bySurface = pairs.some((pair) => pair.faces > 0);
  const size = (pair: Counts): number => (bySurface ? pair.m2 : pair.pixels);
  // Renumbered instances would hide changes of class.
  const all = (same: boolean): number =>
    pairs.reduce((sum, pair) => sum + ((pair.a === pair.b) === same ? size(pair) : 0), 0);
  const head = h("tr", {}, h("th", { scope: "col" }, "in A \\ in B"));
  append(
    head,
    columns.map((name) => h("th", { scope: "col" }, classWords(name))),
  );
  const body = rows.map((row) => {
    const cells = columns.map((column) => {
      const pair = pairs.find(({ a, b }) => a === row && b === column);
      if (!pair) return h("td", { class: row === column && "same" });
      const lines = [
        h("strong", {}, bySurface ? surface(pair.m2) : several(pair.pixels, "pixel")),
        h("span", {}, several(pair.faces, "face")),
        bySurface && h("span", {}, several(pair.pixels, "pixel")),
        row === column && h("span", {}, "another instance"),
      ].filter((line) => line !== false);
      const td = h("td", { class: row === column && "same" }, linked(pair, ...lines));
      const share = size(pair) / Math.max(all(row === column), 1e-9);
      td.style.setProperty("--share", `${Math.round(8 + 52 * share)}%`);
      return td;
    });
    return h("tr", {}, h("th", { scope: "row" }, classWords(row)), ...cells);
  });
  const caption =
    "Class in A by row, class in B by column. The shade is a cell's share of all changes of class, " +
    `or on the diagonal of all changes of instance, by ${bySurface ? "surface" : "pixels"}. ` +
    "A cell leads to the images that show it.";
  const grid = h(
    "table",
    { class: "matrix changes", "aria-label": caption },
    h("thead", {}, head),
    h("tbody", {}, ...body),
  );
  return h("div", {}, h("p", { class: "quiet" }, caption), grid);
}
