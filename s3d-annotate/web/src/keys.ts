// The keys, in one table: what they do, the card of help and the hints are made from it.

export type Command =
  | "finer"
  | "coarser"
  | "doubt"
  | "accept"
  | "leave"
  | "join"
  | "cut"
  | "erase"
  | "class"
  | "undo"
  | "redo"
  | "similar"
  | "show"
  | "frame"
  | "overview"
  | "photograph"
  | "plan"
  | "storey"
  | "find"
  | "help";

export interface Key {
  command: Command;
  /** As an event names them. */
  keys: string[];
  /** As people read them. */
  shown: string;
  does: string;
  group: "Patches" | "Objects" | "View";
}

export const KEYS: readonly Key[] = [
  {
    command: "finer",
    keys: ["["],
    shown: "[",
    does: "smaller patches; also Shift and the wheel",
    group: "Patches",
  },
  { command: "coarser", keys: ["]"], shown: "]", does: "larger patches", group: "Patches" },
  {
    command: "cut",
    keys: ["s"],
    shown: "S",
    does: "cut: by a line, a box, colour or a brush",
    group: "Patches",
  },
  {
    command: "accept",
    keys: ["Enter"],
    shown: "Enter",
    does: "accept what is proposed here",
    group: "Patches",
  },
  { command: "doubt", keys: ["Tab", "n"], shown: "Tab", does: "go to the next doubt", group: "Patches" },
  { command: "join", keys: ["m"], shown: "M", does: "join this object to the last one", group: "Objects" },
  { command: "class", keys: ["c"], shown: "C", does: "give this object the class in hand", group: "Objects" },
  {
    command: "similar",
    keys: ["l"],
    shown: "L",
    does: "find seven more like the last one",
    group: "Objects",
  },
  {
    command: "erase",
    keys: ["x", "Delete"],
    shown: "X",
    does: "erase this object's labels",
    group: "Objects",
  },
  { command: "undo", keys: ["z"], shown: "Z", does: "undo", group: "Objects" },
  { command: "redo", keys: ["Shift+z"], shown: "Shift Z", does: "redo", group: "Objects" },
  { command: "find", keys: ["/"], shown: "/", does: "find a class by its name", group: "Objects" },
  {
    command: "show",
    keys: ["v"],
    shown: "V",
    does: "labels over colours, labels, what has none, colours",
    group: "View",
  },
  { command: "frame", keys: ["f"], shown: "F", does: "go closer to this", group: "View" },
  { command: "overview", keys: ["Home"], shown: "Home", does: "see all from above", group: "View" },
  { command: "photograph", keys: ["g"], shown: "G", does: "go into the nearest photograph", group: "View" },
  { command: "plan", keys: ["p"], shown: "P", does: "plan of the rooms", group: "View" },
  { command: "storey", keys: ["k"], shown: "K", does: "show another storey", group: "View" },
  { command: "help", keys: ["h", "?"], shown: "H", does: "this card", group: "View" },
  { command: "leave", keys: ["Escape"], shown: "Esc", does: "leave a photograph, or cancel", group: "View" },
];

/** What the pointer does. */
export const HANDS: readonly { shown: string; does: string }[] = [
  { shown: "Click or drag", does: "label the patches: a new object" },
  { shown: "Shift + drag", does: "add to the object it begins on, or to the last one" },
  { shown: "Alt + drag", does: "erase labels" },
  { shown: "Right drag", does: "turn; also Space + drag" },
  { shown: "Middle drag", does: "move; also Ctrl + drag" },
  { shown: "Wheel", does: "zoom" },
  { shown: "Arrows, + and −", does: "turn and zoom" },
  { shown: "Space", does: "without a pointer: label what is in the middle" },
];

const COMMANDS = new Map(KEYS.flatMap(({ command, keys }) => keys.map((key) => [key, command] as const)));

/** What a key does; null without a meaning. */
export function commandOf(
  event: Pick<KeyboardEvent, "key" | "shiftKey" | "ctrlKey" | "metaKey" | "altKey">,
): Command | null {
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (event.ctrlKey || event.metaKey) {
    if (key === "z") return event.shiftKey ? "redo" : "undo";
    return key === "y" ? "redo" : null;
  }
  if (event.altKey) return null;
  if (event.shiftKey && key === "z") return "redo";
  if (event.shiftKey && key === "Tab") return null;
  return COMMANDS.get(key) ?? null;
}

/** The keys of the first classes: digits, then letters that mean nothing else. */
export const CLASS_KEYS: readonly string[] = [..."1234567890qwertyuioabdj"].filter(
  (key) => !COMMANDS.has(key),
);

/** The key for a command, to be read. */
export const keyOf = (command: Command): string => KEYS.find((key) => key.command === command)?.shown ?? "";
