// What is drawn on each face: three textures, of which only the rows that change are uploaded.

import { DataTexture, NearestFilter, RGBAFormat, RedFormat } from "three";

/** Faces in a row of a texture. */
export const WIDTH = 2048;

/** Ranges that are uploaded count so many components a pixel, whatever the format. */
const COMPONENTS = 4;

/** What lights up a face; a higher number covers a lower one. */
export const LIGHTS = { none: 0, similar: 1, doubt: 2, hovered: 3, taken: 4, erased: 5 } as const;
export type Light = keyof typeof LIGHTS;

/** How a face's colour is drawn. */
export const KINDS = { none: 0, proposed: 128, labelled: 255 } as const;

/** A texture with some bytes a face. */
class Column {
  readonly texture: DataTexture;
  readonly bytes: Uint8Array;
  private readonly dirty = new Set<number>();

  constructor(faces: number, size: 1 | 4) {
    const rows = Math.max(1, Math.ceil(faces / WIDTH));
    this.bytes = new Uint8Array(size * WIDTH * rows);
    this.texture = new DataTexture(this.bytes, WIDTH, rows, size === 1 ? RedFormat : RGBAFormat);
    this.texture.minFilter = this.texture.magFilter = NearestFilter;
    this.texture.needsUpdate = true;
  }

  changed(face: number): void {
    this.dirty.add(Math.floor(face / WIDTH));
  }

  /** Marks the changed rows for the next picture. Many rows are uploaded as a whole. */
  flush(): void {
    const { dirty, texture } = this;
    if (dirty.size === 0) return;
    if (dirty.size * 2 > texture.image.height) texture.clearUpdateRanges();
    else for (const row of dirty) texture.addUpdateRange(row * WIDTH * COMPONENTS, WIDTH * COMPONENTS);
    dirty.clear();
    texture.needsUpdate = true;
  }
}

export class FaceTable {
  private readonly colors: Column;
  private readonly lights: Column;
  /** The number of the object in 24 bits, and 255 if there is one. */
  private readonly objects: Column;
  /** The faces of each light. */
  private readonly lit = new Map<Light, Uint32Array>();

  constructor(faces: number) {
    this.colors = new Column(faces, 4);
    this.lights = new Column(faces, 1);
    this.objects = new Column(faces, 4);
  }

  get textures(): { colors: DataTexture; lights: DataTexture; objects: DataTexture } {
    const { colors, lights, objects } = this;
    return { colors: colors.texture, lights: lights.texture, objects: objects.texture };
  }

  /** Gives a face a colour, and the number of its object, 0 without one. */
  color(face: number, [r, g, b]: readonly number[], kind: keyof typeof KINDS, object: number): void {
    this.colors.bytes.set([r ?? 0, g ?? 0, b ?? 0, KINDS[kind]], 4 * face);
    this.colors.changed(face);
    const { bytes } = this.objects;
    const number = [object & 255, (object >> 8) & 255, (object >> 16) & 255, object > 0 ? 255 : 0];
    if (number.every((byte, k) => bytes[4 * face + k] === byte)) return;
    bytes.set(number, 4 * face);
    this.objects.changed(face);
  }

  /** Lights up some faces, and no others in this light. */
  light(light: Light, faces: Uint32Array | null): void {
    const before = this.lit.get(light);
    if (!before && !faces) return;
    const value = LIGHTS[light];
    const { bytes } = this.lights;
    const changed = new Set<number>();
    if (before) {
      this.lit.delete(light);
      for (const face of before)
        if (bytes[face] === value) {
          bytes[face] = 0;
          changed.add(Math.floor(face / WIDTH));
        }
      // What was covered shows again.
      const covered = [...this.lit].filter(([other]) => LIGHTS[other] < value);
      covered.sort(([a], [b]) => LIGHTS[a] - LIGHTS[b]);
      for (const [other, its] of covered) this.put(its, LIGHTS[other], changed);
    }
    if (faces) {
      this.lit.set(light, faces);
      this.put(faces, value, changed);
    }
    for (const row of changed) this.lights.changed(row * WIDTH);
  }

  private put(faces: Uint32Array, value: number, changed: Set<number>): void {
    const { bytes } = this.lights;
    for (const face of faces)
      if ((bytes[face] ?? 0) < value) {
        bytes[face] = value;
        changed.add(Math.floor(face / WIDTH));
      }
  }

  flush(): void {
    this.colors.flush();
    this.lights.flush();
    this.objects.flush();
  }
}
