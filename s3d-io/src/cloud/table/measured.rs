//! What a scanner measured: points with their intensities, times and cells of its grid, in blocks.

// The feature `raw` publishes it.
#![cfg_attr(not(feature = "raw"), allow(unreachable_pub))]

use s3d_geom::glam::DVec3;

/// What is known of a point beside its place and colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measured {
    /// NaN: unknown.
    pub(crate) intensity: f32,
    /// NaN: unknown.
    pub(crate) time_s: f64,
    /// Row and column in the scanner's grid, from 0.
    pub(crate) cell: Option<[u32; 2]>,
}

impl Default for Measured {
    fn default() -> Self {
        Self { intensity: f32::NAN, time_s: f64::NAN, cell: None }
    }
}

/// Some points of a laser scan, by column. A column is empty, or has one entry a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanBlock {
    /// Places in the world: metres, +Z up.
    pub positions_m: Vec<DVec3>,
    /// Colours R G B; empty if the scan has none.
    pub colors: Vec<[u8; 3]>,
    /// How much came back, in the file's own unit; empty if the scan does not tell. NaN: unknown.
    pub intensities: Vec<f32>,
    /// Row and column of each point in the scanner's grid, from 0; empty if there is no grid. The largest
    /// numbers stand for a point beside it.
    pub cells: Vec<[u32; 2]>,
    /// When each point was measured, in seconds of the file's own clock; empty if the scan does not tell.
    pub times_s: Vec<f64>,
    /// Where the scanner was at the time of each point, in the world; empty if it stood still.
    pub origins_m: Vec<DVec3>,
}

impl ScanBlock {
    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.positions_m.len()
    }

    /// Returns whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.positions_m.is_empty()
    }

    /// Removes all points but keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.positions_m.clear();
        self.colors.clear();
        self.intensities.clear();
        self.cells.clear();
        self.times_s.clear();
        self.origins_m.clear();
    }
}

/// What a table tells of its points before they are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Told {
    /// The number of points; `None` if only reading them tells it.
    pub(crate) points: Option<u64>,
    pub(crate) has_colors: bool,
    /// Whether colours are bytes, so that their range is known.
    pub(crate) are_bytes: bool,
    pub(crate) has_intensity: bool,
    pub(crate) has_times: bool,
    /// Whether points have cells of a grid.
    pub(crate) has_grid: bool,
}
