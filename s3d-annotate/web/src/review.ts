// What is to be looked at: doubts with their guesses, and patches like the last object.

import type { Desk } from "./desk.js";
import { words } from "./look.js";
import type { Doubt, Patch } from "./scene.js";
import { readJson } from "./server.js";

export class Review {
  private doubt: Doubt | null = null;
  private readonly skipped: number[] = [];
  private similar: { patches: Patch[]; class: string } | null = null;
  /** Called with words for the doubt, and whether its guess can be accepted. */
  told: (words: string, canAccept: boolean) => void = () => {};

  constructor(private readonly desk: Desk) {}

  /** Goes to the next doubt; the one that is shown is skipped. */
  async next(): Promise<void> {
    const { desk, doubt } = this;
    const { tree } = desk.work;
    if (doubt) this.skipped.push(tree.segment[doubt.face] ?? 0);
    try {
      const found = await readJson<{ doubt: Doubt | null }>(`doubt.json?not=${this.skipped.join()}`);
      this.put(found.doubt);
      if (!found.doubt)
        this.told(
          this.skipped.length > 0 ? "No more doubts: the rest was skipped." : "No doubts are left.",
          false,
        );
      if (!found.doubt) this.skipped.length = 0;
    } catch (e) {
      desk.say(e instanceof Error ? e.message : String(e), true);
    }
  }

  private put(doubt: Doubt | null): void {
    const { desk } = this;
    this.doubt = doubt;
    desk.table.light("doubt", doubt && desk.work.patch(doubt));
    desk.view.draw();
    if (!doubt) {
      this.told("", false);
      return;
    }
    const { guess } = doubt;
    const rest = `${doubt.area_m2.toFixed(2)} m².`;
    this.told(
      guess
        ? `Perhaps ${words(guess.class)}, like ${words(guess.like)}. ${rest} Enter: yes. Tab: next.`
        : `What is this? ${rest} Label it, or Tab: next.`,
      guess !== null,
    );
    desk.view.fly({ at: desk.where.near(doubt.at), from: desk.where.near(doubt.from) });
  }

  /** The labels are others now. */
  renew(): void {
    if (this.doubt && this.desk.work.at(this.doubt.face) > 0) this.put(null);
  }

  /** Lights up patches like an object. */
  async alike(instance: number): Promise<void> {
    const { desk } = this;
    const like = desk.work.instance(instance);
    if (!like) return;
    try {
      const { patches } = await readJson<{ patches: Patch[] }>(`similar.json?instance=${instance}`);
      if (patches.length === 0) {
        desk.say(`Nothing without a label looks like ${words(like.name ?? like.class)}.`);
        return;
      }
      this.similar = { patches, class: like.class };
      const faces = patches.flatMap((patch) => [...desk.work.patch(patch)]);
      desk.table.light("similar", Uint32Array.from(faces));
      desk.view.draw();
      desk.say(
        `${patches.length} like ${words(like.name ?? like.class)}. Enter takes them all, Escape none.`,
      );
    } catch (e) {
      desk.say(e instanceof Error ? e.message : String(e), true);
    }
  }

  /** Accepts what is asked: similar patches, or the guess of a doubt. Returns whether something was. */
  async accept(): Promise<boolean> {
    const { desk, similar, doubt } = this;
    if (similar) {
      this.leave();
      for (const patch of similar.patches)
        if (!(await desk.perform({ label: { what: { patches: [patch] }, class: similar.class } }))) break;
      return true;
    }
    if (!doubt?.guess) return false;
    const { face, node, guess } = doubt;
    this.put(null);
    if (await desk.perform({ label: { what: { patches: [{ face, node }] }, class: guess.class } }))
      await this.next();
    return true;
  }

  /** Leaves what is asked. Returns whether something was. */
  leave(): boolean {
    const had = this.similar !== null || this.doubt !== null;
    if (this.similar) {
      this.desk.table.light("similar", null);
      this.desk.say("");
    } else this.put(null);
    this.similar = null;
    this.desk.view.draw();
    return had;
  }
}
