//! The reasons why ranges cannot be fused.

use s3d_geom::glam::DVec3;
use thiserror::Error;

/// The reason why numbers are not a [`RangeImage`](crate::RangeImage), or cannot be fused.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FusionError {
    /// A column or picture has another size than the ranges.
    #[error(
        "{what} of {found:?} pixels for ranges of {expected:?} pixels (width, height): both must be the same"
    )]
    Size {
        /// What has the wrong size.
        what: &'static str,
        /// Its width and height.
        found: [u64; 2],
        /// The width and height of the ranges.
        expected: [u64; 2],
    },
    /// A column does not have one entry a point.
    #[error("{found} {what} for {points} points: there must be as many")]
    Count {
        /// What the column holds.
        what: &'static str,
        /// The number of its entries.
        found: usize,
        /// The number of points.
        points: usize,
    },
    /// Nothing was measured.
    #[error("no pixel or point holds a range: all are 0, NaN or infinite")]
    NothingMeasured,
    /// A range is below 0.
    #[error(
        "a range of {range_m} m at column {column}, row {row}: ranges are metres above 0, or 0 or NaN where \
             nothing was measured"
    )]
    NegativeRange {
        /// The range.
        range_m: f32,
        /// The column of the pixel.
        column: u32,
        /// The row of the pixel.
        row: u32,
    },
    /// Most ranges are so large that they cannot be metres.
    #[error("half of the ranges are above {median_m} m: they are not metres but probably millimetres")]
    NotMetres {
        /// The median of the ranges.
        median_m: f32,
    },
    /// The place of the sensor is not finite.
    #[error("the sensor is at ({}, {}, {}): its place and rotation must be finite", .0.x, .0.y, .0.z)]
    Pose(DVec3),
    /// The numbers of a [`SensorNoise`](crate::SensorNoise) are not finite, are below 0, or are all 0.
    #[error(
        "a sensor's noise of {constant_m} m + {per_m} m/m + {per_m2} m/m²: the numbers must be finite and 0 \
             or more, and not all 0"
    )]
    Noise {
        /// The part that does not depend on the range.
        constant_m: f32,
        /// The part that grows with the range.
        per_m: f32,
        /// The part that grows with the square of the range.
        per_m2: f32,
    },
    /// An option of the fusion is out of its range.
    #[error("{what} is {value}, and must be from {least} to {most}")]
    Option {
        /// What the option says.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The smallest value.
        least: f64,
        /// The largest value.
        most: f64,
    },
    /// A tile has no block.
    #[error(
        "a tile from block {from:?} to {to:?} has no block: each number of the end must be above the start's"
    )]
    Tile {
        /// The first block.
        from: [i32; 3],
        /// The block behind the last one.
        to: [i32; 3],
    },
    /// A measured point is too far from the origin of the world for cells of this size.
    #[error("a point at ({}, {}, {}) is too far from the origin for cells of {cell_m} m: subtract an offset \
             from poses and points", .point.x, .point.y, .point.z)]
    TooFar {
        /// The point, in world metres.
        point: DVec3,
        /// The size of a cell.
        cell_m: f64,
    },
    /// Surfaces that were made with cells of different sizes cannot be joined.
    #[error("surfaces with cells of {a_m} m and {b_m} m cannot be joined")]
    OtherCells {
        /// The size of a cell of the first surface.
        a_m: f64,
        /// The size of a cell of the other one.
        b_m: f64,
    },
    /// No surface was found.
    #[error("the ranges give no surface: no cell was seen from the front by enough rays")]
    NoSurface,
}
