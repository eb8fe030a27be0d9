// The layer over the canvas: names of rooms, and scan locations to enter.

import { Vector3 } from "three";
import type { Index, Location, Mesh, Rgb } from "../data.js";
import { h, isPlain, roomName } from "../dom.js";
import { link } from "../route/route.js";
import type { Eye } from "./eye.js";
import type { Box } from "./files.js";
import { floorOf, placeOfName } from "./lines.js";
import { type Look, slabIn } from "./look.js";
import type { Surface } from "./surface.js";

/** The largest number of locations that are marked at once: those nearest to the point of interest. */
const MOST = 200;
/** A surface hides a location only if it is nearer by this much, metres. */
const SLACK = 0.05;

/** Rooms that are so much lower than another one are on another storey, metres. */
const STOREY = 1.8;

interface Label {
  element: HTMLElement;
  at: Rgb;
}

const away = (a: Rgb, b: Rgb): number => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

export class Labels {
  private readonly locations: Label[] = [];
  private rooms: Label[] = [];

  constructor(
    private readonly index: Index,
    private readonly mesh: Mesh,
    private readonly overlay: HTMLElement,
    enter: (location: Location, href: string) => void,
  ) {
    for (const location of index.locations) {
      if (location.area !== mesh.area || !location.position) continue;
      const name = `${roomName(location.room)} · ${location.uuid.slice(0, 8)}`;
      const words = h("span", { class: "walk-name" }, name);
      const href = link("pano", [location.area, location.uuid]);
      const element = location.pano
        ? h("a", { href, "aria-label": `Enter ${name}` }, words)
        : h("span", {}, words);
      if (location.pano)
        element.addEventListener("click", (event) => {
          if (!isPlain(event)) return;
          event.preventDefault();
          enter(location, href);
        });
      element.classList.add("walk", "small");
      element.hidden = true;
      this.locations.push({ element, at: location.position });
      overlay.append(element);
    }
  }

  /** Shows the names of the rooms, at the height of the floors in `boxes`. */
  nameRooms(boxes: Box[]): void {
    const rooms = this.index.rooms.filter((room) => room.area === this.mesh.area);
    this.rooms = rooms.map((room) => {
      const element = h("span", { class: "room-name" }, roomName(room.name));
      return { element, at: placeOfName(room, floorOf(this.index, this.mesh, boxes, room)) };
    });
    this.overlay.prepend(...this.rooms.map(({ element }) => element));
  }

  /** Moves all labels to their places on a canvas of this size. Labels above the section are hidden. */
  place(eye: Eye, surface: Surface, look: Look, width: number, height: number): void {
    const slab = slabIn(look);
    const { at: target, from } = eye.stand;
    const hidden = (at: Rgb): boolean => {
      const camera = eye.camera.position;
      const hit = surface.pick(camera, new Vector3(...at).sub(camera).normalize(), slab);
      return hit !== null && hit.distance < away(at, from) - SLACK;
    };
    const put = ({ element, at }: Label, wanted: boolean, hides: boolean): void => {
      const [x, y, w] = eye.screen(at, width, height);
      const inside = w > 0 && x > 0 && x < width * w && y > 0 && y < height * w;
      const shown = wanted && inside && at[2] < slab.high && at[2] >= slab.low && !(hides && hidden(at));
      element.hidden = !shown;
      if (shown) element.style.transform = `translate(${x / w}px, ${y / w}px)`;
    };
    let near = this.locations;
    if (near.length > MOST) {
      near = [...near].sort((a, b) => away(a.at, target) - away(b.at, target)).slice(0, MOST);
      for (const { element } of this.locations) element.hidden = true;
    }
    for (const label of near) put(label, look.marks.has("locations"), true);
    // Seen from inside, names of other rooms would appear in the walls.
    const above = from[2] > Math.min(slab.high, this.mesh.max[2]);
    // A floor may hide the rooms below it, but walls hide no names.
    const heights = this.rooms.map((room) => room.at[2]).filter((z) => z < slab.high);
    const top = Math.max(...heights) - STOREY;
    for (const label of this.rooms) put(label, look.marks.has("rooms") && above, label.at[2] < top);
  }
}
