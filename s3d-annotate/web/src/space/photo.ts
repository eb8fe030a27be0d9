// A photograph around the eye: a level panorama, which the faces and what lies beyond them take their
// colours from.

import {
  BackSide,
  GLSL3,
  LinearFilter,
  Mesh,
  RawShaderMaterial,
  RepeatWrapping,
  SphereGeometry,
  Texture,
} from "three";
import { readImage } from "../server.js";
import { type LabelPaint, PANORAMA } from "./paint.js";

const VERTICES = `
precision highp float;
in vec3 position;
uniform mat4 modelViewMatrix, projectionMatrix;
out vec3 toward;
void main() {
  toward = position;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const PIXELS = `
precision highp float;
uniform sampler2D photograph;
in vec3 toward;
out vec4 color;
${PANORAMA}
void main() {
  color = vec4(photographed(photograph, toward), 1.0);
}`;

/** What is around the photograph's place, beyond all faces. */
export function backdrop(paint: LabelPaint): Mesh {
  const material = new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: VERTICES,
    fragmentShader: PIXELS,
    side: BackSide,
    depthTest: false,
    depthWrite: false,
    uniforms: { photograph: paint.photograph },
  });
  const mesh = new Mesh(new SphereGeometry(1, 48, 24), material);
  mesh.renderOrder = -1;
  mesh.frustumCulled = false;
  mesh.visible = false;
  return mesh;
}

export async function readPhotograph(number: number): Promise<Texture> {
  const texture = new Texture(await readImage(`photograph/${number}`));
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = RepeatWrapping;
  texture.generateMipmaps = false;
  texture.needsUpdate = true;
  return texture;
}
