//! Eight pixels at a time, for making images from hits.
//!
//! [`ShadeLanes`] names the few operations on eight values that images need. [`Plain`] implements them in
//! plain Rust, which defines the results. `shade_avx2.rs` and `shade_width.rs` implement them with wide
//! registers.

use half::f16;

/// The number of pixels that are handled together.
pub(crate) const LANES: usize = 8;

/// The bytes of a block that repeats one colour, a little more than ten times.
pub(crate) const COLOR_BLOCK: usize = 32;

/// Operations on eight values.
pub(crate) trait ShadeLanes: Copy {
    /// Eight `f32`.
    type F: Copy;
    /// Eight integers: coordinates in an image are in 32768ths of a pixel.
    type I: Copy;
    /// The fractions of eight places to the right, and of eight downwards: 0 to 1 in 32768ths.
    type Parts: Copy;
    /// The 2 × 2 texels around each of eight places.
    type Quads: Copy;
    /// The weights of eight pixels in −32768ths. They are negative, so that 1 fits in 16 bits.
    type Weights: Copy;
    /// The weights of the 2 × 2 texels around each of eight places, in −32768ths.
    type Corners: Copy;
    /// Sums of weighted colours of eight pixels, in −32768ths of a step of 8 bits.
    type ColorSum: Copy;

    fn splat(self, value: f32) -> Self::F;
    fn load(self, from: &[f32; LANES]) -> Self::F;
    fn store(self, values: Self::F, to: &mut [f32; LANES]);
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    fn sqrt(self, a: Self::F) -> Self::F;
    /// Returns the smaller value; `b` if one is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns the larger value; `b` if one is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns `negative` where the sign bit of `of` is set, else `positive`.
    fn select_by_sign(self, of: Self::F, negative: Self::F, positive: Self::F) -> Self::F;
    /// Returns `yes` in the lanes of `these`, else `no`.
    fn select(self, these: u32, yes: Self::F, no: Self::F) -> Self::F;
    /// Rounds towards 0. The result is unspecified where it does not fit into an `i32`.
    fn truncate(self, values: Self::F) -> Self::F;
    /// Returns bit k if a > b in lane k.
    fn greater(self, a: Self::F, b: Self::F) -> u32;
    /// Stores values rounded towards 0. The result is unspecified where it does not fit into an `i32`.
    fn store_int(self, values: Self::F, to: &mut [i32; LANES]);

    /// Returns ⌊log2⌋ of values of at least 1, and the rest of the logarithm to 0.01.
    fn log2(self, values: Self::F) -> (Self::F, Self::F);
    /// Converts to 32768ths, rounded towards 0. The result is the least integer where it does not fit.
    fn fixed(self, values: Self::F) -> Self::I;
    /// Adds, wrapping around.
    fn add_fixed(self, a: Self::I, b: Self::I) -> Self::I;
    fn store_fixed(self, values: Self::I, to: &mut [i32; LANES]);
    /// Returns bit k if 0 ≤ v < `end` in lane k; `end` is at most 2^31.
    fn within(self, values: Self::I, end: u32) -> u32;
    /// Locates the places (x, y) in an image whose rows are `stride` bytes. Returns where the upper left
    /// texel begins, and the fractions of the places beyond it. Lanes that are not in `these` give the
    /// beginning of the image. The result is unspecified for places outside an image of less than 2^15
    /// columns and rows and 2^31 bytes.
    fn place(self, x: Self::I, y: Self::I, stride: i32, these: u32) -> (Self::I, Self::Parts);
    /// Loads the fractions that [`ShadeLanes::place`] returns, from 32768ths.
    fn parts(self, x: &[i16; LANES], y: &[i16; LANES]) -> Self::Parts;
    /// Stores fractions as 32768ths.
    fn store_parts(self, parts: Self::Parts, x: &mut [i16; LANES], y: &mut [i16; LANES]);
    /// Loads the 2 × 2 texels whose upper left ones begin at `at`. Returns `None` if one is too near the
    /// image's end.
    fn quads(self, image: &Texels<'_>, at: Self::I) -> Option<Self::Quads>;
    /// Combines texels: each value has R G B of two neighbours in its lowest six bytes, in the upper and the
    /// lower row.
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads;
    /// Converts weights from −1 (0) to −32768 (1), rounded towards 0.
    fn weights(self, weights: Self::F) -> Self::Weights;
    /// Returns `weights`, but 0 in lanes that are not in `these`.
    fn masked(self, these: u32, weights: Self::Weights) -> Self::Weights;
    /// Returns weights of 1.
    fn full_weights(self) -> Self::Weights;
    /// Distributes weights over the 2 × 2 texels around places, first by row, then by column, with [`part`].
    /// Each weight is off by at most 1; together they are the weight that was distributed.
    fn corners(self, parts: Self::Parts, weights: Self::Weights) -> Self::Corners;
    /// Returns sums without colour.
    fn zero_sum(self) -> Self::ColorSum;
    /// Adds weighted colours to `sum`. Nothing is rounded.
    fn add_weighted(self, sum: Self::ColorSum, quads: Self::Quads, corners: Self::Corners) -> Self::ColorSum;
    /// Returns the sums as 0 to 255 a channel, not rounded.
    fn channels(self, sum: Self::ColorSum) -> [Self::F; 3];
    /// Rounds the sums to bytes: R G B in the lowest three of each value. The result is never black.
    fn pixels(self, sum: Self::ColorSum) -> [u32; LANES];
    /// Stores the lowest three bytes of each value, one after another.
    fn store_pixels(self, packed: &[u32; LANES], to: &mut [u8; 3 * LANES]);
    /// Stores the lowest three bytes of a value again and again.
    fn store_repeated(self, packed: u32, to: &mut [u8; COLOR_BLOCK]);

    /// Prefetches `thing`, which will be read soon.
    fn prefetch<T>(self, thing: &T);
    /// Returns bit k if `values[k]` is `value`.
    fn equal(self, values: &[u32; LANES], value: u32) -> u32;
    /// Finds where a value differs from the one before it. Writes these places to the beginning of `to`,
    /// ascending, as `from` plus the offset in `values`, and returns their number. The rest of `to` is
    /// unspecified.
    fn changes(self, values: &[u32; 2 * LANES + 1], from: u32, to: &mut [u32; 2 * LANES]) -> usize;
    /// Converts depths to 512ths, rounded half up, at most 65,535.
    fn depths(self, depths: &[f32; LANES], to: &mut [u16; LANES]);
    /// Computes the points place + direction × depth, rounded to `f32`. `PANORAMA` decides how a direction
    /// is made: see [`EightRays`].
    fn points<const PANORAMA: bool>(self, rays: &EightRays<'_>, to: &mut [f32; 3 * LANES]);
    /// Computes the points of [`ShadeLanes::points`], rounded once more to half floats.
    fn half_points<const PANORAMA: bool>(self, rays: &EightRays<'_>, to: &mut [f16; 3 * LANES]);
}

/// The bytes of an image, and the end of the places at which 2 × 2 texels can be read at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Texels<'a> {
    bytes: &'a [u8],
    stride: i32,
    end: u32,
}

impl<'a> Texels<'a> {
    /// Wraps an image with rows of `stride` bytes.
    pub(crate) fn new(bytes: &'a [u8], stride: i32) -> Self {
        let len = i32::try_from(bytes.len()).unwrap_or(0);
        let end = if stride < 0 {
            0
        } else {
            i64::from(len) - i64::from(stride) - 7
        };
        Self { bytes, stride, end: end.max(0) as u32 }
    }

    #[inline(always)]
    pub(crate) fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Returns the bytes a row.
    #[inline(always)]
    pub(crate) fn stride(&self) -> i32 {
        self.stride
    }

    /// Returns the end of the readable places: at every place before it there are eight bytes, and eight more
    /// a `stride` later. It is less than 2^31.
    #[inline(always)]
    pub(crate) fn end(&self) -> u32 {
        self.end
    }
}

/// Eight rays side by side, and their depths. Values by axis repeat: x y z x y z…
#[derive(Clone, Copy, Debug)]
pub(crate) struct EightRays<'a> {
    /// The part of each ray's direction that depends on its column.
    pub(crate) column: &'a [f64; 3 * LANES],
    /// The part that depends on the row. It is added to the columns' part in a perspective view, and
    /// multiplied by it axis by axis in a panorama.
    pub(crate) row: &'a [f64; 12],
    /// The depths; not finite where nothing is seen.
    pub(crate) depths: &'a [f32; LANES],
    /// The common origin of the rays.
    pub(crate) place: &'a [f64; 12],
}

/// Returns a · b / 32768, rounded half up.
#[inline(always)]
pub(crate) fn part(a: i16, b: i16) -> i16 {
    ((i32::from(a) * i32::from(b) + 0x4000) >> 15) as i16
}

/// Plain Rust. The compiler decides whether longer operations are inlined: if all of them are, the crate
/// takes 1.08 times as long to compile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain;

type Eight = [f32; LANES];

#[inline(always)]
fn each(f: impl FnMut(usize) -> f32) -> Eight {
    std::array::from_fn(f)
}

impl ShadeLanes for Plain {
    type F = Eight;
    type I = [i32; LANES];
    type Parts = ([i16; LANES], [i16; LANES]);
    type Quads = [[u64; LANES]; 2];
    type Weights = [i16; LANES];
    /// By pixel: the left and right weights of the upper row, then of the lower row.
    type Corners = [[[i16; 2]; 2]; LANES];
    type ColorSum = [[i32; 3]; LANES];

    #[inline(always)]
    fn splat(self, value: f32) -> Eight {
        [value; LANES]
    }
    #[inline(always)]
    fn load(self, from: &Eight) -> Eight {
        *from
    }
    #[inline(always)]
    fn store(self, values: Eight, to: &mut Eight) {
        *to = values;
    }
    #[inline(always)]
    fn add(self, a: Eight, b: Eight) -> Eight {
        each(|k| a[k] + b[k])
    }
    #[inline(always)]
    fn sub(self, a: Eight, b: Eight) -> Eight {
        each(|k| a[k] - b[k])
    }
    #[inline(always)]
    fn mul(self, a: Eight, b: Eight) -> Eight {
        each(|k| a[k] * b[k])
    }
    #[inline(always)]
    fn div(self, a: Eight, b: Eight) -> Eight {
        each(|k| a[k] / b[k])
    }
    #[inline(always)]
    fn sqrt(self, a: Eight) -> Eight {
        a.map(f32::sqrt)
    }
    #[inline(always)]
    fn min(self, a: Eight, b: Eight) -> Eight {
        each(|k| if a[k] < b[k] { a[k] } else { b[k] })
    }
    #[inline(always)]
    fn max(self, a: Eight, b: Eight) -> Eight {
        each(|k| if a[k] > b[k] { a[k] } else { b[k] })
    }
    #[inline(always)]
    fn select_by_sign(self, of: Eight, negative: Eight, positive: Eight) -> Eight {
        each(|k| {
            if of[k].is_sign_negative() {
                negative[k]
            } else {
                positive[k]
            }
        })
    }
    #[inline(always)]
    fn select(self, these: u32, yes: Eight, no: Eight) -> Eight {
        each(|k| if these >> k & 1 == 1 { yes[k] } else { no[k] })
    }
    #[inline(always)]
    fn truncate(self, values: Eight) -> Eight {
        values.map(|v| v as i32 as f32)
    }
    #[inline(always)]
    fn greater(self, a: Eight, b: Eight) -> u32 {
        (0..LANES).map(|k| u32::from(a[k] > b[k]) << k).sum()
    }
    #[inline(always)]
    fn store_int(self, values: Eight, to: &mut [i32; LANES]) {
        *to = values.map(|v| v as i32);
    }

    #[inline]
    fn log2(self, values: Eight) -> (Eight, Eight) {
        let whole = values.map(|v| ((v.to_bits() >> 23) as i32 - 127) as f32);
        // A parabola through both ends.
        let fraction = values.map(|v| {
            let mantissa = f32::from_bits((v.to_bits() & 0x007F_FFFF) | 0x3F80_0000);
            let fraction = (2.0 - mantissa * (1.0 / 3.0)) * mantissa - 5.0 / 3.0;
            if fraction > 0.0 { fraction } else { 0.0 }
        });
        (whole, fraction)
    }
    #[inline]
    fn fixed(self, values: Eight) -> [i32; LANES] {
        // The smallest number that does not fit.
        const END: f32 = 2_147_483_648.0;
        values
            .map(|v| v * 32768.0)
            .map(|v| if v < END { v as i32 } else { i32::MIN })
    }
    #[inline(always)]
    fn add_fixed(self, a: [i32; LANES], b: [i32; LANES]) -> [i32; LANES] {
        std::array::from_fn(|k| a[k].wrapping_add(b[k]))
    }
    #[inline(always)]
    fn store_fixed(self, values: [i32; LANES], to: &mut [i32; LANES]) {
        *to = values;
    }
    #[inline]
    fn within(self, values: [i32; LANES], end: u32) -> u32 {
        // A negative number is large as an unsigned one.
        (0..LANES).map(|k| u32::from((values[k] as u32) < end) << k).sum()
    }
    #[inline]
    fn place(self, x: [i32; LANES], y: [i32; LANES], stride: i32, these: u32) -> ([i32; LANES], Self::Parts) {
        let rest = |v: i32| (v & 0x7FFF) as i16;
        let at = |k: usize| (y[k] >> 15).wrapping_mul(stride).wrapping_add((x[k] >> 15) * 3);
        (std::array::from_fn(|k| if these >> k & 1 == 1 { at(k) } else { 0 }), (x.map(rest), y.map(rest)))
    }
    #[inline(always)]
    fn parts(self, x: &[i16; LANES], y: &[i16; LANES]) -> Self::Parts {
        (*x, *y)
    }
    #[inline(always)]
    fn store_parts(self, parts: Self::Parts, x: &mut [i16; LANES], y: &mut [i16; LANES]) {
        (*x, *y) = parts;
    }
    #[inline]
    fn quads(self, image: &Texels<'_>, at: [i32; LANES]) -> Option<Self::Quads> {
        let mut quads = [[0; LANES]; 2];
        for (quads, below) in quads.iter_mut().zip([0, image.stride as usize]) {
            for (quad, at) in quads.iter_mut().zip(at) {
                let bytes = image.bytes.get(usize::try_from(at).ok()? + below..)?.first_chunk()?;
                *quad = u64::from_le_bytes(*bytes);
            }
        }
        Some(quads)
    }
    #[inline(always)]
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads {
        [*upper, *lower]
    }
    #[inline(always)]
    fn weights(self, weights: Eight) -> [i16; LANES] {
        weights.map(|weight| weight as i16)
    }
    #[inline(always)]
    fn masked(self, these: u32, weights: [i16; LANES]) -> [i16; LANES] {
        std::array::from_fn(|k| if these >> k & 1 == 1 { weights[k] } else { 0 })
    }
    #[inline(always)]
    fn full_weights(self) -> [i16; LANES] {
        [i16::MIN; LANES]
    }
    #[inline]
    fn corners(self, (x, y): Self::Parts, weights: [i16; LANES]) -> Self::Corners {
        std::array::from_fn(|k| {
            let lower = part(weights[k], y[k]);
            [weights[k] - lower, lower].map(|row| {
                let right = part(row, x[k]);
                [row - right, right]
            })
        })
    }
    #[inline(always)]
    fn zero_sum(self) -> Self::ColorSum {
        [[0; 3]; LANES]
    }
    #[inline]
    fn add_weighted(self, sum: Self::ColorSum, quads: Self::Quads, corners: Self::Corners) -> Self::ColorSum {
        std::array::from_fn(|k| {
            let mut sum = sum[k];
            for (row, weights) in quads.iter().zip(corners[k]) {
                let texels = row[k].to_le_bytes();
                for (n, weight) in weights.into_iter().enumerate() {
                    for c in 0..3 {
                        sum[c] += i32::from(texels[3 * n + c]) * i32::from(weight);
                    }
                }
            }
            sum
        })
    }
    #[inline]
    fn channels(self, sum: Self::ColorSum) -> [Eight; 3] {
        std::array::from_fn(|c| each(|k| sum[k][c] as f32 * (-1.0 / 32768.0)))
    }
    #[inline]
    fn pixels(self, sum: Self::ColorSum) -> [u32; LANES] {
        sum.map(|color| {
            let [r, g, b] = color.map(|c| ((0x4000 - c) >> 15).clamp(0, 255) as u8);
            match u32::from_le_bytes([r, g, b, 0]) {
                0 => 0x01_01_01,
                color => color,
            }
        })
    }
    #[inline]
    fn store_pixels(self, packed: &[u32; LANES], to: &mut [u8; 3 * LANES]) {
        for (pixel, value) in to.as_chunks_mut::<3>().0.iter_mut().zip(packed) {
            let [r, g, b, _] = value.to_le_bytes();
            *pixel = [r, g, b];
        }
    }
    #[inline(always)]
    fn store_repeated(self, packed: u32, to: &mut [u8; COLOR_BLOCK]) {
        *to = std::array::from_fn(|k| packed.to_le_bytes()[k % 3]);
    }

    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
    #[inline(always)]
    fn equal(self, values: &[u32; LANES], value: u32) -> u32 {
        (0..LANES).map(|k| u32::from(values[k] == value) << k).sum()
    }
    #[inline]
    fn changes(self, values: &[u32; 2 * LANES + 1], from: u32, to: &mut [u32; 2 * LANES]) -> usize {
        let mut count = 0;
        for k in 0..2 * LANES {
            if values[k] != values[k + 1] {
                to[count] = from + k as u32;
                count += 1;
            }
        }
        count
    }
    #[inline]
    fn depths(self, depths: &Eight, to: &mut [u16; LANES]) {
        // ⌊x + ½⌋ = ⌊(⌊2x⌋ + 1) / 2⌋, and 2x is exact. The cast turns NaN into 0.
        *to = depths.map(|depth| (((depth * 1024.0).clamp(0.0, 131_070.0) as i32 + 1) >> 1) as u16);
    }
    #[inline]
    fn points<const PANORAMA: bool>(self, rays: &EightRays<'_>, to: &mut [f32; 3 * LANES]) {
        let EightRays { column, row, depths, place } = *rays;
        *to = std::array::from_fn(|k| {
            let (axis, depth) = (k % 3, depths[k / 3]);
            let direction = if PANORAMA {
                column[k] * row[axis]
            } else {
                column[k] + row[axis]
            };
            if depth.is_finite() {
                (place[axis] + direction * f64::from(depth)) as f32
            } else {
                0.0
            }
        });
    }
    #[inline]
    fn half_points<const PANORAMA: bool>(self, rays: &EightRays<'_>, to: &mut [f16; 3 * LANES]) {
        let mut points = [0.0; 3 * LANES];
        self.points::<PANORAMA>(rays, &mut points);
        *to = points.map(f16::from_f32);
    }
}

/// Loads the eight values from the `at`th on; 0 if there are not as many.
#[inline(always)]
pub(crate) fn eight<L: ShadeLanes>(lanes: L, of: &[f32], at: usize) -> L::F {
    match of[at..].first_chunk() {
        Some(values) => lanes.load(values),
        None => lanes.splat(0.0),
    }
}

/// Packs colours of 0 to 255 a channel: R G B in the lowest three bytes of each value, rounded half up.
#[inline(always)]
pub(crate) fn packed<L: ShadeLanes>(lanes: L, color: [L::F; 3]) -> [u32; LANES] {
    let mut packed = [0; LANES];
    for (channel, shift) in color.into_iter().zip([0, 8, 16]) {
        let mut bytes = [0; LANES];
        lanes.store_int(lanes.add(channel, lanes.splat(0.5)), &mut bytes);
        for (packed, byte) in packed.iter_mut().zip(bytes) {
            *packed |= (byte as u32) << shift;
        }
    }
    packed
}

/// Stores eight values from the `at`th on, if there are as many.
#[inline(always)]
pub(crate) fn put<L: ShadeLanes>(lanes: L, to: &mut [f32], at: usize, values: L::F) {
    if let Some(to) = to[at..].first_chunk_mut() {
        lanes.store(values, to);
    }
}
