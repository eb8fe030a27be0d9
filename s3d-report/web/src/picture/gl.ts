// A picture on a WebGL2 canvas, on a sphere or flat. Left and right of a line it shows two modalities, or
// another picture of the same camera on the right.

import { MISSING, NULL_LABEL, TABLE_WIDTH, depthRamp, labelTable, marginRamp } from "../colors.js";
import type { Index, Picture } from "../data.js";
import { type Gaze, focal } from "./geometry.js";
import { fitted, image, numbers, pixelsOf } from "./images.js";
import { MARGINS_WIDTH, MODALITIES, type Modality, PIXELS, VERTICES } from "./shader.js";

export { MODALITIES, type Modality };

/** The numbers of a picture's pixels; null for modalities that it does not have. */
export interface Numbers {
  width: number;
  height: number;
  /** Units of depth; 65,535 where nothing was seen. */
  depth: Uint16Array | null;
  /** Indices of labels; `NO_LABEL` where nothing was seen. */
  label: Uint32Array | null;
  /** Faces of the mesh; `NO_FACE` where nothing was seen. */
  face: Uint32Array | null;
}

export const NO_DEPTH = 65_535;
export const NO_LABEL = 0x0d0d0d;
export const NO_FACE = 0xffffff;

/** A picture of the same camera, shown right of the line. */
export interface Other {
  picture: Picture;
  /** The indices of its labels in the renderer's index. */
  labels: Uint32Array;
  /** The factor for its depths. */
  depth: number;
}

export interface Scene {
  left: Modality;
  right: Modality;
  /** The position of the line as a share of the width. */
  split: number;
  /** The direction of view in a panorama; null for a view, which is flat. */
  gaze: Gaze | null;
  /** The label that lights up. */
  lit?: number | null;
}

/** The rectangle of a flat picture with this shape on a canvas: left, top, width, height. */
export function placeOf(
  of: [number, number],
  width: number,
  height: number,
): [number, number, number, number] {
  const scale = Math.min(width / of[0], height / of[1]);
  const [w, h] = [of[0] * scale, of[1] * scale];
  return [(width - w) / 2, (height - h) / 2, w, h];
}

export class Renderer {
  private readonly gl: WebGL2RenderingContext;
  private readonly program: WebGLProgram;
  private readonly textures = new Map<string, WebGLTexture>();
  private picture: Picture | null = null;
  private other: Picture | null = null;
  private ends: [number, number] = [0, 1];
  private faces = 0;

  constructor(
    readonly canvas: HTMLCanvasElement,
    index: Index,
  ) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: true, premultipliedAlpha: true });
    if (!gl) throw new Error("This browser has no WebGL 2, which panoramas and views need.");
    this.gl = gl;
    this.program = this.link();
    gl.useProgram(this.program);
    gl.bindVertexArray(gl.createVertexArray());
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    for (const by of ["class", "instance"] as const) {
      const { pixels, rows } = labelTable(index, by);
      this.upload(by === "class" ? "classes" : "instances", pixels, TABLE_WIDTH, rows, gl.NEAREST);
    }
    this.upload("ramp", depthRamp(256), 256, 1, gl.LINEAR);
    this.upload("margin_ramp", marginRamp(255), 255, 1, gl.NEAREST);
    this.upload("margins", new Uint8Array([255, 255, 255, 255]), 1, 1, gl.NEAREST);
    this.forget();
  }

  private link(): WebGLProgram {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, text] of [
      [gl.VERTEX_SHADER, VERTICES],
      [gl.FRAGMENT_SHADER, PIXELS],
    ] as const) {
      const shader = gl.createShader(kind);
      if (!shader) throw new Error("WebGL 2 was lost");
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      const log = gl.getShaderInfoLog(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS))
        throw new Error(`WebGL 2: ${log ?? "no shader"}`);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error("WebGL 2 cannot link the program");
    return program;
  }

  private upload(
    name: string,
    source: Uint8Array | HTMLImageElement | HTMLCanvasElement,
    width: number,
    height: number,
    filter: number,
  ): void {
    const { gl } = this;
    const texture = this.textures.get(name) ?? gl.createTexture();
    this.textures.set(name, texture);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    if (source instanceof Uint8Array) {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, source);
    } else {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, source);
    }
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, name.endsWith("ramp") ? gl.CLAMP_TO_EDGE : gl.REPEAT);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  }

  private forget(): void {
    const nothing = new Uint8Array([0x0d, 0x0d, 0x0d, 255]);
    for (const name of ["rgb", "normal", "depth", "label", "face"])
      this.upload(name, nothing, 1, 1, this.gl.NEAREST);
    this.picture = null;
  }

  /** Uploads a picture, and returns the numbers of its pixels. */
  async take(picture: Picture): Promise<Numbers> {
    const [rgb, normal, depth, label, face] = await Promise.all(
      [picture.rgb, picture.normal, picture.depth, picture.label, picture.face].map((url) =>
        url === null ? null : image(url),
      ),
    );
    this.forget();
    const { LINEAR, NEAREST } = this.gl;
    const all = {
      rgb: [rgb, LINEAR],
      normal: [normal, LINEAR],
      depth: [depth, NEAREST],
      label: [label, NEAREST],
      face: [face, NEAREST],
    } as const;
    for (const [name, [element, filter]] of Object.entries(all)) {
      if (element) this.upload(name, element, 0, 0, filter);
    }
    this.picture = picture;
    const depths = depth ? numbers(depth) : null;
    const labels = label ? numbers(label) : null;
    this.ends = depths ? endsOf(depths.values) : [0, 1];
    const faces = face ? numbers(face) : null;
    const { width, height } = depths ?? labels ?? faces ?? { width: 0, height: 0 };
    return {
      width,
      height,
      depth: depths ? Uint16Array.from(depths.values) : null,
      label: labels?.values ?? null,
      face: faces?.values ?? null,
    };
  }

  /** Uploads other colours of the same picture. */
  async sharpen(url: string): Promise<void> {
    const { gl } = this;
    const colors = await image(url);
    if (gl.isContextLost()) return;
    const most = Number(gl.getParameter(gl.MAX_TEXTURE_SIZE));
    this.upload("rgb", fitted(colors, most), 0, 0, gl.LINEAR);
  }

  /** Uploads the picture for the right of the line, and returns the numbers of its pixels. */
  async takeOther({ picture, labels, depth: factor }: Other): Promise<Numbers> {
    const { LINEAR, NEAREST } = this.gl;
    const [rgb, normal, depth, label] = await Promise.all(
      [picture.rgb, picture.normal, picture.depth, picture.label].map((url) =>
        url === null ? null : image(url),
      ),
    );
    const nothing = new Uint8Array([0x0d, 0x0d, 0x0d, 255]);
    for (const name of ["rgb_b", "normal_b", "depth_b", "label_b"]) this.upload(name, nothing, 1, 1, NEAREST);
    if (rgb) this.upload("rgb_b", rgb, 0, 0, LINEAR);
    if (normal) this.upload("normal_b", normal, 0, 0, LINEAR);
    const put = (
      name: string,
      from: HTMLImageElement | null | undefined,
      of: (value: number) => number,
    ): ReturnType<typeof numbers> | null => {
      if (!from) return null;
      const read = numbers(from);
      read.values = read.values.map(of);
      this.upload(name, pixelsOf(read.values), read.width, read.height, NEAREST);
      return read;
    };
    const scaled = (units: number): number =>
      units === NO_DEPTH ? units : Math.min(NO_DEPTH - 1, Math.round(units * factor));
    const depths = put("depth_b", depth, scaled);
    const known = put("label_b", label, (index) => (index === NO_LABEL ? index : (labels[index] ?? 0)));
    this.other = picture;
    const { width, height } = depths ?? known ?? { width: 0, height: 0 };
    return {
      width,
      height,
      depth: depths ? Uint16Array.from(depths.values) : null,
      label: known?.values ?? null,
      face: null,
    };
  }

  /** Uploads the margins of the mesh's faces. */
  takeMargins(margin: Uint8Array): void {
    const { gl } = this;
    const rows = Math.max(1, Math.ceil(margin.length / MARGINS_WIDTH));
    const table = new Uint8Array(MARGINS_WIDTH * rows);
    table.set(margin);
    const texture = this.textures.get("margins");
    gl.bindTexture(gl.TEXTURE_2D, texture ?? null);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, MARGINS_WIDTH, rows, 0, gl.RED, gl.UNSIGNED_BYTE, table);
    this.faces = margin.length;
  }

  /** The ends of the ramp of depths, in units of depth. */
  get range(): [number, number] {
    return this.ends;
  }

  draw(scene: Scene): void {
    const { gl, program, canvas, picture } = this;
    const [width, height] = [canvas.width, canvas.height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (!picture) return;
    const at = (name: string): WebGLUniformLocation | null => gl.getUniformLocation(program, name);
    [...this.textures].forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(at(name), unit);
    });
    gl.uniform2f(at("size"), width, height);
    gl.uniform1f(at("line"), scene.split * width);
    gl.uniform1f(at("lit"), scene.lit ?? -1);
    gl.uniform1i(at("left"), MODALITIES.indexOf(scene.left));
    gl.uniform1i(at("right"), MODALITIES.indexOf(scene.right));
    gl.uniform1i(at("sphere"), scene.gaze ? 1 : 0);
    gl.uniform1i(at("colored"), picture.rgb ? 1 : 0);
    gl.uniform1i(at("two"), this.other ? 1 : 0);
    gl.uniform1i(at("colored_b"), this.other?.rgb ? 1 : 0);
    gl.uniform1f(at("faces"), this.faces);
    gl.uniform1f(at("nearest"), this.ends[0]);
    gl.uniform1f(at("farthest"), this.ends[1]);
    gl.uniform3fv(
      at("missing"),
      MISSING.map((c) => c / 255),
    );
    gl.uniform3fv(
      at("no_votes"),
      NULL_LABEL.map((c) => c / 255),
    );
    if (scene.gaze) {
      gl.uniform1f(at("focal"), focal(scene.gaze, width, height));
      gl.uniform2f(at("gaze"), scene.gaze.lon, scene.gaze.lat);
    } else {
      const [left, top, w, h] = placeOf(picture.of, width, height);
      gl.uniform2f(at("origin"), left, top);
      gl.uniform2f(at("extent"), w, h);
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Frees the memory of the graphics card. */
  close(): void {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}

/** The 1st and the 98th percentile of the depths. */
function endsOf(values: Uint32Array): [number, number] {
  const bins = new Uint32Array(1024);
  let all = 0;
  for (const value of values) {
    if (value >= NO_DEPTH) continue;
    const bin = value >> 6;
    bins[bin] = (bins[bin] ?? 0) + 1;
    all += 1;
  }
  const reached = (share: number): number => {
    let below = 0;
    return bins.findIndex((count) => (below += count) >= share * all);
  };
  return all === 0 ? [0, 1] : [reached(0.01) << 6, (reached(0.98) + 1) << 6];
}
