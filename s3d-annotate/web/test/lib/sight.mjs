// What the page's camera sees of a scene from a viewpoint, reckoned as the page does.

import {
  BufferAttribute,
  BufferGeometry,
  FrontSide,
  PerspectiveCamera,
  Ray,
  Vector3,
} from "../../../../s3d-report/web/node_modules/three/build/three.module.js";
import { MeshBVH } from "../../../../s3d-report/web/node_modules/three-mesh-bvh/build/index.module.js";

/** The page's vertical angle of view, degrees. */
const FOV = 50;

export class Sight {
  /** `window` has the size of the page, and how much its panels cover at each side, pixels. */
  constructor({ positions, index }, window) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setIndex(new BufferAttribute(index, 1));
    this.bvh = new MeshBVH(geometry, { indirect: true });
    this.window = window;
    const { width, height, left, right, top, bottom } = window;
    this.camera = new PerspectiveCamera(FOV, width / height, 0.02, 100);
    this.camera.up.set(0, 0, 1);
    this.camera.setViewOffset(width, height, (right - left) / 2, (bottom - top) / 2, width, height);
    this.ray = new Ray();
  }

  /** Looks from one place at another. */
  look({ at, from }) {
    this.camera.position.set(...from);
    this.camera.lookAt(...at);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  /** The pixel at a place, if nothing of the page lies over it; null without one. */
  pixel(place) {
    const { width, height, left, right, top, bottom } = this.window;
    const point = new Vector3(...place).applyMatrix4(this.camera.matrixWorldInverse);
    if (point.z > -this.camera.near) return null;
    point.applyMatrix4(this.camera.projectionMatrix);
    const [x, y] = [((point.x + 1) / 2) * width, ((1 - point.y) / 2) * height].map(Math.round);
    return x > left + 12 && x < width - right - 12 && y > top + 12 && y < height - bottom - 12
      ? [x, y]
      : null;
  }

  /** The first face in front of a pixel; null without one. */
  face([x, y]) {
    const { width, height } = this.window;
    const { position } = this.camera;
    const to = new Vector3((2 * x) / width - 1, 1 - (2 * y) / height, 0.5).unproject(this.camera);
    this.ray.set(position, to.sub(position).normalize());
    return this.bvh.raycastFirst(this.ray, FrontSide)?.faceIndex ?? null;
  }
}
