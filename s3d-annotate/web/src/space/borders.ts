// Thin lines where two objects meet in the picture. The number of the object in each pixel is drawn first; a line
// is where neighbouring pixels have different ones.

import {
  BufferAttribute,
  BufferGeometry,
  Camera,
  GLSL3,
  Mesh,
  NearestFilter,
  RawShaderMaterial,
  Scene as Drawing,
  type Texture,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { WIDTH } from "./table.js";

// As in the materials of the faces: `told` has the number of the face in 24 bits.
const VERTICES = `
precision highp float;
precision highp int;
in vec4 position;
in uint told;
uniform mat4 modelMatrix, modelViewMatrix, projectionMatrix;
out float height;
flat out uint face;
void main() {
  vec4 place = vec4(position.xyz, 1.0);
  height = (modelMatrix * place).z;
  face = told & 0xffffffu;
  gl_Position = projectionMatrix * modelViewMatrix * place;
}`;

const NUMBERS = `
precision highp float;
precision highp int;
uniform sampler2D objects;
uniform float section;
in float height;
flat in uint face;
out vec4 number;
void main() {
  if (height > section) discard;
  number = texelFetch(objects, ivec2(int(face % ${WIDTH}u), int(face / ${WIDTH}u)), 0);
}`;

const SHEET = `
in vec3 position;
void main() {
  gl_Position = vec4(position, 1.0);
}`;

const LINES = `
precision highp float;
precision highp int;
uniform sampler2D numbers;
uniform float ratio;
out vec4 color;
bool isOther(vec4 own, ivec2 at) {
  vec4 other = texelFetch(numbers, min(at, textureSize(numbers, 0) - 1), 0);
  return other.a > 0.5 && other.rgb != own.rgb;
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 own = texelFetch(numbers, at, 0);
  bool isLine = false;
  for (int k = 1; k <= int(ratio + 0.5); k++)
    isLine = isLine || isOther(own, at + ivec2(k, 0)) || isOther(own, at + ivec2(0, k));
  if (own.a < 0.5 || !isLine) discard;
  color = vec4(vec3(0.06), 0.72);
}`;

export class Borders {
  private readonly numbers = new WebGLRenderTarget(1, 1, {
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });
  private readonly faces: RawShaderMaterial;
  private readonly sheet = new Drawing();
  private readonly camera = new Camera();

  /** `objects` has the number of each face's object, with an alpha of 0 if it has none. */
  constructor(objects: Texture, section: { value: number }, ratio: { value: number }) {
    this.faces = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: VERTICES,
      fragmentShader: NUMBERS,
      uniforms: { objects: { value: objects }, section },
    });
    const lines = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: SHEET,
      fragmentShader: LINES,
      uniforms: { numbers: { value: this.numbers.texture }, ratio },
      transparent: true,
      depthTest: false,
      depthWrite: false,
    });
    // One triangle that is larger than the window.
    const corners = new BufferGeometry();
    corners.setAttribute(
      "position",
      new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3),
    );
    const mesh = new Mesh(corners, lines);
    mesh.frustumCulled = false;
    this.sheet.add(mesh);
  }

  /** The size of the picture, pixels of the device. */
  resize(width: number, height: number): void {
    this.numbers.setSize(width, height);
  }

  /** Draws the number of the object in each pixel. `drawing` has the faces alone. */
  take(renderer: WebGLRenderer, drawing: Drawing, camera: Camera): void {
    drawing.overrideMaterial = this.faces;
    renderer.setRenderTarget(this.numbers);
    renderer.render(drawing, camera);
    renderer.setRenderTarget(null);
    drawing.overrideMaterial = null;
  }

  /** Draws the lines over a picture. */
  draw(renderer: WebGLRenderer): void {
    renderer.autoClear = false;
    renderer.render(this.sheet, this.camera);
    renderer.autoClear = true;
  }
}
