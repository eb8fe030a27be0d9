// The faces that a cut would take, lit before it is made.

import type { Desk } from "../desk.js";
import { facesOf } from "../mesh/runs.js";
import type { FaceRuns, Knife, Patch } from "../scene.js";
import { post } from "../server.js";

export interface Cut {
  at: Patch;
  by: Knife;
}

export class Preview {
  private next: Cut | null = null;
  private asked = "";
  private busy = false;

  constructor(private readonly desk: Desk) {}

  /** Lights up what a cut would take; null: nothing. While the server is asked, the latest cut waits. */
  show(cut: Cut | null): void {
    if (!cut) {
      this.clear();
      return;
    }
    const words = JSON.stringify([this.desk.work.state.revision, cut]);
    if (words === this.asked) return;
    this.asked = words;
    this.next = cut;
    if (!this.busy) void this.ask();
  }

  clear(): void {
    this.next = null;
    this.asked = "";
    this.light(null);
  }

  private async ask(): Promise<void> {
    this.busy = true;
    while (this.next) {
      const { next, asked } = this;
      this.next = null;
      // A cut that does not fit has no preview; the server says why when it is made.
      const found = await post<{ faces: FaceRuns }>("cut", next).catch(() => null);
      if (this.asked === asked) this.light(found && facesOf(found.faces));
    }
    this.busy = false;
  }

  private light(faces: Uint32Array | null): void {
    this.desk.table.light("taken", faces);
    this.desk.view.draw();
  }
}
