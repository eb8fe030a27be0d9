// The terms of what is bundled in a page.

import { append, h } from "./dom.js";

/** The licences of bundled packages, inserted by bundle.mjs. */
declare const LICENCES: { name: string; version: string; text: string }[];

export function licences(): HTMLElement {
  const others = LICENCES.map(({ name, version }) => `${name} ${version}`);
  const words =
    "This page is part of s3d, which is under the MIT licence or the Apache licence 2.0, as you choose. " +
    `It contains ${others.slice(0, -1).join(", ")} and ${others.at(-1)}, under these terms:`;
  const details = h("details", {}, h("summary", {}, "Licences"), h("p", {}, words));
  for (const { name, text } of LICENCES) append(details, [h("h3", {}, name), h("pre", {}, text)]);
  return details;
}
