// The colours of the faces: those of the mesh or of a photograph, and those of the labels on them.

import { type RawShaderMaterial, type Texture, Vector3 } from "three";
import { LIT, shader } from "../../../../s3d-report/web/src/colors.js";
import type { Part } from "../../../../s3d-report/web/src/space/files.js";
import { Materials } from "../../../../s3d-report/web/src/space/materials.js";
import type { Place, Scene } from "../scene.js";
import { type FaceTable, LIGHTS, WIDTH } from "./table.js";

/** How strongly labels cover the colours; 2 shows what has no label. */
export const SHOWS = { both: 0.55, labels: 1, left: 2, colors: 0 } as const;
export type Show = keyof typeof SHOWS;

const ERASED: Place = [222, 60, 50];

// The fourth number of a position is the light of its face; `told` has the number of the face in 24 bits.
const VERTICES = `
precision highp float;
precision highp int;
in vec4 position;
in vec2 uv;
in vec3 tint;
in uint told;
uniform mat4 modelMatrix, modelViewMatrix, projectionMatrix;
uniform vec2 uvOrigin, uvStep;
out vec2 at;
out vec3 tinted;
out vec3 world;
flat out float light;
flat out uint face;
void main() {
  vec4 place = vec4(position.xyz, 1.0);
  world = (modelMatrix * place).xyz;
  light = position.w / 65535.0;
  at = uvOrigin + uvStep * uv;
  tinted = tint;
  face = told & 0xffffffu;
  gl_Position = projectionMatrix * modelViewMatrix * place;
}`;

/** The colour of a level panorama in a direction: the middle column looks along +y, and columns go to +x. */
export const PANORAMA = `
vec3 photographed(sampler2D photograph, vec3 toward) {
  vec3 d = normalize(toward);
  vec2 place = vec2(0.5 + atan(d.x, d.y) / 6.28318530718, 1.0 - acos(clamp(d.z, -1.0, 1.0)) / 3.14159265359);
  return textureLod(photograph, place, 0.0).rgb;
}`;

const PIXELS = `
precision highp float;
precision highp int;
precision highp usampler2D;
uniform sampler2D image, colors, lights, photograph;
uniform vec3 plain, stand, hand;
uniform bool textured, colored, inPhotograph;
uniform float cover, section, ratio;
in vec2 at;
in vec3 tinted;
in vec3 world;
flat in float light;
flat in uint face;
out vec4 color;
${PANORAMA}
void main() {
  vec3 image_color = texture(image, at).rgb;
  if (world.z > section) discard;
  ivec2 cell = ivec2(int(face % ${WIDTH}u), int(face / ${WIDTH}u));
  vec4 own = texelFetch(colors, cell, 0);
  int lit = int(texelFetch(lights, cell, 0).r * 255.0 + 0.5);
  vec3 seen = inPhotograph ? photographed(photograph, world - stand)
    : textured ? image_color : (colored ? tinted : plain) * light;
  float grey = dot(seen, vec3(0.2126, 0.7152, 0.0722));
  float shade = inPhotograph ? 0.75 + 0.5 * grey : light;
  // Without their colours, faces keep a little of them, so that shapes can be made out.
  float bare = inPhotograph ? 0.0 : cover > 1.5 ? 0.0 : max(0.0, (cover - 0.6) / 0.4);
  color.rgb = mix(seen, vec3(0.62 * shade + 0.2 * grey), bare);
  if (cover > 1.5) color.rgb = own.a > 0.75 ? vec3(0.82 * shade) : mix(color.rgb, vec3(1.0, 0.0, 1.0), 0.6);
  else if (own.a > 0.75) color.rgb = mix(color.rgb, own.rgb * shade, cover);
  else if (own.a > 0.25 && cover > 0.0) {
    float band = fract((gl_FragCoord.x + gl_FragCoord.y) / (14.0 * ratio));
    float line = smoothstep(0.0, 0.08, band) * (1.0 - smoothstep(0.26, 0.34, band));
    color.rgb = mix(color.rgb, own.rgb, 0.08 + 0.62 * line);
  }
  if (lit == ${LIGHTS.hovered}) color.rgb = mix(color.rgb, ${shader(LIT)}, 0.5);
  else if (lit == ${LIGHTS.taken}) color.rgb = mix(color.rgb, hand, 0.78);
  else if (lit == ${LIGHTS.erased}) color.rgb = mix(color.rgb, ${shader(ERASED)}, 0.6);
  else if (lit == ${LIGHTS.doubt}) color.rgb = mix(color.rgb, ${shader([255, 130, 20])}, 0.55);
  else if (lit == ${LIGHTS.similar}) color.rgb = mix(color.rgb, ${shader([70, 220, 250])}, 0.55);
  color.a = 1.0;
}`;

/** The materials of a mesh. A change here applies to all of them. */
export class LabelPaint {
  readonly cover = { value: SHOWS.both as number };
  readonly section = { value: 1e9 };
  readonly ratio = { value: 1 };
  readonly inPhotograph = { value: false };
  /** The colour of the class in hand. */
  readonly hand = { value: new Vector3() };
  readonly stand = { value: new Vector3() };
  readonly photograph: { value: Texture };
  private readonly materials: Materials;

  constructor(
    scene: Scene,
    private readonly table: FaceTable,
  ) {
    this.materials = new Materials({ vertices: VERTICES, pixels: PIXELS }, scene.materials, [200, 200, 200]);
    this.photograph = { value: this.materials.blank };
  }

  of(part: Part, place: number): RawShaderMaterial {
    const { colors, lights } = this.table.textures;
    return this.materials.of(part, place, {
      cover: this.cover,
      section: this.section,
      ratio: this.ratio,
      inPhotograph: this.inPhotograph,
      hand: this.hand,
      stand: this.stand,
      photograph: this.photograph,
      colors: { value: colors },
      lights: { value: lights },
    });
  }

  /** Shows a texture of the mesh in existing and later materials. */
  take(texture: number, image: HTMLImageElement, anisotropy: number): void {
    this.materials.take(texture, image, anisotropy);
  }
}
