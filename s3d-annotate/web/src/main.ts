// Starts the page: reads the scene, and puts the tools together.

import { append, h, named } from "../../../s3d-report/web/src/dom.js";
import type { Sides } from "../../../s3d-report/web/src/space/eye.js";
import { Commands } from "./commands.js";
import type { Desk } from "./desk.js";
import { Cuts } from "./hand/cuts.js";
import { Hover } from "./hand/hover.js";
import { Painting } from "./hand/painting.js";
import { Pointer } from "./hand/pointer.js";
import { Look } from "./look.js";
import { boxOf, readMesh } from "./mesh/mesh.js";
import { Tree } from "./mesh/tree.js";
import { Classes } from "./panels/classes.js";
import { Help } from "./panels/help.js";
import { Plan } from "./panels/plan.js";
import { Side } from "./panels/side.js";
import { Stands } from "./panels/stands.js";
import { Status } from "./panels/status.js";
import { Top } from "./panels/top.js";
import { Proposals } from "./proposals.js";
import { Review } from "./review.js";
import { Frame, type Scene } from "./scene.js";
import { readBytes, readJson } from "./server.js";
import { keepAddress } from "./space/address.js";
import { FaceTable } from "./space/table.js";
import { View } from "./space/view.js";
import { Work } from "./work.js";

const progress = h("p", { class: "progress", role: "status" }, "Reading the scene …");

async function readTree({ faces, nodes }: Scene): Promise<Tree> {
  const [segments, tree] = await Promise.all([
    readBytes("segments.bin", 4 * faces),
    readBytes("tree.bin", 8 * nodes),
  ]);
  return new Tree(
    new Uint32Array(segments),
    new Uint32Array(tree, 0, nodes),
    new Float32Array(tree, 4 * nodes, nodes),
  );
}

async function start(): Promise<void> {
  document.body.append(progress);
  const scene = await readJson<Scene>("scene.json");
  document.title = `${scene.name} · s3d label`;
  const where = new Frame(scene.origin);
  const [mesh, tree] = await Promise.all([readMesh(scene), readTree(scene)]);
  const work = await Work.read(tree);
  const look = new Look(scene.classes);
  const table = new FaceTable(scene.faces);
  const canvas = h("canvas", {
    tabindex: 0,
    role: "application",
    "aria-label": "The scene in 3D. Arrow keys turn, plus and minus zoom, H shows all keys.",
  });
  const classes = new Classes(scene.classes, look);
  const status = new Status(look);
  const covered = (): Sides => {
    const wide = window.innerWidth > 700;
    return {
      left: wide ? classes.element.offsetWidth : 0,
      right: wide ? side.element.offsetWidth : 0,
      top: 48,
      bottom: 40,
    };
  };
  const view = new View(canvas, scene, where, table, covered);
  const hover = new Hover(view, work, table, mesh.areas);
  const proposals = new Proposals(work, table, look);
  const desk: Desk = {
    scene,
    where,
    mesh,
    look,
    view,
    table,
    work,
    hover,
    proposals,
    inHand: () => classes.inHand,
    perform: (gesture) => work.perform(gesture),
    say: (words, isFault) => status.say(words, isFault),
  };
  const cuts = new Cuts(desk);
  const painting = new Painting(desk);
  const review = new Review(desk);
  const plan = new Plan(desk);
  const stands = new Stands(desk);
  const help = new Help(() => canvas.focus());
  const commands = new Commands(desk, { classes, cuts, painting, review, plan, help });
  const top = new Top(
    scene,
    () => help.open(),
    () => commands.does("plan"),
  );
  const side = new Side(look, {
    doubt: () => void review.next().then(() => canvas.focus()),
    accept: () => void review.accept().then(() => canvas.focus()),
    acceptAll: () => void commands.acceptAll(),
    visit: ({ number }) => {
      work.last = number;
      view.frameBox(boxOf(mesh, work.facesOf(number)));
      side.tell(work.state, number);
    },
    check: ({ at, from }) => view.fly({ at: where.near(at), from: where.near(from) }),
  });

  const tellHover = (): void => {
    const { now } = hover;
    const name = now && now.instance > 0 ? (work.instance(now.instance)?.name ?? null) : null;
    status.hover(now, name, now ? proposals.classAt(now.face) : null, hover.level);
  };
  const tellProposals = (): void => {
    const { surfaces, rooms } = proposals.all();
    side.tellProposals(surfaces.length, rooms.length);
  };
  const tell = (): void => {
    classes.tell(work.state);
    top.tell(work.state, work.saved);
    side.tell(work.state, work.last);
    plan.tell();
    tellProposals();
  };
  hover.changed = tellHover;
  review.told = (words, canAccept) => side.tellDoubt(words, canAccept);
  work.said = (words, isFault) => status.say(words, isFault);
  work.painted = (faces) => proposals.paint(faces);
  work.changed = () => {
    tell();
    review.renew();
    hover.renew();
    view.draw();
  };
  proposals.arrived = () => {
    tell();
    view.draw();
  };
  classes.changed = () => {
    status.take(classes.inHand);
    view.paint.hand.value.fromArray(look.of(classes.inHand)).divideScalar(255);
  };
  classes.left = () => canvas.focus();
  view.entered = () => {
    stands.entered();
    if (view.photograph === null) delete document.body.dataset["photograph"];
    else document.body.dataset["photograph"] = String(view.photograph);
  };
  new Pointer(desk, painting, cuts);

  document.body.append(
    h(
      "main",
      {},
      top.element,
      top.banner,
      classes.element,
      side.element,
      plan.element,
      cuts.bar,
      stands.element,
      status.element,
      cuts.overlay,
      canvas,
    ),
    help.element,
  );
  classes.changed();
  proposals.paint(work.instances.keys());
  tell();
  await view.build(mesh, (share) => {
    progress.textContent = `Preparing the mesh: ${Math.round(100 * share)} %`;
  });
  progress.remove();
  const moved = keepAddress(view, where);
  view.drawn = () => {
    stands.place();
    if (cuts.way === "box") cuts.draw();
    moved();
  };
  for (const warning of scene.warnings) status.say(warning, true);
  help.openOnce();
  if (!help.element.open) canvas.focus();
  document.body.dataset["ready"] = "true";
  const fault = (e: unknown): void => status.say(e instanceof Error ? e.message : String(e), true);
  view.loadTextures().then(() => (document.body.dataset["loaded"] = "all"), fault);
  void work.awaitPixels();
  proposals.load().then(() => (document.body.dataset["proposed"] = "true"), fault);
}

start().catch((e: unknown) => {
  progress.remove();
  const words = e instanceof Error ? e.message : String(e);
  append(document.body, [h("p", { class: "broken", role: "alert" }, named(words))]);
});
