// The scenes of a presentation: a building that turns, and pictures. What a scene shows follows from the time
// alone, so that it can be held, and gone back to.

import { Vector3 } from "three";
import { type Index, type Mesh, type Picture, load, loadPicture } from "../data.js";
import { h } from "../dom.js";
import type { Gaze } from "../picture/geometry.js";
import { type Modality, Renderer, placeOf } from "../picture/gl.js";
import { modalitiesOf } from "../picture/viewer.js";
import { type Stand, rgb } from "../space/eye.js";
import { lookFrom, showsOf } from "../space/look.js";
import { SpaceView } from "../space/view.js";
import type { Step } from "./steps.js";

/** A building turns by so much in a second, a panorama by so much in a step; radians. */
const TURN = (2 * Math.PI) / 90;
const SWEEP = (75 * Math.PI) / 180;
/** The time in which the eye goes from one storey to the next, ms. */
const FLIGHT = 1100;
/** A panorama is looked at so far below the horizon, and with this angle of view; radians. */
const LAT = (-5 * Math.PI) / 180;
const FOV = (88 * Math.PI) / 180;

const isStill = (): boolean => window.matchMedia("(prefers-reduced-motion: reduce)").matches;

export interface Scene {
  element: HTMLElement;
  /** The name of the layer right of the line; null without a line. */
  layer: string | null;
  /** Shows the time `t`, in ms, of a step that lasts `all`; `wipe` is the share left of the line. */
  draw: (t: number, all: number, wipe: number) => void;
  close: () => void;
}

const LAYERS: Partial<Record<Modality, string>> = { class: "Class", depth: "Depth", normal: "Normals" };

/** The line between two layers. */
function lineOver(): { line: HTMLElement; put: (share: number) => void } {
  const line = h("div", { class: "present-line", hidden: true });
  const put = (share: number): void => {
    line.hidden = share <= 0 || share >= 1;
    line.style.left = `${100 * share}%`;
  };
  return { line, put };
}

/** The building of an area, which stays loaded while its storeys are shown. */
export class Dollhouse implements Scene {
  readonly element = h("div", { class: "present-scene present-building" });
  readonly layer: string | null;
  private readonly view: SpaceView;
  private readonly line = lineOver();
  private readonly loaded: Promise<void>;
  private readonly resized = new ResizeObserver(() => this.aim());
  private from: Stand | null = null;
  private base: Stand | null = null;

  constructor(
    index: Index,
    readonly mesh: Mesh,
  ) {
    const query = new URLSearchParams({ marks: "rooms", show: "texture" });
    const beyond = showsOf(mesh, false).includes("class") ? "class" : "normal";
    const look = { ...lookFrom(index, mesh, query, false), beyond, line: 1 } as const;
    this.layer = beyond === "class" ? "Class" : "Normals";
    let trouble = "";
    this.view = new SpaceView(index, mesh, look, {
      against: null,
      turns: true,
      storey: null,
      changed: () => {},
      progress: () => {},
      fault: (words) => (trouble ||= words),
    });
    this.view.canvas.tabIndex = -1;
    this.element.append(this.view.canvas, this.view.overlay, this.line.line);
    this.loaded = this.view.load().then(() => {
      this.view.eye.land();
      if (trouble !== "") throw new Error(trouble);
      void this.view.loadTextures();
      this.resized.observe(this.element);
    });
  }

  /** Shows a storey, or all of them. The eye comes from where it is if the building is on the screen. */
  async open(storey: number | null): Promise<void> {
    await this.loaded;
    this.from = this.base && this.element.isConnected && !isStill() ? this.view.stand : null;
    this.view.openStorey(storey);
    this.base = this.view.fromAbove();
  }

  draw(t: number, _: number, wipe: number): void {
    const { view, base, from } = this;
    if (!base) return;
    const angle = isStill() ? 0 : (TURN * t) / 1000;
    const [at, eye] = [new Vector3(...base.at), new Vector3(...base.from)];
    const turned = eye
      .sub(at)
      .applyAxisAngle(new Vector3(0, 0, 1), -angle)
      .add(at);
    const share = Math.min(1, t / FLIGHT);
    const eased = from ? share * share * (3 - 2 * share) : 1;
    const between = (a: number[], b: Vector3): Vector3 => new Vector3().fromArray(a).lerp(b, eased);
    view.look.line = wipe;
    view.eye.set({
      at: rgb(from ? between(from.at, at) : at),
      from: rgb(from ? between(from.from, turned) : turned),
    });
    this.line.put(wipe);
  }

  close(): void {
    this.resized.disconnect();
    this.view.close();
  }

  private aim(): void {
    if (this.base) this.base = this.view.fromAbove();
  }
}

/** Loads the picture of a step. */
async function pictureOf(index: Index, step: Exclude<Step, { kind: "building" }>): Promise<Picture> {
  const picture =
    step.kind === "view"
      ? await loadPicture(index, step.view.picture ?? -1)
      : await load<Picture | null>(`pano_${step.location}`);
  if (!picture || picture.rgb === null) throw new Error("This picture is missing.");
  return picture;
}

/** A view, or a panorama to look around in. */
export async function pictureScene(
  index: Index,
  step: Exclude<Step, { kind: "building" }>,
  name: string,
): Promise<Scene> {
  const picture = await pictureOf(index, step);
  const canvas = h("canvas", { role: "img", "aria-label": name });
  const { line, put } = lineOver();
  const element = h("div", { class: "present-scene" }, canvas, line);
  const renderer = new Renderer(canvas, index);
  await renderer.take(picture);
  const there = modalitiesOf(index, step.area, picture);
  const right = (["class", "depth", "normal"] as const).find((modality) => there.includes(modality));

  const isFlat = step.kind === "view";
  if (isFlat) {
    // A square picture has its own colours beside it.
    const around = h("img", { class: "present-around", alt: "", src: picture.rgb ?? "" });
    element.prepend(around);
  }
  const location = step.kind === "view" ? null : index.locations[step.location];
  const lon = (location?.look_deg ?? 0) * (Math.PI / 180);
  let drawn: [number, number, number] = [0, 1, 1];
  const draw = (t: number, all: number, wipe: number): void => {
    drawn = [t, all, wipe];
    const [left, , width] = isFlat
      ? placeOf(picture.of, canvas.width, canvas.height)
      : [0, 0, canvas.width, canvas.height];
    const split = (left + wipe * width) / Math.max(1, canvas.width);
    const turned = isStill() ? 0 : SWEEP * (t / all - 0.5);
    const gaze: Gaze | null = isFlat ? null : { lon: lon + turned, lat: LAT, fov: FOV };
    renderer.draw({ left: "rgb", right: right ?? "rgb", split: right ? split : 1, gaze });
    put(right && wipe > 0 && wipe < 1 ? split : 0);
  };
  const resized = new ResizeObserver(() => {
    const scale = Math.min(2, window.devicePixelRatio || 1);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * scale));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * scale));
    draw(...drawn);
  });
  resized.observe(canvas);
  const close = (): void => {
    resized.disconnect();
    renderer.close();
  };
  return { element, layer: right ? (LAYERS[right] ?? null) : null, draw, close };
}

/** Loads what a step needs, so that it can be shown at once. */
export async function prepare(index: Index, step: Step | undefined): Promise<void> {
  if (step && step.kind !== "building") await pictureOf(index, step).catch(() => {});
}
