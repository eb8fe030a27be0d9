// The viewpoint in 3D: orbit, keys, and flights.

import { type MOUSE, PerspectiveCamera, type TOUCH, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Mesh, Rgb } from "../data.js";
import { type ActOf, actOf } from "../keys.js";
import type { Projected } from "../picture/marks.js";

/** The vertical angle of view, degrees. */
export const FOV = 50;
/** The duration of a flight, ms. */
const FLIGHT = 600;
const NEAREST = 0.05;
/** The duration of a slow turn, ms. */
const TURN = 100_000;

/** Lengths at the sides of a rectangle. */
export type Sides = Record<"left" | "right" | "top" | "bottom", number>;
const NO_SIDES: Sides = { left: 0, right: 0, top: 0, bottom: 0 };

export interface Stand {
  at: Rgb;
  from: Rgb;
}

export const rgb = ({ x, y, z }: Vector3): Rgb => [x, y, z];

/** The upper and the lower rim of a cylinder around some points. */
function ringOf(points: Rgb[]): Rgb[] {
  const ends = [0, 1, 2].map((axis) => {
    // The few outermost points are left out: scans have strays.
    const sorted = points.map((point) => point[axis] ?? 0).sort((a, b) => a - b);
    const few = Math.floor(sorted.length / 200);
    return [sorted[few] ?? 0, sorted.at(-1 - few) ?? 0] as const;
  });
  const [[x0, x1], [y0, y1], [z0, z1]] = ends as [Range, Range, Range];
  const radius = (0.86 * Math.hypot(x1 - x0, y1 - y0)) / 2;
  return Array.from({ length: 48 }, (_, k) => {
    const angle = (2 * Math.PI * k) / 24;
    const [x, y] = [radius * Math.cos(angle), radius * Math.sin(angle)];
    return [(x0 + x1) / 2 + x, (y0 + y1) / 2 + y, k < 24 ? z0 : z1];
  });
}

type Range = readonly [number, number];

export class Eye {
  readonly camera = new PerspectiveCamera(FOV, 1, 0.1, 1000);
  private readonly controls: OrbitControls;
  private readonly size: number;
  private flight = 0;
  /** What follows the flight, if it is not ended before. */
  private landed: (() => void) | null = null;
  private isTurning = false;
  /** Whether the user has chosen the viewpoint. */
  touched = false;
  /** Called when a slow turn begins or ends. */
  turned: (on: boolean) => void = () => {};
  /** The part that nothing lies over: shares of the canvas, and how far it is off the middle. */
  private free = { width: 1, height: 1, right: 0, down: 0 };

  /** `moved` is called whenever the viewpoint changes. */
  constructor(
    canvas: HTMLCanvasElement,
    mesh: Pick<Mesh, "min" | "max">,
    private readonly moved: () => void,
  ) {
    this.size = Math.max(1, Math.hypot(...mesh.max.map((c, axis) => c - (mesh.min[axis] ?? 0))));
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.minDistance = NEAREST;
    this.controls.maxDistance = 6 * this.size;
    this.controls.addEventListener("change", () => this.update());
    this.controls.addEventListener("start", () => {
      this.touched = true;
      this.land();
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** What dragging does with each button and with fingers; null leaves it to others. */
  hands(
    buttons: Record<"left" | "middle" | "right", MOUSE | null>,
    fingers: Record<"one" | "two", TOUCH | null>,
  ): void {
    const { left: LEFT, middle: MIDDLE, right: RIGHT } = buttons;
    this.controls.mouseButtons = { LEFT, MIDDLE, RIGHT };
    const touches: { ONE?: TOUCH | null; TWO?: TOUCH | null } = this.controls.touches;
    [touches.ONE, touches.TWO] = [fingers.one, fingers.two];
  }

  /** Whether the pointer, the wheel and fingers move the viewpoint. */
  set isFree(on: boolean) {
    this.controls.enabled = on;
  }

  get stand(): Stand {
    return { at: rgb(this.controls.target), from: rgb(this.camera.position) };
  }

  /** `covered` has the pixels at each side of the canvas that something lies over. */
  resize(width: number, height: number, covered: Sides = NO_SIDES): void {
    const { left, right, top, bottom } = covered;
    this.camera.aspect = width / height;
    this.free = {
      width: Math.max(0.2, 1 - (left + right) / width),
      height: Math.max(0.2, 1 - (top + bottom) / height),
      right: (left - right) / 2 / width,
      down: (top - bottom) / 2 / height,
    };
    const off = [-this.free.right * width, -this.free.down * height] as const;
    this.camera.setViewOffset(width, height, ...off, width, height);
    this.update();
  }

  /** Moves to a viewpoint at once. */
  set({ at, from }: Stand): void {
    this.land();
    this.put(new Vector3(...at), new Vector3(...from));
  }

  /** Whether a flight leads away from here. */
  get isLeaving(): boolean {
    return this.landed !== null;
  }

  /**
   * Flies to a viewpoint; moves at once for users who want no motion. `landed` is called there, unless the
   * user or another flight ends this one before.
   */
  fly(to: Stand, landed: (() => void) | null = null): void {
    this.land();
    if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
      if (!landed) this.set(to);
      landed?.();
      return;
    }
    this.landed = landed;
    const [at, from] = [this.controls.target.clone(), this.camera.position.clone()];
    const [toAt, toFrom] = [new Vector3(...to.at), new Vector3(...to.from)];
    const start = performance.now();
    const step = (now: number): void => {
      const t = Math.min(1, Math.max(0, now - start) / FLIGHT);
      if (t === 1) {
        // The viewpoint that is left is not told as one that the user chose.
        if (landed) this.put(toAt, toFrom);
        else this.set(to);
        landed?.();
        return;
      }
      const share = t * t * (3 - 2 * t);
      this.put(at.clone().lerp(toAt, share), from.clone().lerp(toFrom, share));
      this.flight = requestAnimationFrame(step);
    };
    this.flight = requestAnimationFrame(step);
  }

  /** Turns slowly about the middle until the next touch, key or flight. */
  turn(): void {
    this.land();
    this.isTurning = true;
    this.turned(true);
    let last = performance.now();
    const step = (now: number): void => {
      const passed = Math.min(100, now - last);
      // Half of the frames are enough for a slow turn.
      if (passed > 25) {
        last = now;
        const { target } = this.controls;
        const back = this.camera.position.clone().sub(target);
        const angle = (-2 * Math.PI * passed) / TURN;
        this.put(target.clone(), target.clone().add(back.applyAxisAngle(this.camera.up, angle)));
      }
      this.flight = requestAnimationFrame(step);
    };
    this.flight = requestAnimationFrame(step);
  }

  /** A viewpoint obliquely from above that sees all of the points, also if they are turned `around`. */
  overview(points: Rgb[], around = false): Stand {
    const back = new Vector3(0.3, -0.62, 0.9).normalize();
    if (around) points = [...points, ...ringOf(points)];
    const right = new Vector3(0, 0, 1).cross(back).normalize();
    const up = back.clone().cross(right);
    const half = Math.tan((FOV * Math.PI) / 360);
    const tan = [half * this.camera.aspect * this.free.width, half * this.free.height] as const;
    // By axis of the canvas: a point that is z nearer to the camera needs tan * z more room on both of its
    // sides.
    const [most, least] = [
      [-Infinity, -Infinity],
      [-Infinity, -Infinity],
    ] as [[number, number], [number, number]];
    let [near, far] = [-Infinity, Infinity];
    for (const point of points) {
      const p = new Vector3(...point);
      const z = p.dot(back);
      [near, far] = [Math.max(near, z), Math.min(far, z)];
      [right, up].forEach((axis, i) => {
        const room = z * (tan[i] ?? half);
        most[i] = Math.max(most[i] ?? 0, p.dot(axis) + room);
        least[i] = Math.max(least[i] ?? 0, room - p.dot(axis));
      });
    }
    if (near < far) return this.stand;
    const away = Math.max((most[0] + least[0]) / (2 * tan[0]), (most[1] + least[1]) / (2 * tan[1]));
    const middle = right
      .multiplyScalar((most[0] - least[0]) / 2)
      .addScaledVector(up, (most[1] - least[1]) / 2);
    const at = middle.addScaledVector(back, (near + far) / 2);
    const from = at
      .clone()
      .addScaledVector(back, Math.max(1, (around ? 1.06 : 1.18) * (away - (near + far) / 2)));
    return { at: rgb(at), from: rgb(from) };
  }

  /** The depth of a point in front of the camera. */
  depth(point: Rgb): number {
    return this.screen(point, 1, 1)[2];
  }

  /** Sets the distance of the point to turn and zoom about; the image stays the same. */
  reach(depth: number): void {
    const ahead = this.camera.getWorldDirection(new Vector3());
    this.controls.target.copy(this.camera.position).addScaledVector(ahead, Math.max(NEAREST, depth));
  }

  /** The direction to a point of the canvas, which is given in shares of its size. */
  ray(u: number, v: number): Vector3 {
    return new Vector3(2 * u - 1, 1 - 2 * v, 0.5)
      .unproject(this.camera)
      .sub(this.camera.position)
      .normalize();
  }

  /** A world point on a canvas of this size, as x·w, y·w and w. */
  screen(point: Rgb, width: number, height: number): Projected {
    const { camera } = this;
    const [x, y, z] = rgb(new Vector3(...point).applyMatrix4(camera.matrixWorldInverse));
    const f = height / 2 / Math.tan((FOV * Math.PI) / 360);
    const [right, down] = [0.5 + this.free.right, 0.5 + this.free.down];
    return [f * x - right * width * z, -f * y - down * height * z, -z];
  }

  close(): void {
    this.land();
    this.controls.dispose();
  }

  /** Ends a flight or a turn. */
  land(): void {
    cancelAnimationFrame(this.flight);
    this.landed = null;
    if (this.isTurning) this.turned(false);
    this.isTurning = false;
  }

  private put(at: Vector3, from: Vector3): void {
    this.controls.target.copy(at);
    this.camera.position.copy(from);
    this.controls.update();
    this.update();
  }

  private update(): void {
    const { camera, controls } = this;
    const away = camera.position.distanceTo(controls.target);
    camera.near = Math.min(0.1, Math.max(0.005, away / 50));
    camera.far = away + 2 * this.size + 10;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.moved();
  }

  private key(event: KeyboardEvent): void {
    const turns: Partial<Record<ActOf<"space">, [number, number]>> = {
      left: [-1, 0],
      right: [1, 0],
      up: [0, 1],
      down: [0, -1],
    };
    const zooms: Partial<Record<ActOf<"space">, number>> = { nearer: 1 / 1.2, farther: 1.2 };
    const act = actOf("space", event);
    const [turn, zoom] = act ? [turns[act], zooms[act]] : [];
    if (!turn && !zoom) return;
    event.preventDefault();
    this.touched = true;
    this.land();
    const at = this.controls.target.clone();
    const [x, y, z] = rgb(this.camera.position.clone().sub(at));
    const away = Math.min(6 * this.size, Math.max(NEAREST, Math.hypot(x, y, z) * (zoom ?? 1)));
    const step = Math.PI / 24;
    const azimuth = Math.atan2(y, x) + step * (turn?.[0] ?? 0);
    const limit = Math.PI / 2 - 1e-4;
    const rise = Math.atan2(z, Math.hypot(x, y)) + step * (turn?.[1] ?? 0);
    const height = Math.min(limit, Math.max(-limit, rise));
    const level = away * Math.cos(height);
    const back = new Vector3(level * Math.cos(azimuth), level * Math.sin(azimuth), away * Math.sin(height));
    this.put(at, at.clone().add(back));
  }
}
