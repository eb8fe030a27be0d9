//! What speaks for a place of one surface in the frame of the other, and what against it.

use super::free::FreeSpace;
use super::plan::FLOOR_WEIGHT;
use super::refine::{Pair, Similarity};

/// What was counted of both surfaces, `a` first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Score {
    /// The shares of the points that lie on the other surface.
    pub(super) overlap: [f64; 2],
    /// The shares of the points that stand where the other surface has room.
    pub(super) against: [f64; 2],
    /// Points that speak for the place less those that speak against it, square metres; floors count less.
    pub(super) evidence_m2: f64,
    /// The points that speak against the place, as a share of all that say something.
    pub(super) contradiction: f64,
    /// The evidence as a share of what fits.
    pub(super) agreement: f64,
}

/// A point where the other surface has room counts as so many that fit. Surfaces of one building hardly
/// contradict each other.
const AGAINST: f64 = 4.0;
/// The least cosine of a floor's normal with the upright axis.
const LEVEL: f32 = 0.8;

/// Looks at each `every`th point of both surfaces. Surfaces within `near_m` are the same. What lies beside a
/// surface that looks the same way, up to `beside_m`, speaks against the place too, but only once: small
/// things are moved more easily than walls.
pub(super) fn score(
    pair: &Pair<'_>,
    free: [&FreeSpace; 2],
    place: &Similarity,
    [near_m, beside_m]: [f64; 2],
    every: [usize; 2],
) -> Score {
    let mut score = Score::default();
    let mut fits = [0.0; 2];
    let (mut contradicts, mut beside) = (0.0, 0.0);
    for side in 0..2 {
        let points = pair.points[side];
        let all = points.positions.iter().zip(&points.normals).step_by(every[side].max(1));
        let count = all.len().max(1) as f64;
        let weight_m2 = pair.spacing_m[side] * pair.spacing_m[side] * every[side].max(1) as f64;

        for ((p, n), partner) in all.zip(pair.partners(place, side, beside_m, every[side])) {
            let weight = if n.z.abs() >= LEVEL {
                f64::from(FLOOR_WEIGHT)
            } else {
                1.0
            };
            match partner {
                Some(partner) if partner.distance.abs() <= near_m => {
                    score.overlap[side] += 1.0 / count;
                    fits[side] += weight * weight_m2;
                    continue;
                }
                Some(_) => beside += 0.5 * weight * weight_m2,
                None => (),
            }
            let there = match side {
                0 => place.apply(p.as_dvec3()),
                _ => place.apply_back(p.as_dvec3()),
            };
            if free[1 - side].contains(there.as_vec3()) {
                score.against[side] += 1.0 / count;
                contradicts += 0.5 * weight * weight_m2;
            }
        }
    }
    // What lies on each other has one area. A large surface beside a small one cannot have more.
    let fits = fits[0].min(fits[1]);
    score.evidence_m2 = fits - beside - AGAINST * contradicts;
    score.agreement = score.evidence_m2 / fits.max(f64::MIN_POSITIVE);
    score.contradiction = contradicts / (fits + contradicts).max(f64::MIN_POSITIVE);
    score
}
