// The scene in 3D: draws it, moves the eye, and tells what lies under the pointer.

import { LinearSRGBColorSpace, MOUSE, Scene as Drawing, TOUCH, Vector3, WebGLRenderer } from "three";
import { type FaceVotes } from "../../../../s3d-report/web/src/picture/faces.js";
import { Eye, type Sides, type Stand, rgb } from "../../../../s3d-report/web/src/space/eye.js";
import { type Hit, Surface } from "../../../../s3d-report/web/src/space/surface.js";
import { type Mesh, groupsOf, partOf, stepOf } from "../mesh/mesh.js";
import type { Frame, Place, Point, Scene } from "../scene.js";
import { readImage } from "../server.js";
import { Borders } from "./borders.js";
import { LabelPaint, SHOWS, type Show } from "./paint.js";
import { backdrop, readPhotograph } from "./photo.js";
import type { FaceTable } from "./table.js";

/** No ray is longer, metres. */
const FAR = 1e7;
/** The steepest look up or down in a photograph, radians. */
const STEEP = 1.55;

const frame = (): Promise<void> => new Promise((done) => requestAnimationFrame(() => done()));

export class View {
  readonly eye: Eye;
  readonly paint: LabelPaint;
  readonly surface: Surface;
  private readonly renderer: WebGLRenderer;
  private readonly drawing = new Drawing();
  private readonly borders: Borders;
  private readonly sky;
  private pending = false;
  private shown: Show = "both";
  /** The photograph around the eye; null in the open. */
  photograph: number | null = null;
  private before: Stand | null = null;
  /** Called after each picture. */
  drawn: () => void = () => {};
  /** Called when another photograph, or none, is around the eye. */
  entered: () => void = () => {};
  /** The duration of the longest picture, ms, for measuring. */
  longest = 0;

  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly scene: Scene,
    private readonly where: Frame,
    private readonly table: FaceTable,
    private readonly covered: () => Sides,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.paint = new LabelPaint(scene, table);
    this.borders = new Borders(table.textures.objects, this.paint.section, this.paint.ratio);
    this.surface = new Surface(this.paint);
    this.sky = backdrop(this.paint);
    this.drawing.add(this.sky, this.surface.group);
    const [min, max] = scene.box.map((corner) => where.near(corner)) as [Place, Place];
    this.eye = new Eye(canvas, { min, max }, () => this.draw());
    this.grip("paint");
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener("webglcontextrestored", () => this.draw());
    this.look();
  }

  /** Makes the parts of the mesh, a few faces at a time. */
  async build(mesh: Mesh, told: (share: number) => void): Promise<void> {
    const step = stepOf(mesh);
    const groups = groupsOf(mesh, step);
    const numbers = { label: Uint32Array.from({ length: this.scene.faces }, (_, face) => face) };
    const votes: FaceVotes = { ...numbers, runnerUp: new Uint32Array(), margin: new Uint8Array() };
    for (const [done, group] of groups.entries()) {
      told(done / groups.length);
      await frame();
      this.surface.add(partOf(mesh, group, step), votes, null);
    }
    this.resize();
    this.overview();
  }

  async loadTextures(): Promise<void> {
    const anisotropy = Math.min(4, this.renderer.capabilities.getMaxAnisotropy());
    for (let texture = 0; texture < this.scene.textures; texture++) {
      this.paint.take(texture, await readImage(`texture/${texture}`), anisotropy);
      this.draw();
    }
  }

  /** What the next drag with the first button does: paint, turn the eye, or push it aside. */
  grip(to: "paint" | "turn"): void {
    const left = to === "turn" ? MOUSE.ROTATE : null;
    this.eye.hands({ left, middle: MOUSE.PAN, right: MOUSE.ROTATE }, { one: null, two: TOUCH.DOLLY_ROTATE });
  }

  show(show: Show): void {
    this.shown = show;
    this.paint.cover.value = SHOWS[show];
    this.draw();
  }

  get showing(): Show {
    return this.shown;
  }

  overview(): void {
    const points = this.surface.sample({ low: -Infinity, high: Infinity });
    if (points.length > 0) this.eye.set(this.eye.overview(points));
  }

  /** What lies under a point of the window. */
  pick(x: number, y: number): Hit | null {
    const { position } = this.eye.camera;
    return this.surface.pick(position, this.ray(x, y), { low: -FAR, high: this.paint.section.value });
  }

  /** The direction of a point of the window. */
  ray(x: number, y: number): Vector3 {
    const box = this.canvas.getBoundingClientRect();
    return this.eye.ray((x - box.left) / box.width, (y - box.top) / box.height);
  }

  get from(): Place {
    return rgb(this.eye.camera.position);
  }

  /** Where a place is on the canvas; null behind the eye. */
  screen(place: readonly number[]): Point | null {
    const { camera } = this.eye;
    const point = new Vector3(...(place as Place)).applyMatrix4(camera.matrixWorldInverse);
    if (point.z > -camera.near) return null;
    point.applyMatrix4(camera.projectionMatrix);
    const { clientWidth, clientHeight } = this.canvas;
    return [((point.x + 1) / 2) * clientWidth, ((1 - point.y) / 2) * clientHeight];
  }

  fly(to: Stand): void {
    if (this.photograph !== null) this.leave();
    this.eye.fly(to);
  }

  /** Flies to where a box fills the view. */
  frameBox([low, high]: [Place, Place]): void {
    const at = low.map((c, k) => (c + (high[k] ?? 0)) / 2) as Place;
    const size = Math.max(0.4, Math.hypot(...low.map((c, k) => (high[k] ?? 0) - c)));
    const back = this.eye.camera.getWorldDirection(new Vector3()).multiplyScalar(-1.25 * size);
    this.fly({ at, from: rgb(back.add(new Vector3(...at))) });
  }

  /** The photograph nearest to the eye; null if there is none. */
  nearest(): number | null {
    let best: { number: number; away: number } | null = null;
    for (const [number, { at }] of this.scene.photographs.entries()) {
      const away = this.eye.camera.position.distanceTo(new Vector3(...this.where.near(at)));
      if (!best || away < best.away) best = { number, away };
    }
    return best?.number ?? null;
  }

  /** Goes into a photograph. The direction of view stays. */
  async enter(number: number): Promise<void> {
    const photograph = this.scene.photographs[number];
    if (!photograph) return;
    const texture = await readPhotograph(number);
    if (this.paint.photograph.value !== texture && this.photograph !== null)
      this.paint.photograph.value.dispose();
    else this.before = this.eye.stand;
    const ahead = this.eye.camera.getWorldDirection(new Vector3());
    const from = this.where.near(photograph.at);
    this.photograph = number;
    this.paint.photograph.value = texture;
    this.paint.stand.value.set(...from);
    this.paint.inPhotograph.value = this.sky.visible = true;
    this.sky.position.set(...from);
    this.eye.isFree = false;
    this.eye.camera.fov = 75;
    if (Math.abs(ahead.z) > 0.6) ahead.setZ(0).normalize();
    if (ahead.lengthSq() === 0) ahead.set(0, 1, 0);
    this.eye.set({ from, at: rgb(ahead.add(new Vector3(...from))) });
    this.entered();
  }

  /** Leaves the photograph, to where the eye was before. */
  leave(): void {
    if (this.photograph === null) return;
    this.photograph = null;
    this.paint.inPhotograph.value = this.sky.visible = false;
    this.eye.isFree = true;
    this.eye.camera.fov = 50;
    if (this.before) this.eye.set(this.before);
    this.entered();
  }

  /** Turns the eye within a photograph, radians. */
  turn(right: number, up: number): void {
    const { from } = this.eye.stand;
    const ahead = this.eye.camera.getWorldDirection(new Vector3());
    const side = Math.atan2(ahead.x, ahead.y) + right;
    const rise = Math.max(-STEEP, Math.min(STEEP, Math.asin(Math.max(-1, Math.min(1, ahead.z))) + up));
    const [level, high] = [Math.cos(rise), Math.sin(rise)];
    const at = [level * Math.sin(side), level * Math.cos(side), high].map((c, k) => c + (from[k] ?? 0));
    this.eye.set({ from, at: at as Place });
  }

  /** Listens to drags, the wheel and arrows in a photograph. */
  private look(): void {
    const { canvas } = this;
    let last: Point | null = null;
    const angle = (): number => (this.eye.camera.fov * Math.PI) / 180 / Math.max(1, canvas.clientHeight);
    canvas.addEventListener("pointerdown", (event) => {
      const turns = event.button === 2 || event.button === 1 || canvas.dataset["grip"] === "turn";
      if (this.photograph !== null && turns) last = [event.clientX, event.clientY];
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    window.addEventListener("pointermove", (event) => {
      if (!last || this.photograph === null) return;
      this.turn((last[0] - event.clientX) * angle(), (event.clientY - last[1]) * angle());
      last = [event.clientX, event.clientY];
    });
    window.addEventListener("pointerup", () => (last = null));
    canvas.addEventListener("wheel", (event) => {
      if (this.photograph === null || event.shiftKey) return;
      const { camera } = this.eye;
      camera.fov = Math.max(15, Math.min(100, camera.fov * Math.exp(event.deltaY / 900)));
      this.turn(0, 0);
    });
    const turns: Record<string, Point> = {
      ArrowLeft: [-1, 0],
      ArrowRight: [1, 0],
      ArrowUp: [0, 1],
      ArrowDown: [0, -1],
    };
    canvas.addEventListener(
      "keydown",
      (event) => {
        const by = turns[event.key];
        if (this.photograph === null || !by || event.altKey || event.ctrlKey) return;
        event.stopImmediatePropagation();
        event.preventDefault();
        this.turn(0.15 * by[0], 0.15 * by[1]);
      },
      { capture: true },
    );
  }

  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    this.renderer.setPixelRatio(ratio);
    this.paint.ratio.value = ratio;
    this.renderer.setSize(width, height, false);
    this.borders.resize(this.canvas.width, this.canvas.height);
    this.eye.resize(width, height, this.covered());
    this.paintNow();
  }

  /** Draws at the next chance. */
  draw(): void {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.paintNow();
    });
  }

  private paintNow(): void {
    const start = performance.now();
    this.table.flush();
    const { renderer, drawing, eye, borders } = this;
    const isBordered = this.shown === "both" || this.shown === "labels";
    if (isBordered) {
      this.sky.visible = false;
      borders.take(renderer, drawing, eye.camera);
      this.sky.visible = this.photograph !== null;
    }
    renderer.render(drawing, eye.camera);
    if (isBordered) borders.draw(renderer);
    this.longest = Math.max(this.longest, performance.now() - start);
    this.drawn();
  }
}
