//! Edges of colours.

use super::gray::PaddedGray;
use crate::shade::channels::fit;
use s3d_geom::Raster;
use s3d_simd::{dispatch, level};

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
    dispatch!(level(), _simd => draw(&padded, width, out));
}

#[inline(always)]
fn draw(padded: &PaddedGray, width: usize, out: &mut Raster<u8>) {
    let across = blurred_across(padded);
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
#[inline(always)]
fn blurred_across(padded: &PaddedGray) -> Vec<u16> {
    let width = padded.line - 8;
    let mut out = vec![0; padded.levels.len() / padded.line * width];
    for (line, out) in padded.levels.chunks_exact(padded.line).zip(out.chunks_exact_mut(width)) {
        let parts: [&[u8]; 9] = std::array::from_fn(|k| &line[k..k + width]);
        let [a, b, c, d, e, f, g, h, i] = parts;
        for (x, out) in out.iter_mut().enumerate() {
            // The weights add up to 256, so 16 bits are enough.
            let near = 56 * (u16::from(d[x]) + u16::from(f[x])) + 70 * u16::from(e[x]);
            let far = 8 * (u16::from(b[x]) + u16::from(h[x])) + 28 * (u16::from(c[x]) + u16::from(g[x]));
            *out = u16::from(a[x]) + u16::from(i[x]) + far + near;
        }
    }
    out
}

/// Blurs down the lines from `first` on, and writes levels times 256.
#[inline(always)]
fn blur_down(lines: &[u16], width: usize, first: usize, out: &mut [u16]) {
    let line = |k: usize| &lines[(first + k) * width..(first + k + 1) * width];
    let [a, b, c, d, e, f, g, h, i] = std::array::from_fn(line);
    for (x, out) in out.iter_mut().enumerate() {
        let near = 56 * (u32::from(d[x]) + u32::from(f[x])) + 70 * u32::from(e[x]);
        let far = 8 * (u32::from(b[x]) + u32::from(h[x])) + 28 * (u32::from(c[x]) + u32::from(g[x]));
        *out = ((u32::from(a[x]) + u32::from(i[x]) + far + near + 128) >> 8) as u16;
    }
}

/// Writes the strengths of a line from the blurred lines around it.
#[inline(always)]
fn magnitudes(lines: &[Vec<u16>; 3], out: &mut [u8]) {
    let [above, at, below] = lines.each_ref().map(Vec::as_slice);
    let width = out.len();
    let [a, b, c]: [[&[u16]; 3]; 3] =
        [above, at, below].map(|line| std::array::from_fn(|k| &line[k..k + width]));
    for (x, out) in out.iter_mut().enumerate() {
        let (left, right) =
            (i32::from(a[0][x]) + i32::from(c[0][x]), i32::from(a[2][x]) + i32::from(c[2][x]));
        let (top, bottom) =
            (i32::from(a[0][x]) + i32::from(a[2][x]), i32::from(c[0][x]) + i32::from(c[2][x]));
        let h = right + 2 * i32::from(b[2][x]) - left - 2 * i32::from(b[0][x]);
        let v = bottom + 2 * i32::from(c[1][x]) - top - 2 * i32::from(a[1][x]);
        let (h, v) = (h as f32, v as f32);
        // 255 · 4 · m = √(h² + v²) / (256 √2) for levels times 256 and differences times 4.
        let strength = ((h * h + v * v) * (1.0 / 131_072.0)).sqrt();
        *out = (strength + 0.5).min(255.0) as u8;
    }
}
