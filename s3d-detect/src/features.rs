//! The features of a box: what its points are like in 6×6×6 cells, its place in its space, and its size.
//!
//! The paper names the kinds of features; their forms here are ours.
//!
//! - Each cell holds whether it has surfels and how many; the mean of each component of their normals,
//!   without sign; their mean curvature; their mean colour, less the mean of the space, since walls and woods
//!   of another building have other colours; and how much of that colour is the box's own rather than its
//!   surroundings'. The cells reach beyond the box by a quarter of its size, so that two in six along an axis
//!   are outside.
//! - The colour of the whole box is described by its [palette](super::palette).
//! - Position and size are spread over bins, and a linear machine weighs each bin: a number counts in the two
//!   bins next to it.

use crate::palette::{ENTRIES, LAYERS, Palette, Shares, own_of, share};
use crate::surfel::index::Index;
use glam::Vec3;
use s3d_geom::Aabb;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Cells along an axis.
const SIDE: usize = 6;
const CELLS: usize = SIDE * SIDE * SIDE;
/// How far the cells reach beyond a box: this share of its size, between these lengths in metres.
const BEYOND: f32 = 0.25;
const BEYOND_M: [f32; 2] = [0.02, 0.3];

const OCCUPANCY: Range<usize> = 0..2 * CELLS;
const NORMAL: Range<usize> = OCCUPANCY.end..OCCUPANCY.end + 3 * CELLS;
const CURVATURE: Range<usize> = NORMAL.end..NORMAL.end + CELLS;
/// Colour. Each cell has its mean and how much of it is the box's own; the box has the shares of the palette
/// inside, around and in its layers, and its contrasts.
const CELL_COLOR: Range<usize> = CURVATURE.end..CURVATURE.end + 3 * CELLS;
const OWN: Range<usize> = CELL_COLOR.end..CELL_COLOR.end + CELLS;
const SHARES: Range<usize> = OWN.end..OWN.end + (2 + LAYERS) * ENTRIES;
const CONTRAST: Range<usize> = SHARES.end..SHARES.end + 7 * CONTRAST_BINS;
const COLOR: Range<usize> = CELL_COLOR.start..CONTRAST.end;

/// The numbers of bins for a position in the unit cube, a height, a length, a share of the space's length,
/// and a contrast.
const POSITION_BINS: usize = 11;
const HEIGHT_BINS: usize = 13;
const SIZE_BINS: usize = 16;
const SHARE_BINS: usize = 9;
const CONTRAST_BINS: usize = 6;
const POSITION: Range<usize> = COLOR.end..COLOR.end + 5 * POSITION_BINS + 2 * HEIGHT_BINS;
const SIZE: Range<usize> = POSITION.end..POSITION.end + 3 * (SIZE_BINS + SHARE_BINS);

/// The number of features of a box.
pub const FEATURES: usize = SIZE.end;

/// The range of the bins of heights, in metres.
const HEIGHTS_M: [f32; 2] = [0.0, 3.6];
/// The range of the bins of lengths, in metres. Their steps are even in the logarithm.
const LENGTHS_M: [f32; 2] = [0.01, 12.0];
/// The factor of colours, which are differences to the mean of the space.
const COLOR_WEIGHT: f32 = 2.0;
/// The factor of the shares of a palette.
const SHARE_WEIGHT: f32 = 3.0;
/// The weight of a bin: as much as about ten cells.
const BIN_WEIGHT: f32 = 3.0;

/// The features that a machine is given: the rows of the paper's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    /// All features.
    Full,
    /// No position and size.
    NoGlobal,
    /// No occupancy, normal and curvature.
    NoLocal,
    /// No colour.
    NoColor,
}

impl Variant {
    /// All variants, in the order of the table.
    pub const ALL: [Self; 4] = [Self::Full, Self::NoGlobal, Self::NoLocal, Self::NoColor];

    /// The name of its row in the paper's table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "Full model",
            Self::NoGlobal => "No global",
            Self::NoLocal => "No local",
            Self::NoColor => "No color",
        }
    }

    /// The columns of features that it leaves out.
    pub fn without(self) -> Vec<Range<usize>> {
        match self {
            Self::Full => vec![],
            Self::NoGlobal => vec![POSITION, SIZE],
            Self::NoLocal => vec![OCCUPANCY, NORMAL, CURVATURE],
            Self::NoColor => vec![COLOR],
        }
    }
}

/// The sums of a cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    count: f32,
    normal: Vec3,
    curvature: f32,
    color: Vec3,
    own: f32,
}

/// Returns the [`FEATURES`] features of a box, in the frame of a space of this extent.
pub fn describe(index: &Index, extent: Vec3, b: &Aabb) -> Vec<f32> {
    let mut out = vec![0.0; FEATURES];
    let beyond = (b.size() * BEYOND).clamp(Vec3::splat(BEYOND_M[0]), Vec3::splat(BEYOND_M[1]));
    let grown = Aabb { min: b.min - beyond, max: b.max + beyond };
    let palette = Palette::new(b, index.shades_within(&grown).map(|(s, shade)| (s.position, shade)));

    describe_cells(&mut out, index, &grown, &palette.own());
    describe_palette(&mut out, &palette);
    describe_place(&mut out, extent, b);
    out
}

/// Fills the features of the cells of a grown box.
fn describe_cells(out: &mut [f32], index: &Index, grown: &Aabb, own: &Shares) {
    let mut cells = [Cell::default(); CELLS];
    let scale = SIDE as f32 / grown.size();
    for (s, shade) in index.shades_within(grown) {
        let at = ((s.position - grown.min) * scale)
            .as_uvec3()
            .min(glam::UVec3::splat(SIDE as u32 - 1));
        let cell = &mut cells[(at.x as usize * SIDE + at.y as usize) * SIDE + at.z as usize];
        cell.count += 1.0;
        cell.normal += s.normal.abs();
        cell.curvature += s.curvature;
        cell.color += s.color;
        cell.own += own_of(shade, own);
    }

    let occupied = cells.iter().filter(|c| c.count > 0.0).count() as f32;
    let mean = cells.iter().map(|c| c.count).sum::<f32>() / occupied.max(1.0);
    for (i, cell) in cells.iter().enumerate().filter(|(_, c)| c.count > 0.0) {
        out[2 * i] = 1.0;
        out[2 * i + 1] = (0.5 * cell.count / mean).min(1.0);
        let normal = cell.normal / cell.count;
        let color = COLOR_WEIGHT * (cell.color / cell.count - index.mean_color());
        out[NORMAL.start + 3 * i..][..3].copy_from_slice(&normal.to_array());
        out[CURVATURE.start + i] = 3.0 * cell.curvature / cell.count;
        out[CELL_COLOR.start + 3 * i..][..3].copy_from_slice(&color.to_array());
        out[OWN.start + i] = cell.own / cell.count;
    }
}

/// Fills the features of the colours of a box: shares, then contrasts.
fn describe_palette(out: &mut [f32], palette: &Palette) {
    let shares = palette
        .inside_and_around()
        .into_iter()
        .chain(palette.layers.map(|layer| share(&layer)));
    for (out, share) in out[SHARES].iter_mut().zip(shares.flatten()) {
        *out = SHARE_WEIGHT * share;
    }

    for (bins, contrast) in out[CONTRAST].chunks_exact_mut(CONTRAST_BINS).zip(palette.contrasts()) {
        if let Some(contrast) = contrast {
            put(Some(bins), contrast);
        }
    }
}

/// Fills the features of the place and the size of a box.
fn describe_place(out: &mut [f32], extent: Vec3, b: &Aabb) {
    let [center, low, high] = [b.center(), b.min, b.max].map(|p| of_extent(p, extent));
    let size = b.size();
    let (position, sizes) = out[POSITION.start..].split_at_mut(SIZE.start - POSITION.start);

    let mut bins = position.chunks_exact_mut(POSITION_BINS);
    for value in [center.x, center.y, center.z, low.z, high.z] {
        put(bins.next(), value);
    }
    let mut bins = position[5 * POSITION_BINS..].chunks_exact_mut(HEIGHT_BINS);
    for height in [b.min.z, extent.z - b.max.z] {
        put(bins.next(), (height - HEIGHTS_M[0]) / (HEIGHTS_M[1] - HEIGHTS_M[0]));
    }

    let mut bins = sizes.chunks_exact_mut(SIZE_BINS);
    let [least, most] = LENGTHS_M.map(libm::logf);
    for axis in 0..3 {
        put(bins.next(), (libm::logf(size[axis].max(LENGTHS_M[0])) - least) / (most - least));
    }
    let mut bins = sizes[3 * SIZE_BINS..].chunks_exact_mut(SHARE_BINS);
    for axis in 0..3 {
        put(bins.next(), of_extent(size, extent)[axis]);
    }
}

fn of_extent(p: Vec3, extent: Vec3) -> Vec3 {
    p / extent.max(Vec3::splat(0.1))
}

/// Spreads a number between 0 and 1 over the two bins next to it.
fn put(bins: Option<&mut [f32]>, value: f32) {
    let Some(bins) = bins else { return };
    let place = value.clamp(0.0, 1.0) * (bins.len() - 1) as f32;
    let low = (place as usize).min(bins.len() - 2);
    let share = place - low as f32;
    bins[low] = BIN_WEIGHT * (1.0 - share);
    bins[low + 1] = BIN_WEIGHT * share;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfel::Surfel;
    use glam::vec3;

    fn surfel(position: Vec3) -> Surfel {
        let extent = Aabb { min: position, max: position };
        Surfel {
            position,
            extent,
            normal: vec3(0.0, -1.0, 0.0),
            curvature: 0.1,
            color: vec3(0.2, 0.4, 0.6),
            room: 0,
        }
    }

    #[test]
    fn each_block_holds_its_features() {
        let index = Index::new(vec![
            surfel(vec3(1.5, 1.5, 0.55)),
            Surfel { color: Vec3::splat(0.4), ..surfel(vec3(3.0, 3.0, 2.0)) },
        ]);
        let b = Aabb { min: vec3(1.0, 1.0, 0.0), max: vec3(2.0, 2.0, 1.0) };
        let row = describe(&index, vec3(4.0, 4.0, 2.5), &b);
        assert_eq!(row.len(), FEATURES);

        // The box is grown to 1.5 m; the surfel is in the middle of it: cell (3, 3, 3).
        let cell = (3 * 6 + 3) * 6 + 3;
        let local: Vec<usize> = (0..CELL_COLOR.end).filter(|&i| row[i] != 0.0).collect();
        let colors = [0, 1, 2].map(|k| CELL_COLOR.start + 3 * cell + k);
        let mut expected = vec![2 * cell, 2 * cell + 1, NORMAL.start + 3 * cell + 1, CURVATURE.start + cell];
        // Its green is the mean of the space.
        expected.extend([colors[0], colors[2]]);
        assert_eq!(local, expected);
        assert_eq!((row[2 * cell], row[2 * cell + 1], row[NORMAL.start + 3 * cell + 1]), (1.0, 0.5, 1.0));
        assert!((row[CURVATURE.start + cell] - 0.3).abs() < 1e-6 && (row[colors[2]] - 0.2).abs() < 1e-6);

        // All of the colour is the box's own. It is in the middle third, and has nothing to differ from.
        assert!(row[OWN.start + cell] > 0.9 && row[OWN].iter().filter(|v| **v != 0.0).count() == 1);
        let shares: Vec<f32> = row[SHARES].chunks(ENTRIES).map(|of| of.iter().sum()).collect();
        let expected = [SHARE_WEIGHT, 0.0, 0.0, SHARE_WEIGHT, 0.0];
        assert!(shares.iter().zip(expected).all(|(s, e)| (s - e).abs() < 1e-5), "{shares:?}");
        assert!(row[CONTRAST].iter().all(|v| *v == 0.0));

        // The bins of a number sum to the weight of one bin.
        let global: f32 = row[POSITION.start..].iter().sum();
        assert!((global - BIN_WEIGHT * (5 + 2 + 3 + 3) as f32).abs() < 1e-4, "{global}");
        // The middle of the unit cube's x is 0.375, between bins 3 and 4 of 11.
        assert!((row[POSITION.start + 3] - 0.25 * BIN_WEIGHT).abs() < 1e-5);
        assert!((row[POSITION.start + 4] - 0.75 * BIN_WEIGHT).abs() < 1e-5);
    }

    fn features_left(v: Variant) -> usize {
        FEATURES - v.without().iter().map(Range::len).sum::<usize>()
    }

    #[test]
    fn variants_leave_out_the_features_of_the_paper() {
        assert_eq!(Variant::ALL.map(features_left), [FEATURES, 2312, FEATURES - 6 * CELLS, FEATURES - 1016]);
        assert_eq!(SIZE.end, 2312 + 55 + 26 + 75);
    }
}
