//! Pillow's Lanczos filter on 8-bit images, to the bit. Pixels that it makes black are not evaluated.

use s3d_geom::Raster;
use std::f64::consts::PI;

/// The number of fraction bits of a weight: 32, less 8 for a pixel and 2 for overshoots.
const BITS: u32 = 22;
/// A weight is `high · 2^LOW_BITS + low`. Both have 16 bits, which processors multiply and add fast.
const LOW_BITS: u32 = 11;
/// The reach of the filter, in pixels of the coarser of both images.
const REACH: f64 = 3.0;

/// The weights that make one pixel along an axis: of the pixels from `start` on.
struct Taps {
    start: usize,
    high: Vec<i16>,
    low: Vec<i16>,
}

/// Pillow's `resize(…, LANCZOS)` for images with 8 bits a channel. Source: Pillow, `libImaging/Resample.c`.
pub struct Lanczos {
    columns: Option<Vec<Taps>>,
    rows: Option<Vec<Taps>>,
    width: usize,
}

impl Lanczos {
    /// Prepares to resize images of `from` pixels (width, height) to `to` pixels.
    pub fn new(from: [u32; 2], to: [u32; 2]) -> Self {
        // The library, too, skips an axis that keeps its length.
        let axis =
            |i: usize| (from[i] != to[i]).then(|| (0..to[i]).map(|at| taps(from[i], to[i], at)).collect());
        Self { columns: axis(0), rows: axis(1), width: to[0] as usize }
    }

    /// Returns a channel of the result, row by row.
    ///
    /// # Panics
    /// If `image` has another size than `from`, or `channel` is not below 3.
    pub fn channel(&self, image: &Raster<[u8; 3]>, channel: usize) -> Vec<u8> {
        // Along x.
        let mut line: Vec<i16> = Vec::new();
        let mut wide = Vec::with_capacity(self.width * image.height() as usize);
        for row in image.rows() {
            let Some(columns) = &self.columns else {
                wide.extend(row.iter().map(|pixel| pixel[channel]));
                continue;
            };
            line.clear();
            line.extend(row.iter().map(|pixel| i16::from(pixel[channel])));
            wide.extend(columns.iter().map(|taps| taps.of(&line[taps.start..])));
        }

        // Along y, all columns at once.
        let Some(rows) = &self.rows else { return wide };
        let mut out = Vec::with_capacity(self.width * rows.len());
        let mut sums = vec![0i32; self.width];
        for taps in rows {
            sums.fill(1 << (BITS - 1));
            let lines = wide.chunks_exact(self.width).skip(taps.start);
            for ((high, low), line) in taps.high.iter().zip(&taps.low).zip(lines) {
                let weight = (i32::from(*high) << LOW_BITS) + i32::from(*low);
                sums.iter_mut()
                    .zip(line)
                    .for_each(|(sum, pixel)| *sum += weight * i32::from(*pixel));
            }
            out.extend(sums.iter().map(|sum| (sum >> BITS).clamp(0, 255) as u8));
        }
        out
    }

    /// Returns the pixel of a channel in column `x` and row `y` of the result.
    ///
    /// # Panics
    /// Like [`Lanczos::channel`], and if the pixel is outside.
    pub fn pixel(&self, image: &Raster<[u8; 3]>, channel: usize, x: usize, y: usize) -> u8 {
        let across = |row: usize| {
            let row = image.row(row as u32);
            let Some(columns) = &self.columns else { return row[x][channel] };
            let taps = &columns[x];
            let inside = &row[taps.start..][..taps.high.len()];
            taps.of(&inside.iter().map(|pixel| i16::from(pixel[channel])).collect::<Vec<_>>())
        };
        let Some(rows) = &self.rows else { return across(y) };
        let taps = &rows[y];
        let column = taps.start..taps.start + taps.high.len();
        taps.of(&column.map(|row| i16::from(across(row))).collect::<Vec<_>>())
    }
}

impl Taps {
    /// Returns the weighted sum of the first pixels of `line`.
    fn of(&self, line: &[i16]) -> u8 {
        let sum = |weights: &[i16]| {
            let products = weights.iter().zip(line).map(|(w, p)| i32::from(*w) * i32::from(*p));
            products.sum::<i32>()
        };
        let sum = (1 << (BITS - 1)) + (sum(&self.high) << LOW_BITS) + sum(&self.low);
        (sum >> BITS).clamp(0, 255) as u8
    }
}

/// Returns the weights for pixel `at` of an axis that is resized from `from` pixels to `to`.
fn taps(from: u32, to: u32, at: u32) -> Taps {
    let scale = f64::from(from) / f64::from(to);
    let coarse = scale.max(1.0);
    let middle = (f64::from(at) + 0.5) * scale;
    let start = (middle - REACH * coarse + 0.5).max(0.0) as u32;
    let end = ((middle + REACH * coarse + 0.5) as u32).min(from);
    let weights: Vec<f64> = (start..end)
        .map(|i| lanczos((f64::from(i) - middle + 0.5) * (1.0 / coarse)))
        .collect();
    let total: f64 = weights.iter().sum();
    let fixed = weights.iter().map(|weight| {
        let weight = if total == 0.0 { *weight } else { weight / total } * f64::from(1 << BITS);
        (weight + if weight < 0.0 { -0.5 } else { 0.5 }) as i32
    });
    let (high, low) = fixed
        .map(|weight| ((weight >> LOW_BITS) as i16, (weight & ((1 << LOW_BITS) - 1)) as i16))
        .unzip();
    Taps { start: start as usize, high, low }
}

/// Returns sinc(x) · sinc(x/3) where |x| is below 3, and 0 elsewhere.
fn lanczos(x: f64) -> f64 {
    if (-REACH..REACH).contains(&x) {
        sinc(x) * sinc(x / REACH)
    } else {
        0.0
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { libm::sin(x * PI) / (x * PI) }
}
