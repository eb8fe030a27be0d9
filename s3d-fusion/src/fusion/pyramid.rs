//! The smallest and largest ranges of an image, in squares of pixels.

use super::view::Extent;
use crate::range_image::Surfel;

/// Levels of squares of 4, 8, 16 … pixels.
#[derive(Debug)]
pub(crate) struct Pyramid {
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    /// The nearest range around all pixels of the square, 0 if one is missing; the largest range, 0 if all
    /// are.
    ranges: Vec<[f32; 2]>,
}

/// The base-two logarithm of the side of the smallest squares.
const FIRST: u32 = 2;

impl Pyramid {
    pub(crate) fn new(surfels: &[Surfel], [width, height]: [u32; 2]) -> Self {
        let (width, height) = (width as usize, height as usize);
        let side = 1 << FIRST;
        let mut first = Level::new(width.div_ceil(side), height.div_ceil(side));
        for (y, row) in surfels.chunks_exact(width).enumerate() {
            let squares = &mut first.ranges[y / side * first.width..][..first.width];
            for (square, pixels) in squares.iter_mut().zip(row.chunks(side)) {
                for surfel in pixels {
                    // What was dropped is behind whatever its pixel shows.
                    let range = if surfel.weight > 0.0 { surfel.range } else { 0.0 };
                    *square = [square[0].min(surfel.nearest), square[1].max(range)];
                }
            }
        }

        let mut levels = vec![first];
        while let Some(last) = levels.last().filter(|l| l.width > 1 || l.height > 1) {
            let mut next = Level::new(last.width.div_ceil(2), last.height.div_ceil(2));
            for (i, ranges) in last.ranges.iter().enumerate() {
                let square = &mut next.ranges[i / last.width / 2 * next.width + i % last.width / 2];
                *square = [square[0].min(ranges[0]), square[1].max(ranges[1])];
            }
            levels.push(next);
        }
        Self { levels }
    }

    /// Returns a lower bound of the nearest range of the pixels, 0 if one is missing, and an upper bound of
    /// the largest.
    pub(crate) fn ranges(&self, extent: &Extent) -> [f32; 2] {
        let size = [0, 1].map(|k| extent.to[k] - extent.from[k]);
        // At most 5 × 5 squares: larger ones would mix in what is beside.
        let larger = size[0].max(size[1]) >> (FIRST + 2);
        let level = ((u32::BITS - larger.leading_zeros()) as usize).min(self.levels.len() - 1);
        let squares = &self.levels[level];
        let [from, to] =
            [extent.from, extent.to].map(|p| p.map(|k| (k >> (FIRST as usize + level)) as usize));
        let mut ranges = [f32::INFINITY, 0.0_f32];
        for y in from[1]..=to[1] {
            for [near, far] in &squares.ranges[y * squares.width..][from[0]..=to[0]] {
                ranges = [ranges[0].min(*near), ranges[1].max(*far)];
            }
        }
        ranges
    }
}

impl Level {
    fn new(width: usize, height: usize) -> Self {
        Self { width, height, ranges: vec![[f32::INFINITY, 0.0]; width * height] }
    }
}
