// The page's text has the sizes, weights and heights of lines of one scale.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const style = ["base.css", "style.css", "relations.css", "present.css", "../../s3d-annotate/web/label.css"]
  .map((name) => readFileSync(new URL(`../../${name}`, import.meta.url), "utf8"))
  .join("\n");

/** The values of a property, in all rules. */
const values = (property) =>
  [...style.matchAll(new RegExp(`[{;\\s]${property}:\\s*([^;}]+)`, "g"))].map(([, value]) => value.trim());

for (const [property, name] of [
  ["font-size", "size"],
  ["font-weight", "weight"],
  ["line-height", "line"],
])
  test(`every ${property} is one of the scale`, () => {
    const known = new Set(
      [...style.matchAll(new RegExp(`--(${name}-[a-z]+): [\\d.]`, "g"))].map(([, it]) => it),
    );
    assert.ok(known.size >= 3 && known.size <= 6, [...known].join(" "));
    const used = values(property);
    assert.ok(used.length >= 4, `${used}`);
    for (const value of used) {
      // The letters of a plan are as large as its unit asks, and charts have units of their own.
      if (/^calc\([\d.]+ \* var\(--unit\)\)$/.test(value)) continue;
      const [, of] = /^(?:calc\([\d.]+ \* )?var\(--([a-z-]+)\)\)?$/.exec(value) ?? [];
      assert.ok(known.has(of), `${property}: ${value}`);
    }
  });
