//! The transform from one surface to another that shows some of the same building.

mod free;
mod normals;
mod plan;
mod refine;
mod score;
mod search;
mod surface;
mod turns;

pub use surface::SurfacePoints;
#[doc(hidden)]
pub use search::TRUTH;

use crate::register::OpenMotion;
use s3d_geom::glam::DAffine3;
use thiserror::Error;

/// How surfaces are aligned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignOptions {
    /// Whether both surfaces are level, with +Z up: then one turns about the upright axis alone.
    pub is_level: bool,
    /// Whether the surfaces may have different scales.
    pub with_scale: bool,
}

impl Default for AlignOptions {
    fn default() -> Self {
        Self { is_level: true, with_scale: false }
    }
}

/// A place of one surface in the frame of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// From the frame of the first surface to that of the second, metres: a rotation times `scale`, and a
    /// translation.
    pub b_from_a: DAffine3,
    /// How much the first surface grows; 1 unless a scale was asked for.
    pub scale: f64,
    /// The share of each surface that lies on the other one, 0 to 1.
    pub overlap: [f64; 2],
    /// The share of each surface that stands where the other one has room, 0 to 1.
    pub against: [f64; 2],
    /// The median distance between the surfaces where they overlap, metres.
    pub median_m: f64,
    /// The root of the mean squared distance there, metres.
    pub rms_m: f64,
    /// What speaks for the place less what speaks against it, square metres; floors count less.
    pub evidence_m2: f64,
    /// Motions of the first surface that nothing fixes. Along them, the place is one of many.
    pub open: Vec<OpenMotion>,
    #[doc(hidden)]
    pub contradiction: f64,
}

/// Why surfaces are not aligned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AlignError {
    /// A surface has too few points.
    #[error("{points} points, of which {surface} are on a surface")]
    Thin {
        /// The number of finite points.
        points: usize,
        /// The number of evenly spread points with a normal.
        surface: usize,
    },
    /// One surface is far larger than the other one.
    #[error("one is {ratio:.0} times as large as the other: check their units")]
    Units {
        /// How much larger.
        ratio: f64,
    },
    /// Nothing fits.
    #[error("nothing fits")]
    NoFit,
}

/// Finds where `a` lies in the frame of `b`. Returns the places, the best first, at least one.
pub fn align(
    a: &SurfacePoints,
    b: &SurfacePoints,
    options: &AlignOptions,
) -> Result<Vec<Alignment>, AlignError> {
    search::search(a, b, options)
}
