//! Edges of colours.

use super::gray::PaddedGray;
use crate::shade::channels::fit;
use s3d_geom::Raster;

/// The pixels on each side that an edge depends on: four of the blur, one of the derivative.
const MARGIN: usize = 5;

/// Writes the strength of gray edges into an existing image: min(255, 255 · 4 · m), rounded, where m is the
/// Sobel magnitude of blurred levels from 0 to 1. The blur is the binomial filter of nine pixels, whose
/// standard deviation is √2 pixels. `gray` is [`gray_image`](crate::gray_image) of the colours, and `wraps`
/// says that its first column is a neighbour of its last.
///
/// A magnitude is √((h² + v²) / 2), where h and v are the differences of the two neighbours along rows
/// and columns, smoothed by (1, 2, 1) / 4 across. It is the filter of Canny's detector before its thinning
/// ("A Computational Approach to Edge Detection", PAMI 8(6), 1986), as in the annotator of Omnidata.
pub fn texture_edge_image_into(gray: &Raster<u8>, wraps: bool, out: &mut Raster<u8>) {
    fit(out, gray, 0);
    if gray.is_empty() {
        return;
    }
    let width = gray.width() as usize;
    let padded = PaddedGray::new(gray, MARGIN, wraps);
    let across = blurred_across(&padded);
    let blurred_width = padded.line - 8;

    // Three blurred lines at a time, of levels times 256.
    let mut lines: [Vec<u16>; 3] = std::array::from_fn(|k| vec![0; blurred_width * usize::from(k < 3)]);
    for (k, line) in lines.iter_mut().enumerate().skip(1) {
        blur_down(&across, blurred_width, k - 1, line);
    }
    for (row, out) in out.pixels_mut().chunks_exact_mut(width).enumerate() {
        lines.rotate_left(1);
        blur_down(&across, blurred_width, row + 2, &mut lines[2]);
        magnitudes(&lines, out);
    }
}

/// Blurs along lines. Returns levels times 256, in lines that are 8 pixels shorter.
fn blurred_across(padded: &PaddedGray) -> Vec<u16> {
    let mut out = Vec::with_capacity(padded.levels.len());
    for line in padded.levels.chunks_exact(padded.line) {
        out.extend(line.windows(9).map(|w| {
            let pair = |k: usize| u32::from(w[k]) + u32::from(w[8 - k]);
            (pair(0) + 8 * pair(1) + 28 * pair(2) + 56 * pair(3) + 70 * u32::from(w[4])) as u16
        }));
    }
    out
}

/// Blurs down the lines from `first` on, and writes levels times 256.
fn blur_down(lines: &[u16], width: usize, first: usize, out: &mut [u16]) {
    let line = |k: usize| &lines[(first + k) * width..(first + k + 1) * width];
    let [a, b, c, d, e, f, g, h, i] = std::array::from_fn(line);
    for (x, out) in out.iter_mut().enumerate() {
        let at = |line: &[u16]| u32::from(line[x]);
        let sum = (at(a) + at(i)) + 8 * (at(b) + at(h)) + 28 * (at(c) + at(g)) + 56 * (at(d) + at(f));
        *out = ((sum + 70 * at(e) + 128) >> 8) as u16;
    }
}

/// Writes the strengths of a line from the blurred lines around it.
fn magnitudes(lines: &[Vec<u16>; 3], out: &mut [u8]) {
    let [above, at, below] = lines.each_ref().map(Vec::as_slice);
    let windows = above.windows(3).zip(at.windows(3)).zip(below.windows(3));
    for (out, ((a, b), c)) in out.iter_mut().zip(windows) {
        let level = |level: u16| i32::from(level);
        let right = level(a[2]) + 2 * level(b[2]) + level(c[2]);
        let left = level(a[0]) + 2 * level(b[0]) + level(c[0]);
        let top = level(a[0]) + 2 * level(a[1]) + level(a[2]);
        let bottom = level(c[0]) + 2 * level(c[1]) + level(c[2]);
        let [h, v] = [(right - left) as f32, (bottom - top) as f32];
        // 255 · 4 · m = √(h² + v²) / (256 √2) for levels times 256 and differences times 4.
        let strength = ((h * h + v * v) * (1.0 / 131_072.0)).sqrt();
        *out = (strength + 0.5).min(255.0) as u8;
    }
}
