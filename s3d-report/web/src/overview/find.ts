// A field that finds anything by its name, and leads to it: a combobox with a list.

import type { Index } from "../data.js";
import { h } from "../dom.js";
import { type Thing, matches, thingsOf } from "./search.js";

/** The field for the header. Ctrl-K, ⌘K and `/` go to it. */
export function findField(index: Index): HTMLElement {
  const list = h("ul", { id: "found", role: "listbox", "aria-label": "Found", hidden: true });
  const field = h("input", {
    type: "text",
    role: "combobox",
    class: "search",
    placeholder: "Find anything",
    "aria-label": "Find anything",
    "aria-controls": list.id,
    "aria-expanded": "false",
    "aria-autocomplete": "list",
    "aria-keyshortcuts": "Control+K Meta+K /",
    autocomplete: "off",
    spellcheck: "false",
  });
  const told = h("span", { class: "hidden", "aria-live": "polite" });
  let things: Thing[] | null = null;
  let found: Thing[] = [];
  let at = 0;

  const close = (): void => {
    list.hidden = true;
    field.setAttribute("aria-expanded", "false");
    field.removeAttribute("aria-activedescendant");
  };
  const point = (to: number): void => {
    at = (to + found.length) % Math.max(1, found.length);
    [...list.children].forEach((option, i) => option.setAttribute("aria-selected", String(i === at)));
    const option = list.children[at];
    if (found.length === 0 || !option) return field.removeAttribute("aria-activedescendant");
    field.setAttribute("aria-activedescendant", option.id);
    option.scrollIntoView({ block: "nearest" });
  };
  const go = (thing: Thing | undefined): void => {
    if (!thing) return;
    close();
    field.value = "";
    field.blur();
    window.location.hash = thing.href;
  };
  const show = (): void => {
    things ??= thingsOf(index);
    found = matches(things, field.value);
    const options = found.map((thing, i) => {
      const option = h(
        "li",
        { id: `found-${i}`, role: "option", "aria-selected": "false" },
        h("bdi", {}, thing.name),
        h("span", { class: "quiet" }, thing.kind),
      );
      // The field keeps the focus.
      option.addEventListener("pointerdown", (event) => event.preventDefault());
      option.addEventListener("click", () => go(thing));
      return option;
    });
    list.replaceChildren(...options);
    list.hidden = found.length === 0;
    field.setAttribute("aria-expanded", String(found.length > 0));
    told.textContent = found.length === 0 ? "Nothing has that name." : `${found.length} found`;
    point(0);
  };

  field.addEventListener("input", show);
  field.addEventListener("focus", show);
  field.addEventListener("blur", close);
  field.addEventListener("keydown", (event) => {
    const steps: Record<string, () => void> = {
      ArrowDown: () => (list.hidden ? show() : point(at + 1)),
      ArrowUp: () => (list.hidden ? show() : point(at - 1)),
      Enter: () => (list.hidden ? undefined : go(found[at])),
      Escape: () => {
        if (list.hidden) field.value = "";
        close();
      },
    };
    const step = steps[event.key];
    if (!step) return;
    event.preventDefault();
    step();
  });
  document.addEventListener("keydown", (event) => {
    const isTyping = (event.target as Element).matches?.("input, select, textarea") ?? false;
    const isShortcut = (event.ctrlKey || event.metaKey) && !event.altKey && event.key.toLowerCase() === "k";
    const isSlash = event.key === "/" && !isTyping && !event.ctrlKey && !event.metaKey && !event.altKey;
    if (!isShortcut && !isSlash) return;
    event.preventDefault();
    field.focus();
    field.select();
  });
  return h(
    "div",
    { class: "find", role: "search" },
    field,
    h("kbd", { "aria-hidden": "true" }, "Ctrl K"),
    list,
    told,
  );
}
