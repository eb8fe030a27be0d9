// A field that finds anything by its name, and leads to it: a combobox with a list.

import type { Index } from "../data.js";
import { h } from "../dom.js";
import { type ActOf, actOf, shortcutsOf } from "../keys.js";
import { type Thing, matches, thingsOf } from "./search.js";

/** The field for the header. */
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
    "aria-keyshortcuts": shortcutsOf("page", "find"),
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
    const steps: Record<ActOf<"find">, () => void> = {
      next: () => (list.hidden ? show() : point(at + 1)),
      previous: () => (list.hidden ? show() : point(at - 1)),
      take: () => (list.hidden ? undefined : go(found[at])),
      close: () => {
        if (list.hidden) field.value = "";
        close();
      },
    };
    const act = actOf("find", event);
    if (!act) return;
    event.preventDefault();
    steps[act]();
  });
  document.addEventListener("keydown", (event) => {
    const isTyping = (event.target as Element).matches?.("input, select, textarea") ?? false;
    const isLetter = !event.ctrlKey && !event.metaKey;
    if (actOf("page", event) !== "find" || (isTyping && isLetter)) return;
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
