// Statistics of the votes of annotated points: how many votes faces have, by how much they are won, and
// between which classes.

import { bar, spread } from "./charts.js";
import { css } from "../colors.js";
import type { Index, VoteSpread, Votes } from "../data.js";
import { append, count, h, named, percent, several, table } from "../dom.js";
import { patchLink } from "../route/places.js";

const number = (words: string): HTMLElement => h("span", { class: "number" }, words);

/** The largest number of classes in a matrix; more are shown as a list. */
const MATRIX = 16;

/** Faces by the margin of their label. */
function margins(votes: Votes): HTMLElement {
  const { faces_voted, faces_contested } = votes.total;
  const close = votes.total.faces_won_with_less_than_three_quarters;
  const none = votes.total.faces_won_with_less_than_half;
  const rows: [string, number][] = [
    ["all of the votes", faces_voted - faces_contested],
    ["three quarters or more", faces_contested - close],
    ["half to three quarters", close - none],
    ["less than half", none],
    ["no votes", votes.faces_without_votes],
  ];
  return table(
    ["Won with", "Faces", "", ""],
    rows.map(([name, faces]) => [
      name,
      number(count(faces)),
      number(percent(faces / Math.max(1, votes.faces))),
      bar(faces / Math.max(1, votes.faces), "var(--accent)"),
    ]),
  );
}

function byName(index: Index, kind: "Class" | "Room", votes: Votes): HTMLElement {
  const parts = (kind === "Class" ? votes.classes : votes.rooms).filter((part) => part.points > 0);
  const color = (name: string): string =>
    css(index.classes.find((c) => c.name === name)?.color ?? [128, 128, 128]);
  const key = (name: string): HTMLElement => {
    const square = h("span", { class: "key" });
    square.style.background = color(name);
    return h("span", {}, kind === "Class" ? square : null, named(name));
  };
  return table(
    [kind, "Points", "Faces", "Votes a face", "Disputed", "Under ¾"],
    parts.map((part) => [
      key(part.name),
      number(count(part.points)),
      number(count(part.faces_voted)),
      number(part.votes_per_voted_face.toFixed(1)),
      number(percent(part.faces_contested / Math.max(1, part.faces_voted))),
      number(count(part.faces_won_with_less_than_three_quarters)),
    ]),
  );
}

/** The largest patch that is disputed between two classes. */
function largest(index: Index, area: number, votes: Votes, pair: [string, string]): string | null {
  const of_class = (label: string): string => label.split("_")[0] ?? "";
  const wanted = [...pair].sort().join();
  const patch = votes.disputed_patches.find((p) => p.labels.map(of_class).sort().join() === wanted);
  return patch ? patchLink(index, area, patch.center) : null;
}

function matrix(index: Index, area: number, votes: Votes): HTMLElement {
  const disputes = votes.disputing_classes;
  const involved = new Set(disputes.flatMap((d) => d.classes));
  const order = index.classes.map((c) => c.name);
  const names = [...involved].sort((a, b) => order.indexOf(a) - order.indexOf(b));
  const words = (d: Votes["disputing_classes"][number]): string =>
    `${d.classes.map(named).join(" and ")}: ${several(d.faces, "face")}, ${d.m2.toFixed(3)} m²`;
  const cell = (d: Votes["disputing_classes"][number], text: string): HTMLElement => {
    const href = largest(index, area, votes, d.classes);
    return href
      ? h("a", { href, title: words(d), "aria-label": words(d) }, text)
      : h("span", { title: words(d) }, text);
  };
  if (names.length > MATRIX)
    return table(
      ["Classes", "Faces", "Surface"],
      disputes.map((d) => [
        cell(d, d.classes.map(named).join(" and ")),
        number(count(d.faces)),
        number(`${d.m2.toFixed(3)} m²`),
      ]),
    );
  const most = Math.max(...disputes.map((d) => d.faces));
  const head = h(
    "tr",
    {},
    h("td", {}),
    ...names.map((name) => h("th", { scope: "col" }, h("span", {}, named(name)))),
  );
  const rows = names.map((row, i) => {
    const cells = names.slice(0, i + 1).map((column) => {
      const d = disputes.find(
        ({ classes: [a, b] }) => (a === row && b === column) || (a === column && b === row),
      );
      const td = h("td", {}, d ? cell(d, count(d.faces)) : null);
      if (d) td.style.setProperty("--share", `${Math.round(12 + 58 * (d.faces / most))}%`);
      return td;
    });
    return h("tr", {}, h("th", { scope: "row" }, named(row)), ...cells);
  });
  return h("table", { class: "matrix" }, h("thead", {}, head), h("tbody", {}, ...rows));
}

/** How the faces of an area are distributed over numbers of votes and margins. */
function spreads({ votes, margin }: VoteSpread): HTMLElement[] {
  // The largest and the smallest number of votes of a face in bin k.
  const most = (k: number): number => (k === 0 ? 0 : 2 ** (k - 1));
  const fewest = (k: number): number => (k < 2 ? k : most(k - 1) + 1);
  const range = (k: number): string =>
    fewest(k) === most(k) ? count(most(k)) : `${count(fewest(k))} to ${count(most(k))}`;
  const words =
    "Shares of the faces, and in grey beside them the shares of their surface. The margin is the lead of the " +
    "first label over the second, as a share of all votes of the face. Point at a bar, or go from bar to bar " +
    "with arrow keys, to read it.";
  const charts = [
    spread({
      title: "Votes of a face, up to",
      bins: votes,
      nameOf: (k) => `${range(k)} ${k === 1 ? "vote" : "votes"}`,
      ticks: { of: "bars", words: votes.map((_, k) => String(most(k))) },
    }),
    spread({
      title: "Margin of faces with votes",
      bins: margin,
      nameOf: (k) => `${10 * k} to ${10 * (k + 1)} %`,
      ticks: { of: "axis", words: ["0 %", "50 %", "100 %"] },
    }),
  ];
  return [h("p", { class: "quiet" }, words), h("div", { class: "charts" }, ...charts)];
}

export function votesSection(index: Index): HTMLElement | null {
  const spreadOf = (area: number): VoteSpread | null =>
    index.meshes.find((mesh) => mesh.area === area)?.spread ?? null;
  const votesOf = (area: number): Votes | null => index.votes.find((v) => v.area === area)?.votes ?? null;
  const areas = index.areas.map(({ area }) => area).filter((area) => votesOf(area) ?? spreadOf(area));
  if (areas.length === 0) return null;
  const section = h("section", {}, h("h2", {}, "Votes"));
  for (const area of areas) {
    const [votes, faces] = [votesOf(area), spreadOf(area)];
    if (areas.length > 1) append(section, [h("h3", {}, `Area ${area}`)]);
    const charts = faces ? spreads(faces) : [];
    if (!votes) {
      append(section, charts);
      continue;
    }
    const { points, faces_voted, votes_per_voted_face } = votes.total;
    append(section, [
      h(
        "p",
        { class: "quiet" },
        `${count(points)} annotated points voted for ${count(faces_voted)} of ${count(votes.faces)} faces, ` +
          `${votes_per_voted_face.toFixed(1)} for each.`,
      ),
      margins(votes),
      ...charts,
      byName(index, "Class", votes),
    ]);
    if (votes.rooms.length > 1) append(section, [byName(index, "Room", votes)]);
    if (votes.disputing_classes.length === 0) continue;
    append(section, [
      h("h3", {}, "Disputes between classes"),
      h(
        "p",
        { class: "quiet" },
        "Faces that were won with less than three quarters of the votes, by the classes of the first and the " +
          "second label. A number leads to the largest patch.",
      ),
      matrix(index, area, votes),
    ]);
  }
  return section;
}
