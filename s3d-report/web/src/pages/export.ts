// A drawing of the page as a file: SVG with the colours that it has now, and PNG.

import { append, h } from "../dom.js";
import { fileName, save } from "../tools.js";

const SVG = "http://www.w3.org/2000/svg";
/** The width of the PNG file, pixels, and of the margin in both, as a share of the width. */
const WIDTH = 2000;
const MARGIN = 0.02;

/** What a shape looks like is told by these, and its geometry by the others. */
const LOOKS = [
  "fill",
  "fill-opacity",
  "fill-rule",
  "stroke",
  "stroke-width",
  "stroke-opacity",
  "stroke-linejoin",
  "opacity",
  "font-size",
  "font-family",
  "text-anchor",
  "paint-order",
];
const GEOMETRY = ["d", "x", "y", "dx", "dy", "cx", "cy", "r", "width", "height"];
/** What images need besides: their content is in the file. */
const IMAGE = ["href", "mask", "preserveAspectRatio", "id"];

/** A copy that needs no style sheet. Links become groups. Null if it is not shown. */
function plain(element: Element): Element | null {
  const isLink = element.tagName === "a";
  const isMask = element.tagName === "mask";
  // The content of a mask is never displayed by itself.
  if (!isMask && getComputedStyle(element).display === "none") return null;
  const copy = document.createElementNS(SVG, isLink ? "g" : element.tagName);
  const isImage = isMask || element.tagName === "image";
  for (const name of isImage ? [...GEOMETRY, ...IMAGE] : GEOMETRY) {
    const value = element.getAttribute(name);
    if (value !== null) copy.setAttribute(name, value);
  }
  if (!isLink && element.tagName !== "title") {
    const style = getComputedStyle(element);
    for (const name of LOOKS) copy.setAttribute(name, style.getPropertyValue(name));
  }
  for (const child of element.childNodes)
    if (child instanceof Element) append(copy, [plain(child)]);
    else if (child.nodeType === Node.TEXT_NODE) copy.append(child.textContent ?? "");
  return copy;
}

/** The characters of a rule `U+0-FF, U+131`. */
const rangesOf = (words: string): [number, number][] =>
  words.split(",").map((range) => {
    const [from = "", to = from] = range.trim().replace(/^U\+/i, "").split("-");
    return [Number.parseInt(from, 16), Number.parseInt(to, 16)];
  });

/** The page's font, as far as a text has its letters: a file of its own has no other. */
function fontOf(text: string): string {
  const has = (words: string): boolean =>
    rangesOf(words).some(([from, to]) =>
      [...text].some((letter) => {
        const code = letter.codePointAt(0) ?? 0;
        return code >= from && code <= to;
      }),
    );
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]);
  return rules
    .filter((rule) => rule instanceof CSSFontFaceRule && has(rule.style.getPropertyValue("unicode-range")))
    .map((rule) => rule.cssText)
    .join("");
}

/** The text of a drawing that stands on the page, and its shape: height by width. */
export function svgOf(drawing: SVGSVGElement): { text: string; shape: number } {
  const { x, y, width, height } = drawing.viewBox.baseVal;
  const margin = MARGIN * width;
  const [w, h_] = [width + 2 * margin, height + 2 * margin];
  const root = document.createElementNS(SVG, "svg");
  const box = [x - margin, y - margin, w, h_];
  root.setAttribute("viewBox", box.join(" "));
  root.setAttribute("width", String(WIDTH));
  root.setAttribute("height", String(Math.round((WIDTH * h_) / w)));
  const paper = document.createElementNS(SVG, "rect");
  ["x", "y", "width", "height"].forEach((name, i) => paper.setAttribute(name, String(box[i])));
  paper.setAttribute("fill", getComputedStyle(drawing.parentElement ?? drawing).backgroundColor);
  append(root, [paper, ...[...drawing.children].map(plain)]);
  const font = fontOf(root.textContent ?? "");
  if (font !== "") {
    const style = document.createElementNS(SVG, "style");
    style.textContent = font;
    root.prepend(style);
  }
  return { text: new XMLSerializer().serializeToString(root), shape: h_ / w };
}

async function png(drawing: SVGSVGElement): Promise<Blob | null> {
  const { text, shape } = svgOf(drawing);
  const image = new Image();
  image.src = `data:image/svg+xml,${encodeURIComponent(text)}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [WIDTH, Math.round(WIDTH * shape)];
  canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}

/** Buttons that save a drawing, which `whole` completes before. */
export function saves(
  drawing: SVGSVGElement,
  dataSet: string,
  name: string,
  whole: () => Promise<void>,
): HTMLElement {
  const button = (words: string, act: () => Promise<void>): HTMLElement =>
    h("button", { type: "button", "aria-label": `${words} of ${name}`, click: act }, words);
  return h(
    "div",
    { class: "saves" },
    button("Save SVG", async () => {
      await whole();
      const { text } = svgOf(drawing);
      save(fileName(dataSet, name, "svg"), new Blob([text], { type: "image/svg+xml" }));
    }),
    button("Save PNG", async () => {
      await whole();
      const file = await png(drawing);
      if (file) save(fileName(dataSet, name, "png"), file);
    }),
  );
}
