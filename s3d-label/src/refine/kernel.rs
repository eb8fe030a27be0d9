//! How similar two pixels look, and which pixels of a window are looked at.

use super::padded::{Look, MARGIN};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// The standard deviation of colours, 0 to 255, and the least similarity of colours, of 255.
const COLOR: (f64, f64) = (15.0, 8.0);

/// The same of depths, in 512ths of a doubling. Depth and normal come from the mesh, like the labels that are
/// in doubt: they weigh little.
const DEPTH: (f64, f64) = (40.0, 230.0);

/// The same of normals: of the distance of unit vectors.
const NORMAL: (f64, f64) = (0.6, 230.0);

/// Entries of the table of colours: squared distances in steps of 16.
const COLOR_STEPS: usize = 1024;

/// The radius of the window, as a multiple of the reach of the band, and its limits in pixels.
const RADIUS: (f64, [f64; 2]) = (1.6, [5.0, MARGIN as f64 - 2.0]);

/// The standard deviation of the weights of a window's pixels, as a share of the radius.
const SIGMA: f64 = 0.7;

/// Circles of a window, pixels on each, and how the circles become denser towards the middle.
const CIRCLES: u32 = 4;
const ON_CIRCLE: u32 = 8;
const POWER: f64 = 1.3;

/// Tables of similarities.
pub(super) struct Kernel {
    color: Vec<u8>,
    depth: Vec<u8>,
    normal: Vec<u8>,
}

impl Kernel {
    pub(super) fn new() -> Self {
        let table = |len: usize, (sigma, least): (f64, f64), distance_squared: &dyn Fn(f64) -> f64| {
            let entry = |step: usize| {
                let exponent = -0.5 * distance_squared(step as f64) / (sigma * sigma);
                (least + (255.0 - least) * libm::exp(exponent)).round() as u8
            };
            (0..len).map(entry).collect()
        };
        Self {
            color: table(COLOR_STEPS, COLOR, &|step| step * 16.0),
            depth: table(512, DEPTH, &|step| step * step),
            // From opposite normals to equal ones, in 128ths of the product.
            normal: table(257, NORMAL, &|step| (2.0 - 2.0 * (step - 128.0) / 126.0).max(0.0)),
        }
    }

    /// Returns how similar two looks are: 1 to 255.
    #[inline(always)]
    pub(super) fn similarity(&self, a: &Look, b: &Look) -> u8 {
        let entry = |table: &[u8], at: usize| u32::from(table.get(at).copied().unwrap_or(0));
        let mut distance = 0;
        let mut product = 0;
        for k in 0..3 {
            // Always there: the arrays have three entries.
            let (Some(p), Some(q)) = (a.color.get(k), b.color.get(k)) else { continue };
            distance += u32::from(p.abs_diff(*q)).pow(2);
            let (Some(p), Some(q)) = (a.normal.get(k), b.normal.get(k)) else { continue };
            product += i32::from(*p) * i32::from(*q);
        }

        let color = entry(&self.color, (distance as usize >> 4).min(COLOR_STEPS - 1));
        let depth = entry(&self.depth, usize::from(a.depth.abs_diff(b.depth)).min(511));
        let normal = entry(&self.normal, ((product >> 7) + 128).clamp(0, 256) as usize);
        ((color * depth * normal) >> 16).clamp(1, 255) as u8
    }
}

/// A pixel of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WindowPixel {
    /// Where it is: columns to the right and rows down.
    pub(super) offset: [i16; 2],
    /// How much it counts, of 255.
    pub(super) weight: u8,
}

/// The windows of all reaches. Neighbours look at circles that are turned by half a step, as on a
/// chessboard, so that together they see what lies between.
pub(super) struct Windows {
    of_reach: Vec<[Vec<WindowPixel>; 2]>,
}

impl Windows {
    pub(super) fn new() -> Self {
        Self {
            of_reach: (0..=24)
                .map(|reach| [0.0, 0.5].map(|turn| window(reach, turn)))
                .collect(),
        }
    }

    /// Returns the window of a pixel with this reach, on the white or black fields of a chessboard.
    pub(super) fn of(&self, reach: u8, is_black: bool) -> &[WindowPixel] {
        let both = self.of_reach.get(usize::from(reach)).or(self.of_reach.last());
        both.map_or(&[], |[white, black]| if is_black { black } else { white })
    }
}

/// Returns the pixels of a window, sorted by row and column. `turn` turns its circles, in steps of a circle.
fn window(reach: u8, turn: f64) -> Vec<WindowPixel> {
    let (times, [least, most]) = RADIUS;
    let radius = (f64::from(reach) * times).clamp(least, most);
    let mut pixels = BTreeMap::new();

    for circle in 0..CIRCLES {
        let share = libm::pow(f64::from(circle + 1) / f64::from(CIRCLES), POWER);
        for k in 0..ON_CIRCLE {
            let step = f64::from(k) + 0.5 * f64::from(circle % 2) + turn;
            let angle = TAU * step / f64::from(ON_CIRCLE);
            let place = [libm::cos(angle), libm::sin(angle)].map(|part| (radius * share * part).round());
            let [x, y] = place;
            if place != [0.0; 2] {
                let exponent = -0.5 * (x * x + y * y) / (SIGMA * radius * SIGMA * radius);
                let weight = (libm::exp(exponent) * 255.0).round() as u8;
                pixels.insert([y as i16, x as i16], weight);
            }
        }
    }
    let pixel = |([y, x], weight): ([i16; 2], u8)| WindowPixel { offset: [x, y], weight };
    pixels.into_iter().map(pixel).collect()
}
