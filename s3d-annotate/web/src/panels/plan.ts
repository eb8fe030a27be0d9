// The plan: rooms from above, storey by storey. A drag over a room splits it; two that are chosen can be joined.

import { append, choice, h, named, s } from "../../../../s3d-report/web/src/dom.js";
import { boxOf, innermost } from "../../../../s3d-report/web/src/outline.js";
import type { Desk } from "../desk.js";
import { metres2, words } from "../look.js";
import type { Point, RoomShape } from "../scene.js";
import { type Drawn, areaOf, drawnRooms, heightsOf, nameOf } from "./rooms.js";

/** A shorter drag is a click, pixels. */
const STILL = 5;

export class Plan {
  readonly element: HTMLElement;
  private readonly tabs = h("div", { class: "storeys", role: "group", "aria-label": "Storeys" });
  private readonly sheet = h("div", { class: "sheet" });
  private readonly form = h("div", { class: "form" });
  private svg = s("svg", {});
  private rooms: Drawn[] = [];
  private storey: number | null = null;
  private chosen: string[] = [];
  private from: Point | null = null;
  private isMoved = false;
  private line: SVGElement | null = null;
  /** The rooms that are shown, as text: they are drawn again only if they differ. */
  private before = "";
  /** The storeys changed, or another is shown. */
  left: () => void = () => {};

  constructor(private readonly desk: Desk) {
    const close = h(
      "button",
      { type: "button", "aria-label": "Close the plan", click: () => this.left() },
      "×",
    );
    this.element = h(
      "section",
      { class: "plan panel", "aria-label": "Plan of the rooms", hidden: true, tabindex: -1 },
      h("div", { class: "plan-head" }, h("h2", {}, "Rooms"), this.tabs, close),
      this.sheet,
      this.form,
    );
    this.element.addEventListener("keydown", (event) => this.key(event));
  }

  /** The floors of the storeys, from the lowest up. */
  floors(): number[] {
    return drawnRooms(this.desk.work.state, this.desk.proposals).storeys.all.map(({ floors }) => floors[0]);
  }

  tell(): void {
    if (this.element.hidden) return;
    const { rooms, storeys } = drawnRooms(this.desk.work.state, this.desk.proposals);
    const now = JSON.stringify([rooms, this.storey, this.chosen]);
    if (now === this.before) return;
    this.before = now;
    this.rooms = rooms;
    if (this.storey === null || this.storey >= storeys.all.length) this.storey = 0;
    const { storey } = this;
    this.tabs.replaceChildren(
      ...(storeys.all.length < 2 ? [] : storeys.all).map(({ name }, i) =>
        h(
          "button",
          { type: "button", "aria-pressed": String(i === storey), click: () => this.open(i) },
          name,
        ),
      ),
    );
    this.chosen = this.chosen.filter((key) => rooms.some((room) => room.key === key));
    this.draw();
    this.fill();
  }

  private open(storey: number): void {
    this.storey = storey;
    this.chosen = [];
    this.tell();
  }

  private draw(): void {
    const here = this.rooms.filter(({ storey }) => storey === this.storey);
    const points = here.flatMap(({ is }) =>
      is.parts.flatMap(({ outline }) => outline.map(([x, y]) => [x, -y])),
    );
    if (points.length === 0) {
      const structure = this.desk.proposals.structure;
      const text = structure ? "No rooms were found." : "The rooms are still being found.";
      this.sheet.replaceChildren(h("p", { class: "told" }, text));
      return;
    }
    const box = boxOf(points);
    const svg = s("svg", {
      viewBox: `${box.x} ${box.y} ${box.w} ${box.h}`,
      role: "group",
      "aria-label": "Rooms: click to choose, drag a line over one to split it",
    });
    this.svg = svg;
    const scale = Math.max(box.w / 560, box.h / 420);
    for (const room of here) svg.append(this.shape(room, scale));
    svg.addEventListener("pointerdown", (event) => this.down(event));
    svg.addEventListener("pointermove", (event) => this.move(event));
    svg.addEventListener("pointerup", (event) => void this.up(event));
    // Who types the type of a room goes on with the same room.
    const focused = this.sheet.contains(document.activeElement) ? document.activeElement : null;
    const key = focused instanceof SVGElement ? focused.dataset["key"] : undefined;
    this.sheet.replaceChildren(svg);
    if (key !== undefined) this.focus(key);
  }

  private focus(key: string): void {
    const rooms = [...this.svg.querySelectorAll<SVGElement>("[data-key]")];
    rooms.find((room) => room.dataset["key"] === key)?.focus({ preventScroll: true });
  }

  private shape(room: Drawn, scale: number): SVGElement {
    const isChosen = this.chosen.includes(room.key);
    const name = nameOf(room);
    const area = metres2(areaOf(room.is));
    const group = s("g", {
      class: `room${room.proposed === null ? "" : " proposed"}${isChosen ? " chosen" : ""}`,
      role: "button",
      tabindex: 0,
      "aria-pressed": String(isChosen),
      "aria-label": `${room.proposed === null ? "" : "Proposed "}${name} ${area}`,
      "data-key": room.key,
    });
    for (const { outline } of room.is.parts)
      group.append(s("polygon", { points: outline.map(([x, y]) => `${x},${-y}`).join(" ") }));
    const largest = room.is.parts.reduce((a, b) =>
      areaOf({ ...room.is, parts: [a] }) >= areaOf({ ...room.is, parts: [b] }) ? a : b,
    );
    const [x, y] = innermost([largest.outline]);
    const size = 15 * scale;
    const lines = [
      s("tspan", { x, y: -y }, named(name)),
      " ",
      s("tspan", { x, y: -y + 1.25 * size, class: "area" }, area),
    ];
    group.append(s("text", { "font-size": size }, ...lines));
    group.addEventListener("keydown", (event) => {
      if (event.key !== " " && event.key !== "Enter") return;
      if (event.key === "Enter" && isChosen) return;
      event.preventDefault();
      event.stopPropagation();
      this.choose(room.key);
    });
    return group;
  }

  private choose(key: string): void {
    const had = this.chosen.includes(key);
    this.chosen = had ? this.chosen.filter((other) => other !== key) : [...this.chosen.slice(-1), key];
    this.tell();
    this.focus(key);
  }

  private place(event: PointerEvent): Point {
    const matrix = this.svg.getScreenCTM()?.inverse();
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix);
    return [x, -y];
  }

  private down(event: PointerEvent): void {
    if (event.button !== 0) return;
    this.from = this.place(event);
    this.isMoved = false;
    [this.startX, this.startY] = [event.clientX, event.clientY];
    this.svg.setPointerCapture(event.pointerId);
  }
  private startX = 0;
  private startY = 0;

  private move(event: PointerEvent): void {
    if (!this.from) return;
    if (Math.hypot(event.clientX - this.startX, event.clientY - this.startY) > STILL) this.isMoved = true;
    if (!this.isMoved) return;
    this.line?.remove();
    const [[x1, y1], [x2, y2]] = [this.from, this.place(event)];
    this.line = s("line", { class: "split", x1, y1: -y1, x2, y2: -y2 });
    this.svg.append(this.line);
  }

  private async up(event: PointerEvent): Promise<void> {
    const { from } = this;
    this.from = null;
    this.line?.remove();
    this.line = null;
    if (!from) return;
    const to = this.place(event);
    if (this.isMoved) {
      const middle: Point = [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2];
      const room = this.roomAt(middle);
      if (room?.room) await this.desk.perform({ split_room: { room: room.room.number, line: [from, to] } });
      else
        this.desk.say(
          room ? "Accept the room first: then it can be split." : "The line's middle lies in no room.",
          true,
        );
      return;
    }
    const room = this.roomAt(to);
    if (room) this.choose(room.key);
  }

  private roomAt([x, y]: Point): Drawn | undefined {
    return this.rooms.findLast(
      ({ is, storey }) =>
        storey === this.storey &&
        is.parts.some(({ outline }) => {
          let inside = false;
          outline.forEach(([ax, ay], i) => {
            const [bx, by] = outline[(i + 1) % outline.length] ?? [0, 0];
            if (ay > y !== by > y && x < ax + ((y - ay) * (bx - ax)) / (by - ay)) inside = !inside;
          });
          return inside;
        }),
    );
  }

  private get chosenRooms(): Drawn[] {
    return this.chosen.flatMap((key) => this.rooms.filter((room) => room.key === key));
  }

  /** What can be done with the chosen rooms. */
  private fill(): void {
    const [first, second] = this.chosenRooms;
    const open = this.rooms.filter(({ proposed }) => proposed !== null);
    const button = (text: string, act: () => void): HTMLElement =>
      h("button", { type: "button", click: act }, text);
    const parts: (Node | null)[] = [];
    if (first && second) {
      const words = `${nameOf(first)} and ${nameOf(second)}`;
      parts.push(h("p", { class: "told" }, `Join ${words}?`));
      if (first.room && second.room) parts.push(button("Join  Enter", () => void this.join()));
      else parts.push(h("p", { class: "told" }, "Accept both first."));
    } else if (first?.room) parts.push(this.shapeForm(first, first.room.number));
    else if (first)
      parts.push(
        h("p", { class: "told" }, `Proposed: ${metres2(areaOf(first.is))}.`),
        button("Accept  Enter", () => void this.accept()),
      );
    else
      parts.push(
        h("p", { class: "told" }, "Click a room, or two to join them. Drag a line over a room to split it."),
      );
    if (!first && open.length > 0)
      parts.push(button(`Accept all ${open.length}  Enter`, () => void this.accept()));
    this.form.replaceChildren();
    append(this.form, parts);
  }

  private shapeForm({ is }: Drawn, number: number): HTMLElement {
    const put = (shape: Partial<RoomShape>): void => {
      void this.desk.perform({ room: { room: number, is: { ...is, ...shape } } });
    };
    const types = this.desk.scene.room_types;
    const known = !is.kind || types.includes(is.kind) ? types : [is.kind, ...types];
    const entries = [["", "no type"], ...known.map((type) => [type, words(type)])] as [string, string][];
    const heights = heightsOf(is);
    const height = (k: 0 | 1, name: string): HTMLElement => {
      const field = h("input", {
        type: "number",
        step: 0.01,
        value: heights[k].toFixed(2),
        "aria-label": name,
      });
      field.addEventListener("change", () => {
        const value = field.valueAsNumber;
        if (!Number.isFinite(value)) return;
        put({
          parts: is.parts.map((part) => {
            const changed: [number, number] = [...part.heights];
            // Parts at other heights keep theirs.
            if (part.heights[k] === heights[k]) changed[k] = value;
            return { ...part, heights: changed };
          }),
        });
      });
      return field;
    };
    return h(
      "div",
      { class: "room-form" },
      choice("Type of the room", entries, is.kind ?? "", (kind) => put({ kind: kind === "" ? null : kind })),
      h("label", {}, "Floor ", height(0, "Height of the floor, metres"), " m"),
      h("label", {}, "Ceiling ", height(1, "Height of the ceiling, metres"), " m"),
      h("button", { type: "button", click: () => void this.remove(number) }, "Remove"),
    );
  }

  private async remove(room: number): Promise<void> {
    await this.desk.perform({ remove_room: { room } });
  }

  private async join(): Promise<void> {
    const [first, second] = this.chosenRooms;
    if (!first?.room || !second?.room) return;
    await this.desk.perform({ join_rooms: { into: first.room.number, rooms: [second.room.number] } });
  }

  /** Accepts the chosen proposals, or all of them. */
  private async accept(): Promise<void> {
    const chosen = this.chosenRooms.length > 0 ? this.chosenRooms : this.rooms;
    const rooms = chosen.flatMap(({ proposed }) => (proposed === null ? [] : [proposed]));
    if (rooms.length > 0) await this.desk.perform({ accept: { surfaces: [], rooms } });
  }

  private key(event: KeyboardEvent): void {
    const isTyping = (event.target as Element).matches("input, select, button");
    if (event.key === "Escape") {
      if (this.chosen.length > 0) {
        this.chosen = [];
        this.tell();
      } else this.left();
    } else if (isTyping || event.ctrlKey || event.altKey || event.metaKey) return;
    else if (event.key === "Enter") void (this.chosen.length === 2 ? this.join() : this.accept());
    else if (event.key === "Delete" && this.chosenRooms[0]?.room)
      void this.remove(this.chosenRooms[0].room.number);
    else if (/^[0-9]$/.test(event.key) && this.chosenRooms.length === 1) {
      const [first] = this.chosenRooms;
      const kind = this.desk.scene.room_types[(Number(event.key) + 9) % 10];
      if (first?.room && kind !== undefined)
        void this.desk.perform({ room: { room: first.room.number, is: { ...first.is, kind } } });
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
