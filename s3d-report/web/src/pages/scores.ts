// Scores of predictions: tables, the confusion of classes, and each room or image.

import { type ConfusionTable, type Index, type ScoreTable, type Scores, load } from "../data.js";
import { choice, count, h, named, percent, roomName, table } from "../dom.js";
import { imageLink } from "../route/places.js";
import { type Route, link, replaceRoute } from "../route/route.js";

/** The number of rooms or images in a list. */
const MOST = 50;

const number = (words: string): HTMLElement => h("span", { class: "number" }, words);

const words = (value: number | null): string => (value === null ? "–" : value.toFixed(4));

function scoreTable({ title, columns, rows }: ScoreTable): HTMLElement {
  const cells = rows.map(({ name, scores }) => [
    named(name),
    ...scores.map(({ value, interval }) =>
      h(
        "span",
        { class: "number" },
        words(value),
        value !== null &&
          interval &&
          h("span", { class: "quiet" }, ` [${words(interval[0])}, ${words(interval[1])}]`),
      ),
    ),
  ]);
  return h("section", {}, h("h3", {}, title), table(["", ...columns], cells));
}

/** A row for each true class, a column for each predicted one. A cell has its share of the row. */
function confusion({ classes, counts }: ConfusionTable): HTMLElement {
  const all = classes.map((_, row) => (counts[row] ?? []).reduce((sum, n) => sum + n, 0));
  const names = counts.some((row) => (row[classes.length] ?? 0) > 0) ? [...classes, "no class"] : classes;
  const isThere = (at: number): boolean => (all[at] ?? 0) > 0 || counts.some((row) => (row[at] ?? 0) > 0);
  const columns = names.map((_, at) => at).filter(isThere);
  const rows = columns.filter((at) => (all[at] ?? 0) > 0);

  const cell = (row: number, column: number): HTMLElement => {
    const n = counts[row]?.[column] ?? 0;
    const share = n / (all[row] ?? 1);
    const told =
      `${named(names[row] ?? "")} predicted as ${named(names[column] ?? "")}: ` +
      `${count(n)} of ${count(all[row] ?? 0)} (${percent(share)})`;
    const shown = h("span", { title: told, "aria-label": told }, n === 0 ? "" : percent(share));
    const td = h("td", { class: row === column && "same" }, shown);
    td.style.setProperty("--share", `${Math.round(70 * share)}%`);
    return td;
  };

  const caption = "True class by row, predicted class by column. A cell has its share of the true class.";
  const head = columns.map((at) => h("th", { scope: "col" }, h("span", {}, named(names[at] ?? ""))));
  const body = rows.map((row) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, named(names[row] ?? "")),
      ...columns.map((column) => cell(row, column)),
    ),
  );
  return h(
    "section",
    {},
    h("h3", {}, "Confusion of classes"),
    h("p", { class: "quiet" }, caption),
    h(
      "table",
      { class: "matrix confusion", "aria-label": caption },
      h("thead", {}, h("tr", {}, h("td", {}), ...head)),
      h("tbody", {}, ...body),
    ),
  );
}

/** The link to a room or an image, and its name in words. */
function placeOf(index: Index, area: number, name: string): { words: string; href: string | null } {
  const [, uuid, room, frame] = /^camera_([^_]+)_(.*)_frame_([^_]+)$/.exec(name) ?? [];
  const of = index.areas.length > 1 ? `area ${area} · ` : "";
  if (uuid === undefined || room === undefined || frame === undefined) {
    const views = index.views.some((view) => view.area === area && view.room === name);
    return {
      words: of + roomName(name),
      href: views ? link("views", [], { room: `${area}/${name}` }) : null,
    };
  }
  const which = frame === "equirectangular" ? "panorama" : `view ${frame}`;
  return {
    words: `${of}${roomName(room)} · ${uuid.slice(0, 8)} · ${which}`,
    href: imageLink(index, area, uuid, frame),
  };
}

/** The rooms or images by one of their scores, which can be chosen. */
function units(index: Index, { units: { columns, rows, units } }: Scores): HTMLElement | null {
  if (units.length === 0) return null;
  let row = Math.max(0, rows.indexOf("mean"));
  let column = 0;
  let order = "lowest";
  const list = h("div", {});

  const update = (): void => {
    const valued = units.flatMap((unit) => {
      const value = unit.scores[row]?.[column];
      return value === null || value === undefined ? [] : [{ unit, value }];
    });
    const sign = order === "lowest" ? 1 : -1;
    valued.sort((a, b) => sign * (a.value - b.value));
    const lines = valued.slice(0, MOST).map(({ unit, value }) => {
      const { words: name, href } = placeOf(index, unit.area, unit.name);
      return [href ? h("a", { href }, name) : name, number(words(value))];
    });
    const rest = units.length - lines.length;
    const told = rest > 0 ? `${count(rest)} more, or without this score, are in the JSON of s3d eval.` : "";
    list.replaceChildren(
      table(["", `${rows[row] ?? ""}, ${columns[column] ?? ""}`], lines),
      h("p", { class: "quiet" }, told),
    );
  };

  const numbered = (names: string[]): [string, string][] => names.map((name, i) => [String(i), name]);
  const chosen = (set: (value: string) => void) => (value: string) => {
    set(value);
    update();
  };
  const bar = h(
    "p",
    { class: "bar" },
    choice(
      "Row",
      numbered(rows),
      String(row),
      chosen((value) => (row = Number(value))),
    ),
    " ",
    choice(
      "Column",
      numbered(columns),
      String(column),
      chosen((value) => (column = Number(value))),
    ),
    " ",
    choice(
      "Order",
      [
        ["lowest", "lowest first"],
        ["highest", "highest first"],
      ],
      order,
      chosen((value) => (order = value)),
    ),
  );
  update();
  const isImage = units[0]?.name.startsWith("camera_") ?? false;
  return h("section", {}, h("h3", {}, isImage ? "Images" : "Rooms"), bar, list);
}

function result(index: Index, scores: Scores): HTMLElement {
  const { protocol, version, variant, evaluator, counted } = scores;
  const nouns = Object.entries(counted).map(([noun, n]) => `${noun} ${count(n)}`);
  const differences = (scores.against?.differences ?? []).map((of) =>
    scoreTable({ ...of, title: `${of.title}: minus the scores of the other predictions` }),
  );
  return h(
    "div",
    {},
    h("h2", {}, `${protocol} as ${variant}`),
    h(
      "p",
      { class: "quiet" },
      `${nouns.join(", ")} · version ${version} of the protocol, s3d-eval ${evaluator}`,
    ),
    ...scores.notes.map((note) => h("p", {}, note)),
    ...scores.tables.map(scoreTable),
    ...differences,
    scores.confusion && confusion(scores.confusion),
    units(index, scores),
    h(
      "details",
      {},
      h("summary", {}, "Definition"),
      h("ul", {}, ...scores.definition.map((sentence) => h("li", {}, sentence))),
    ),
  );
}

export async function scoresPage(index: Index, route: Route): Promise<HTMLElement> {
  const files = Array.from({ length: index.scores }, (_, i) => load<Scores>(`scores_${i}`));
  const all = await Promise.all(files);
  const asked = Number(route.path[0] ?? 0);
  const place = h("div", {});
  const show = (at: number): void => {
    const scores = all[at];
    place.replaceChildren(scores ? result(index, scores) : h("p", {}, "There are no such scores."));
  };
  const names = all.map(({ name, protocol }, i): [string, string] => [
    String(i),
    `${named(name)} (${protocol})`,
  ]);
  const chooser =
    all.length > 1 &&
    choice("Predictions", names, String(asked), (value) => {
      replaceRoute("scores", [value], {});
      show(Number(value));
    });
  show(asked);
  return h("main", { class: "page" }, h("h1", {}, "Scores"), chooser, place);
}
