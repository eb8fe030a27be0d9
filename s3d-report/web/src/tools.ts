// Full screen, the link to what is shown, and its picture as a file.

import { h, s } from "./dom.js";

/** Icons of 16 × 16. */
const ICONS = {
  full: "M2 6V2h4M10 2h4v4M14 10v4h-4M6 14H2v-4",
  link: "M6.5 9.5l3-3M7 4.5l1.2-1.2a3.2 3.2 0 0 1 4.5 4.5L11.5 9M9 11.5l-1.2 1.2a3.2 3.2 0 0 1-4.5-4.5L4.5 7",
  save: "M8 2v8M4.5 6.8L8 10.3l3.5-3.5M2.5 13.5h11",
};

function icon(shape: keyof typeof ICONS): SVGElement {
  return s("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, s("path", { d: ICONS[shape] }));
}

/** A name for a file: the data set, and what the address says is shown. */
export function fileName(dataSet: string, address: string, ending: string): string {
  const words = (text: string): string => text.replace(/[^\w.-]+/g, "_").replace(/^[_.]+|_+$/g, "");
  const shown = words(address.replace(/^#\/?/, ""));
  return `${[words(dataSet), shown].filter(Boolean).join("_").slice(0, 140)}.${ending}`;
}

/** Offers a file to the user. */
export function save(name: string, content: Blob): void {
  const url = URL.createObjectURL(content);
  const anchor = h("a", { href: url, download: name });
  anchor.click();
  window.setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

/** What a canvas shows, on the colour behind it. It must have been drawn in the same task. */
function pngOf(canvas: HTMLCanvasElement): Promise<Blob | null> {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d");
  if (context) {
    context.fillStyle = getComputedStyle(canvas.parentElement ?? canvas).backgroundColor;
    context.fillRect(0, 0, copy.width, copy.height);
    context.drawImage(canvas, 0, 0);
  }
  return new Promise((resolve) => copy.toBlob(resolve, "image/png"));
}

async function copied(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const field = h("textarea", { class: "hidden" }, text);
    document.body.append(field);
    field.select();
    const done = document.execCommand("copy");
    field.remove();
    return done;
  }
}

export interface Shown {
  /** What fills the screen. */
  element: HTMLElement;
  canvas: HTMLCanvasElement;
  dataSet: string;
  /** Draws what the picture is to show. */
  draw: () => void;
}

/** Buttons for a picture. */
export function pictureTools({ element, canvas, dataSet, draw }: Shown): HTMLElement {
  const told = h("span", { class: "tools-told", role: "status" });
  let timer = 0;
  const tell = (words: string): void => {
    told.textContent = words;
    window.clearTimeout(timer);
    timer = window.setTimeout(() => told.replaceChildren(), 2500);
  };
  const button = (words: string, shape: keyof typeof ICONS, act: () => void): HTMLElement =>
    h("button", { type: "button", "aria-label": words, title: words, click: act }, icon(shape));
  const bar = h("div", { class: "viewer-tools" });
  if (document.fullscreenEnabled)
    bar.append(
      button("Full screen", "full", () => {
        void (document.fullscreenElement ? document.exitFullscreen() : element.requestFullscreen());
      }),
    );
  bar.append(
    button("Copy link", "link", () => {
      void copied(window.location.href).then((done) => tell(done ? "Link copied" : "Cannot copy the link"));
    }),
    button("Save picture", "save", () => {
      draw();
      const name = fileName(dataSet, window.location.hash, "png");
      void pngOf(canvas).then((file) => file && save(name, file));
    }),
    told,
  );
  return bar;
}
