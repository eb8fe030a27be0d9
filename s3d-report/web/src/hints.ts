// The page of keys and gestures: a dialog over everything.

import { append, h } from "./dom.js";
import { actOf, groups, shortcutsOf, signsOf } from "./keys.js";

function dialog(): HTMLDialogElement {
  const columns = h("div", { class: "hints-groups" });
  for (const [, { title, gestures = [], acts }] of groups) {
    const rows = h("dl", {});
    for (const [gesture, words] of gestures) rows.append(h("dt", {}, gesture), h("dd", {}, words));
    for (const { keys, words } of Object.values(acts)) {
      const signs = signsOf(keys).map((sign) => h("kbd", {}, sign));
      rows.append(h("dt", {}, ...signs), h("dd", {}, words));
    }
    columns.append(h("section", {}, h("h3", {}, title), rows));
  }
  const close = h("button", { type: "button", autofocus: true }, "Close");
  const made = h("dialog", { class: "hints", "aria-labelledby": "hints-title" });
  append(made, [
    h("div", { class: "hints-head" }, h("h2", { id: "hints-title" }, "Keys and gestures"), close),
    columns,
  ]);
  close.addEventListener("click", () => made.close());
  // A click beside the dialog hits the dialog itself.
  made.addEventListener("click", (event) => {
    if (event.target === made) made.close();
  });
  made.addEventListener("close", () => made.remove());
  // What lies below gets no keys meanwhile.
  made.addEventListener("keydown", (event) => event.stopPropagation());
  return made;
}

function show(): void {
  if (document.querySelector("dialog.hints")) return;
  const made = dialog();
  document.body.append(made);
  made.showModal();
}

/** A button for the header that opens the hints. The key `?` opens them anywhere, unless one writes. */
export function hintsButton(): HTMLElement {
  document.addEventListener("keydown", (event) => {
    const isTyping = (event.target as Element).matches?.("input, select, textarea") ?? false;
    if (isTyping || actOf("page", event) !== "hints") return;
    event.preventDefault();
    show();
  });
  return h(
    "button",
    {
      type: "button",
      class: "hints-button",
      "aria-label": "Keys and gestures",
      "aria-keyshortcuts": shortcutsOf("page", "hints"),
      title: "Keys and gestures (?)",
      click: show,
    },
    "?",
  );
}
