//! Keypoints of colours.

use super::gray::PaddedGray;
use crate::shade::channels::fit;
use s3d_geom::Raster;
use s3d_simd::{dispatch, level};

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
    let padded = PaddedGray::new(gray, MARGIN, wraps);
    let width = gray.width() as usize;
    dispatch!(level(), _simd => draw(&padded, width, out));
}

#[inline(always)]
fn draw(padded: &PaddedGray, width: usize, out: &mut Raster<u8>) {
    let sums = BoxSums::new(padded);
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

/// The sums of levels above and to the left of each place. A line has its even columns first, and then the
/// odd ones: responses are two columns apart, and so next to each other.
struct BoxSums {
    /// The even columns of a line, and the odd ones.
    half: usize,
    sums: Vec<u32>,
}

impl BoxSums {
    #[inline(always)]
    fn new(gray: &PaddedGray) -> Self {
        let half = (gray.line + 1).div_ceil(2);
        let rows = gray.levels.len() / gray.line;
        let mut sums = vec![0u32; 2 * half * (rows + 1)];
        let mut across = vec![0u32; 2 * half];
        for (row, levels) in gray.levels.chunks_exact(gray.line).enumerate() {
            let mut sum = 0u32;
            for (level, out) in levels.iter().zip(&mut across[1..]) {
                // Sums of large images wrap around, and their differences do not mind.
                sum = sum.wrapping_add(u32::from(*level));
                *out = sum;
            }

            let (above, rest) = sums[row * 2 * half..].split_at_mut(2 * half);
            let (even, odd) = rest[..2 * half].split_at_mut(half);
            let (even_above, odd_above) = above.split_at(half);
            let outs = even.iter_mut().zip(even_above).zip(odd.iter_mut().zip(odd_above));
            for (pair, ((even, even_above), (odd, odd_above))) in across.chunks_exact(2).zip(outs) {
                *even = even_above.wrapping_add(pair[0]);
                *odd = odd_above.wrapping_add(pair[1]);
            }
        }
        Self { half, sums }
    }

    /// Raises the responses of every second pixel of a row to the determinants of the filter whose third is
    /// `LOBE` pixels wide. `row` counts the margin.
    #[inline(always)]
    fn determinants<const LOBE: usize>(&self, row: usize, responses: &mut [f32]) {
        let count = responses.len();
        let width = 3 * LOBE;
        let (half, third) = (width / 2, LOBE / 2);
        // The sums at a column of the window around each response.
        let line = |row: usize| &self.sums[row * 2 * self.half..(row + 1) * 2 * self.half];
        let at = |row: usize, x: usize| {
            let start = (x % 2) * self.half + x / 2;
            &line(row)[start..start + count]
        };
        let corners = |top: usize, bottom: usize, left: usize, right: usize| {
            [at(bottom, right), at(top, right), at(bottom, left), at(top, left)]
        };

        let x = MARGIN;
        let (high, low) = (row + 1 - LOBE, row + LOBE);
        let (left, right) = (x + 1 - LOBE, x + LOBE);
        let wide = corners(high, low, x - half, x + half + 1);
        let wide_middle = corners(high, low, x - third, x + third + 1);
        let tall = corners(row - half, row + half + 1, left, right);
        let tall_middle = corners(row - third, row + third + 1, left, right);
        let upper_left = corners(row - LOBE, row, x - LOBE, x);
        let lower_right = corners(row + 1, row + LOBE + 1, x + 1, x + LOBE + 1);
        let upper_right = corners(row - LOBE, row, x + 1, x + LOBE + 1);
        let lower_left = corners(row + 1, row + LOBE + 1, x - LOBE, x);
        let scale = 1.0 / (255.0 * (width * width) as f32);

        for (n, response) in responses.iter_mut().enumerate() {
            let xx = sum(&wide, n).wrapping_sub(sum(&wide_middle, n).wrapping_mul(3));
            let yy = sum(&tall, n).wrapping_sub(sum(&tall_middle, n).wrapping_mul(3));
            let xy = sum(&upper_left, n)
                .wrapping_add(sum(&lower_right, n))
                .wrapping_sub(sum(&upper_right, n))
                .wrapping_sub(sum(&lower_left, n));
            let (xx, yy, xy) = (xx as i32 as f32 * scale, yy as i32 as f32 * scale, xy as i32 as f32 * scale);
            let determinant = xx * yy - MIXED * xy * xy;
            *response = if determinant > *response {
                determinant
            } else {
                *response
            };
        }
    }
}

/// Returns the sum of the levels of the box around a response.
#[inline(always)]
fn sum(corners: &[&[u32]; 4], response: usize) -> u32 {
    let [bottom_right, top_right, bottom_left, top_left] = corners;
    let right = bottom_right[response].wrapping_sub(top_right[response]);
    right.wrapping_sub(bottom_left[response].wrapping_sub(top_left[response]))
}
