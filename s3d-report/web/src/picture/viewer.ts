// A picture with two modalities, a movable line between them, and a readout for the pointer.

import type { Index, Picture, Rgb } from "../data.js";
import { type Divider, divider } from "./divider.js";
import { append, choice, flat, h } from "../dom.js";
import { type ActOf, actOf } from "../keys.js";
import { type FaceVotes, loadFaceVotes } from "./faces.js";
import { type Gaze, clampGaze, focal, panoramaAt } from "./geometry.js";
import {
  MODALITIES,
  type Modality,
  NO_DEPTH,
  NO_FACE,
  NO_LABEL,
  type Numbers,
  type Other,
  Renderer,
  placeOf,
} from "./gl.js";
import { chosen } from "../route/memory.js";
import { Marks, type Projected } from "./marks.js";
import { type Spot, legendOf, tell } from "./readout.js";
import { spaceLink } from "../route/route.js";
import { pictureTools } from "../tools.js";

const NAMES: Record<Modality, string> = {
  rgb: "Colour",
  depth: "Depth",
  normal: "Normals",
  class: "Class",
  instance: "Instance",
  unlabelled: "Unlabelled",
  contested: "Disputed",
  changed: "Changed",
};

/** The time after which an unmoved pointer counts as resting, ms. */
const REST = 250;
/** A press that moves no farther counts as a click, CSS pixels. */
const STILL = 5;

/** How a picture is shown, as kept in the address. */
export interface Look {
  left: Modality;
  right: Modality;
  split: number;
  gaze: Gaze | null;
}

/** Another picture, B, beside A. */
export interface OtherSide extends Other {
  /** The modalities in which both can be shown. */
  modalities: Modality[];
  /** Words for the labels of a pixel in both. */
  tell: (a: number | null, b: number | null) => HTMLElement[];
}

export interface ViewerOptions {
  /** A description of the picture for screen readers. */
  title: string;
  area: number;
  /** The room, for pixels without a label. */
  room: string;
  /** The world point of a pixel at a depth, and its distance from the camera. */
  point: (i: number, j: number, depth: number) => Rgb | null;
  position: Rgb | null;
  /** The place of a world point on a canvas of this size, as x·w, y·w and w. */
  screen: (point: Rgb, gaze: Gaze | null, width: number, height: number) => Projected | null;
  /** Another picture of the same camera, shown right of the line in the same modality. */
  other?: OtherSide;
  /** More switches beside those of the images. */
  tools?: (HTMLElement | undefined)[];
  /** Called when the pointer comes to another instance; with null when it is on none. */
  pointed?: (label: number | null) => void;
  /** Called when the look has changed. */
  changed: (look: Look) => void;
  /** Called after each drawing, with the size of the canvas in CSS pixels. */
  drawn?: (width: number, height: number) => void;
}

/** The modalities in which a picture can be shown. */
export function modalitiesOf(index: Index, area: number, picture: Picture): Modality[] {
  const voted = index.meshes.some((mesh) => mesh.area === area && mesh.has_votes);
  const has: Record<Modality, boolean> = {
    rgb: picture.rgb !== null,
    depth: picture.depth !== null,
    normal: picture.normal !== null,
    class: picture.label !== null,
    instance: picture.label !== null,
    unlabelled: picture.label !== null,
    contested: picture.face !== null && voted,
    changed: false,
  };
  return MODALITIES.filter((modality) => has[modality]);
}

/** The look in an address, as far as the picture has the modalities. */
export function lookFrom(query: URLSearchParams, there: Modality[], gaze: Gaze | null): Look {
  const of = (name: "left" | "right", otherwise: Modality[]): Modality => {
    const word = (query.get(name) ?? chosen[name]) as Modality;
    return there.includes(word) ? word : (otherwise.find((m) => there.includes(m)) ?? there[0] ?? "rgb");
  };
  const split = Number(query.get("split") ?? chosen.split ?? "0.5");
  return {
    left: of("left", ["rgb"]),
    right: of("right", ["class", "depth", "normal"]),
    split: split >= 0 && split <= 1 ? split : 0.5,
    gaze,
  };
}

/** The part of an address with the direction of view. */
export function gazeQuery({ lon, lat, fov }: Gaze): Record<string, string> {
  const degrees = (radians: number): string => ((radians * 180) / Math.PI).toFixed(1);
  return { lon: degrees(lon), lat: degrees(lat), fov: degrees(fov) };
}

/** The part of an address with the layers and the line between them. */
export const layersOf = ({ left, right, split }: Look): Record<string, string> => ({
  left,
  right,
  split: split.toFixed(3),
});

export const queryOf = (look: Look): Record<string, string> => ({
  ...(look.gaze && gazeQuery(look.gaze)),
  ...layersOf(look),
});

export class Viewer {
  readonly element: HTMLElement;
  /** Lies over the canvas, for drawings in it. */
  readonly overlay = h("div", { class: "overlay" });
  private readonly canvas = h("canvas", { tabindex: 0 });
  private readonly divider: Divider;
  private readonly readout = h("output", { class: "readout", "aria-live": "polite" });
  private readonly legend = h("div", { class: "legend" });
  private readonly bar = h("div", { class: "viewer-bar" });
  private readonly renderer: Renderer;
  private readonly resized = new ResizeObserver(() => this.resize());
  private readonly marks = new Marks();
  private readonly measuring: HTMLButtonElement;
  private readonly escape = (event: KeyboardEvent): void => {
    if (actOf("picture", event) === "stop") this.endMarks();
  };
  private readonly modalities: Modality[];
  private numbers: Numbers = { width: 0, height: 0, depth: null, label: null, face: null };
  private others: Numbers | null = null;
  private votes: FaceVotes | null = null;
  /** The reason why there are no votes. */
  private trouble = "";
  private rest = 0;
  private pending = false;
  private closed = false;
  /** The label under the pointer, whose pixels light up. */
  private lit: number | null = null;

  private constructor(
    private readonly index: Index,
    private readonly picture: Picture,
    private readonly look: Look,
    private readonly options: ViewerOptions,
  ) {
    const label = options.other ? "Line between A and B" : "Line between the two modalities";
    this.divider = divider(
      label,
      () => this.canvas,
      (share) => this.moveSplit(share),
    );
    const frame = h("div", { class: "frame" }, this.canvas, this.overlay, this.divider.line);
    this.element = h("section", { class: "viewer" }, this.bar, frame, this.readout, this.legend);
    const { canvas, element } = this;
    const dataSet = index.data_set.name;
    frame.append(pictureTools({ element, canvas, dataSet, draw: () => this.renderer.draw(this.look) }));
    this.measuring = h("button", { type: "button", "aria-pressed": "false" }, "Measure");
    this.measuring.addEventListener("click", () => {
      const on = this.measuring.getAttribute("aria-pressed") !== "true";
      this.measuring.setAttribute("aria-pressed", String(on));
      if (!on) this.marks.endMeasure();
      this.draw();
    });
    append(this.overlay, this.marks.elements);
    this.canvas.setAttribute("aria-label", flat(options.title));
    this.canvas.setAttribute("role", "img");
    this.modalities = options.other?.modalities ?? modalitiesOf(index, options.area, picture);
    this.renderer = new Renderer(this.canvas, index);
  }

  static async open(index: Index, picture: Picture, look: Look, options: ViewerOptions): Promise<Viewer> {
    const viewer = new Viewer(index, picture, look, options);
    viewer.numbers = await viewer.renderer.take(picture);
    if (options.other) viewer.others = await viewer.renderer.takeOther(options.other);
    viewer.fillBar();
    const hint = look.gaze
      ? "Drag to look around, scroll to zoom, point at something to know what it is."
      : "Point at something to know what it is.";
    viewer.readout.append(h("span", { class: "quiet" }, hint));
    viewer.listen();
    document.addEventListener("keydown", viewer.escape);
    viewer.resized.observe(viewer.canvas);
    viewer.changed();
    return viewer;
  }

  /** Shows the colours of a file that has more of them. If it cannot be read, this is told. */
  async sharpen(colors: Promise<string>): Promise<void> {
    try {
      const url = await colors;
      if (this.closed) return;
      await this.renderer.sharpen(url);
      this.draw();
      this.element.dataset["sharp"] = "true";
    } catch (e) {
      if (!this.closed)
        append(this.element, [h("p", { role: "alert" }, e instanceof Error ? e.message : String(e))]);
    }
  }

  close(): void {
    this.closed = true;
    window.clearTimeout(this.rest);
    document.removeEventListener("keydown", this.escape);
    this.resized.disconnect();
    this.renderer.close();
  }

  get gaze(): Gaze | null {
    return this.look.gaze;
  }

  /** The depth, in units, at a point of the picture, which is given in shares of its size. */
  depthAt(u: number, v: number): number | null {
    const { width, height, depth } = this.numbers;
    const [i, j] = [Math.min(width - 1, Math.floor(u * width)), Math.min(height - 1, Math.floor(v * height))];
    const value = depth?.[j * width + i];
    return value === undefined || value === NO_DEPTH ? null : value;
  }

  /** The labels of both pictures, if they have the same size. */
  get labels(): { width: number; height: number; a: Uint32Array | null; b: Uint32Array | null } {
    const { width, height, label: a } = this.numbers;
    const fits = this.others?.width === width && this.others.height === height;
    return { width, height, a, b: fits ? (this.others?.label ?? null) : null };
  }

  lookAt(gaze: Gaze): void {
    this.look.gaze = clampGaze(gaze);
    this.changed();
  }

  private fillBar(): void {
    const there = this.modalities.map((m): [string, string] => [m, NAMES[m]]);
    const pick = (label: string, ...sides: ("left" | "right")[]): HTMLElement =>
      choice(label, there, this.look[sides[0] ?? "left"], (value) => {
        for (const side of sides) this.look[side] = value as Modality;
        if (sides.length === 1) Object.assign(chosen, { left: this.look.left, right: this.look.right });
        this.changed();
      });
    const two = [
      pick("Left of the line", "left"),
      h("span", { class: "versus", "aria-hidden": "true" }, "|"),
      pick("Right of the line", "right"),
    ];
    const one = [pick("What of both is shown", "left", "right")];
    const { tools = [] } = this.options;
    this.bar.classList.toggle("with-tools", tools.some(Boolean));
    append(this.bar, [...(this.others ? one : two), this.numbers.depth && this.measuring, ...tools]);
  }

  /** Loads the votes of the area's faces once; until then the readout has none. */
  private async loadVotes(): Promise<void> {
    if (this.votes) return;
    try {
      const votes = await loadFaceVotes(this.options.area);
      if (this.closed || this.votes) return;
      this.votes = votes;
      this.renderer.takeMargins(votes.margin);
    } catch (e) {
      this.trouble = e instanceof Error ? e.message : String(e);
    }
    if (this.closed) return;
    this.fillLegend();
    this.draw();
  }

  private endMarks(): void {
    this.marks.endMeasure();
    this.marks.pinAt(null, "");
    this.measuring.setAttribute("aria-pressed", "false");
    this.draw();
  }

  /** Handles a click at a point of the canvas: an end of the line, or the place for the link to 3D. */
  private mark(x: number, y: number): void {
    const { area, position } = this.options;
    const point = this.spotAt(x, y, this.canvas.getBoundingClientRect())?.spot.point;
    if (!point) return;
    if (this.measuring.getAttribute("aria-pressed") === "true") this.marks.measure(point, [x, y]);
    else if (this.index.meshes.some((mesh) => mesh.area === area))
      this.marks.pinAt(point, spaceLink(area, point, position, this.others ? "changed" : null));
    this.draw();
  }

  private listen(): void {
    const { canvas } = this;
    let from: { x: number; y: number } | null = null;
    let press: { x: number; y: number } | null = null;
    const fingers = new Map<number, PointerEvent>();
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, event);
      canvas.setPointerCapture(event.pointerId);
      from = { x: event.clientX, y: event.clientY };
      press = fingers.size === 1 && event.button === 0 ? from : null;
      this.read(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (press && Math.hypot(event.clientX - press.x, event.clientY - press.y) > STILL) press = null;
      const gaze = this.look.gaze;
      if (gaze && fingers.size === 2 && fingers.has(event.pointerId)) {
        const [a, b] = [...fingers.values()] as [PointerEvent, PointerEvent];
        const before = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        fingers.set(event.pointerId, event);
        const [c, d] = [...fingers.values()] as [PointerEvent, PointerEvent];
        const after = Math.hypot(c.clientX - d.clientX, c.clientY - d.clientY);
        if (after > 0) this.lookAt({ ...gaze, fov: (gaze.fov * before) / after });
      } else if (gaze && from && fingers.size === 1) {
        const f = focal(gaze, canvas.clientWidth, canvas.clientHeight);
        const [dx, dy] = [event.clientX - from.x, event.clientY - from.y];
        from = { x: event.clientX, y: event.clientY };
        canvas.classList.add("dragged");
        this.lookAt({ ...gaze, lon: gaze.lon - dx / f, lat: gaze.lat + dy / f });
      }
      this.read(event);
    });
    for (const end of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(end, (event) => {
        fingers.delete(event.pointerId);
        if (press && end === "pointerup") {
          const box = canvas.getBoundingClientRect();
          this.mark(press.x - box.left, press.y - box.top);
        }
        press = null;
        from = null;
        canvas.classList.remove("dragged");
      });
    }
    canvas.addEventListener(
      "wheel",
      (event) => {
        if (!this.look.gaze) return;
        event.preventDefault();
        this.lookAt({ ...this.look.gaze, fov: this.look.gaze.fov * Math.exp(event.deltaY / 900) });
      },
      { passive: false },
    );
    for (const event of ["pointerleave", "blur"]) canvas.addEventListener(event, () => this.point(null));
    canvas.addEventListener("keydown", (event) => this.key(event));
    // Only focus by the keyboard counts; a touch gives the focus too, but has a place of its own.
    canvas.addEventListener("focus", () => {
      if (canvas.matches(":focus-visible")) this.readMiddle();
    });
  }

  private key(event: KeyboardEvent): void {
    const gaze = this.look.gaze;
    const act = actOf("picture", event);
    if (act === "take") this.mark(this.canvas.clientWidth / 2, this.canvas.clientHeight / 2);
    if (!act || !gaze) return;
    const step = gaze.fov / 12;
    const moves: Partial<Record<ActOf<"picture">, Partial<Gaze>>> = {
      left: { lon: gaze.lon - step },
      right: { lon: gaze.lon + step },
      up: { lat: gaze.lat + step },
      down: { lat: gaze.lat - step },
      nearer: { fov: gaze.fov / 1.2 },
      farther: { fov: gaze.fov * 1.2 },
    };
    const move = moves[act];
    if (!move) return;
    event.preventDefault();
    this.lookAt({ ...gaze, ...move });
    this.readMiddle();
  }

  private moveSplit(to: number): void {
    this.look.split = to;
    chosen.split = to;
    this.changed();
  }

  private changed(): void {
    const percent = Math.round(100 * this.look.split);
    const names = this.others ? ["A", "B"] : [NAMES[this.look.left], NAMES[this.look.right]];
    this.divider.put(this.look.split, `${names[0]} on ${percent} %, ${names[1]} on the rest`);
    this.fillLegend();
    if (this.look.left === "contested" || this.look.right === "contested") void this.loadVotes();
    // The address belongs to the viewer only while it is on the page.
    if (this.element.isConnected) this.options.changed(this.look);
    this.draw();
  }

  private resize(): void {
    const scale = Math.min(2, window.devicePixelRatio || 1);
    const { canvas } = this;
    [canvas.width, canvas.height] = [
      Math.max(1, Math.round(canvas.clientWidth * scale)),
      Math.max(1, Math.round(canvas.clientHeight * scale)),
    ];
    this.paint();
  }

  private draw(): void {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.paint();
    });
  }

  private paint(): void {
    if (this.closed) return;
    this.renderer.draw({ ...this.look, lit: this.lit });
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.marks.draw((point) => this.options.screen(point, this.look.gaze, width, height), width, height);
    this.options.drawn?.(width, height);
  }

  private fillLegend(): void {
    const shown = [this.look.left, this.look.right];
    const units = this.index.data_set.depth_units_per_m;
    const [near, far] = this.renderer.range;
    const trouble = this.trouble !== "" && h("span", { role: "alert" }, this.trouble);
    this.legend.replaceChildren(...legendOf(this.index, shown, [near / units, far / units]));
    append(this.legend, [shown.includes("contested") && trouble]);
  }

  private read(event: PointerEvent): void {
    const box = this.canvas.getBoundingClientRect();
    this.readAt(event.clientX - box.left, event.clientY - box.top, box);
  }

  private readMiddle(): void {
    const box = this.canvas.getBoundingClientRect();
    this.readAt(box.width / 2, box.height / 2, box);
  }

  /** The values at a point of the canvas with the size of `box`, not limited to whole pixels. */
  private spotAt(
    x: number,
    y: number,
    box: DOMRect,
  ): { pixel: string; spot: Spot; other: number | null } | null {
    const [w, h_] = [box.width, box.height];
    let [u, v] = [0, 0];
    if (this.look.gaze) {
      [u, v] = panoramaAt(this.look.gaze, w, h_, x, y);
    } else {
      const [left, top, width, height] = placeOf(this.picture.of, w, h_);
      [u, v] = [(x - left) / width, (y - top) / height];
    }
    const { width, height, depth, label, face } = this.numbers;
    if (width === 0 || u < 0 || u >= 1 || v < 0 || v >= 1) return null;
    const [i, j] = [Math.floor(u * width), Math.min(height - 1, Math.floor(v * height))];
    const known = (values: ArrayLike<number> | null, nothing: number): number | null => {
      const value = values?.[j * width + i] ?? nothing;
      return value === nothing ? null : value;
    };
    const units = known(depth, NO_DEPTH);
    const metres = units === null ? null : units / this.index.data_set.depth_units_per_m;
    const point = metres === null ? null : this.options.point(i, j, metres);
    const from = this.options.position;
    const away = point && from ? Math.hypot(...point.map((c, axis) => c - (from[axis] ?? 0))) : metres;
    const spot = { label: known(label, NO_LABEL), face: known(face, NO_FACE), distance: away, point };
    let other: number | null = null;
    if (this.others?.label) {
      const { width: across, height: down, label: labels } = this.others;
      const row = Math.min(down - 1, Math.floor(v * down));
      const value = labels[row * across + Math.floor(u * across)] ?? NO_LABEL;
      other = value === NO_LABEL ? null : value;
    }
    return { pixel: `${i},${j}`, spot, other };
  }

  /** Lights up the pixels of an instance; none with null. */
  light(label: number | null): void {
    const lit = this.others || !label ? null : label;
    if (lit === this.lit) return;
    this.lit = lit;
    this.draw();
  }

  /** Handles that the pointer is on an instance; on none with null. */
  private point(label: number | null): void {
    this.light(label);
    this.options.pointed?.(label || null);
  }

  /** Shows the values at a point of the canvas. */
  private readAt(x: number, y: number, box: DOMRect): void {
    window.clearTimeout(this.rest);
    this.readout.replaceChildren();
    delete this.readout.dataset["pixel"];
    const found = this.spotAt(x, y, box);
    this.point(found?.spot.label ?? null);
    if (!found) return;
    const { room } = this.options;
    const { spot } = found;
    const told = tell(this.index, spot, { room, hasDepth: this.numbers.depth !== null }, this.votes);
    const { other } = this.options;
    const ofOne = (entry: HTMLElement): boolean => !["class", "instance"].includes(entry.dataset["is"] ?? "");
    append(this.readout, other ? [...other.tell(spot.label, found.other), ...told.filter(ofOne)] : told);
    this.readout.dataset["pixel"] = found.pixel;
    const voted = this.modalities.includes("contested");
    if (this.votes || this.trouble !== "" || !voted || !spot.label || spot.face === null) return;
    const gaze = this.look.gaze;
    this.rest = window.setTimeout(async () => {
      await this.loadVotes();
      // The votes belong to this point, unless the readout or the direction changed meanwhile.
      if (this.votes && this.readout.dataset["pixel"] === found.pixel && this.look.gaze === gaze)
        this.readAt(x, y, box);
    }, REST);
  }
}
