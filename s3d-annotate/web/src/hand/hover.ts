// What lies under the pointer: a face, and the patch around it at the level of the tree in use.

import type { Hit } from "../../../../s3d-report/web/src/space/surface.js";
import type { Patch, Place } from "../scene.js";
import type { FaceTable } from "../space/table.js";
import type { View } from "../space/view.js";
import type { Work } from "../work.js";

export interface Hovered extends Patch {
  at: Place;
  faces: Uint32Array;
  area: number;
  instance: number;
}

export class Hover {
  now: Hovered | null = null;
  /** The dearest join in a patch. */
  private cost = 0;
  /** Called when something else lies under the pointer. */
  changed: () => void = () => {};
  x = -1;
  y = -1;
  private pending = false;

  constructor(
    private readonly view: View,
    private readonly work: Work,
    private readonly table: FaceTable,
    private readonly areas: Float32Array,
  ) {}

  /** Moves the pointer; the patch lights up with the next picture. */
  move(x: number, y: number): void {
    [this.x, this.y] = [x, y];
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.refresh();
    });
  }

  /** Looks again, at once. */
  refresh(): void {
    this.set(this.x < 0 ? null : this.view.pick(this.x, this.y));
  }

  clear(): void {
    [this.x, this.y] = [-1, -1];
    this.set(null);
  }

  /** The patch at a face. */
  patchAt(face: number): Patch {
    return { face, node: this.work.tree.nodeAt(face, this.cost) };
  }

  private set(hit: Hit | null): void {
    const { work, now } = this;
    if (!hit) {
      if (now) this.put(null);
      return;
    }
    const instance = work.at(hit.face);
    // A node that was chosen here stays, also if joins above it cost the same.
    const stays = now !== null && work.tree.holds(now.node, hit.face);
    const node = stays ? now.node : work.tree.nodeAt(hit.face, this.cost);
    if (stays && now.instance === instance && work.at(now.face) === instance) {
      now.face = hit.face;
      now.at = hit.point;
      this.changed();
      return;
    }
    this.put({ face: hit.face, node, at: hit.point });
  }

  private put(patch: (Patch & { at: Place }) | null): void {
    const { work, areas } = this;
    if (patch) {
      const faces = work.patch(patch);
      const area = faces.reduce((sum, face) => sum + (areas[face] ?? 0), 0);
      this.now = { ...patch, faces, area, instance: work.at(patch.face) };
    } else this.now = null;
    this.light();
    this.changed();
  }

  /** Lights up the patch. */
  light(): void {
    this.table.light("hovered", this.now?.faces ?? null);
    this.view.draw();
  }

  /** The labels are others now: the patch may be, too. */
  renew(): void {
    const { now } = this;
    if (now) this.put({ face: now.face, node: now.node, at: now.at });
  }

  /** Goes up or down the tree. */
  step(up: boolean): void {
    const { now, work } = this;
    if (!now) {
      if (!up) this.cost = 0;
      return;
    }
    // Steps that change nothing under the pointer are passed over.
    let node = now.node;
    for (;;) {
      const next = up ? work.tree.parent(node) : work.tree.childAt(node, now.face);
      if (next === null || next === node) break;
      node = next;
      if (work.patch({ node, face: now.face }).length !== now.faces.length) break;
    }
    if (node === now.node) return;
    this.cost = work.tree.cost(node);
    this.put({ face: now.face, node, at: now.at });
  }

  /** The number of joins in the patch, for words. */
  get level(): number {
    return this.now ? this.work.tree.steps(this.now.node, this.now.face) : 0;
  }
}
