//! Keypoints of colours.

use super::gray::PaddedGray;
use crate::shade::channels::fit;
use s3d_geom::Raster;

/// The pixels on each side that a response depends on.
const MARGIN: usize = 14;
/// The weight of the mixed derivative, which makes up for boxes in the place of Gaussians.
const MIXED: f32 = 0.81;

/// Writes the response of a detector of blobs into an existing image: min(255, 2,048 · √max(0, D)),
/// rounded. D is the largest determinant of the Hessian, Dxx · Dyy − (0.9 · Dxy)², over the four filters
/// of SURF's first octave, of levels from 0 to 1. Second derivatives are sums over boxes, divided by the area
/// of the filter. Each 2 × 2 pixels have the response of the first of them, which is SURF's sampling. `gray`
/// is [`gray_image`](crate::gray_image) of the colours, and `wraps` says that its first column is a neighbour
/// of its last.
///
/// Source: Bay et al., "Speeded-Up Robust Features (SURF)", CVIU 110(3), 2008.
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
        // The filters are 9, 15, 21 and 27 pixels wide.
        let at = 2 * pair + MARGIN;
        sums.determinants::<3>(at, &mut responses);
        sums.determinants::<5>(at, &mut responses);
        sums.determinants::<7>(at, &mut responses);
        sums.determinants::<9>(at, &mut responses);

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

    /// Raises the responses of every second pixel of a row to the determinants of the filter whose third is
    /// `LOBE` pixels wide. `row` counts the margin.
    fn determinants<const LOBE: usize>(&self, row: usize, responses: &mut [f32]) {
        let width = 3 * LOBE;
        let (half, third) = (width / 2, LOBE / 2);
        let line = |row: usize| &self.sums[row * self.line..(row + 1) * self.line];
        // Bands of rows.
        let (top, bottom) = (line(row - half), line(row + half + 1));
        let (high, low) = (line(row + 1 - LOBE), line(row + LOBE));
        let (third_high, third_low) = (line(row - third), line(row + third + 1));
        let (upper, lower) = (line(row - LOBE), line(row + LOBE + 1));
        let (at, after) = (line(row), line(row + 1));
        let scale = 1.0 / (255.0 * (width * width) as f32);

        for (n, response) in responses.iter_mut().enumerate() {
            // Windows of a known length need no checks of their places.
            let [top, bottom] = [window(top, n), window(bottom, n)];
            let [high, low] = [window(high, n), window(low, n)];
            let [third_high, third_low] = [window(third_high, n), window(third_low, n)];
            let [upper, lower, at, after] =
                [window(upper, n), window(lower, n), window(at, n), window(after, n)];
            let (x, tall) = (MARGIN, (MARGIN + 1 - LOBE, MARGIN + LOBE));

            let xx = sum(high, low, x - half, x + half + 1).wrapping_sub(3u32.wrapping_mul(sum(
                high,
                low,
                x - third,
                x + third + 1,
            )));
            let yy = sum(top, bottom, tall.0, tall.1)
                .wrapping_sub(3u32.wrapping_mul(sum(third_high, third_low, tall.0, tall.1)));
            let xy = sum(upper, at, x - LOBE, x)
                .wrapping_add(sum(after, lower, x + 1, x + LOBE + 1))
                .wrapping_sub(sum(upper, at, x + 1, x + LOBE + 1))
                .wrapping_sub(sum(after, lower, x - LOBE, x));
            let (xx, yy, xy) = (xx as i32 as f32 * scale, yy as i32 as f32 * scale, xy as i32 as f32 * scale);
            *response = response.max(xx * yy - MIXED * xy * xy);
        }
    }
}

/// The places of a line that a response depends on.
const SPAN: usize = 2 * MARGIN + 1;

/// Returns the places around a response.
#[inline(always)]
fn window(line: &[u32], response: usize) -> &[u32; SPAN] {
    line[2 * response..].first_chunk().unwrap_or(&[0; SPAN])
}

/// Returns the sum of the levels of a box.
#[inline(always)]
fn sum(top: &[u32; SPAN], bottom: &[u32; SPAN], left: usize, right: usize) -> u32 {
    let right = bottom[right].wrapping_sub(top[right]);
    right.wrapping_sub(bottom[left].wrapping_sub(top[left]))
}
