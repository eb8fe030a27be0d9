// The keys of the page, and what one does with pointer and fingers. Handlers ask this table what a key does,
// and the page of hints lists it, so that it tells the keys that there are.

/** Something that is done: the keys that do it (as `KeyboardEvent.key`), and what it is. */
interface Act {
  keys: readonly string[];
  words: string;
}

interface Group {
  title: string;
  /** Pairs of a gesture and what it does. */
  gestures?: readonly (readonly [string, string])[];
  acts: Readonly<Record<string, Act>>;
}

const act = (words: string, ...keys: string[]): Act => ({ words, keys });

const GROUPS = {
  page: {
    title: "Everywhere",
    acts: {
      find: act("Find a room, class, instance, location or view", "/", "Control+k"),
      hints: act("Show these keys and gestures", "?"),
    },
  },
  find: {
    title: "In the field that finds",
    acts: {
      next: act("Go to the next line", "ArrowDown"),
      previous: act("Go to the line before", "ArrowUp"),
      take: act("Open what is chosen", "Enter"),
      close: act("Close the list; again to empty the field", "Escape"),
    },
  },
  picture: {
    title: "Panoramas and views",
    gestures: [
      ["Drag", "Look around in a panorama"],
      ["Wheel, or two fingers", "Zoom in a panorama"],
      ["Point", "Know what it is"],
      ["Click", "Mark a place, with a link to it in 3D"],
      ["Click a round mark", "Go to that scan location"],
    ],
    acts: {
      left: act("Turn to the left", "ArrowLeft"),
      right: act("Turn to the right", "ArrowRight"),
      up: act("Look up", "ArrowUp"),
      down: act("Look down", "ArrowDown"),
      nearer: act("Zoom in", "+", "="),
      farther: act("Zoom out", "-"),
      take: act("Mark, or measure from, the middle", "Enter"),
      stop: act("End measuring, and remove the mark", "Escape"),
    },
  },
  objects: {
    title: "Objects of a view",
    gestures: [["Point at an object, or at its line of the list", "See its outline, and what hides it"]],
    acts: {
      next: act("Go to the next object", "ArrowDown"),
      previous: act("Go to the object before", "ArrowUp"),
    },
  },
  space: {
    title: "3D and overview",
    gestures: [
      ["Drag", "Turn"],
      ["Drag with the right button, or two fingers", "Move"],
      ["Wheel, or two fingers", "Zoom to the pointer"],
      ["Double-click", "Go closer"],
      ["Click while measuring", "Set a corner; the first one closes an outline"],
      ["Point", "Know what it is"],
      ["Click a round mark", "Fly into the panorama"],
    ],
    acts: {
      left: act("Turn to the left", "ArrowLeft"),
      right: act("Turn to the right", "ArrowRight"),
      up: act("Look from higher up", "ArrowUp"),
      down: act("Look from lower down", "ArrowDown"),
      nearer: act("Go closer", "+", "="),
      farther: act("Go back", "-"),
      take: act("Measure from the middle", "Enter"),
      undo: act("Take back the last corner", "Backspace"),
      stop: act("End measuring", "Escape"),
    },
  },
  plan: {
    title: "Plan",
    gestures: [
      ["Point", "See the kept views of a scan location, and what shares surface with it"],
      ["Click a room or scan location", "Open its panorama"],
    ],
    acts: {},
  },
  line: {
    title: "The line between two pictures",
    gestures: [["Drag", "Move it"]],
    acts: {
      left: act("Move it to the left", "ArrowLeft", "ArrowDown"),
      right: act("Move it to the right", "ArrowRight", "ArrowUp"),
      start: act("Move it to the left end", "Home"),
      end: act("Move it to the right end", "End"),
    },
  },
  present: {
    title: "Presentation",
    acts: {
      hold: act("Pause, or go on", " "),
      next: act("Next step", "ArrowRight", "PageDown"),
      previous: act("Step before", "ArrowLeft", "PageUp"),
      first: act("First step", "Home"),
      last: act("Last step", "End"),
      fill: act("Fill the screen", "f", "F"),
      leave: act("Leave", "Escape"),
    },
  },
} as const satisfies Record<string, Group>;

type Groups = typeof GROUPS;
export type GroupName = keyof Groups;
export type ActOf<G extends GroupName> = keyof Groups[G]["acts"];

export const groups: readonly (readonly [GroupName, Group])[] = Object.entries(GROUPS) as [
  GroupName,
  Group,
][];

/** The key of an event as in the table. Control and ⌘ are one, and make letters small. */
function keyOf({ key, ctrlKey, metaKey, altKey }: KeyboardEvent): string | null {
  if (altKey) return null;
  return ctrlKey || metaKey ? `Control+${key.toLowerCase()}` : key;
}

/** What a key does in a part of the page; null if it does nothing. */
export function actOf<G extends GroupName>(group: G, event: KeyboardEvent): ActOf<G> | null {
  const key = keyOf(event);
  const acts = Object.entries<Act>(GROUPS[group].acts);
  const found = key === null ? undefined : acts.find(([, { keys }]) => keys.includes(key));
  return (found?.[0] ?? null) as ActOf<G> | null;
}

/** The keys of an act for `aria-keyshortcuts`. */
export function shortcutsOf<G extends GroupName>(group: G, of: ActOf<G>): string {
  const { keys } = (GROUPS[group].acts as Record<PropertyKey, Act>)[of] ?? { keys: [] };
  const spoken = keys.map((key) => (key === " " ? "Space" : key.replace(/\+k$/, "+K")));
  return spoken
    .flatMap((key) => [key, ...(key.startsWith("Control+") ? [key.replace("Control", "Meta")] : [])])
    .join(" ");
}

const SIGNS: Record<string, string> = {
  ArrowLeft: "←",
  ArrowRight: "→",
  ArrowUp: "↑",
  ArrowDown: "↓",
  " ": "Space",
  "-": "−",
  Escape: "Esc",
  "Control+k": "Ctrl K",
  PageDown: "Page ↓",
  PageUp: "Page ↑",
};

/** A key as it is written on keyboards. Letters of both sizes are one key. */
export const signsOf = (keys: readonly string[]): string[] => [
  ...new Set(keys.map((key) => SIGNS[key] ?? (key.length === 1 ? key.toUpperCase() : key))),
];
