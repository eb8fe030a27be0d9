// The labels: what the server has on disk, and the gestures on their way to it.

import { facesOf } from "./mesh/runs.js";
import type { Tree } from "./mesh/tree.js";
import type { FaceRuns, Gesture, Instance, Patch, State } from "./scene.js";
import { Gone, Refused, Stale, post, readBytes, readJson } from "./server.js";

interface Change {
  state: State;
  changed: [number, FaceRuns][];
}

/** Whether all gestures are on disk: `saved`, still on their way, or the server is gone. */
export type Saved = "saved" | "saving" | "gone";

/** The time between questions to a server that is gone, ms. */
const PATIENCE = 2000;

/** Scenes without planned views have no pixels to wait for. */
const PIXEL_TRIES = 60;

/** A state without the instances that have no faces any more. */
const present = (state: State): State => ({
  ...state,
  instances: state.instances.filter(({ faces }) => faces > 0),
});

export class Work {
  private waiting: Promise<unknown> = Promise.resolve();
  private open = 0;
  saved: Saved = "saved";
  state: State;
  /** The instance that gestures add to. */
  last: number | null = null;
  private readonly byNumber = new Map<number, Instance>();
  /** Faces have other instances now. */
  painted: (faces: Iterable<number>) => void = () => {};
  /** The state is another. */
  changed: () => void = () => {};
  /** Something is to be said to the user. */
  said: (words: string, isFault: boolean) => void = () => {};

  private constructor(
    readonly tree: Tree,
    /** The instance of each face, 0 without one. */
    readonly instances: Uint32Array,
    state: State,
  ) {
    this.state = present(state);
    this.number();
  }

  static async read(tree: Tree): Promise<Work> {
    const [state, labels] = await Promise.all([
      readJson<State>("state.json"),
      readBytes("labels.bin", 4 * tree.segment.length),
    ]);
    return new Work(tree, new Uint32Array(labels), state);
  }

  private number(): void {
    this.byNumber.clear();
    for (const instance of this.state.instances) this.byNumber.set(instance.number, instance);
    if (this.last !== null && !this.byNumber.has(this.last)) this.last = null;
  }

  instance(number: number): Instance | undefined {
    return this.byNumber.get(number);
  }

  /** The instance of a face, 0 without one. */
  at(face: number): number {
    return this.instances[face] ?? 0;
  }

  /** The faces of an instance. */
  facesOf(number: number): Uint32Array {
    const faces: number[] = [];
    for (let face = 0; face < this.instances.length; face++)
      if (this.instances[face] === number) faces.push(face);
    return Uint32Array.from(faces);
  }

  patch({ node, face }: Patch): Uint32Array {
    return this.tree.patch(node, face, this.instances);
  }

  /** Sends a gesture after all before it. Returns whether it is on disk. */
  perform(gesture: Gesture): Promise<boolean> {
    this.open += 1;
    this.mark();
    const done = this.waiting.then(() => this.send(gesture));
    this.waiting = done;
    return done.finally(() => {
      this.open -= 1;
      this.mark();
    });
  }

  private mark(): void {
    if (this.saved !== "gone") this.saved = this.open > 0 ? "saving" : "saved";
    this.changed();
  }

  private async send(gesture: Gesture): Promise<boolean> {
    for (;;) {
      const { revision } = this.state;
      try {
        const change = await post<Change>("gesture", { revision, gesture });
        this.take(change);
        return true;
      } catch (e) {
        if (e instanceof Gone) {
          await this.back();
          // The gesture may have arrived before the server went.
          if (this.state.revision === revision) continue;
          return true;
        }
        if (e instanceof Stale) {
          await this.reload().catch(() => this.back());
          this.said("Another window changed the labels. They are shown as they are now.", true);
        } else this.said(e instanceof Refused || e instanceof Error ? e.message : String(e), true);
        return false;
      }
    }
  }

  private take({ state, changed }: Change): void {
    const before = new Set(this.byNumber.keys());
    this.state = present(state);
    this.number();
    const born = this.state.instances.filter(({ number }) => !before.has(number));
    if (born.length > 0) this.last = born.at(-1)?.number ?? this.last;
    for (const [instance, runs] of changed) {
      const faces = facesOf(runs);
      for (const face of faces) this.instances[face] = instance;
      this.painted(faces);
    }
    this.changed();
  }

  /** Takes the labels as the server has them. */
  async reload(): Promise<void> {
    const [state, labels] = await Promise.all([
      readJson<State>("state.json"),
      readBytes("labels.bin", 4 * this.instances.length),
    ]);
    this.instances.set(new Uint32Array(labels));
    this.state = present(state);
    this.number();
    this.painted(this.instances.keys());
    this.changed();
  }

  /** Asks for the state until the server has counted the pixels of the planned views. */
  async awaitPixels(): Promise<void> {
    for (let k = 0; k < PIXEL_TRIES && this.state.total_pixels === 0; k++) {
      await new Promise((done) => window.setTimeout(done, PATIENCE + 200 * k));
      if (this.open > 0) continue;
      const state = await readJson<State>("state.json").catch(() => null);
      if (state?.revision !== this.state.revision || this.open > 0) continue;
      this.state = present(state);
      this.changed();
    }
  }

  /** Waits until the server answers again. */
  private async back(): Promise<void> {
    this.saved = "gone";
    this.changed();
    for (;;) {
      await new Promise((done) => window.setTimeout(done, PATIENCE));
      try {
        await this.reload();
        break;
      } catch {
        // It is still gone.
      }
    }
    this.saved = "saving";
    this.said("The server is back.", false);
    this.changed();
  }
}
