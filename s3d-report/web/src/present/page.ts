// The presentation: what there is to see, full of the window, step by step by itself.

import type { Index } from "../data.js";
import { append, flat, h, named, s, say } from "../dom.js";
import { type ActOf, actOf } from "../keys.js";
import { key } from "../picture/readout.js";
import { lastBefore } from "../route/memory.js";
import { type Page, type Route, link, numberOf, replaceRoute } from "../route/route.js";
import { Awake } from "./awake.js";
import { Dollhouse, type Scene, pictureScene, prepare } from "./scenes.js";
import { type Step, captionOf, stepsOf, wipeAt, wipeWithoutMotion } from "./steps.js";

/** The duration of a step, ms. */
const LASTS: Record<Step["kind"], number> = { building: 16_000, view: 9_000, panorama: 14_000 };
/** The time between two drawings, ms; without motion a step has two of them. */
const FRAME = 25;
/** The controls go after so much time without a move, and one scene into the next; ms. */
const [IDLE, FADE] = [3000, 700];

const ICONS = {
  previous: "M11 3L5 8l6 5z",
  next: "M5 3l6 5-6 5z",
  pause: "M4 3h3v10H4zM9 3h3v10H9z",
  play: "M4 2.5l9 5.5-9 5.5z",
  full: "M2 6V2h4v1.5H3.500V6zM10 2h4v4h-1.500V3.500H10zM14 10v4h-4v-1.500h2.500V10zM6 14H2v-4h1.500v2.500H6z",
  leave: "M3.500 2.500L8 7l4.500-4.500 1 1L9 8l4.500 4.500-1 1L8 9l-4.500 4.500-1-1L7 8 2.500 3.500z",
};

/** Whether there is anything to present. */
export const isPresentable = (index: Index): boolean => stepsOf(index).length > 0;

/** Fills the screen, where the browser can. */
export function fillScreen(): void {
  document.documentElement.requestFullscreen?.().catch(() => {});
}

export function presentPage(index: Index, route: Route): Page {
  const area = route.path[0] === undefined ? null : Number(route.path[0]);
  const steps = stepsOf(index, area);
  if (steps.length === 0) {
    const words = "There is nothing to present: no mesh, no view and no panorama.";
    const element = h("main", { class: "page" }, h("h1", {}, "Presentation"), h("p", {}, words));
    return { element, close: () => {} };
  }
  const first = Math.round(numberOf(route.query, "step", 1, steps.length, 1)) - 1;
  const show = new Presentation(index, steps, route.path, first);
  return { element: show.element, close: () => show.close(), start: show.element };
}

class Presentation {
  readonly element: HTMLElement;
  private readonly stage = h("div", { class: "present-stage" });
  private readonly title = h("p", { class: "present-title" });
  private readonly words = h("p", {});
  private readonly layers = h("p", { class: "present-layers" });
  private readonly count = h("span", { class: "present-count" });
  private readonly bar = h("div", { class: "present-progress", "aria-hidden": "true" });
  private readonly pause = h("button", { type: "button", class: "present-pause" });
  private readonly slide: HTMLElement;
  private readonly awake = new Awake();
  private readonly isStill = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  private building: Dollhouse | null = null;
  private scene: Scene | null = null;
  /** The time in the step, ms. */
  private time = 0;
  private playing = true;
  private loading = true;
  private turn = 0;
  private last = 0;
  private drawn = -1;
  private idle = 0;
  private frame = 0;
  private closed = false;

  constructor(
    private readonly index: Index,
    private readonly steps: Step[],
    private readonly path: string[],
    private at: number,
  ) {
    const caption = h("div", { class: "present-caption" }, this.title, this.words, this.layers);
    // A reader hears of a step that one went to, not of those that come by themselves.
    this.slide = h("div", { role: "group", "aria-roledescription": "step", "aria-live": "off" }, caption);
    this.element = h("main", { class: "present" });
    this.element.setAttribute("aria-label", flat(`Presentation of ${named(index.data_set.name)}`));
    append(this.element, [
      h("h1", { class: "hidden" }, "Presentation"),
      this.stage,
      this.slide,
      this.controls(),
      this.bar,
    ]);
    document.addEventListener("keydown", this.key);
    document.addEventListener("fullscreenchange", this.screen);
    for (const event of ["pointermove", "pointerdown", "focusin"])
      this.element.addEventListener(event, () => this.wake());
    this.wake();
    this.play(true);
    void this.go(this.at, 1);
    this.tick();
  }

  close(): void {
    this.closed = true;
    window.clearTimeout(this.idle);
    window.clearTimeout(this.frame);
    cancelAnimationFrame(this.frame);
    document.removeEventListener("keydown", this.key);
    document.removeEventListener("fullscreenchange", this.screen);
    this.awake.close();
    this.end(this.scene);
    this.building?.close();
  }

  private controls(): HTMLElement {
    const shape = (name: keyof typeof ICONS): SVGElement =>
      s("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, s("path", { d: ICONS[name] }));
    const button = (words: string, keys: string, name: keyof typeof ICONS, act: () => void): HTMLElement => {
      const made = h(
        "button",
        { type: "button", "aria-label": words, "aria-keyshortcuts": keys },
        shape(name),
      );
      made.title = `${words} (${keys.replace("Arrow", "").toLowerCase()})`;
      made.addEventListener("click", act);
      return made;
    };
    this.pause.setAttribute("aria-keyshortcuts", "Space");
    this.pause.addEventListener("click", () => this.play(!this.playing));
    this.pause.append(shape("pause"), shape("play"));
    const bar = h("div", { class: "present-controls", role: "group", "aria-label": "Presentation" });
    append(bar, [
      button("Previous step", "ArrowLeft", "previous", () => this.step(-1)),
      this.pause,
      button("Next step", "ArrowRight", "next", () => this.step(1)),
      this.count,
      document.fullscreenEnabled && button("Full screen", "F", "full", () => this.toggleScreen()),
      button("Leave the presentation", "Escape", "leave", () => this.leave()),
    ]);
    return bar;
  }

  private play(on: boolean): void {
    this.playing = on;
    const words = on ? "Pause" : "Play";
    this.pause.setAttribute("aria-label", words);
    this.pause.title = `${words} (space)`;
    this.element.classList.toggle("paused", !on);
    this.slide.setAttribute("aria-live", on ? "off" : "polite");
    this.awake.keep(on);
    this.wake();
  }

  /** Goes to the next step or to the one before, as the user wants. */
  private step(by: 1 | -1): void {
    void this.go(this.at + by, by);
  }

  /** Shows a step. One that cannot be read is passed over. */
  private async go(to: number, by: 1 | -1): Promise<void> {
    const mine = ++this.turn;
    const { steps, index } = this;
    this.loading = true;
    this.element.setAttribute("aria-busy", "true");
    for (let tried = 0; tried < steps.length; tried++) {
      const at = (to + by * tried + steps.length * (tried + 1)) % steps.length;
      const step = steps[at];
      if (!step) continue;
      try {
        const scene = await this.sceneOf(step);
        if (mine !== this.turn || this.closed) {
          if (scene !== this.building) scene.close();
          return;
        }
        this.put(at, step, scene);
        void prepare(index, steps[(at + 1) % steps.length]);
        return;
      } catch {
        if (mine !== this.turn || this.closed) return;
      }
    }
    this.loading = false;
    say(this.title, "Nothing can be shown");
    say(this.words, "None of the pictures and meshes of this report can be read; see Notes.");
  }

  private async sceneOf(step: Step): Promise<Scene> {
    if (step.kind !== "building") return pictureScene(this.index, step, this.nameOf(step));
    if (this.building?.mesh.area !== step.area) {
      const old = this.building;
      if (old && old === this.scene) this.scene = null;
      old?.element.remove();
      old?.close();
      this.building = null;
    }
    const mesh = this.index.meshes.find(({ area }) => area === step.area);
    if (!mesh) throw new Error("There is no such mesh.");
    this.building ??= new Dollhouse(this.index, mesh);
    // What is loaded must have its size.
    if (!this.building.element.isConnected) this.stage.prepend(this.building.element);
    await this.building.open(step.storey);
    return this.building;
  }

  private nameOf(step: Step): string {
    const { title, words } = captionOf(this.index, step);
    return [title, words].filter(Boolean).join(": ");
  }

  private put(at: number, step: Step, scene: Scene): void {
    const { stage } = this;
    [this.at, this.time, this.drawn, this.loading] = [at, 0, -1, false];
    const old = this.scene;
    if (scene !== old) {
      this.scene = scene;
      scene.element.classList.toggle("entering", !this.isStill);
      stage.append(scene.element);
      // The new scene lies on the old one until it has come in.
      window.setTimeout(() => this.end(old), this.isStill ? 0 : FADE);
      void scene.element.offsetWidth;
      scene.element.classList.remove("entering");
    }
    this.element.removeAttribute("aria-busy");
    this.tell(step, scene);
    this.paint();
    replaceRoute("present", this.path, { step: String(at + 1) });
  }

  private tell(step: Step, scene: Scene): void {
    const { title, words, classes } = captionOf(this.index, step);
    say(this.title, title);
    say(this.words, words);
    const keys = scene.layer === "Class" ? classes : [];
    const entries = keys.map(({ name, color }) =>
      h("span", { class: "entry" }, key(color), named(name.replaceAll("_", " "))),
    );
    const layer = scene.layer !== null && h("span", {}, `Colour | ${scene.layer}`);
    this.layers.replaceChildren();
    append(this.layers, [layer, ...entries]);
    this.count.textContent = `${this.at + 1} of ${this.steps.length}`;
    this.slide.setAttribute("aria-label", `${this.at + 1} of ${this.steps.length}`);
    this.element.dataset["step"] = String(this.at + 1);
    this.element.dataset["kind"] = step.kind;
  }

  /** Ends a scene that has gone. The building stays, out of sight. */
  private end(scene: Scene | null): void {
    if (!scene || (scene === this.scene && !this.closed)) return;
    scene.element.remove();
    if (scene !== this.building) scene.close();
  }

  private tick(): void {
    if (this.closed) return;
    const now = performance.now();
    const passed = Math.min(200, now - this.last);
    if (passed >= FRAME) {
      this.last = now;
      if (this.playing && !this.loading && document.visibilityState === "visible") {
        this.time += passed;
        const step = this.steps[this.at];
        if (step && this.time >= LASTS[step.kind]) {
          // A single step begins again.
          void this.go(this.at + 1, 1);
        } else this.paint();
      }
    }
    // Without motion there is little to do.
    this.frame = this.isStill
      ? window.setTimeout(() => this.tick(), 100)
      : requestAnimationFrame(() => this.tick());
  }

  private paint(): void {
    const step = this.steps[this.at];
    if (!step || !this.scene) return;
    const all = LASTS[step.kind];
    const t = Math.min(1, this.time / all);
    this.bar.style.width = `${100 * (this.isStill ? Math.floor(2 * t) / 2 : t)}%`;
    const wipe = this.isStill ? wipeWithoutMotion(t) : wipeAt(t);
    if (this.isStill && wipe === this.drawn) return;
    this.drawn = wipe;
    this.scene.draw(this.time, all, wipe);
  }

  /** Shows the controls for a while. */
  private wake(): void {
    window.clearTimeout(this.idle);
    this.element.classList.remove("idle");
    this.idle = window.setTimeout(() => {
      if (this.playing) this.element.classList.add("idle");
    }, IDLE);
  }

  private readonly key = (event: KeyboardEvent): void => {
    const onButton = (event.target as Element).closest?.("button, a") != null;
    const acts: Record<ActOf<"present">, () => void> = {
      hold: () => this.play(!this.playing),
      next: () => this.step(1),
      previous: () => this.step(-1),
      first: () => void this.go(0, 1),
      last: () => void this.go(this.steps.length - 1, -1),
      fill: () => this.toggleScreen(),
      leave: () => this.leave(),
    };
    const act = actOf("present", event);
    // A button that has the focus is pressed by Space itself.
    if (!act || (act === "hold" && onButton)) return;
    event.preventDefault();
    this.wake();
    acts[act]();
  };

  private isLeavingScreen = false;

  private toggleScreen(): void {
    if (!document.fullscreenElement) return fillScreen();
    this.isLeavingScreen = true;
    void document.exitFullscreen();
  }

  /** The browser takes Escape to leave the full screen; then the presentation ends, too. */
  private readonly screen = (): void => {
    if (document.fullscreenElement) return;
    if (!this.isLeavingScreen) this.leave();
    this.isLeavingScreen = false;
  };

  /** Goes back to where one was, or to the first page. */
  private leave(): void {
    if (this.closed) return;
    this.isLeavingScreen = true;
    if (document.fullscreenElement) void document.exitFullscreen();
    if (lastBefore("present") !== null) history.back();
    else window.location.replace(link(""));
  }
}
