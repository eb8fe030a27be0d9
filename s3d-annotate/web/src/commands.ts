// What the keys do.

import type { Desk } from "./desk.js";
import type { Cuts } from "./hand/cuts.js";
import type { Painting } from "./hand/painting.js";
import { type Command, commandOf } from "./keys.js";
import { words } from "./look.js";
import { boxOf } from "./mesh/mesh.js";
import { runsOf } from "./mesh/runs.js";
import type { Classes } from "./panels/classes.js";
import type { Help } from "./panels/help.js";
import type { Plan } from "./panels/plan.js";
import type { Review } from "./review.js";
import { SHOWS, type Show } from "./space/paint.js";

/** What lies this much below the next floor belongs to a storey, metres. */
const BELOW = 0.4;

const SHOWN: Record<Show, string> = {
  both: "Labels over the colours.",
  labels: "Labels alone.",
  left: "What has no label yet.",
  colors: "Colours alone.",
};

export interface Tools {
  classes: Classes;
  cuts: Cuts;
  painting: Painting;
  review: Review;
  plan: Plan;
  help: Help;
}

export class Commands {
  private storey = 0;

  constructor(
    private readonly desk: Desk,
    private readonly tools: Tools,
  ) {
    document.addEventListener("keydown", (event) => this.key(event));
    tools.plan.left = () => this.plan(false);
  }

  private key(event: KeyboardEvent): void {
    const { canvas } = this.desk.view;
    const target = event.target instanceof Element ? event.target : document.body;
    if (this.tools.help.element.open || target.matches("input, select, textarea")) return;
    const isOnScene = target === canvas || target === document.body;
    // Elsewhere, these keys work as everywhere.
    if (!isOnScene && ["Tab", "Enter", " ", "Home", "Delete"].includes(event.key)) return;
    if (event.key === " ") {
      event.preventDefault();
      return;
    }
    const command = commandOf(event);
    if (command) {
      event.preventDefault();
      this.does(command);
      return;
    }
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (this.tools.classes.takeKey(event.key)) event.preventDefault();
  }

  does(command: Command): void {
    const { desk, tools } = this;
    const acts: Record<Command, () => void> = {
      finer: () => void (tools.cuts.size(false) || desk.hover.step(false)),
      coarser: () => void (tools.cuts.size(true) || desk.hover.step(true)),
      doubt: () => void tools.review.next(),
      accept: () => void this.accept(),
      leave: () => this.leave(),
      join: () => this.join(),
      cut: () => tools.cuts.cycle(),
      erase: () => this.erase(),
      class: () => this.changeClass(),
      undo: () => void this.back("undo"),
      redo: () => void this.back("redo"),
      similar: () => this.similar(),
      show: () => this.show(),
      frame: () => this.frame(),
      overview: () => this.overview(),
      photograph: () => this.photograph(),
      plan: () => this.plan(Boolean(tools.plan.element.hidden)),
      storey: () => this.nextStorey(),
      find: () => tools.classes.find(),
      help: () => tools.help.open(),
    };
    acts[command]();
  }

  /** The instance under the pointer; tells the user if there is none. */
  private under(): number | null {
    const instance = this.desk.hover.now?.instance ?? 0;
    if (instance > 0) return instance;
    this.desk.say("There is no object under the pointer.", true);
    return null;
  }

  private async accept(): Promise<void> {
    const { desk, tools } = this;
    if (await tools.review.accept()) return;
    const { now } = desk.hover;
    const place = desk.where.world(now?.at ?? desk.view.from);
    const accepted = desk.proposals.around(now?.face ?? null, place);
    if (accepted) await desk.perform({ accept: accepted });
    else desk.say(desk.proposals.structure ? "Nothing is proposed here." : "Proposals are still being made.");
  }

  async acceptAll(): Promise<void> {
    const all = this.desk.proposals.all();
    if (all.surfaces.length + all.rooms.length > 0) await this.desk.perform({ accept: all });
  }

  private leave(): void {
    const { desk, tools } = this;
    if (tools.painting.isOpen) tools.painting.cancel();
    else if (tools.cuts.way !== null) {
      if (!tools.cuts.reset()) tools.cuts.open(null);
    } else if (!tools.review.leave()) {
      if (desk.view.photograph !== null) desk.view.leave();
      else this.plan(false);
    }
  }

  private join(): void {
    const { work } = this.desk;
    const other = this.under();
    if (other === null) return;
    if (work.last === null || work.last === other) {
      work.last = other;
      this.desk.say(
        `${words(work.instance(other)?.name ?? "this")} is the one to join to. Press M over another.`,
      );
      return;
    }
    void this.desk.perform({ join: { into: work.last, instances: [other] } });
  }

  private erase(): void {
    const instance = this.under();
    if (instance === null) return;
    const faces = runsOf(this.desk.work.facesOf(instance));
    void this.desk.perform({ erase: { what: { faces } } });
  }

  private changeClass(): void {
    const instance = this.under();
    const { work, inHand, perform } = this.desk;
    if (instance === null) return;
    if (work.instance(instance)?.class === inHand()) this.desk.say(`This is ${words(inHand())} already.`);
    else void perform({ class: { instance, class: inHand() } });
  }

  private async back(which: "undo" | "redo"): Promise<void> {
    const { work, perform, say } = this.desk;
    const can = which === "undo" ? work.state.can_undo : work.state.can_redo;
    if (!can && work.saved === "saved") say(`There is nothing to ${which}.`);
    else await perform(which);
  }

  private similar(): void {
    const { hover, work } = this.desk;
    const instance = hover.now && hover.now.instance > 0 ? hover.now.instance : work.last;
    if (instance === null) this.desk.say("Label one first, or point at one.", true);
    else void this.tools.review.alike(instance);
  }

  private show(): void {
    const { view, say } = this.desk;
    const all = Object.keys(SHOWS) as Show[];
    const next = all[(all.indexOf(view.showing) + 1) % all.length] ?? "both";
    view.show(next);
    say(SHOWN[next]);
  }

  private frame(): void {
    const { hover, view, mesh } = this.desk;
    if (hover.now) view.frameBox(boxOf(mesh, hover.now.faces));
  }

  private overview(): void {
    const { view } = this.desk;
    view.leave();
    view.overview();
  }

  private photograph(): void {
    const { view, say } = this.desk;
    const nearest = view.nearest();
    if (view.photograph !== null) view.leave();
    else if (nearest === null) say("This scene has no photographs.");
    else
      view.enter(nearest).catch((e: unknown) => {
        say(e instanceof Error ? e.message : String(e), true);
      });
  }

  plan(open: boolean): void {
    const { element } = this.tools.plan;
    const had = element.contains(document.activeElement);
    element.hidden = !open;
    document.body.classList.toggle("with-plan", open);
    this.tools.plan.tell();
    if (open) element.focus();
    else if (had) this.desk.view.canvas.focus();
  }

  /** Cuts the scene below the next storey; after the highest, all is shown. */
  private nextStorey(): void {
    const { view, where, say } = this.desk;
    const floors = this.tools.plan.floors();
    this.storey = (this.storey + 1) % floors.length;
    const next = floors[floors.length - this.storey];
    const height = this.storey === 0 || next === undefined ? 1e9 : where.near([0, 0, next - BELOW])[2];
    view.paint.section.value = height;
    view.draw();
    say(
      floors.length < 2
        ? "There is one storey."
        : this.storey === 0
          ? "All storeys."
          : "The storeys above are cut away.",
    );
  }
}
