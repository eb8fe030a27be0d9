// What a data set is, in a sentence and a few numbers: only what the index has.

import type { Index } from "../data.js";
import { count, roomWords, tamed } from "../dom.js";
import { storeysOf } from "../storeys.js";

const WORDS = "no one two three four five six seven eight nine ten eleven twelve".split(" ");
const inWords = (n: number): string => WORDS[n] ?? count(n);

/** The number of types of rooms that are named. */
const TYPES = 3;
/** The number of numbers. */
const NUMBERS = 6;

function plural(n: number, noun: string): string {
  if (n === 1) return noun;
  return /[^aeiou]y$/.test(noun)
    ? `${noun.slice(0, -1)}ies`
    : `${noun}${/(s|ch|x)$/.test(noun) ? "es" : "s"}`;
}

const counted = (n: number, noun: string): string => `${inWords(n)} ${plural(n, noun)}`;

/** `a, b and c`. */
function listed(parts: string[]): string {
  const last = parts.at(-1) ?? "";
  return parts.length < 2 ? last : `${parts.slice(0, -1).join(", ")} and ${last}`;
}

/** `three offices, a hallway and two others`. */
function types(index: Index): string {
  const found = new Map<string, number>();
  for (const { name } of index.rooms) {
    const type = tamed(roomWords(name.replace(/_\d+$/, "")));
    found.set(type, (found.get(type) ?? 0) + 1);
  }
  const sorted = [...found].sort((a, b) => b[1] - a[1]);
  const named = sorted.length <= TYPES + 1 ? sorted : sorted.slice(0, TYPES);
  const others = sorted.slice(named.length).reduce((sum, [, n]) => sum + n, 0);
  const one = (noun: string): string => `${/^[aeio]/.test(noun) ? "an" : "a"} ${noun}`;
  const words = named.map(([noun, n]) => (n === 1 ? one(noun) : counted(n, noun)));
  return listed(others > 0 ? [...words, counted(others, "other")] : words);
}

export function sentenceOf(index: Index): string {
  const storeys = index.areas.reduce((sum, { area }) => sum + storeysOf(index, area).all.length, 0);
  const areas = index.areas.length;
  const where =
    areas > 1 ? `in ${counted(areas, "area")}` : storeys > 1 && `on ${counted(storeys, "storey")}`;
  const rooms = index.rooms.length;
  const locations = index.locations.length;
  const seen = locations > 0 ? `, seen from ${counted(locations, "scan location")}` : "";
  const what = rooms > 0 ? counted(rooms, "room") : "A scan without labels";
  const kinds = rooms > 1 ? `: ${types(index)}` : "";
  const sentence = `${what}${where ? ` ${where}` : ""}${kinds}${seen}.`;
  return sentence.charAt(0).toUpperCase() + sentence.slice(1);
}

/** `12.9 M`. */
function short(n: number): string {
  if (n < 1e5) return count(n);
  return n < 1e6
    ? `${count(n / 1e3)} k`
    : n < 1e9
      ? `${(n / 1e6).toFixed(1)} M`
      : `${(n / 1e9).toFixed(1)} G`;
}

/** The six most telling numbers, with their names. */
export function numbersOf(index: Index): [value: string, name: string][] {
  const sum = (values: number[]): number => values.reduce((a, b) => a + b, 0);
  const floor = sum(index.rooms.map((room) => room.floor_m2));
  const instances = index.labels.filter((label) => label.class !== null).length;
  const present = index.pixels_by_class.filter(
    (pixels, i) => pixels + (index.surface_by_class[i]?.faces ?? 0) > 0,
  );
  const numbers: [number, string, string][] = [
    [floor, `${count(floor)} m²`, "of floor"],
    [instances, count(instances), plural(instances, "instance")],
    [present.length, `${present.length} of ${index.classes.length}`, "classes"],
    ...(
      [
        [index.views.filter((view) => view.picture !== null).length, "view"],
        [index.locations.filter((location) => location.pano).length, "panorama"],
        [sum(index.areas.map((area) => area.points)), "point"],
        [sum(index.areas.map((area) => area.faces)), "face"],
        [index.locations.length, "scan location"],
      ] as const
    ).map(([n, noun]): [number, string, string] => [n, short(n), plural(n, noun)]),
    [index.data_set.bytes, `${(index.data_set.bytes / 1e6).toFixed(0)} MB`, "of files"],
    [index.data_set.files, short(index.data_set.files), "files"],
  ];
  return numbers
    .filter(([n]) => n > 0)
    .map(([, value, name]): [string, string] => [value, name])
    .slice(0, NUMBERS);
}
