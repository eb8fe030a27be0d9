// Images as pixels and as numbers.

import type { Pixels } from "./geometry.js";

export async function image(url: string): Promise<HTMLImageElement> {
  const element = new Image();
  element.src = url;
  await element.decode();
  return element;
}

/** The pixels of an image; null if this browser cannot draw on a canvas. */
export async function decoded(url: string): Promise<Pixels | null> {
  const element = await image(url);
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [element.naturalWidth, element.naturalHeight];
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context?.drawImage(element, 0, 0);
  return context?.getImageData(0, 0, canvas.width, canvas.height) ?? null;
}

/** An image that is no wider than this. */
export function fitted(element: HTMLImageElement, most: number): HTMLImageElement | HTMLCanvasElement {
  const scale = Math.min(1, most / Math.max(element.naturalWidth, element.naturalHeight));
  if (scale === 1) return element;
  const canvas = document.createElement("canvas");
  canvas.width = Math.floor(scale * element.naturalWidth);
  canvas.height = Math.floor(scale * element.naturalHeight);
  const context = canvas.getContext("2d");
  if (context) context.imageSmoothingQuality = "high";
  context?.drawImage(element, 0, 0, canvas.width, canvas.height);
  return canvas;
}

/** The pixels of an image as 24-bit numbers. */
export function numbers(element: HTMLImageElement): { width: number; height: number; values: Uint32Array } {
  const { naturalWidth: width, naturalHeight: height } = element;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height];
  const context = canvas.getContext("2d", { willReadFrequently: true, colorSpace: "srgb" });
  if (!context) throw new Error("this browser cannot draw on a canvas");
  context.drawImage(element, 0, 0);
  const bytes = context.getImageData(0, 0, width, height).data;
  const values = new Uint32Array(width * height);
  for (let i = 0; i < values.length; i++) {
    values[i] = ((bytes[4 * i] ?? 0) << 16) | ((bytes[4 * i + 1] ?? 0) << 8) | (bytes[4 * i + 2] ?? 0);
  }
  return { width, height, values };
}

/** 24-bit numbers as pixels. */
export function pixelsOf(values: Uint32Array): Uint8Array {
  const pixels = new Uint8Array(4 * values.length);
  values.forEach((value, i) => pixels.set([value >> 16, (value >> 8) & 255, value & 255, 255], 4 * i));
  return pixels;
}
