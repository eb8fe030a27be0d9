//! The transform from one surface to another that shows some of the same building.
//!
//! [`align`] looks everywhere before it looks closely, so that no first guess is needed and no luck:
//!
//! 1. **Turns and heights** at which the directions of walls and the heights of floors agree.
//! 2. **Plan images** of both surfaces, slab by slab, compared at all shifts at once by Fourier transforms.
//! 3. **Point to plane** from the best hundred places, in three steps from 20 cm to 6 cm between points.
//! 4. **What contradicts.** Above a floor there is room up to the ceiling. A wall of the other surface that
//!    stands in this room speaks against a place four times as much as a wall that fits speaks for it.
//!
//! Rooms that are alike fit several places. So the second-best place is told with the best, and
//! [`Aligned::doubt`] says when the best is no answer.

mod free;
mod normals;
mod plan;
mod refine;
mod scales;
mod score;
mod search;
mod surface;
#[cfg(test)]
mod tests;
mod tilts;
mod turns;

pub use surface::SurfacePoints;

use crate::register::OpenMotion;
use s3d_geom::glam::DAffine3;
use search::Search;
use thiserror::Error;

/// How surfaces are aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AlignOptions {
    /// Whether both surfaces are level, with +Z up. Then one turns about the upright axis alone.
    pub is_level: bool,
    /// Whether the surfaces may have different scales. Heights of rooms tell which are tried.
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
    /// From the frame of the first surface to the frame of the second, metres: a rotation times `scale`, then
    /// a translation.
    pub b_from_a: DAffine3,
    /// How much the first surface grows; 1 unless a scale was asked for.
    pub scale: f64,
    /// The share of each surface that lies on the other one, 0 to 1.
    pub overlap: [f64; 2],
    /// The share of each surface that stands where the other one has room, 0 to 1.
    pub against: [f64; 2],
    /// What speaks against the place, as a share of all that says something, 0 to 1; floors count less.
    pub contradiction: f64,
    /// The evidence as a share of what lies on each other, up to 1. It is less if surfaces stand in room, or
    /// lie beside each other by some centimetres.
    pub agreement: f64,
    /// What speaks for the place less four times what speaks against it, square metres; floors count less.
    /// Places are ordered by it.
    pub evidence_m2: f64,
    /// The median distance between the surfaces where they overlap, along normals, metres.
    pub median_m: f64,
    /// The root of the mean squared distance there, metres.
    pub rms_m: f64,
    /// Motions of the first surface that nothing fixes, such as the slide along a bare corridor. Along them
    /// the place is one of many.
    pub open: Vec<OpenMotion>,
}

/// The places that were found.
#[derive(Clone, Debug, PartialEq)]
pub struct Aligned {
    /// The best first, at least one. The best fits; others need not.
    pub places: Vec<Alignment>,
}

/// Why the best place is no answer.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Doubt {
    /// Another place is nearly as good.
    Rival {
        /// The evidence of the other place as a share of the best one's.
        share: f64,
    },
    /// Nothing fixes a motion.
    Open,
}

/// A place needs this share of the smaller surface on the other one.
const LEAST_OVERLAP: f64 = 0.08;
/// More contradicts only at wrong places, even if things were moved between two scans.
const MOST_CONTRADICTION: f64 = 0.06;
/// The evidence of a place must be this share of what lies on each other.
const LEAST_AGREEMENT: f64 = 0.5;
/// Another place is a rival if it has this share of the evidence of the best, and agrees nearly as well.
/// A room without its furniture fits both ways, and furniture then tells.
const RIVAL: f64 = 0.5;
const LESS_AGREEMENT: f64 = 0.06;
/// A surface that is larger by this factor has another unit.
const UNITS: f64 = 100.0;

impl Aligned {
    /// Returns why the best place is no answer, if it is none.
    pub fn doubt(&self) -> Option<Doubt> {
        let (best, others) = self.places.split_first()?;
        if !best.open.is_empty() {
            return Some(Doubt::Open);
        }
        let share = |other: &Alignment| other.evidence_m2 / best.evidence_m2;
        let rival = others
            .iter()
            .find(|other| share(other) >= RIVAL && other.agreement >= best.agreement - LESS_AGREEMENT)?;
        Some(Doubt::Rival { share: share(rival) })
    }
}

/// Why surfaces are not aligned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AlignError {
    /// There is too little surface.
    #[error("it has {points} points, and only {surface} places of its surface are known: give more of it")]
    Thin {
        /// The number of finite points.
        points: usize,
        /// The number of evenly spread points that have a normal.
        surface: usize,
    },
    /// One surface is far larger than the other one.
    #[error("one is {ratio:.0} times as large as the other one: check their units")]
    Units {
        /// How much larger.
        ratio: f64,
    },
    /// A scale is to be found, and a surface has no floor below a ceiling.
    #[error("a scale is found by heights of rooms, and one has no floor with a ceiling above it")]
    NoHeights,
    /// No place fits.
    #[error(
        "nothing fits: at the best place, {:.0} % of the smaller one lie on the other one, {:.0} % of what \
         is seen of both contradicts, and the evidence is {:.0} % of what lies on each other",
        100.0 * .overlap,
        100.0 * .contradiction,
        100.0 * .agreement
    )]
    NoFit {
        /// The share of the smaller surface that lies on the other one, at the best place.
        overlap: f64,
        /// What speaks against this place, as [`Alignment::contradiction`].
        contradiction: f64,
        /// The same as [`Alignment::agreement`].
        agreement: f64,
    },
}

/// Finds where `a` lies in the frame of `b`. Both are in metres; +Z is up unless they may be tilted. Every
/// call with the same surfaces gives the same answer, for any number of threads.
///
/// A second takes about 300 m² of surface on one core. The error of an answer is below a millimetre where
/// several square metres overlap with noise of some millimetres.
///
/// ```
/// use s3d_fusion::{AlignOptions, SurfacePoints, align};
/// use s3d_geom::glam::{DAffine3, DVec3};
///
/// let room = s3d_synth::scenes::furnished_room(3);
/// let there = DAffine3::from_translation(DVec3::new(20.0, -7.0, 1.0)) * DAffine3::from_rotation_z(2.0);
/// let moved = room.positions().iter().map(|p| there.transform_point3(p.as_dvec3()).as_vec3()).collect();
/// let moved = s3d_geom::TriMesh::from_faces(moved, room.faces().to_vec())?;
///
/// let [a, b] = [SurfacePoints::of_mesh(&room)?, SurfacePoints::of_mesh(&moved)?];
/// let found = align(&a, &b, &AlignOptions::default())?;
/// assert!(found.doubt().is_none());
/// assert!(found.places[0].b_from_a.abs_diff_eq(there, 0.005));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`AlignError::Units`], [`AlignError::NoHeights`], [`AlignError::NoFit`].
pub fn align(a: &SurfacePoints, b: &SurfacePoints, options: &AlignOptions) -> Result<Aligned, AlignError> {
    let [size_a, size_b] = [a, b].map(SurfacePoints::size_m);
    let ratio = size_a.max(size_b) / size_a.min(size_b).max(f64::MIN_POSITIVE);
    if ratio > UNITS && !options.with_scale {
        return Err(AlignError::Units { ratio });
    }
    let search = Search::new(a, b, options);
    if search.is_empty() {
        return Err(AlignError::NoHeights);
    }

    let places = search.places();
    let overlap = |place: &Alignment| place.overlap[0].max(place.overlap[1]);
    let Some(best) = places.first() else {
        return Err(AlignError::NoFit { overlap: 0.0, contradiction: 0.0, agreement: 0.0 });
    };
    let contradicts = best.contradiction > MOST_CONTRADICTION || best.agreement < LEAST_AGREEMENT;
    if overlap(best) < LEAST_OVERLAP || contradicts {
        let Alignment { contradiction, agreement, .. } = *best;
        return Err(AlignError::NoFit { overlap: overlap(best), contradiction, agreement });
    }
    Ok(Aligned { places })
}
