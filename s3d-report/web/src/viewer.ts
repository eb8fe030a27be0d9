// A picture to look at: two modalities with a line between them that moves, and what is under the pointer.

import { css } from "./colors.js";
import type { Index, Picture, Rgb } from "./data.js";
import { append, choice, h, roomName } from "./dom.js";
import { type Gaze, clampGaze, focal, panoramaAt } from "./geometry.js";
import { MODALITIES, type Modality, NO_DEPTH, NO_LABEL, type Numbers, Renderer, placeOf } from "./gl.js";

const NAMES: Record<Modality, string> = {
  rgb: "Colour",
  depth: "Depth",
  normal: "Normals",
  class: "Class",
  instance: "Instance",
  unlabelled: "Unlabelled",
};

/** How a picture is looked at: what the address keeps of it. */
export interface Look {
  left: Modality;
  right: Modality;
  split: number;
  gaze: Gaze | null;
}

export interface ViewerOptions {
  /** What the picture shows, for screen readers. */
  title: string;
  /** The room, where there is no label to tell it. */
  room: string;
  /** The world point of a pixel at a depth, and its distance from the camera. */
  point: (i: number, j: number, depth: number) => Rgb | null;
  position: Rgb | null;
  /** Called when the look has changed. */
  changed: (look: Look) => void;
  /** Called after each drawing, with the size of the canvas in CSS pixels. */
  drawn?: (width: number, height: number) => void;
}

/** Which modalities a picture can be shown in. */
export function modalitiesOf(picture: Picture): Modality[] {
  const has: Record<Modality, boolean> = {
    rgb: picture.rgb !== null,
    depth: picture.depth !== null,
    normal: picture.normal !== null,
    class: picture.label !== null,
    instance: picture.label !== null,
    unlabelled: picture.label !== null,
  };
  return MODALITIES.filter((modality) => has[modality]);
}

/** The look that an address asks for, as far as the picture can be shown so. */
export function lookFrom(query: URLSearchParams, picture: Picture, gaze: Gaze | null): Look {
  const there = modalitiesOf(picture);
  const of = (name: string, otherwise: Modality[]): Modality => {
    const word = query.get(name) as Modality;
    return there.includes(word) ? word : (otherwise.find((m) => there.includes(m)) ?? there[0] ?? "rgb");
  };
  const split = Number(query.get("split") ?? "0.5");
  return {
    left: of("left", ["rgb"]),
    right: of("right", ["class", "depth", "normal"]),
    split: split >= 0 && split <= 1 ? split : 0.5,
    gaze,
  };
}

export function queryOf(look: Look): Record<string, string> {
  const degrees = (radians: number): string => ((radians * 180) / Math.PI).toFixed(1);
  const gaze = look.gaze;
  return {
    ...(gaze && { lon: degrees(gaze.lon), lat: degrees(gaze.lat), fov: degrees(gaze.fov) }),
    left: look.left,
    right: look.right,
    split: look.split.toFixed(3),
  };
}

export class Viewer {
  readonly element: HTMLElement;
  /** Lies over the canvas, for what is drawn in it. */
  readonly overlay = h("div", { class: "overlay" });
  private readonly canvas = h("canvas", { tabindex: 0 });
  private readonly line: HTMLElement;
  private readonly readout = h("output", { class: "readout", "aria-live": "polite" });
  private readonly legend = h("div", { class: "legend" });
  private readonly bar = h("div", { class: "viewer-bar" });
  private readonly renderer: Renderer;
  private readonly resized = new ResizeObserver(() => this.resize());
  private numbers: Numbers = { width: 0, height: 0, depth: null, label: null };
  private pending = false;
  private closed = false;

  private constructor(
    private readonly index: Index,
    private readonly picture: Picture,
    private readonly look: Look,
    private readonly options: ViewerOptions,
  ) {
    this.line = h(
      "div",
      {
        class: "split",
        role: "slider",
        tabindex: 0,
        "aria-label": "Line between the two modalities",
        "aria-valuemin": 0,
        "aria-valuemax": 100,
        keydown: (event: KeyboardEvent) => this.splitKey(event),
        pointerdown: (event: PointerEvent) => this.splitDrag(event),
      },
      h("span", { class: "grip", "aria-hidden": "true" }),
    );
    const frame = h("div", { class: "frame" }, this.canvas, this.overlay, this.line);
    this.element = h("section", { class: "viewer" }, this.bar, frame, this.readout, this.legend);
    this.canvas.setAttribute("aria-label", options.title);
    this.canvas.setAttribute("role", "img");
    this.renderer = new Renderer(this.canvas, index);
  }

  static async open(index: Index, picture: Picture, look: Look, options: ViewerOptions): Promise<Viewer> {
    const viewer = new Viewer(index, picture, look, options);
    viewer.numbers = await viewer.renderer.take(picture);
    viewer.fillBar();
    const hint = look.gaze
      ? "Drag to look around, scroll to zoom, point at something to know what it is."
      : "Point at something to know what it is.";
    viewer.readout.append(h("span", { class: "quiet" }, hint));
    viewer.listen();
    viewer.resized.observe(viewer.canvas);
    viewer.changed();
    return viewer;
  }

  close(): void {
    this.closed = true;
    this.resized.disconnect();
    this.renderer.close();
  }

  get gaze(): Gaze | null {
    return this.look.gaze;
  }

  /** The depth in units at a place of the picture, in shares of its size. */
  depthAt(u: number, v: number): number | null {
    const { width, height, depth } = this.numbers;
    const [i, j] = [Math.min(width - 1, Math.floor(u * width)), Math.min(height - 1, Math.floor(v * height))];
    const value = depth?.[j * width + i];
    return value === undefined || value === NO_DEPTH ? null : value;
  }

  lookAt(gaze: Gaze): void {
    this.look.gaze = clampGaze(gaze);
    this.changed();
  }

  private fillBar(): void {
    const there = modalitiesOf(this.picture).map((m): [string, string] => [m, NAMES[m]]);
    const pick = (side: "left" | "right"): HTMLSelectElement =>
      choice(side === "left" ? "Left of the line" : "Right of the line", there, this.look[side], (value) => {
        this.look[side] = value as Modality;
        this.changed();
      });
    append(this.bar, [
      pick("left"),
      h("span", { class: "versus", "aria-hidden": "true" }, "|"),
      pick("right"),
    ]);
  }

  private listen(): void {
    const { canvas } = this;
    let from: { x: number; y: number } | null = null;
    const fingers = new Map<number, PointerEvent>();
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, event);
      canvas.setPointerCapture(event.pointerId);
      from = { x: event.clientX, y: event.clientY };
      this.read(event);
    });
    canvas.addEventListener("pointermove", (event) => {
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
    canvas.addEventListener("keydown", (event) => this.key(event));
    // Focus by the keyboard; a touch gives it too, and has told its own place.
    canvas.addEventListener("focus", () => {
      if (canvas.matches(":focus-visible")) this.readMiddle();
    });
  }

  private key(event: KeyboardEvent): void {
    const gaze = this.look.gaze;
    if (!gaze || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = gaze.fov / 12;
    const moves: Record<string, Partial<Gaze>> = {
      ArrowLeft: { lon: gaze.lon - step },
      ArrowRight: { lon: gaze.lon + step },
      ArrowUp: { lat: gaze.lat + step },
      ArrowDown: { lat: gaze.lat - step },
      "+": { fov: gaze.fov / 1.2 },
      "=": { fov: gaze.fov / 1.2 },
      "-": { fov: gaze.fov * 1.2 },
    };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    this.lookAt({ ...gaze, ...move });
    this.readMiddle();
  }

  private splitKey(event: KeyboardEvent): void {
    const steps: Record<string, number> = {
      ArrowLeft: -0.02,
      ArrowDown: -0.02,
      ArrowRight: 0.02,
      ArrowUp: 0.02,
    };
    const ends: Record<string, number> = { Home: 0, End: 1 };
    const to = ends[event.key] ?? (event.key in steps ? this.look.split + (steps[event.key] ?? 0) : null);
    if (to === null) return;
    event.preventDefault();
    this.moveSplit(to);
  }

  private splitDrag(down: PointerEvent): void {
    down.preventDefault();
    this.line.setPointerCapture(down.pointerId);
    this.line.focus();
    const move = (event: PointerEvent): void => {
      const box = this.canvas.getBoundingClientRect();
      this.moveSplit((event.clientX - box.left) / box.width);
    };
    const end = (): void => {
      this.line.removeEventListener("pointermove", move);
      this.line.removeEventListener("pointerup", end);
      this.line.removeEventListener("pointercancel", end);
    };
    this.line.addEventListener("pointermove", move);
    this.line.addEventListener("pointerup", end);
    this.line.addEventListener("pointercancel", end);
  }

  private moveSplit(to: number): void {
    this.look.split = Math.min(1, Math.max(0, to));
    this.changed();
  }

  private changed(): void {
    const percent = Math.round(100 * this.look.split);
    this.line.style.left = `${100 * this.look.split}%`;
    this.line.setAttribute("aria-valuenow", String(percent));
    this.line.setAttribute(
      "aria-valuetext",
      `${NAMES[this.look.left]} on ${percent} %, ${NAMES[this.look.right]} on the rest`,
    );
    this.fillLegend();
    // Until it is on the page, the address is not its own.
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
    this.renderer.draw(this.look);
    this.options.drawn?.(this.canvas.clientWidth, this.canvas.clientHeight);
  }

  /** Explains the colours of depth and of what has no label. */
  private fillLegend(): void {
    this.legend.replaceChildren();
    const shown = [this.look.left, this.look.right];
    if (shown.includes("depth")) {
      const [near, far] = this.renderer.range.map(
        (units) => `${(units / this.index.data_set.depth_units_per_m).toFixed(1)} m`,
      );
      append(this.legend, [h("span", {}, near), h("span", { class: "ramp" }), h("span", {}, far)]);
    }
    if (shown.includes("unlabelled")) {
      append(this.legend, [h("span", { class: "key magenta" }), h("span", {}, "no label")]);
    }
    if (shown.includes("class")) {
      for (const [i, { name, color }] of this.index.classes.entries()) {
        if (!this.index.pixels_by_class[i]) continue;
        const key = h("span", { class: "key" });
        key.style.background = css(color);
        append(this.legend, [h("span", { class: "entry" }, key, name)]);
      }
    }
  }

  private read(event: PointerEvent): void {
    const box = this.canvas.getBoundingClientRect();
    this.readAt(event.clientX - box.left, event.clientY - box.top, box);
  }

  private readMiddle(): void {
    const box = this.canvas.getBoundingClientRect();
    this.readAt(box.width / 2, box.height / 2, box);
  }

  /** Tells what a point of the canvas shows, whose size is that of `box`: not of whole pixels. */
  private readAt(x: number, y: number, box: DOMRect): void {
    const [w, h_] = [box.width, box.height];
    let [u, v] = [0, 0];
    if (this.look.gaze) {
      [u, v] = panoramaAt(this.look.gaze, w, h_, x, y);
    } else {
      const [left, top, width, height] = placeOf(this.picture.of, w, h_);
      [u, v] = [(x - left) / width, (y - top) / height];
    }
    const { width, height, depth, label } = this.numbers;
    this.readout.replaceChildren();
    delete this.readout.dataset["pixel"];
    if (width === 0 || u < 0 || u >= 1 || v < 0 || v >= 1) return;
    const [i, j] = [Math.floor(u * width), Math.min(height - 1, Math.floor(v * height))];
    const entry = (name: string, value: string): HTMLElement =>
      h("span", { class: "entry", "data-is": name }, h("span", { class: "name" }, name), value);
    const units = depth?.[j * width + i] ?? NO_DEPTH;
    const of_label = label?.[j * width + i] ?? NO_LABEL;
    let room = this.options.room;
    if (label && of_label !== NO_LABEL) {
      const found = this.index.labels[of_label];
      const of_class =
        found?.class === null || found === undefined ? undefined : this.index.classes[found.class];
      if (found && of_class) {
        const key = h("span", { class: "key" });
        key.style.background = css(of_class.color);
        const parts = found.name.split("_");
        room = parts.slice(2, 4).join("_");
        append(this.readout, [
          h("span", { class: "entry", "data-is": "class" }, key, of_class.name),
          entry("instance", found.name),
        ]);
      } else {
        append(this.readout, [entry("class", "no label")]);
      }
    }
    append(this.readout, [entry("room", roomName(room))]);
    this.readout.dataset["pixel"] = `${i},${j}`;
    if (units === NO_DEPTH) {
      append(this.readout, [entry("distance", depth ? "nothing seen" : "not stored")]);
      return;
    }
    const metres = units / this.index.data_set.depth_units_per_m;
    const point = this.options.point(i, j, metres);
    const from = this.options.position;
    const away = point && from ? Math.hypot(...point.map((c, axis) => c - (from[axis] ?? 0))) : metres;
    append(this.readout, [entry("distance", `${away.toFixed(3)} m`)]);
    if (point) append(this.readout, [entry("X Y Z", point.map((c) => c.toFixed(3)).join("  "))]);
  }
}
