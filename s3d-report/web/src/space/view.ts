// A mesh on a canvas, drawn when something changes, with a readout for the pointer.

import { ColorManagement, Group, LinearSRGBColorSpace, Plane, Scene, Vector3, WebGLRenderer } from "three";
import type { Index, Location, Mesh, Rgb, Votes } from "../data.js";
import { type Against, type FaceChanges, groupOf, loadChanges } from "../compare/data.js";
import { tellBoth } from "../compare/words.js";
import { append, h, roomOf } from "../dom.js";
import { actOf } from "../keys.js";
import { type FaceVotes, SURE, loadFaceVotes } from "../picture/faces.js";
import { Marks } from "../picture/marks.js";
import type { Measured } from "../picture/measure.js";
import { tell } from "../picture/readout.js";
import { type Slab, WHOLE, fullest, slabOf, storeysOf } from "../storeys.js";
import { Eye, type Sides, type Stand } from "./eye.js";
import { type Box, loadBoxes, loadPart, loadTextures } from "./files.js";
import { Labels } from "./labels.js";
import { borderLines, boxLines, drop, floorOf, frustums, roomLines } from "./lines.js";
import { type Look, type Mark, slabIn } from "./look.js";
import { Paint, type Show } from "./paint.js";
import { type Hit, Surface } from "./surface.js";
import { vantage } from "./vantage.js";

/** A press that moves no farther counts as a click, CSS pixels. */
const STILL = 5;
/** A point this close below the section is cut away as well, metres. */
const SLACK = 0.05;
/** Until the ceilings are known, a storey is cut this high above its floors, metres. */
const OPEN = 2.2;
/** Higher than everything, metres. */
const SKY = 1e6;

export interface ViewOptions {
  /** The comparison with another data set. */
  against: Against | null;
  /** Called when the look or the viewpoint changes. */
  changed: () => void;
  /** Whether the area is turned slowly at first. */
  turns?: boolean;
  /** The storey that is shown at first, null for all; by default the one with the most rooms. */
  storey?: number | null;
  /** The pixels at the sides of the canvas that something lies over. */
  covered?: () => Sides;
  /** Called as files arrive, and with the fault of a file. */
  progress: (words: string) => void;
  fault: (words: string) => void;
}

/** Adjacent faces whose labels two labels dispute. */
export type Patch = Votes["disputed_patches"][number];

/** The size of a patch: half of its longest side. */
const sizeOf = ({ m2, bbox }: Patch): number =>
  bbox ? Math.max(...[0, 1, 2].map((k) => ((bbox[k + 3] ?? 0) - (bbox[k] ?? 0)) / 2)) : Math.sqrt(m2);

/** Two labels dispute a face whose first label leads by this share of its votes at most. */
const DISPUTED = 0.5;
/** The centre of a patch that an address names is no farther away, metres. */
const SAME = 2e-3;
const rounded = (height: number): number => (Number.isFinite(height) ? Number(height.toFixed(2)) : height);

/** An extension that TypeScript does not know. */
interface ProvokingVertex {
  readonly FIRST_VERTEX_CONVENTION_WEBGL: number;
  provokingVertexWEBGL(convention: number): void;
}

export class SpaceView {
  readonly canvas = h("canvas", { tabindex: 0, role: "img" });
  readonly overlay = h("div", { class: "overlay" });
  readonly readout = h("output", { class: "readout", "aria-live": "polite" });
  readonly eye: Eye;
  boxes: Box[] = [];
  changes: FaceChanges | null = null;
  private readonly renderer: WebGLRenderer;
  private readonly paint: Paint;
  private readonly surface: Surface;
  private readonly scene = new Scene();
  private readonly lines = new Group();
  private readonly marked = new Group();
  private readonly cut = new Plane(new Vector3(0, 0, -1), SKY);
  private readonly bottom = new Plane(new Vector3(0, 0, 1), SKY);
  readonly storeys;
  /** The storey that is shown; null for all of them. */
  storey: number | null;
  private readonly slabs = new Map<number | null, Slab>();
  private readonly marks = new Marks();
  private readonly labels: Labels;
  private readonly resized = new ResizeObserver(() => this.resize());
  private votes: FaceVotes | null = null;
  private measuring: Measured | null = null;
  private loaded = false;
  /** Whether the outlines of rooms are shown, until all of the mesh is there. */
  private sketched = false;
  private top = SKY;
  private pending = false;
  private closed = false;
  private lit: number | null = null;

  constructor(
    private readonly index: Index,
    readonly mesh: Mesh,
    readonly look: Look,
    private readonly options: ViewOptions,
  ) {
    const gl = this.canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("This browser has no WebGL 2, which the 3D view needs.");
    // Colours are shown with the values in the files.
    ColorManagement.enabled = false;
    this.renderer = new WebGLRenderer({ canvas: this.canvas, context: gl });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.setClearColor(0, 0);
    this.renderer.clippingPlanes = [this.cut, this.bottom];
    // All corners of a face have the same values. With the first corner as the provoking one, WebGL needs
    // no extra work.
    const corners = gl.getExtension("WEBGL_provoking_vertex") as ProvokingVertex | null;
    corners?.provokingVertexWEBGL(corners.FIRST_VERTEX_CONVENTION_WEBGL);
    this.paint = new Paint(index, mesh);
    this.surface = new Surface(this.paint);
    this.scene.add(this.surface.group, this.lines, this.marked);
    this.storeys = storeysOf(index, mesh.area);
    this.storey = options.storey === undefined ? fullest(this.storeys.all) : options.storey;
    this.eye = new Eye(this.canvas, mesh, () => this.changed());
    this.canvas.setAttribute("aria-label", `Area ${mesh.area} in 3D; arrow keys turn, plus and minus zoom`);
    this.labels = new Labels(index, mesh, this.overlay, (location, href) => this.enter(location, href));
    // The pin has a link to 3D, which is left out here.
    append(
      this.overlay,
      this.marks.elements.filter((element) => !(element instanceof HTMLAnchorElement)),
    );
    this.listen();
    this.resized.observe(this.canvas);
  }

  /** Loads the mesh, and shows its parts as they arrive. */
  async load(): Promise<void> {
    const { mesh, options } = this;
    if (mesh.has_votes) {
      options.progress("Loading the votes of the faces.");
      this.votes = await this.tried(loadFaceVotes(mesh.area));
    }
    if (mesh.has_boxes) this.boxes = (await this.tried(loadBoxes(mesh.area))) ?? [];
    if (options.against) this.changes = await this.tried(loadChanges(options.against, mesh.area));
    for (let part = 0; part < mesh.files && !this.closed; part++) {
      options.progress(`Loading the mesh: file ${part + 1} of ${mesh.files}.`);
      const read = await this.tried(loadPart(mesh, part));
      if (read && !this.closed) this.surface.add(read, this.votes, this.changes);
      if (this.sketched) this.draw();
    }
    options.progress("");
    if (this.closed) return;
    this.loaded = true;
    this.sketched = false;
    this.labels.nameRooms(this.boxes);
    this.fillLines();
    this.start();
  }

  /** Shows the outlines of the rooms of the storey that is shown first, from about the same viewpoint. */
  private sketch(): void {
    const { index, mesh, look, storeys } = this;
    const isSought = look.find !== null || look.instance !== null;
    const rooms = storeys.all[fullest(storeys.all)]?.rooms ?? [];
    if (rooms.length === 0 || isSought || (look.at !== null && look.from === null)) return;
    const outlines = rooms.map((room) => ({ room, floor: floorOf(index, mesh, [], room) }));
    drop(this.lines);
    this.lines.add(roomLines(outlines));
    const points = outlines.flatMap(({ room, floor }) =>
      room.outline.flat().flatMap(([x, y]): Rgb[] => [
        [x, y, floor],
        [x, y, floor + OPEN],
      ]),
    );
    this.top = Math.max(...points.map(([, , z]) => z));
    this.sketched = true;
    const { at, from } = look;
    this.eye.set(at && from ? { at, from } : this.eye.overview(points, this.options.turns));
  }

  /** Loads the textures, and shows each file as it arrives. */
  async loadTextures(): Promise<void> {
    const { mesh, options } = this;
    const anisotropy = Math.min(4, this.renderer.capabilities.getMaxAnisotropy());
    for (let file = 0; file < mesh.texture_files && !this.closed; file++) {
      options.progress(`Loading textures: file ${file + 1} of ${mesh.texture_files}.`);
      const images = await this.tried(loadTextures(mesh, file));
      if (this.closed) return;
      images?.forEach((image, i) => this.paint.take(16 * file + i, image, anisotropy));
      this.draw();
    }
    options.progress("");
  }

  /** The content of a file. If it cannot be read, that is reported, and the rest goes on. */
  private async tried<T>(file: Promise<T>): Promise<T | null> {
    try {
      return await file;
    } catch (e) {
      if (!this.closed) this.options.fault(e instanceof Error ? e.message : String(e));
      return null;
    }
  }

  /** Draws everything with the current look; `lines` if other lines are needed. */
  refresh(lines = false): void {
    if (lines) this.fillLines();
    this.changed();
  }

  /** Lights up the faces of an instance; none with null. */
  light(label: number | null): void {
    if (label === this.lit) return;
    this.lit = label;
    this.draw();
  }

  /** Draws what the picture of the canvas is to show. */
  drawPlain(): void {
    this.lit = null;
    this.paintNow();
  }

  /** Starts to measure distances or areas; with null this ends. */
  measure(what: Measured | null): void {
    this.measuring = what;
    this.marks.endMeasure();
    if (what) this.marks.measured = what;
    this.draw();
  }

  /** Takes back the last corner of what is measured. */
  undoCorner(): void {
    this.marks.undo();
    this.draw();
  }

  /** Goes to a viewpoint of a place. If the section cuts the place away, the section is lifted. */
  visit(at: Rgb, size: number, flying: boolean): void {
    const patch = this.patchAt(at);
    this.reveal(at, patch?.labels[0] ?? "");
    drop(this.marked);
    const border = patch && this.borderOf(patch);
    if (border) this.marked.add(borderLines(border));
    this.marks.pinAt(border ? null : at, "");
    const to = { at, from: this.vantage(at, patch ? sizeOf(patch) : size) };
    if (flying) this.eye.fly(to);
    else this.eye.set(to);
    this.changed();
  }

  /** Shows the storey of a place on an instance; all of the area, if this is not enough to see it. */
  private reveal(at: Rgb, label: string): void {
    const shows = ({ low, high }: Slab): boolean => at[2] >= low && at[2] <= high - SLACK;
    if (shows(slabIn(this.look))) return;
    const slab = this.slabOf(this.storeys.of(at[2], roomOf(label)));
    this.cutTo(shows(slab) ? slab : WHOLE);
  }

  /** The disputed patch with this centre. */
  private patchAt(at: Rgb): Patch | null {
    const patches = this.index.votes.find(({ area }) => area === this.mesh.area)?.votes.disputed_patches;
    const off = ({ center }: Patch): number => Math.hypot(...center.map((c, k) => c - (at[k] ?? 0)));
    return patches?.find((patch) => off(patch) < SAME) ?? null;
  }

  /** The border of a patch's faces; null if none of them is shown. */
  private borderOf({ labels, bbox, center }: Patch): number[] | null {
    const { votes } = this;
    const [first, second] = labels.map((name) => this.index.labels.findIndex((l) => l.name === name));
    if (!votes || !bbox) return null;
    const isDisputed = (face: number): boolean =>
      votes.label[face] === first &&
      votes.runnerUp[face] === second &&
      (votes.margin[face] ?? SURE) <= DISPUTED * SURE;
    const points = this.surface.border(bbox, center, isDisputed);
    return points.length > 0 ? points : null;
  }

  /** The part of the area that shows a storey, or all storeys, below the ceilings. */
  slabOf(storey: number | null): Slab {
    const known = this.slabs.get(storey) ?? this.slabFor(storey);
    if (this.loaded) this.slabs.set(storey, known);
    return known;
  }

  private slabFor(storey: number | null): Slab {
    const { all } = this.storeys;
    const top = all.length - 1;
    if (top > 0) {
      const slab = slabOf(all, storey ?? top, (floor, above) => this.surface.ceiling(floor, above));
      return { low: storey === null ? -Infinity : slab.low, high: rounded(slab.high) };
    }
    const floor = this.surface.floor();
    const high = floor === null ? null : this.surface.ceiling(floor, Infinity);
    return { low: -Infinity, high: rounded(high ?? Infinity) };
  }

  private cutTo({ low, high }: Slab): void {
    this.look.base = low;
    this.look.section = high;
  }

  /** A viewpoint from above that sees all of what is shown. */
  fromAbove(): Stand {
    return this.eye.overview(this.surface.sample(slabIn(this.look)), this.options.turns);
  }

  /** Goes to the instance that the address names, and shows its box. */
  private findInstance(): boolean {
    const { look, votes, index } = this;
    const label = index.labels.findIndex(({ name }) => name === look.instance);
    if (label <= 0 || !votes) return false;
    const faces: number[] = [];
    votes.label.forEach((of, face) => of === label && faces.push(face));
    const boxes = this.boxes.filter((box) => box.label === label);
    const found = this.visitFaces(faces, false);
    if (found) {
      this.marked.add(boxLines(index, boxes, null));
      this.marks.pinAt(null, "");
    }
    return found;
  }

  /** Shows a storey, or all of them, from above. */
  showStorey(storey: number | null): void {
    this.openStorey(storey);
    this.eye.touched = false;
    this.eye.fly(this.fromAbove());
    this.changed();
  }

  /** Flies to where all of what is shown is seen. */
  lookFromAbove(): void {
    this.eye.fly(this.fromAbove());
  }

  /** Cuts the area to a storey, or to all of them. */
  openStorey(storey: number | null): void {
    this.storey = storey;
    this.cutTo(this.slabOf(storey));
  }

  /** Goes to the middle of some faces. Stays if none of them is shown. */
  visitFaces(faces: number[], flying: boolean): boolean {
    const place = this.surface.placeOf(new Set(faces));
    if (place) this.visit(place.at, Math.sqrt(place.m2), flying);
    return place !== null;
  }

  /** Goes to the changed faces that the address names. */
  private findChange(): boolean {
    const { changes, look, options } = this;
    if (!look.find || !changes || !options.against) return false;
    const group = groupOf(options.against, changes, look.find.was, look.find.is);
    return group !== undefined && this.visitFaces(group.faces, false);
  }

  close(): void {
    this.closed = true;
    this.resized.disconnect();
    this.eye.close();
    drop(this.lines);
    drop(this.marked);
    this.surface.close();
    this.paint.close();
    const context = this.renderer.getContext();
    this.renderer.dispose();
    context.getExtension("WEBGL_lose_context")?.loseContext();
  }

  /**
   * What is shown by default: the storey of the target, or else the one with the most rooms, just below the
   * ceilings; all of the area, if the viewpoint is below them, or the target above.
   */
  private firstSlab(): Slab {
    const { at, from } = this.look;
    const slab = this.slabOf(at ? this.storeys.of(at[2]) : fullest(this.storeys.all));
    if ((from && from[2] < slab.high) || (at && at[2] > slab.high - SLACK)) return WHOLE;
    return slab;
  }

  private start(): void {
    this.resize();
    const { at, from, place } = this.look;
    if (this.options.storey !== undefined) this.openStorey(this.options.storey);
    else if (this.look.section === null) this.cutTo(this.firstSlab());
    if (at && from) {
      this.eye.set({ at, from });
      this.eye.touched = true;
    } else if (at) this.visit(at, 0.5, false);
    else if (!this.findChange() && !this.findInstance()) {
      this.eye.set(this.fromAbove());
      if (this.options.turns && !window.matchMedia("(prefers-reduced-motion: reduce)").matches)
        this.eye.turn();
    }
    if (at && from && place) this.marks.pinAt(at, "");
  }

  /** A viewpoint with a free view of a place. */
  private vantage(at: Rgb, size: number): Rgb {
    const stands = this.index.locations.flatMap(({ area, position }) =>
      area === this.mesh.area && position ? [position] : [],
    );
    const { surface, look, mesh } = this;
    const place = { at, size, slack: mesh.cell_m ?? 0 };
    return vantage(surface, slabIn(look), place, stands, this.eye.stand);
  }

  private listen(): void {
    const { canvas } = this;
    let down: { x: number; y: number } | null = null;
    canvas.addEventListener("pointerdown", (event) => {
      down = event.isPrimary && event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
      this.read(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons === 0) this.read(event);
    });
    canvas.addEventListener("pointerup", (event) => {
      const still = down && Math.hypot(event.clientX - down.x, event.clientY - down.y) < STILL;
      down = null;
      if (still) this.click(this.read(event));
    });
    // Before the zoom, so that it goes to the point under the pointer.
    const aim = (event: WheelEvent): void => {
      const hit = this.read(event);
      if (hit) this.eye.reach(this.eye.depth(hit.point));
    };
    canvas.addEventListener("wheel", aim, { capture: true, passive: true });
    canvas.addEventListener("webglcontextrestored", () => this.draw());
    canvas.addEventListener("dblclick", (event) => {
      const hit = this.read(event);
      if (!hit || this.measuring) return;
      const { from } = this.eye.stand;
      const back = from.map((c, axis) => c + 0.5 * ((hit.point[axis] ?? 0) - c)) as Rgb;
      this.eye.touched = true;
      this.eye.fly({ at: hit.point, from: back });
    });
    canvas.addEventListener("keydown", (event) => {
      if (actOf("space", event) === "take") this.click(this.readAt(0.5, 0.5));
    });
    for (const event of ["pointerleave", "blur"]) canvas.addEventListener(event, () => this.light(null));
    canvas.addEventListener("keyup", () => this.readAt(0.5, 0.5));
    canvas.addEventListener("focus", () => {
      if (canvas.matches(":focus-visible")) this.readAt(0.5, 0.5);
    });
  }

  private click(hit: Hit | null): void {
    if (!hit || !this.measuring) return;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [x, y, w] = this.eye.screen(hit.point, width, height);
    this.marks.measure(hit.point, [x / w, y / w]);
    this.draw();
  }

  private read(event: PointerEvent | MouseEvent): Hit | null {
    const box = this.canvas.getBoundingClientRect();
    return this.readAt((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
  }

  /** Shows the values at a point of the canvas, which is given in shares of its size. */
  private readAt(u: number, v: number): Hit | null {
    if (!this.loaded) return null;
    const hit = this.surface.pick(this.eye.camera.position, this.eye.ray(u, v), slabIn(this.look));
    this.readout.replaceChildren();
    const label = hit && (this.votes?.label[hit.face] ?? null);
    // Where changes are shown, their colours count.
    this.light(this.look.show === "changed" ? null : label || null);
    if (!hit) return null;
    const spot = { label, face: hit.face, distance: hit.distance, point: hit.point };
    const told = tell(this.index, spot, { room: "", hasDepth: true }, this.votes);
    const labels = this.changes?.labelsOf(hit.face);
    const hidden = labels ? ["class", "instance"] : [];
    // Only a label says which room it is.
    if (!label) hidden.push("room");
    append(this.readout, labels && this.options.against ? tellBoth(this.options.against, ...labels) : []);
    append(
      this.readout,
      told.filter((entry) => !hidden.includes(entry.dataset["is"] ?? "")),
    );
    return hit;
  }

  private fillLines(): void {
    if (!this.loaded) return;
    const { index, mesh, look, boxes } = this;
    drop(this.lines);
    if (look.marks.has("rooms")) {
      const rooms = index.rooms.filter((room) => room.area === mesh.area);
      this.lines.add(roomLines(rooms.map((room) => ({ room, floor: floorOf(index, mesh, boxes, room) }))));
    }
    if (look.boxes !== null) this.lines.add(boxLines(index, boxes, look.boxes === "all" ? null : look.boxes));
    for (const mark of ["kept", "dropped"] as const satisfies Mark[])
      if (look.marks.has(mark)) this.lines.add(frustums(index, mesh.area, mark === "kept"));
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.renderer.setSize(width, height, false);
    this.eye.resize(width, height, this.options.covered?.());
    if (!this.loaded) this.sketch();
    this.paintNow();
  }

  /** Flies to a scan location, and opens its panorama. The flight ends in the direction that it shows. */
  private enter(location: Location, href: string): void {
    const open = (): void => {
      window.location.hash = href;
    };
    const { position: from, azimuth_rad: middle, look_deg: look } = location;
    if (!from) return open();
    const { at: nowAt, from: nowFrom } = this.eye.stand;
    const straight = Math.atan2(nowAt[1] - nowFrom[1], nowAt[0] - nowFrom[0]);
    const azimuth = middle === null ? straight : middle - ((look ?? 0) * Math.PI) / 180;
    const at: Rgb = [from[0] + Math.cos(azimuth), from[1] + Math.sin(azimuth), from[2]];
    this.eye.fly({ at, from }, open);
  }

  private changed(): void {
    if (this.loaded && this.canvas.isConnected && !this.eye.isLeaving) this.options.changed();
    this.draw();
  }

  private draw(): void {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.paintNow();
    });
  }

  private paintNow(): void {
    if (this.closed || !(this.loaded || this.sketched)) return;
    const { show, beyond, base } = this.look;
    const section = this.look.section ?? (this.sketched ? this.top : null);
    this.paint.set(this.look, this.look.line * this.canvas.width, slabIn(this.look), this.lit);
    this.cut.constant = Math.min(SKY, section ?? SKY);
    this.bottom.constant = Math.min(SKY, -base);
    const flat: (Show | null)[] = ["class", "instance", "unlabelled", "normal", null];
    const isFlat = flat.includes(show) && flat.includes(beyond) && this.look.only === null;
    this.surface.useMaterials(!isFlat);
    this.renderer.render(this.scene, this.eye.camera);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.labels.place(this.eye, this.surface, this.look, width, height);
    this.marks.draw((point) => this.eye.screen(point, width, height), width, height);
  }

  get stand(): Stand {
    return this.eye.stand;
  }
}
