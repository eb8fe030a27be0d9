// One view, large: the slider, the readout, and why the view was kept.

import { type Index, type View, loadPicture, loadThumb } from "../data.js";
import { append, count, h, named, percent, roomName, several } from "../dom.js";
import { viewPoint, viewScreen } from "../picture/geometry.js";
import { placeOf } from "../picture/gl.js";
import { image as decodedImage } from "../picture/images.js";
import { loadObjects, loadPartners } from "../relations/data.js";
import { matchPage } from "../relations/match.js";
import { objectsQuery, objectsView, shown } from "../relations/objects.js";
import { partnerCards } from "../relations/partners.js";
import { type Route, type Sight, link, replaceRoute } from "../route/route.js";
import { type Look, Viewer, lookFrom, modalitiesOf, queryOf } from "../picture/viewer.js";
import { nameOf } from "./names.js";

/** A sentence that says why a view was kept or dropped. */
export function reasonOf(view: View): string {
  if (view.photograph !== null) return "A photograph: each photograph is a view.";
  if (!view.place) return "views.json does not list it.";
  const { reason, rank, pool } = view.place;
  const place = `its entropy is number ${rank} of ${several(pool, "view")}`;
  switch (reason) {
    case "all":
      return `Kept, as all views are: ${place}.`;
    case "highest":
      return `Kept: ${place}, among the highest 60 %.`;
    case "drawn":
      return `Kept: ${place}, between the highest and the lowest, and drawn at random.`;
    case "not_drawn":
      return `Dropped: ${place}, between the highest and the lowest, and not drawn at random.`;
    case "lowest":
      return `Dropped: ${place}, among the lowest 15 %.`;
  }
}

/** The link to the panorama of a view's location, turned in the direction of the view. */
export function inPanorama(index: Index, view: View): string | null {
  const location = view.location === null ? undefined : index.locations[view.location];
  if (!location?.pano || view.yaw_deg === null || view.pitch_deg === null || view.fov_deg === null)
    return null;
  // Yaw grows to the left, longitude to the right.
  const gaze = {
    lon: String(-view.yaw_deg),
    lat: String(view.pitch_deg),
    fov: String(Math.max(view.fov_deg, 60)),
  };
  return link("pano", [location.area, location.uuid], gaze);
}

function facts(index: Index, view: View): HTMLElement {
  const list = h("dl", { class: "facts" });
  const add = (name: string, value: string | null | undefined | false): void => {
    if (value) append(list, [h("dt", {}, name), h("dd", {}, value)]);
  };
  const degrees = (value: number | null): string | null => (value === null ? null : `${value.toFixed(1)}°`);
  const share = (value: number | null | undefined): string | null => (value == null ? null : percent(value));
  add("Room", roomName(view.room));
  add("Entropy", view.entropy === null ? null : `${view.entropy.toFixed(3)} nats`);
  add("Yaw", degrees(view.yaw_deg));
  add("Pitch", degrees(view.pitch_deg));
  add("Field of view", degrees(view.fov_deg));
  add("Scan coverage", share(view.seen?.coverage));
  add("Unlabelled", share(view.seen?.unlabelled));
  add("Instances", view.seen?.instances == null ? null : count(view.seen.instances));
  const shares = [...(view.seen?.classes ?? [])].sort((a, b) => b[1] - a[1]).slice(0, 6);
  add(
    "Classes",
    shares
      .map(([c, n]) => `${named(index.classes[c]?.name ?? "?")} ${percent(n)}`.replaceAll(" ", "\u00a0"))
      .join(", "),
  );
  return list;
}

/** What is shown of a view while its file is read: its small image. Null if there is none. */
export async function viewSight(index: Index, route: Route): Promise<Sight | null> {
  const view = index.views.find((v) => v.picture === Number(route.path[0] ?? ""));
  if (!view || view.picture === null || route.path.length > 1) return null;
  const url = await loadThumb(index, view.picture);
  if (url === null) return null;
  const image = await decodedImage(url);
  const frame = h("section", { class: "viewer flat" }, h("div", { class: "frame" }, image));
  frame.style.setProperty("--shape", String(image.naturalWidth / Math.max(1, image.naturalHeight)));
  const head = h("div", { class: "look-head" }, h("h1", {}, nameOf(index, view)));
  const body = h("div", { class: "view-body" }, frame);
  return { element: h("main", { class: "look", "aria-busy": "true" }, head, body), draw: () => {} };
}

export async function viewPage(
  index: Index,
  route: Route,
): Promise<{ element: HTMLElement; close: () => void }> {
  const at = Number(route.path[0] ?? "");
  const view = index.views.find((v) => v.picture === at);
  const [, kind, number] = route.path;
  const match = view && kind !== undefined ? await matchPage(index, view, kind, Number(number)) : null;
  if (match) return match;
  if (!view || view.picture === null || kind !== undefined) {
    const page = h("main", { class: "page" }, h("h1", {}, "View"), h("p", {}, "There is no such view."));
    return { element: page, close: () => {} };
  }
  const pictures = index.views.filter((v) => v.picture !== null);
  const place = pictures.indexOf(view);
  const steps: { element: HTMLAnchorElement; picture: number }[] = [];
  const step = (by: number, words: string, sign: string): HTMLElement | null => {
    const to = pictures[place + by];
    if (!to) return null;
    const element = h("a", { class: "step", "aria-label": words }, sign);
    steps.push({ element, picture: to.picture ?? 0 });
    return element;
  };
  // The next view has the same layers.
  const pointSteps = (layers: Record<string, string>): void => {
    for (const { element, picture } of steps) element.href = link("view", [picture], layers);
  };
  const there = inPanorama(index, view);
  const head = h("div", { class: "look-head" }, h("h1", {}, nameOf(index, view)));
  append(head, [step(-1, "Previous view", "←"), step(1, "Next view", "→")]);
  pointSteps({});
  const aside = h("aside", {}, h("p", {}, reasonOf(view)), facts(index, view));
  append(aside, [there && h("p", {}, h("a", { href: there }, "Look there in the panorama"))]);
  const body = h("div", { class: "view-body" });
  const element = h("main", { class: "look" }, head, body);
  const picture = await loadPicture(index, view.picture);
  if (!picture) {
    append(body, [h("p", {}, "Its images are missing or damaged; see Notes."), aside]);
    return { element, close: () => {} };
  }
  const location = view.location === null ? undefined : index.locations[view.location];
  const look = lookFrom(route.query, modalitiesOf(index, view.area, picture), null);
  if (route.query.has("objects")) shown.objects = route.query.get("objects") === "on";
  const changed = (now: Look): void => {
    const query = { ...queryOf(now), ...(view.objects ? objectsQuery() : {}) };
    pointSteps({ ...queryOf(now), ...objectsQuery() });
    replaceRoute("view", [at], query);
  };
  const objects = view.objects
    ? objectsView({
        index,
        size: picture.of,
        room: view.room,
        objects: async () => (await loadObjects(index, at)) ?? [],
        light: (label) => viewer.light(label),
        changed: () => changed(look),
      })
    : null;
  const viewer = await Viewer.open(index, picture, look, {
    title: nameOf(index, view),
    area: view.area,
    room: view.room,
    point: (i, j, depth) => viewPoint(picture, i, j, depth),
    position: view.position ?? location?.position ?? null,
    screen: (point, _, width, height) => {
      const at = viewScreen(picture, point);
      const [left, top, w, h_] = placeOf(picture.of, width, height);
      return at && [at[0] * w + left * at[2], at[1] * h_ + top * at[2], at[2]];
    },
    changed,
    tools: [objects?.button],
    pointed: (label) => objects?.point(label),
  });
  pointSteps({ ...queryOf(look), ...objectsQuery() });
  viewer.element.classList.add("flat");
  viewer.element.style.setProperty("--shape", String(picture.of[0] / picture.of[1]));
  if (objects) {
    viewer.overlay.prepend(objects.overlay);
    aside.prepend(objects.list);
  }
  append(body, [viewer.element, aside]);
  const partners = await loadPartners(index, view.area, at).catch((e: unknown) => {
    append(element, [h("p", { role: "alert" }, e instanceof Error ? e.message : String(e))]);
    return [];
  });
  append(element, [partnerCards(index, view, partners)]);
  return { element, close: () => viewer.close() };
}
