// A stand-in for the server of `s3d label`: node mock.mjs OBJ PORT.
import { createServer } from "node:http";
import { readFileSync, existsSync, readdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { createRequire } from "node:module";
const { PNG } = createRequire(new URL("../../../../s3d-report/web/package.json", import.meta.url))("pngjs");

const [obj, port] = process.argv.slice(2);
const dir = dirname(obj);
const photos = [];
{
  const root = join(dir, "../area_1/pano/rgb");
  if (existsSync(root))
    for (const name of readdirSync(root)) {
      const pose = JSON.parse(readFileSync(join(root, "../pose", name.replace("_rgb.png", "_pose.json"))));
      const [, , [fx, fy]] = pose.camera_rt_matrix;
      const png = PNG.sync.read(readFileSync(join(root, name)));
      const out = new PNG({ width: png.width, height: png.height });
      const shift = Math.round((Math.atan2(fx, fy) / (2 * Math.PI)) * png.width);
      for (let y = 0; y < png.height; y++)
        for (let x = 0; x < png.width; x++) {
          const u = (x - shift + png.width) % png.width;
          png.data.copy(
            out.data,
            4 * (y * png.width + x),
            4 * (y * png.width + u),
            4 * (y * png.width + u) + 4,
          );
        }
      photos.push({
        name: pose.room + "_" + pose.camera_uuid.slice(0, 4),
        at: pose.camera_location,
        kind: "panorama",
        png: PNG.sync.write(out),
      });
    }
}
const page = new URL("../../../src/server/page.html", import.meta.url);
const mats = [],
  textures = [],
  matOf = new Map();
{
  let name;
  for (const line of readFileSync(join(dir, "rgb.mtl"), "utf8").split("\n")) {
    const w = line.trim().split(/\s+/);
    if (w[0] === "newmtl") {
      name = w[1];
      matOf.set(name, mats.length);
      mats.push({ color: [200, 200, 200], texture: null });
    }
    if (w[0] === "Kd") mats.at(-1).color = w.slice(1).map((c) => Math.round(255 * c));
    if (w[0] === "map_Kd") {
      let i = textures.indexOf(w[1]);
      if (i < 0) {
        i = textures.length;
        textures.push(w[1]);
      }
      mats.at(-1).texture = i;
    }
  }
}
const V = [],
  T = [],
  F = [],
  M = [],
  UV = [];
let m = 0;
for (const line of readFileSync(obj, "utf8").split("\n")) {
  const w = line.split(/\s+/);
  if (w[0] === "v") V.push([+w[1], -w[3], +w[2]]);
  else if (w[0] === "vt") T.push([+w[1], +w[2]]);
  else if (w[0] === "usemtl") m = matOf.get(w[1]);
  else if (w[0] === "f") {
    const c = w.slice(1, 4).map((x) => x.split("/"));
    F.push(c.map((x) => x[0] - 1));
    M.push(m);
    UV.push(...c.flatMap((x) => T[x[1] - 1] ?? [0, 0]));
  }
}
const n = F.length;
const sub = (a, b) => a.map((c, k) => c - b[k]);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const normal = [],
  area = [];
for (const f of F) {
  const [a, b, c] = f.map((v) => V[v]);
  const x = cross(sub(b, a), sub(c, a));
  const l = Math.hypot(...x);
  area.push(l / 2);
  normal.push(x.map((k) => k / (l || 1)));
}
const key = (v) => V[v].map((c) => Math.round(1e3 * c)).join();
const edges = new Map();
F.forEach((f, i) => {
  for (let k = 0; k < 3; k++) {
    const e = [key(f[k]), key(f[(k + 1) % 3])].sort().join("|");
    edges.set(e, [...(edges.get(e) ?? []), i]);
  }
});
const up = Array.from({ length: n }, (_, i) => i);
const find = (i) => {
  while (up[i] !== i) i = up[i] = up[up[i]];
  return i;
};
const borders = [];
for (const fs of edges.values())
  for (let k = 1; k < fs.length; k++) {
    const [a, b] = [fs[0], fs[k]];
    const d = normal[a].reduce((s, c, q) => s + c * normal[b][q], 0);
    if (d > 0.95 && M[a] === M[b]) up[find(a)] = find(b);
    else borders.push([1 - d, a, b]);
  }
const num = new Map(),
  seg = new Uint32Array(n);
for (let i = 0; i < n; i++) {
  const r = find(i);
  if (!num.has(r)) num.set(r, num.size);
  seg[i] = num.get(r);
}
const parent = Array(num.size).fill(0xffffffff),
  cost = Array(num.size).fill(0);
const top = (x) => {
  while (parent[x] !== 0xffffffff) x = parent[x];
  return x;
};
borders.sort((a, b) => a[0] - b[0]);
for (const [c, a, b] of borders) {
  const [x, y] = [top(seg[a]), top(seg[b])];
  if (x === y) continue;
  parent[x] = parent[y] = parent.length;
  parent.push(0xffffffff);
  cost.push(c);
}
console.log(n, "faces", num.size, "segments", parent.length, "nodes");
const N = parent.length,
  size = new Uint32Array(N),
  first = new Uint32Array(N);
for (const s of seg) size[s]++;
parent.forEach((p, x) => {
  if (p !== 0xffffffff) size[p] += size[x];
});
{
  const nx = new Uint32Array(N);
  let roots = 0;
  for (let x = N - 1; x >= 0; x--) {
    const p = parent[x];
    const at = p === 0xffffffff ? roots : nx[p];
    if (p === 0xffffffff) roots += size[x];
    else nx[p] += size[x];
    first[x] = nx[x] = at;
  }
}
const order = new Uint32Array(n);
{
  const at = first.slice();
  for (let f = 0; f < n; f++) order[at[seg[f]]++] = f;
}
const facesOf = (node) => [...order.subarray(first[node], first[node] + size[node])].sort((a, b) => a - b);
const classes = "ceiling floor wall beam column window door table chair sofa bookcase board clutter".split(
  " ",
);
let label = new Uint32Array(n),
  inst = new Map(),
  rooms = new Map(),
  next = 1,
  revision = 0;
const undo = [],
  redo = [];
const runs = (fs) => {
  const r = [];
  let e = 0;
  for (const f of fs) {
    if (r.length && f === e) r[r.length - 1]++;
    else r.push(f - e, 1);
    e = f + 1;
  }
  return r;
};
const unrun = (r) => {
  const o = [];
  let f = 0;
  for (let i = 0; i < r.length; i += 2) {
    f += r[i];
    for (let k = 0; k < r[i + 1]; k++) o.push(f++);
  }
  return o;
};
const patch = ({ face, node }) => facesOf(node).filter((f) => label[f] === label[face]);
const select = (s) => [...new Set([...(s.patches ?? []).flatMap(patch), ...unrun(s.faces ?? [])])];
const structure = () => {
  const surfaces = [];
  num.forEach((s) => {
    const fs = facesOf(s);
    const a = fs.reduce((t, f) => t + area[f], 0);
    const z = normal[fs[0]][2];
    if (a > 3)
      surfaces.push({
        class: z > 0.9 ? "floor" : z < -0.9 ? "ceiling" : "wall",
        faces: runs(fs),
        room: 0,
        area_m2: a,
      });
  });
  return {
    surfaces,
    rooms: [
      {
        kind: "office",
        name: null,
        parts: [
          {
            outline: [
              [12, 4],
              [18, 4],
              [18, 10],
              [12, 10],
            ],
            heights: [0, 2.8],
          },
        ],
      },
      {
        kind: "lounge",
        name: null,
        parts: [
          {
            outline: [
              [18.2, 4],
              [26, 4],
              [26, 10],
              [18.2, 10],
            ],
            heights: [0, 2.8],
          },
        ],
      },
    ],
  };
};
let struct;
const state = () => {
  const by = new Map();
  for (let f = 0; f < n; f++)
    if (label[f]) {
      const x = by.get(label[f]) ?? [0, 0];
      by.set(label[f], [x[0] + 1, x[1] + area[f]]);
    }
  const total = area.reduce((a, b) => a + b, 0),
    lab = [...by.values()].reduce((a, b) => a + b[1], 0);
  return {
    revision,
    instances: [...by].map(([number, [faces, area_m2]]) => ({
      number,
      name: `${inst.get(number)}_${number}`,
      class: inst.get(number),
      faces,
      area_m2,
    })),
    rooms: [...rooms].map(([number, is]) => ({ number, name: `${is.kind}_${number}`, is, faces: 0 })),
    labelled_m2: lab,
    total_m2: total,
    labelled_pixels: Math.round(((1e6 * lab) / total) * 0.9),
    total_pixels: 1e6,
    can_undo: undo.length > 0,
    can_redo: redo.length > 0,
  };
};
const act = (g) => {
  const snap = () => ({ label: label.slice(), inst: new Map(inst), rooms: new Map(rooms) });
  const put = (s) => {
    ({ label, inst, rooms } = s);
  };
  const [k, v] = typeof g === "string" ? [g] : Object.entries(g)[0];
  if (k === "undo" || k === "redo") {
    const [from, to] = k === "undo" ? [undo, redo] : [redo, undo];
    if (!from.length) throw Error("Nothing to " + k);
    to.push(snap());
    put(from.pop());
    return;
  }
  undo.push(snap());
  redo.length = 0;
  if (k === "label") {
    for (const f of select(v.what)) label[f] = next;
    inst.set(next++, v.class);
  } else if (k === "add") for (const f of select(v.what)) label[f] = v.instance;
  else if (k === "erase") for (const f of select(v.what)) label[f] = 0;
  else if (k === "cut") {
    const fs = v.by.faces ? unrun(v.by.faces) : patch(v.at).filter((f, i) => i % 2);
    for (const f of fs) label[f] = next;
    inst.set(next++, v.class);
  } else if (k === "join") {
    for (let f = 0; f < n; f++) if (v.instances.includes(label[f])) label[f] = v.into;
  } else if (k === "class") inst.set(v.instance, v.class);
  else if (k === "accept") {
    for (const i of v.surfaces) {
      for (const f of unrun(struct.surfaces[i].faces)) if (!label[f]) label[f] = next;
      inst.set(next++, struct.surfaces[i].class);
    }
    for (const i of v.rooms) rooms.set(next++, struct.rooms[i]);
  } else if (k === "room") rooms.set(v.room ?? next++, v.is);
  else if (k === "remove_room") rooms.delete(v.room);
  else if (k === "join_rooms") {
    const a = rooms.get(v.into);
    rooms.set(v.into, { ...a, parts: [...a.parts, ...v.rooms.flatMap((r) => rooms.get(r).parts)] });
    for (const r of v.rooms) rooms.delete(r);
  } else if (k === "split_room") {
    const a = rooms.get(v.room),
      [[x0, y0], [x1, y1]] = v.line,
      side = ([x, y]) => (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0);
    const half = (sign) => {
      const o = a.parts[0].outline,
        out = [];
      o.forEach((p, i) => {
        const q = o[(i + 1) % o.length],
          [s, u] = [side(p) * sign, side(q) * sign];
        if (s >= 0) out.push(p);
        if (s * u < 0) out.push(p.map((c, k) => c + ((q[k] - c) * s) / (s - u)));
      });
      return { ...a, parts: [{ ...a.parts[0], outline: out }] };
    };
    rooms.set(v.room, half(1));
    rooms.set(next++, half(-1));
  } else throw Error("not mocked: " + k);
};
const bin = {
  "positions.bin": () => Float32Array.from(V.flat()),
  "faces.bin": () => Uint32Array.from(F.flat()),
  "materials.bin": () => Uint16Array.from(M),
  "uv.bin": () => Float32Array.from(UV),
  "segments.bin": () => seg,
  "labels.bin": () => label,
};
createServer(async (q, r) => {
  const path = decodeURIComponent(new URL(q.url, "http://x").pathname).replace(/^\/t\//, "");
  const json = (o, c = 200) => {
    r.writeHead(c, { "content-type": "application/json" });
    r.end(JSON.stringify(o));
  };
  let body = "";
  for await (const c of q) body += c;
  try {
    if (path === "") return r.writeHead(200, { "content-type": "text/html" }).end(readFileSync(page));
    if (bin[path]) {
      const a = bin[path]();
      return r.end(Buffer.from(a.buffer, a.byteOffset, a.byteLength));
    }
    if (path === "tree.bin")
      return r.end(
        Buffer.concat([
          Buffer.from(Uint32Array.from(parent).buffer),
          Buffer.from(Float32Array.from(cost).buffer),
        ]),
      );
    if (path.startsWith("texture/")) return r.end(readFileSync(join(dir, textures[+path.slice(8)])));
    if (path === "scene.json")
      return json({
        name: "demo",
        folder: "/tmp/demo.labels",
        version: "0",
        faces: n,
        vertices: V.length,
        origin: [0, 0, 0],
        box: [
          V.reduce((a, b) => a.map((c, k) => Math.min(c, b[k]))),
          V.reduce((a, b) => a.map((c, k) => Math.max(c, b[k]))),
        ],
        classes,
        room_types: ["office", "hallway", "lounge"],
        has_colors: false,
        materials: mats,
        textures: textures.length,
        nodes: parent.length,
        segments: num.size,
        photographs: photos.map(({ png, ...p }) => p),
        warnings: [],
      });
    if (path === "state.json") return json(state());
    if (path === "structure.json") return json((struct ??= structure()));
    if (path.startsWith("photograph/")) return r.end(photos[+path.slice(11)].png);
    if (path === "doubt.json") {
      const not = new Set(
        new URL(q.url, "http://x").searchParams.get("not").split(",").filter(Boolean).map(Number),
      );
      let best = null;
      for (let s = 0; s < num.size; s++) {
        if (not.has(s)) continue;
        const fs = facesOf(s).filter((f) => !label[f]);
        const a = fs.reduce((t, f) => t + area[f], 0);
        if (fs.length && (!best || a > best.a)) best = { a, f: fs[0], s };
      }
      if (!best) return json({ doubt: null });
      const at = V[F[best.f][0]],
        nn = normal[best.f];
      const [cl] = [...inst.values()];
      return json({
        doubt: {
          face: best.f,
          node: best.s,
          area_m2: best.a,
          at,
          from: at.map((c, k) => c + 2 * nn[k] + (k === 2 ? 0.3 : 0.1)),
          guess: cl ? { class: cl, like: cl + "_1" } : null,
        },
      });
    }
    if (path === "similar.json") {
      const out = [];
      for (let s = 0; s < num.size && out.length < 7; s++) {
        const fs = facesOf(s);
        if (!label[fs[0]] && fs.length > 20 && fs.length < 60) out.push({ face: fs[0], node: s });
      }
      return json({ patches: out });
    }
    if (path === "save") return json({ saved: ["labels.npz", "rooms.json"] });
    if (path === "write") return json({ written: "/tmp/demo.labels/" + JSON.parse(body).format });
    if (path === "checks.json")
      return json({
        checks: [
          {
            kind: "two_pieces",
            text: "chair_3 has two pieces, 1.2 m apart",
            at: [22, 6, 1],
            from: [20, 4, 2],
            instance: 3,
          },
        ],
      });
    if (path === "gesture") {
      const { revision: at, gesture } = JSON.parse(body);
      if (at !== revision) return json({ error: "stale", revision }, 409);
      const before = label.slice();
      try {
        act(gesture);
      } catch (e) {
        return json({ error: e.message }, 422);
      }
      revision++;
      const by = new Map();
      for (let f = 0; f < n; f++)
        if (label[f] !== before[f]) by.set(label[f], [...(by.get(label[f]) ?? []), f]);
      return json({ state: state(), changed: [...by].map(([i, fs]) => [i, runs(fs)]) });
    }
    json({ error: "no " + path }, 404);
  } catch (e) {
    console.error(e);
    json({ error: String(e) }, 500);
  }
}).listen(+port, "127.0.0.1", () => console.log("ready"));
