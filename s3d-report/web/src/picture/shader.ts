// The program that draws a picture on the graphics card: the modalities, and the borders of labels.

import { LIT, OTHER_CLASS, OTHER_INSTANCE, TABLE_WIDTH, shader } from "../colors.js";

export const MODALITIES = [
  "rgb",
  "depth",
  "normal",
  "class",
  "instance",
  "unlabelled",
  "contested",
  "changed",
] as const;
export type Modality = (typeof MODALITIES)[number];

/** The number of columns in the table of margins by face. */
export const MARGINS_WIDTH = 4096;

export const VERTICES = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(4.0 * corner - 1.0, 0.0, 1.0);
}`;

const INPUTS = `#version 300 es
precision highp float;
uniform sampler2D rgb, normal, depth, label, face, classes, instances, ramp, margins, margin_ramp;
uniform sampler2D rgb_b, normal_b, depth_b, label_b;
uniform vec2 size;
uniform float line, focal, nearest, farthest, lit;
uniform int left, right;
uniform bool sphere, colored, two, colored_b;
uniform vec2 gaze, origin, extent;
uniform vec3 missing, no_votes;
uniform float faces;
out vec4 color;
const float PI = 3.14159265358979;

float number(vec4 pixel) {
  vec3 bytes = floor(pixel.rgb * 255.0 + 0.5);
  return bytes.r * 65536.0 + bytes.g * 256.0 + bytes.b;
}

vec4 named(sampler2D table, float index) {
  ivec2 place = ivec2(int(index) % ${TABLE_WIDTH}, int(index) / ${TABLE_WIDTH});
  return texelFetch(table, place, 0);
}

vec2 class_of(float index) {
  return index == 855309.0 ? vec2(-1.0) : vec2(named(classes, index).a, named(instances, index).a);
}`;

/** A stair of a border is looked for so far from a pixel, in pixels of the label's image. */
const REACH = 16;

// A label belongs to a whole pixel of its image, so its borders are stairs. They are drawn as the lines that
// made the stairs: a straight piece of a border rises from the middle of the step at its one end to the
// middle of the step at its other end (morphological antialiasing; A. Reshetov, 2009). No line is half a
// pixel off the stairs, so the middle of each pixel keeps its own label.
const BORDERS = `
vec2 size_of(bool b) {
  return vec2(b ? textureSize(label_b, 0) : textureSize(label, 0));
}

// A label by its place in pixels of its image.
float label_at(bool b, vec2 at) {
  vec2 size = size_of(b);
  vec2 uv = vec2(sphere ? at.x : clamp(at.x, 0.5, size.x - 0.5), at.y) / size;
  return number(b ? texture(label_b, uv) : texture(label, uv));
}

// The label of the other picture at the same place.
float other_at(bool b, vec2 at) {
  return label_at(!b, at / size_of(b) * size_of(!b));
}

// A number for what is seen of a label. Between equal numbers there is no border.
float kind_at(int modality, bool b, vec2 at) {
  float index = label_at(b, at);
  if (modality == 4) return index;
  if (modality == -1) return index == lit ? 1.0 : 0.0;
  if (modality == 7) {
    float other = other_at(b, at);
    return index == other ? 0.0 : class_of(index) == class_of(other) ? 1.0 : 2.0;
  }
  if (index == 855309.0) return -1.0;
  if (modality == 5) return index == 0.0 ? 1.0 : 0.0;
  return dot(class_of(index), vec2(255.0, 65280.0));
}

// How far a place is from the border between its pixel and the next one in a direction: in pixels of the
// image, and negative on the other side of the border.
float inside(int modality, bool b, vec2 at, vec2 direction, float own, float next) {
  vec2 middle = floor(at) + 0.5;
  vec2 along = abs(direction.yx);
  float ends[2], rises[2];
  for (int side = 0; side < 2; side++) {
    float steps = 1.0, rise = 0.0;
    for (; steps <= ${REACH}.0; steps++) {
      vec2 place = middle + (side == 0 ? -steps : steps) * along;
      float here = kind_at(modality, b, place), there = kind_at(modality, b, place + direction);
      if (here == own && there == next) continue;
      if ((here == next) != (there == own)) rise = here == next ? 0.5 : -0.5;
      break;
    }
    ends[side] = steps - 0.5;
    rises[side] = rise;
  }
  float length = ends[0] + ends[1];
  float share = (dot(at - middle, along) + ends[0]) / length;
  float rise = share < 0.5 ? rises[0] : rises[1];
  float slope = 2.0 * rise / length;
  return (0.5 - dot(at - middle, direction) - rise * abs(1.0 - 2.0 * share)) / sqrt(1.0 + slope * slope);
}`;

const LABELS = `
// What a label looks like; \`other\` is the other picture's label.
vec3 look_of(int modality, float index, float other, vec3 seen, bool is_colored) {
  float light = is_colored ? dot(seen, vec3(0.2126, 0.7152, 0.0722)) : 0.6;
  if (modality == 7) {
    bool is_class = class_of(index) != class_of(other);
    vec3 other_color = is_class ? ${shader(OTHER_CLASS)} : ${shader(OTHER_INSTANCE)};
    if (index != other) return is_colored ? mix(other_color, seen, 0.25) : other_color;
    return 0.5 * mix(vec3(light), is_colored ? seen : vec3(light), 0.5);
  }
  if (index == 855309.0) return missing;
  if (modality == 5) return index == 0.0 ? vec3(1.0, 0.0, 1.0) : vec3(0.12 + 0.7 * light);
  vec3 flat_color = (modality == 3 ? named(classes, index) : named(instances, index)).rgb;
  return is_colored ? mix(flat_color, seen, 0.3) : flat_color;
}

// The labels of a place, with smooth borders. \`grain\` is the share of the picture in a pixel of the screen.
vec3 labels_at(int modality, vec2 uv, bool b, vec3 seen, bool is_colored, float grain) {
  vec2 size = size_of(b);
  vec2 at = uv * size;
  vec2 middle = floor(at) + 0.5;
  float own = kind_at(modality, b, middle);
  vec3 shown = look_of(modality, label_at(b, middle), other_at(b, middle), seen, is_colored);
  vec3 beside = shown;
  float least = 1e9;
  for (int axis = 0; axis < 2; axis++) {
    float side = at[axis] < middle[axis] ? -1.0 : 1.0;
    vec2 direction = axis == 0 ? vec2(side, 0.0) : vec2(0.0, side);
    float next = kind_at(modality, b, middle + direction);
    if (next == own) continue;
    float off = inside(modality, b, at, direction, own, next);
    if (off >= least) continue;
    vec2 place = middle + direction;
    least = off;
    beside = look_of(modality, label_at(b, place), other_at(b, place), seen, is_colored);
  }
  return mix(beside, shown, clamp(0.5 + least / sqrt(grain * size.x * size.y), 0.0, 1.0));
}

// Tints the instance under the pointer, and draws a light edge around it.
vec3 light_up(vec3 shown, vec2 uv, vec2 across, vec2 down, float grain) {
  vec2 size = size_of(false);
  vec2 at = uv * size;
  float pixel = sqrt(grain * size.x * size.y);
  float own = kind_at(-1, false, at);
  float least = 1e9;
  vec2 directions[4] = vec2[](vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0));
  for (int i = 0; i < 4; i++)
    if (kind_at(-1, false, floor(at) + 0.5 + directions[i]) != own)
      least = min(least, inside(-1, false, at, directions[i], own, 1.0 - own));
  float off = (own == 1.0 ? least : -least) / pixel;
  float tinted = clamp(0.5 + off, 0.0, 1.0), reached = clamp(2.0 + off, 0.0, 1.0);
  if (pixel > 0.5) {
    // The edge is wider than the pixels around.
    vec2 beside[4] = vec2[](across, -across, down, -down);
    for (int i = 0; i < 4; i++)
      if (number(texture(label, uv + 1.5 * beside[i])) == lit) reached = 1.0;
  }
  shown = mix(shown, ${shader(LIT)}, 0.45 * tinted);
  return mix(shown, vec3(1.0), reached - tinted);
}`;

export const PIXELS = `${INPUTS}
${BORDERS}
${LABELS}

vec3 show(int modality, vec2 uv, bool b, float grain) {
  vec3 seen = b ? texture(rgb_b, uv).rgb : texture(rgb, uv).rgb;
  bool is_colored = b ? colored_b : colored;
  if (modality == 0) return seen;
  if (modality == 2) return b ? texture(normal_b, uv).rgb : texture(normal, uv).rgb;
  if (modality == 1) {
    float units = number(b ? texture(depth_b, uv) : texture(depth, uv));
    float place = clamp((units - nearest) / (farthest - nearest), 0.0, 1.0);
    return units == 65535.0 ? missing : texture(ramp, vec2(place, 0.5)).rgb;
  }
  if (modality == 6) {
    float light = is_colored ? dot(seen, vec3(0.2126, 0.7152, 0.0722)) : 0.6;
    float of_face = number(texture(face, uv));
    if (of_face == 16777215.0 || faces == 0.0) return missing;
    int place = int(of_face);
    ivec2 at = ivec2(place % ${MARGINS_WIDTH}, place / ${MARGINS_WIDTH});
    float margin = of_face < faces ? floor(texelFetch(margins, at, 0).r * 255.0 + 0.5) : 255.0;
    vec3 shade = margin == 255.0 ? no_votes : texture(margin_ramp, vec2((margin + 0.5) / 255.0, 0.5)).rgb;
    return mix(shade, vec3(light), 0.2);
  }
  return labels_at(modality, uv, b, seen, is_colored, grain);
}

void main() {
  vec2 at = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  vec2 uv;
  if (sphere) {
    vec2 ray = vec2(at.x - size.x / 2.0, size.y / 2.0 - at.y) / focal;
    float forward = cos(gaze.y) - ray.y * sin(gaze.y);
    float rise = sin(gaze.y) + ray.y * cos(gaze.y);
    float lon = gaze.x + atan(ray.x, forward);
    uv = vec2(lon / (2.0 * PI) + 0.5, 0.5 - atan(rise, length(vec2(ray.x, forward))) / PI);
  } else {
    uv = (at - origin) / extent;
  }
  // Behind the eye a panorama's ends meet.
  vec2 across = dFdx(uv), down = dFdy(uv);
  across.x -= round(across.x);
  down.x -= round(down.x);
  float grain = max(abs(across.x * down.y - across.y * down.x), 1e-12);
  if (sphere) {
    uv.x = fract(uv.x);
  } else if (any(lessThan(uv, vec2(0.0))) || any(greaterThanEqual(uv, vec2(1.0)))) {
    color = vec4(0.0);
    return;
  }
  color = vec4(show(at.x < line ? left : right, uv, two && at.x >= line, grain), 1.0);
  if (lit >= 0.0) color.rgb = light_up(color.rgb, uv, across, down, grain);
}`;
