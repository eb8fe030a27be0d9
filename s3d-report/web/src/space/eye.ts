// The viewpoint in 3D: orbit, keys, and flights.

import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Mesh, Rgb } from "../data.js";
import type { Projected } from "../marks.js";

/** The vertical angle of view, degrees. */
export const FOV = 50;
/** The duration of a flight, ms. */
const FLIGHT = 700;
const NEAREST = 0.05;

export interface Stand {
  at: Rgb;
  from: Rgb;
}

export const rgb = ({ x, y, z }: Vector3): Rgb => [x, y, z];

export class Eye {
  readonly camera = new PerspectiveCamera(FOV, 1, 0.1, 1000);
  private readonly controls: OrbitControls;
  private readonly size: number;
  private flight = 0;

  /** `moved` is called whenever the viewpoint changes. */
  constructor(
    canvas: HTMLCanvasElement,
    mesh: Mesh,
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
    this.controls.addEventListener("start", () => this.land());
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  get stand(): Stand {
    return { at: rgb(this.controls.target), from: rgb(this.camera.position) };
  }

  resize(width: number, height: number): void {
    this.camera.aspect = width / height;
    this.update();
  }

  /** Moves to a viewpoint at once. */
  set({ at, from }: Stand): void {
    this.land();
    this.put(new Vector3(...at), new Vector3(...from));
  }

  /** Flies to a viewpoint; moves at once for users who want no motion. */
  fly(to: Stand): void {
    this.land();
    if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
      this.set(to);
      return;
    }
    const [at, from] = [this.controls.target.clone(), this.camera.position.clone()];
    const [toAt, toFrom] = [new Vector3(...to.at), new Vector3(...to.from)];
    const start = performance.now();
    const step = (now: number): void => {
      const t = Math.min(1, Math.max(0, now - start) / FLIGHT);
      if (t === 1) {
        this.set(to);
        return;
      }
      const share = t * t * (3 - 2 * t);
      this.put(at.clone().lerp(toAt, share), from.clone().lerp(toFrom, share));
      this.flight = requestAnimationFrame(step);
    };
    this.flight = requestAnimationFrame(step);
  }

  /** A viewpoint obliquely from above that sees all of the points. */
  overview(points: Rgb[]): Stand {
    const back = new Vector3(0.3, -0.62, 0.9).normalize();
    const right = new Vector3(0, 0, 1).cross(back).normalize();
    const up = back.clone().cross(right);
    const tan = Math.tan((FOV * Math.PI) / 360);
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
        const room = z * tan * (i === 0 ? this.camera.aspect : 1);
        most[i] = Math.max(most[i] ?? 0, p.dot(axis) + room);
        least[i] = Math.max(least[i] ?? 0, room - p.dot(axis));
      });
    }
    if (near < far) return this.stand;
    const away = Math.max(
      (most[0] + least[0]) / (2 * tan * this.camera.aspect),
      (most[1] + least[1]) / (2 * tan),
    );
    const middle = right
      .multiplyScalar((most[0] - least[0]) / 2)
      .addScaledVector(up, (most[1] - least[1]) / 2);
    const at = middle.addScaledVector(back, (near + far) / 2);
    const from = at.clone().addScaledVector(back, Math.max(1, 1.18 * (away - (near + far) / 2)));
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
    return [f * x - (width / 2) * z, -f * y - (height / 2) * z, -z];
  }

  close(): void {
    this.land();
    this.controls.dispose();
  }

  private land(): void {
    cancelAnimationFrame(this.flight);
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
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const turns: Record<string, [number, number]> = {
      ArrowLeft: [-1, 0],
      ArrowRight: [1, 0],
      ArrowUp: [0, 1],
      ArrowDown: [0, -1],
    };
    const zooms: Record<string, number> = { "+": 1 / 1.2, "=": 1 / 1.2, "-": 1.2 };
    const [turn, zoom] = [turns[event.key], zooms[event.key]];
    if (!turn && !zoom) return;
    event.preventDefault();
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
