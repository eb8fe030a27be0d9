//! Keypoints of colours.

use super::gray::PaddedGray;
use crate::shade::channels::fit;
use s3d_geom::Raster;

/// The third of each filter's width, pixels: the filters are 9, 15, 21 and 27 pixels wide.
const LOBES: [usize; 4] = [3, 5, 7, 9];
/// The pixels on each side that a response depends on.
const MARGIN: usize = 14;
/// The weight of the mixed derivative, which makes up for boxes in the place of Gaussians.
const MIXED: f32 = 0.81;

/// Writes the response of a detector of blobs into an existing image: min(255, 2,048 · √max(0, D)), rounded. D
/// is the largest determinant of the Hessian, Dxx · Dyy − (0.9 · Dxy)², over the four filters of SURF's first
/// octave, of levels from 0 to 1. Second derivatives are sums over boxes, divided by the area of the filter.
/// Each 2 × 2 pixels have the response of the first of them, which is SURF's sampling. `gray` is
/// [`gray_image`](crate::gray_image) of the colours, and `wraps` says that its first column is a neighbour of
/// its last.
///
/// Source: Bay, Ess, Tuytelaars and Van Gool, "Speeded-Up Robust Features (SURF)", CVIU 110(3), 2008.
pub fn keypoint_image_into(gray: &Raster<u8>, wraps: bool, out: &mut Raster<u8>) {
    fit(out, gray, 0);
    if gray.is_empty() {
        return;
    }
    let width = gray.width() as usize;
    let sums = BoxSums::new(&PaddedGray::new(gray, MARGIN, wraps));
    let mut responses = vec![0f32; width.div_ceil(2)];
    for (pair, rows) in out.pixels_mut().chunks_mut(2 * width).enumerate() {
        responses.fill(0.0);
        for lobe in LOBES {
            sums.determinants(2 * pair + MARGIN, lobe, &mut responses);
        }

        let (row, copy) = rows.split_at_mut(width);
        for (pixels, response) in row.chunks_mut(2).zip(&responses) {
            pixels.fill((2048.0 * response.sqrt() + 0.5).min(255.0) as u8);
        }
        copy.copy_from_slice(&row[..copy.len()]);
    }
}

/// The sums of levels above and to the left of each place.
struct BoxSums {
    line: usize,
    sums: Vec<u32>,
}

impl BoxSums {
    fn new(gray: &PaddedGray) -> Self {
        let line = gray.line + 1;
        let rows = gray.levels.len() / gray.line;
        let mut sums = vec![0u32; line * (rows + 1)];
        for (row, levels) in gray.levels.chunks_exact(gray.line).enumerate() {
            let (above, rest) = sums[row * line..].split_at_mut(line);
            let mut sum = 0u32;
            for ((level, above), out) in levels.iter().zip(&above[1..]).zip(&mut rest[1..line]) {
                // Sums of large images wrap around, and their differences do not mind.
                sum = sum.wrapping_add(u32::from(*level));
                *out = above.wrapping_add(sum);
            }
        }
        Self { line, sums }
    }

    /// Raises the responses of every second pixel of a row to the determinants of a filter. `row` counts the
    /// margin.
    fn determinants(&self, row: usize, lobe: usize, responses: &mut [f32]) {
        let width = 3 * lobe;
        let half = width / 2;
        let line = |row: usize| &self.sums[row * self.line..(row + 1) * self.line];
        // Bands of rows, and places in a line from the left end of the filter on.
        let (top, bottom) = (line(row - half), line(row + half + 1));
        let (high, low) = (line(row + 1 - lobe), line(row + lobe));
        let (third_high, third_low) = (line(row - lobe / 2), line(row + lobe / 2 + 1));
        let (upper, lower) = (line(row - lobe), line(row + lobe + 1));
        let (at, after) = (line(row), line(row + 1));
        let scale = 1.0 / (255.0 * (width * width) as f32);

        for (n, response) in responses.iter_mut().enumerate() {
            let x = 2 * n + MARGIN;
            let sum = |top: &[u32], bottom: &[u32], left: usize, right: usize| {
                let right = bottom[right].wrapping_sub(top[right]);
                right.wrapping_sub(bottom[left].wrapping_sub(top[left])) as i32
            };
            let (left, right) = (x - half, x + half + 1);
            let xx = sum(high, low, left, right) - 3 * sum(high, low, x - lobe / 2, x + lobe / 2 + 1);
            let (left_tall, right_tall) = (x + 1 - lobe, x + lobe);
            let yy = sum(top, bottom, left_tall, right_tall)
                - 3 * sum(third_high, third_low, left_tall, right_tall);
            let xy = sum(upper, at, x - lobe, x) + sum(after, lower, x + 1, x + lobe + 1)
                - sum(upper, at, x + 1, x + lobe + 1)
                - sum(after, lower, x - lobe, x);
            let [xx, yy, xy] = [xx, yy, xy].map(|sum| sum as f32 * scale);
            *response = response.max(xx * yy - MIXED * xy * xy);
        }
    }
}
