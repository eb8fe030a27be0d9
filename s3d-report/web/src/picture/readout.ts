// The values under the pointer in words, and the legend of the colours.

import { OTHER_CLASS, OTHER_INSTANCE, css, depthRamp, gradient, marginRamp } from "../colors.js";
import type { Index, Rgb } from "../data.js";
import { h, named, percent, roomName, roomOf } from "../dom.js";
import { type FaceVotes, NO_VOTES, SURE } from "./faces.js";
import type { Modality } from "./gl.js";

/** A pixel of a picture. Values that are unknown or were not seen are null. */
export interface Spot {
  label: number | null;
  face: number | null;
  /** The distance from the camera, metres. */
  distance: number | null;
  point: Rgb | null;
}

export const entry = (name: string, value: string): HTMLElement =>
  h("span", { class: "entry", "data-is": name }, h("span", { class: "name" }, name), value);

export function key(color: Rgb): HTMLElement {
  const element = h("span", { class: "key" });
  element.style.background = css(color);
  return element;
}

/** Words for the votes for a face. */
function tellVotes(index: Index, votes: FaceVotes, face: number): HTMLElement[] {
  const margin = votes.margin[face] ?? NO_VOTES;
  if (margin === NO_VOTES) return [entry("margin", "no votes")];
  if (margin === SURE && !votes.runnerUp[face]) return [];
  const other = index.labels[votes.runnerUp[face] ?? 0];
  const told = [entry("margin", percent(margin / SURE))];
  if (other) told.push(entry("runner-up", other.class === null ? "unlabelled" : named(other.name)));
  return told;
}

/** Words for a pixel. `room` is the picture's room, and `votes` may still be loading. */
export function tell(
  index: Index,
  spot: Spot,
  picture: { room: string; hasDepth: boolean },
  votes: FaceVotes | null,
): HTMLElement[] {
  const told: HTMLElement[] = [];
  let { room } = picture;
  if (spot.label !== null) {
    const label = index.labels[spot.label];
    const of_class = label?.class === null || label === undefined ? undefined : index.classes[label.class];
    if (label && of_class) {
      room = roomOf(label.name);
      told.push(h("span", { class: "entry", "data-is": "class" }, key(of_class.color), named(of_class.name)));
      told.push(entry("instance", named(label.name)));
    } else told.push(entry("class", "unlabelled"));
  }
  told.push(entry("room", roomName(room)));
  if (spot.distance === null) told.push(entry("distance", picture.hasDepth ? "nothing seen" : "not stored"));
  else told.push(entry("distance", `${spot.distance.toFixed(3)} m`));
  if (spot.point) told.push(entry("X Y Z", spot.point.map((c) => c.toFixed(3)).join("  ")));
  if (spot.face !== null) {
    told.push(entry("face", String(spot.face)));
    if (votes) told.push(...tellVotes(index, votes, spot.face));
  }
  return told;
}

function ramp(from: string, colors: (n: number) => Uint8Array, to: string): HTMLElement[] {
  const element = h("span", { class: "ramp" });
  element.style.background = gradient(colors);
  return [h("span", {}, from), element, h("span", {}, to)];
}

/** The legend of the shown modalities; `range` is the range of depths in metres. */
export function legendOf(index: Index, shown: Modality[], range: [number, number]): HTMLElement[] {
  const legend: HTMLElement[] = [];
  if (shown.includes("depth")) {
    const [near, far] = range.map((m) => `${m.toFixed(1)} m`);
    legend.push(...ramp(near ?? "", depthRamp, far ?? ""));
  }
  if (shown.includes("contested")) {
    legend.push(...ramp("a tie", marginRamp, "all votes agree"));
    legend.push(h("span", { class: "entry" }, key([128, 128, 128]), "no votes"));
  }
  if (shown.includes("unlabelled"))
    legend.push(h("span", { class: "entry" }, key([255, 0, 255]), "unlabelled"));
  if (shown.includes("changed")) {
    legend.push(h("span", { class: "entry" }, key(OTHER_CLASS), "another class"));
    legend.push(h("span", { class: "entry" }, key(OTHER_INSTANCE), "another instance of the class"));
  }
  if (shown.includes("class")) {
    for (const [i, { name, color }] of index.classes.entries())
      if (index.pixels_by_class[i]) legend.push(h("span", { class: "entry" }, key(color), named(name)));
  }
  return legend;
}
