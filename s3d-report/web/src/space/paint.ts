// The colours of the faces: one shader, which reads them from textures or from a table by face.

import { DataTexture, NearestFilter, RGBAFormat, type RawShaderMaterial, type Texture } from "three";
import {
  LIT,
  NULL_LABEL,
  OTHER_CLASS,
  OTHER_INSTANCE,
  TABLE_WIDTH,
  labelTable,
  marginRamp,
  shader,
} from "../colors.js";
import type { Index, Mesh } from "../data.js";
import type { Slab } from "../storeys.js";
import type { Part } from "./files.js";
import type { Look } from "./look.js";
import { Materials } from "./materials.js";

export const SHOWS = ["texture", "class", "instance", "margin", "unlabelled", "changed", "normal"] as const;
export type Show = (typeof SHOWS)[number];

// The fourth number of a position is the light of its face; `told` has 24 bits of its label, 8 of its margin;
// `changed` is 1 of another instance, 2 of another class, else 0.
const VERTICES = `
precision highp float;
precision highp int;
in vec4 position;
in vec2 uv;
in vec3 tint;
in float changed;
in uint told;
uniform mat4 modelMatrix, modelViewMatrix, projectionMatrix;
uniform vec2 uvOrigin, uvStep;
out vec2 at;
out vec3 tinted;
out vec3 world;
flat out float light;
flat out float differs;
flat out uint of;
void main() {
  vec4 place = vec4(position.xyz, 1.0);
  world = (modelMatrix * place).xyz;
  light = position.w / 65535.0;
  at = uvOrigin + uvStep * uv;
  tinted = tint;
  of = told;
  differs = changed;
  gl_Position = projectionMatrix * modelViewMatrix * place;
}`;

const PIXELS = `
precision highp float;
precision highp int;
precision highp usampler2D;
uniform sampler2D image, classes, instances, ramp;
uniform vec3 plain;
uniform bool textured, colored;
// What is shown left of a line and on it, and right of it, the class that is not grey, or -1, and the label
// that is lit up, or 0.
uniform int show, beyond, only, lit;
uniform float line, section, base;
in vec2 at;
in vec3 tinted;
in vec3 world;
flat in float light;
flat in float differs;
flat in uint of;
out vec4 color;

vec4 named(sampler2D table, uint index) {
  return texelFetch(table, ivec2(int(index % ${TABLE_WIDTH}u), int(index / ${TABLE_WIDTH}u)), 0);
}

// The number of a label's class, from 1; 0 without one.
int class_of(uint label) {
  vec2 bytes = vec2(named(classes, label).a, named(instances, label).a) * 255.0;
  return int(bytes.x + 256.0 * bytes.y + 0.5);
}

void main() {
  vec3 image_color = texture(image, at).rgb;
  vec3 normal = normalize(cross(dFdx(world), dFdy(world)));
  if (world.z > section || world.z < base) discard;
  int shown = gl_FragCoord.x < line ? show : beyond;
  vec3 seen = textured ? image_color : (colored ? tinted : plain) * light;
  uint label = of & 0xffffffu, margin = of >> 24;
  vec3 none = ${shader(NULL_LABEL)};
  if (shown == 0) color.rgb = seen;
  else if (shown == 1) color.rgb = named(classes, label).rgb * light;
  else if (shown == 2) color.rgb = named(instances, label).rgb * light;
  else if (shown == 6) color.rgb = 0.5 + 0.5 * normal;
  else if (shown == 3) {
    vec3 led = texelFetch(ramp, ivec2(int(margin), 0), 0).rgb;
    // A little of the colours, so that shapes can be made out.
    color.rgb = mix(margin == 255u ? none : led, vec3(dot(seen, vec3(0.2126, 0.7152, 0.0722))), 0.25);
  } else if (shown == 5) {
    vec3 other = differs > 1.5 ? ${shader(OTHER_CLASS)} : ${shader(OTHER_INSTANCE)};
    if (differs > 0.5) color.rgb = other * light;
    else color.rgb = mix(vec3(dot(seen, vec3(0.2126, 0.7152, 0.0722))), vec3(0.55), 0.45);
  } else color.rgb = label == 0u ? vec3(1.0, 0.0, 1.0) : vec3(0.82 * light);
  if (only >= 0 && class_of(label) != only + 1)
    color.rgb = mix(vec3(dot(seen, vec3(0.2126, 0.7152, 0.0722))), vec3(0.62), 0.65);
  if (lit > 0 && int(label) == lit) color.rgb = mix(color.rgb, ${shader(LIT)}, 0.5);
  color.a = 1.0;
}`;

function table(pixels: Uint8Array, width: number, rows: number): DataTexture {
  const texture = new DataTexture(pixels, width, rows, RGBAFormat);
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

/** The materials of a mesh. A change here applies to all of them. */
export class Paint {
  private readonly show = { value: 0 };
  private readonly beyond = { value: 0 };
  private readonly line = { value: 0 };
  private readonly only = { value: -1 };
  private readonly section = { value: 0 };
  private readonly base = { value: 0 };
  private readonly lit = { value: 0 };
  private readonly tables: Record<string, { value: Texture }>;
  private readonly materials: Materials;

  constructor(index: Index, mesh: Mesh) {
    this.materials = new Materials({ vertices: VERTICES, pixels: PIXELS }, mesh.materials, NULL_LABEL);
    const [classes, instances] = [labelTable(index, "class"), labelTable(index, "instance")];
    this.tables = {
      classes: { value: table(classes.pixels, TABLE_WIDTH, classes.rows) },
      instances: { value: table(instances.pixels, TABLE_WIDTH, instances.rows) },
      // Margins are whole numbers up to 254.
      ramp: { value: table(marginRamp(255), 255, 1) },
    };
  }

  /**
   * Sets what is drawn. The line between two colourings is at so many pixels from the left; the faces of the
   * label `lit` light up.
   */
  set({ show, beyond, only }: Look, line: number, { low, high }: Slab, lit: number | null): void {
    this.show.value = SHOWS.indexOf(show);
    this.beyond.value = SHOWS.indexOf(beyond ?? show);
    this.line.value = line;
    this.only.value = only ?? -1;
    this.section.value = high;
    this.base.value = low;
    this.lit.value = lit ?? 0;
  }

  /** The material for the faces of a part that have the material at this index. */
  of(part: Part, place: number): RawShaderMaterial {
    return this.materials.of(part, place, {
      ...this.tables,
      show: this.show,
      beyond: this.beyond,
      line: this.line,
      only: this.only,
      section: this.section,
      base: this.base,
      lit: this.lit,
    });
  }

  /** Uploads the image of a texture, for existing and later materials. */
  take(texture: number, image: HTMLImageElement, anisotropy: number): void {
    this.materials.take(texture, image, anisotropy);
  }

  close(): void {
    this.materials.close();
    for (const { value } of Object.values(this.tables)) value.dispose();
  }
}
