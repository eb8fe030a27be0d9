// The materials of a mesh for a shader: a texture, the colours of vertices, or one colour.

import {
  DataTexture,
  FrontSide,
  GLSL3,
  type IUniform,
  LinearFilter,
  LinearMipmapLinearFilter,
  RawShaderMaterial,
  RepeatWrapping,
  Texture,
  Vector2,
  Vector3,
} from "three";
import type { Rgb } from "../data.js";
import type { Part } from "./files.js";

export interface Shaders {
  vertices: string;
  pixels: string;
}

/** The materials of a mesh. Each has the uniforms `image`, `textured`, `colored`, `plain`, `uvOrigin`, `uvStep`. */
export class Materials {
  /** A white pixel, in place of images that are not there. */
  readonly blank = new DataTexture(new Uint8Array([255, 255, 255, 255]), 1, 1);
  private readonly images = new Map<number, Texture>();
  private readonly made: { material: RawShaderMaterial; texture: number | null }[] = [];

  constructor(
    private readonly shaders: Shaders,
    private readonly all: { color: Rgb; texture: number | null }[],
    private readonly missing: Rgb,
  ) {
    this.blank.needsUpdate = true;
  }

  /** The material for the faces of a part that have the material at this index, with uniforms of the program's own. */
  of(part: Part, place: number, uniforms: Record<string, IUniform>): RawShaderMaterial {
    const { color, texture } = this.all[place] ?? { color: this.missing, texture: null };
    const image = part.uv && texture !== null ? this.images.get(texture) : undefined;
    const material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: this.shaders.vertices,
      fragmentShader: this.shaders.pixels,
      side: FrontSide,
      uniforms: {
        ...uniforms,
        image: { value: image ?? this.blank },
        textured: { value: image !== undefined },
        colored: { value: part.color !== null },
        plain: { value: new Vector3(...color).divideScalar(255) },
        uvOrigin: { value: new Vector2(...part.uvOrigin) },
        uvStep: { value: new Vector2(...part.uvStep) },
      },
    });
    this.made.push({ material, texture: part.uv && texture });
    return material;
  }

  /** Uploads the image of a texture, for existing and later materials. */
  take(texture: number, image: HTMLImageElement, anisotropy: number): void {
    const made = new Texture(image);
    made.wrapS = made.wrapT = RepeatWrapping;
    made.minFilter = LinearMipmapLinearFilter;
    made.magFilter = LinearFilter;
    made.anisotropy = anisotropy;
    made.needsUpdate = true;
    this.images.set(texture, made);
    for (const { material, texture: its } of this.made) {
      if (its !== texture) continue;
      (material.uniforms["image"] as { value: Texture }).value = made;
      (material.uniforms["textured"] as { value: boolean }).value = true;
    }
  }

  close(): void {
    for (const { material } of this.made) material.dispose();
    for (const texture of [...this.images.values(), this.blank]) texture.dispose();
  }
}
