// A person who knows what each face of a scene is, and finds the strokes that label it.

import { classOf, roomOf } from "./truth.mjs";

/** The levels of the tree that the person tries: costs of joins. */
const LEVELS = [0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1, 1.4, 2, 3, 4.5, 7];
/** A stroke goes over so many patches at most, within this of the first, metres. */
const MOST_PATCHES = 8;
const REACH = 2.5;
/** While a pointer moves, the page looks for patches at this distance, pixels, and so often at most. */
const STEP = 6;
const MOST_STEPS = 40;
/** The person looks at so many things, of which most is left, before a stroke. */
const THINGS = 6;
const FAR = [0.5, 1, 1.8, 3];

const away = (a, b) => Math.hypot(...a.map((c, k) => c - b[k]));

export class Person {
  /** `faces` are those of `facesOf`. */
  constructor(scene, faces, sight) {
    const names = [...new Set(faces.map(({ label }) => label))].filter((label) => classOf(label) !== null);
    this.scene = scene;
    this.faces = faces;
    this.sight = sight;
    this.names = [null, ...names];
    const number = new Map(this.names.map((name, thing) => [name, thing]));
    /** What each face is: from 1, 0 if nobody knows. */
    this.thing = Uint16Array.from(faces, ({ label }) => number.get(label) ?? 0);
    this.near = faces.map(({ middle }) => middle.map((c, k) => c - scene.origin[k]));
    this.all = faces.reduce((sum, { m2 }) => sum + m2, 0);
    /** The instance that stands for each thing, 0 without one. */
    this.instanceOf = new Uint32Array(this.names.length);
    this.instances = new Uint32Array(faces.length);
    this.levels = LEVELS.map((cost) =>
      Uint32Array.from({ length: scene.segments }, (_, segment) => this.nodeAt(segment, cost)),
    );
    this.ofSegment = Array.from({ length: scene.segments }, () => []);
    scene.segment.forEach((segment, face) => this.ofSegment[segment].push(face));
    for (const list of this.ofSegment) list.sort((a, b) => faces[b].m2 - faces[a].m2);
    /** What could not be done. */
    this.failed = new Set();
  }

  nodeAt(node, cost) {
    const { parent, cost: costs } = this.scene;
    while (parent[node] < costs.length && costs[parent[node]] <= cost) node = parent[node];
    return node;
  }

  holds(node, face) {
    for (let at = this.scene.segment[face]; at <= node; at = this.scene.parent[at])
      if (at === node) return true;
    return false;
  }

  /** The nodes with a face, from its segment up. */
  chain(face) {
    const found = [];
    for (let at = this.scene.segment[face]; at < this.scene.parent.length; at = this.scene.parent[at])
      found.push(at);
    return found;
  }

  /** The room that most of the floor in an outline is of, as the scene was generated. */
  roomAt(outline) {
    const [low, high] = [Math.min, Math.max].map((most) =>
      [0, 1].map((k) => most(...outline.map((p) => p[k]))),
    );
    const rooms = new Map();
    for (const { middle, m2, label } of this.faces)
      if (classOf(label) === "floor" && [0, 1].every((k) => middle[k] > low[k] && middle[k] < high[k]))
        rooms.set(roomOf(label), (rooms.get(roomOf(label)) ?? 0) + m2);
    return [...rooms].reduce((a, b) => (b[1] > a[1] ? b : a))[0];
  }

  /** The segments of a node. */
  segmentsIn(node) {
    this.below ??= new Map();
    if (!this.below.has(node)) {
      const found = [];
      for (let segment = 0; segment < this.scene.segments; segment++)
        if (this.holds(node, this.ofSegment[segment][0])) found.push(segment);
      this.below.set(node, found);
    }
    return this.below.get(node);
  }

  /** The faces of a node that have an instance. */
  patch(node, instance) {
    return this.segmentsIn(node).flatMap((segment) =>
      this.ofSegment[segment].filter((face) => this.instances[face] === instance),
    );
  }

  isRight(thing, instance) {
    return thing > 0 && instance > 0 && this.instanceOf[thing] === instance;
  }

  /** The share of the surface that has the right instance, or none where it was generated without one. */
  get right() {
    let sum = 0;
    this.faces.forEach(({ m2 }, face) => {
      const [thing, instance] = [this.thing[face], this.instances[face]];
      if (thing === 0 ? instance === 0 : this.isRight(thing, instance)) sum += m2;
    });
    return sum / this.all;
  }

  /** The instances stand for the thing of their class that they have most of, the one with most of it first. */
  meet(classes) {
    const shares = new Map();
    this.instances.forEach((instance, face) => {
      if (instance === 0) return;
      const of = shares.get(instance) ?? new Map();
      shares.set(instance, of.set(this.thing[face], (of.get(this.thing[face]) ?? 0) + this.faces[face].m2));
    });
    const most = [...shares].flatMap(([instance, of]) => {
      const known = [...of].filter(([thing]) => classes.get(instance) === classOf(this.names[thing]));
      return known.length > 0 ? [[instance, ...known.reduce((a, b) => (b[1] > a[1] ? b : a))]] : [];
    });
    for (const [instance, thing] of most.sort((a, b) => b[2] - a[2]))
      if (this.instanceOf[thing] === 0) this.instanceOf[thing] = instance;
  }

  /** The area that a set of faces would put right if they became a thing's, less what they would spoil, m². */
  gain(thing, faces) {
    let sum = 0;
    for (const face of faces) {
      const [is, instance, { m2 }] = [this.thing[face], this.instances[face], this.faces[face]];
      if (is === thing) sum += this.isRight(thing, instance) ? 0 : m2;
      else if (this.isRight(is, instance)) sum -= m2;
      else if (is > 0) sum -= 0.5 * m2;
      else if (instance === 0) sum -= m2;
    }
    return sum;
  }

  /** For each thing: the patches of one level and one instance that are best for it, by their gain. */
  wishes() {
    const { segment } = this.scene;
    const shares = new Map();
    this.faces.forEach(({ m2 }, face) => {
      const key = (segment[face] * 4096 + this.instances[face]) * 512 + this.thing[face];
      shares.set(key, (shares.get(key) ?? 0) + m2);
    });
    const best = [];
    LEVELS.forEach((cost, level) => {
      const patches = new Map();
      for (const [key, m2] of shares) {
        const [thing, rest] = [key % 512, Math.floor(key / 512)];
        const [instance, leaf] = [rest % 4096, Math.floor(rest / 4096)];
        const name = this.levels[level][leaf] * 4096 + instance;
        const of = patches.get(name) ?? new Map();
        patches.set(name, of.set(thing, (of.get(thing) ?? 0) + m2));
      }
      const strokes = new Map();
      for (const [name, of] of patches) {
        const [node, instance] = [Math.floor(name / 4096), name % 4096];
        const all = [...of].reduce((sum, [thing, m2]) => sum + (thing > 0 ? m2 : 0), 0);
        const right = [...of].find(([thing]) => this.isRight(thing, instance))?.[1] ?? 0;
        for (const [thing, m2] of of) {
          if (thing === 0 || this.isRight(thing, instance)) continue;
          const gain = m2 - right - 0.5 * (all - m2 - right);
          if (gain <= 0 || this.failed.has(`${thing} ${node} ${instance}`)) continue;
          const stroke = `${thing} ${instance}`;
          strokes.set(stroke, [...(strokes.get(stroke) ?? []), { node, gain }]);
        }
      }
      for (const [stroke, touched] of strokes) {
        const [thing, instance] = stroke.split(" ").map(Number);
        touched.sort((a, b) => b.gain - a.gain);
        const place = ({ node }) => this.near[this.ofSegment[this.segmentsIn(node)[0]][0]];
        const first = place(touched[0]);
        const within = touched.filter((one) => away(place(one), first) < REACH).slice(0, MOST_PATCHES);
        const gain = within.reduce((sum, one) => sum + one.gain, 0);
        best.push({ thing, instance, level, cost, touched: within, gain });
      }
    });
    return best.sort((a, b) => b.gain - a.gain);
  }

  /** The patches that a stroke along pixels would take, as the page finds them. */
  taken(path, cost, kind, from, target) {
    const nodes = new Map();
    const look = (pixel) => {
      const face = this.sight.face(pixel);
      if (face === null) return;
      const instance = this.instances[face];
      if (kind === "label" ? instance !== from : instance === target) return;
      const node = this.nodeAt(this.scene.segment[face], cost);
      nodes.set(`${node} ${instance}`, { node, instance });
    };
    look(path[0]);
    for (let k = 1; k < path.length; k++) {
      const [[ax, ay], [bx, by]] = [path[k - 1], path[k]];
      const steps = Math.min(MOST_STEPS, Math.ceil(Math.hypot(bx - ax, by - ay) / STEP));
      for (let j = 1; j <= steps; j++) look([ax + (j / steps) * (bx - ax), ay + (j / steps) * (by - ay)]);
    }
    return [...nodes.values()];
  }

  /** Where some of a patch is seen from the viewpoint in use; null if nowhere. */
  seen(thing, node, instance) {
    for (const segment of this.segmentsIn(node).slice(0, 12)) {
      const list = this.ofSegment[segment].filter(
        (face) => this.instances[face] === instance && this.thing[face] === thing,
      );
      for (const face of [list[0], list[1], list[list.length >> 1], list.at(-1)]) {
        const pixel = face === undefined ? null : this.sight.pixel(this.near[face]);
        const hit = pixel && this.sight.face(pixel);
        // Not at the edge: the page reckons with rounded numbers.
        if (pixel && hit !== null && this.instances[hit] === instance && this.holds(node, hit))
          return { face: hit, pixel };
      }
    }
    return null;
  }

  /** Viewpoints for what a patch has of a thing. */
  *stands(thing, patch) {
    const faces = patch.filter((face) => this.thing[face] === thing);
    faces.sort((a, b) => this.faces[b].m2 - this.faces[a].m2);
    for (const face of new Set([faces[0], faces[1], faces[faces.length >> 1]].filter((f) => f !== undefined)))
      for (const tilt of [
        [0.04, 0.06, 0.02],
        [0.6, 0, 0.3],
        [-0.6, 0, 0.3],
        [0, 0.6, 0.3],
        [0, -0.6, 0.3],
      ])
        for (const far of FAR) {
          const at = this.near[face];
          const toward = this.faces[face].normal.map((c, k) => c + tilt[k]);
          const length = Math.hypot(...toward);
          yield { at, from: at.map((c, k) => c + (far * toward[k]) / length) };
        }
  }

  /** A stroke that does most of a wish; null if none can. */
  strokeFor(wish, last) {
    const { thing, instance, cost, touched } = wish;
    const target = this.instanceOf[thing];
    const kind = target === 0 ? "label" : "add";
    const anchor = touched[0].node;
    let best = null;
    let tried = 0;
    for (const stand of this.stands(thing, this.patch(anchor, instance))) {
      this.sight.look(stand);
      const seen = touched.flatMap(({ node }) => this.seen(thing, node, instance) ?? []);
      if (!seen.some(({ face }) => this.holds(anchor, face))) continue;
      // The stroke has one level: the highest of its patches' own.
      const level = ({ face }) => this.scene.cost[this.nodeAt(this.scene.segment[face], cost)];
      const first = seen.reduce((a, b) => (level(b) > level(a) ? b : a));
      const nodeFrom = this.nodeAt(this.scene.segment[first.face], cost);
      const own = this.scene.cost[nodeFrom];
      const others = seen.filter((one) => one !== first);
      const paths = [[first.pixel]];
      let [path, rest] = [[first.pixel], others.map(({ pixel }) => pixel)];
      while (rest.length > 0) {
        const end = path.at(-1);
        rest.sort((a, b) => away(a, end) - away(b, end));
        path = [...path, rest[0]];
        rest = rest.slice(1);
        paths.push(path);
      }
      const begins = kind === "add" ? this.beginning(target, last, instance) : [[]];
      for (const begin of begins)
        for (const way of paths) {
          const whole = [...begin, ...way];
          const faces = this.taken(whole, own, kind, instance, target).flatMap((one) =>
            this.patch(one.node, one.instance),
          );
          const gain = this.gain(thing, faces);
          if (gain > (best?.gain ?? 0))
            best = {
              wish,
              kind,
              thing,
              stand,
              path: whole,
              face: first.face,
              point: first.pixel,
              node: nodeFrom,
              gain,
              patches: way.length,
            };
        }
      if (best && ++tried >= 12) break;
    }
    return best;
  }

  /** Where an adding stroke may begin so that it adds to an instance. */
  beginning(target, last, instance) {
    const ways = instance === 0 && last === target ? [[]] : [];
    let tries = 0;
    const all = this.ofInstance(target);
    const step = Math.max(1, Math.floor(all.length / 40));
    for (let k = 0; k < all.length && tries < 3; k += step) {
      const pixel = this.sight.pixel(this.near[all[k]]);
      const hit = pixel && this.sight.face(pixel);
      if (pixel && hit !== null && this.instances[hit] === target) {
        ways.push([pixel]);
        tries += 1;
      }
    }
    return ways;
  }

  ofInstance(instance) {
    const found = [];
    this.instances.forEach((of, face) => of === instance && found.push(face));
    return found.sort((a, b) => this.faces[b].m2 - this.faces[a].m2);
  }

  /** The next stroke; null if nothing is worth one. `last` is the instance that the page adds to. */
  next(last, least) {
    for (;;) {
      const wishes = this.wishes();
      const ofThing = new Map();
      for (const wish of wishes)
        if ((ofThing.get(wish.thing)?.length ?? 0) < 2)
          ofThing.set(wish.thing, [...(ofThing.get(wish.thing) ?? []), wish]);
      const few = [...ofThing.values()].slice(0, THINGS).flat();
      if (few.length === 0 || few[0].gain < least) return null;
      let best = null;
      for (const wish of few) {
        if (best && wish.gain <= best.gain) continue;
        const stroke = this.strokeFor(wish, last);
        if (stroke && stroke.gain > 0.4 * wish.gain) {
          if (!best || stroke.gain > best.gain) best = stroke;
        } else this.fail({ wish });
      }
      if (best) return best;
    }
  }

  /** Remembers that a stroke cannot be made. */
  fail({ wish }) {
    this.failed.add(`${wish.thing} ${wish.touched[0].node} ${wish.instance}`);
  }

  /** Takes a stroke as done, for planning without a page. */
  imagine(stroke, cost) {
    const target = this.instanceOf[stroke.thing];
    const from = this.instances[stroke.face];
    this.sight.look(stroke.stand);
    const faces = this.taken(stroke.path, cost, stroke.kind, from, target).flatMap((one) =>
      this.patch(one.node, one.instance),
    );
    const number = stroke.kind === "add" ? target : Math.max(...this.instances, ...this.instanceOf) + 1;
    if (stroke.kind === "label") this.instanceOf[stroke.thing] = number;
    for (const face of faces) this.instances[face] = number;
    return number;
  }
}
