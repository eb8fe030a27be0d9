//! From all places to the best ones, coarse to fine.

use super::free::FreeSpace;
use super::plan::{Plan, Shape};
use super::refine::{Pair, Settled, Similarity, unknown};
use super::scales::scales;
use super::score::{Score, score};
use super::surface::SurfacePoints;
use super::tilts::tilts;
use super::turns::{shifts, turns};
use super::{AlignOptions, Alignment};
use crate::register::{Motion, Open, OpenMotion};
use rayon::prelude::*;
use s3d_geom::glam::{DAffine3, DMat3, DQuat, DVec3};

/// A level of the way from coarse to fine.
struct Level {
    /// The distance between points, metres, unless the surfaces have a larger one.
    cell_m: f64,
    /// The first and the last reach along normals, metres.
    reach_m: [f64; 2],
    /// Surfaces that are nearer are the same, metres.
    near_m: f64,
    steps: usize,
    most_points: usize,
    /// So many places begin.
    places: usize,
    /// Places that are nearer at the end are one, metres.
    same_m: f64,
}

const LEVELS: [Level; 3] = [
    Level {
        cell_m: 0.2,
        reach_m: [0.4, 0.12],
        near_m: 0.1,
        steps: 10,
        most_points: 1_500,
        places: 100,
        same_m: 0.15,
    },
    Level {
        cell_m: 0.1,
        reach_m: [0.15, 0.04],
        near_m: 0.04,
        steps: 8,
        most_points: 4_000,
        places: 32,
        same_m: 0.06,
    },
    Level {
        cell_m: 0.06,
        reach_m: [0.06, 0.02],
        near_m: 0.02,
        steps: 25,
        most_points: 12_000,
        places: 10,
        same_m: 0.03,
    },
];

/// Places are one if they differ by less than this angle too, radians.
const SAME_RAD: f64 = 0.03;
/// Places of plan images that are nearer are one, metres: along the plan, and in height.
const APART_M: [f64; 2] = [0.4, 0.15];
/// So many of the best places are also tried a little beside, since a coarse image does not tell them apart.
const BESIDE: usize = 3;
const BESIDE_M: f64 = 0.25;
/// In the end, surfaces are the same within so many times the median distance of the best place, and within
/// these bounds, metres.
const NEAR: f64 = 3.0;
const NEAR_M: [f64; 2] = [0.006, 0.02];
/// In the end, a surface this far beside another one is not the same, metres.
const OFF_M: f64 = 0.28;
/// The last steps, and the points that they take.
const POLISH_STEPS: usize = 2;
const MOST_POLISHED: usize = 40_000;
/// So many points are looked at in the end.
const MOST_SCORED: usize = 8_000;

/// The first surface, as it is or turned and grown.
struct View {
    a: SurfacePoints,
    of_a: Similarity,
    free: FreeSpace,
}

/// A place that was found so far.
#[derive(Clone)]
struct Found {
    view: usize,
    place: Similarity,
    score: Score,
}

impl Found {
    fn is_near(&self, other: &Self, same_m: [f64; 2]) -> bool {
        let between = self.place.shift - other.place.shift;
        self.view == other.view
            && self.place.turn.angle_between(other.place.turn) < SAME_RAD
            && between.truncate().length() < same_m[0]
            && between.z.abs() < same_m[1]
    }
}

/// Both surfaces, and all ways to look at the first.
pub(super) struct Search<'a> {
    given: [&'a SurfacePoints; 2],
    options: &'a AlignOptions,
    views: Vec<View>,
    b: SurfacePoints,
    /// How `b` was turned.
    of_b: DQuat,
    free_b: FreeSpace,
}

impl<'a> Search<'a> {
    pub(super) fn new(a: &'a SurfacePoints, b: &'a SurfacePoints, options: &'a AlignOptions) -> Self {
        let (tilts_a, of_b) = if options.is_level {
            (vec![DQuat::IDENTITY], DQuat::IDENTITY)
        } else {
            (tilts(a), tilts(b).first().copied().unwrap_or(DQuat::IDENTITY))
        };
        let turned_b = b.turned(of_b, 1.0);
        let view = |turn: DQuat, scale: f64| {
            let turned = a.turned(turn, scale);
            let of_a = Similarity { turn, scale, shift: DVec3::ZERO };
            View { free: FreeSpace::new(&turned.points, turned.has_sides), a: turned, of_a }
        };
        let views = tilts_a.iter().flat_map(|turn| {
            let scales = if options.with_scale {
                scales(&a.turned(*turn, 1.0), &turned_b)
            } else {
                vec![1.0]
            };
            scales
                .into_iter()
                .map(|scale| view(*turn, scale))
                .collect::<Vec<View>>()
        });
        let views = views.collect();
        let free_b = FreeSpace::new(&turned_b.points, b.has_sides);
        Self { given: [a, b], options, views, b: turned_b, of_b, free_b }
    }

    /// Whether there is no way to look at the first surface.
    pub(super) fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// The best places, the best first. None if the surfaces have nothing in common.
    pub(super) fn places(&self) -> Vec<Alignment> {
        let mut found = self.everywhere();
        for (number, level) in LEVELS.iter().enumerate() {
            found.truncate(level.places);
            if number == 1 {
                found.extend(beside(&found));
            }
            let with_scale = self.options.with_scale && number > 0;
            found = self.refined(&found, level, unknown(self.options.is_level, with_scale));
        }

        let last = &LEVELS[LEVELS.len() - 1];
        let pairs: Vec<(&Found, Pair<'_>)> =
            found.iter().map(|f| (f, self.pair(&self.views[f.view]))).collect();
        let settled: Vec<(&Found, &Pair<'_>, Settled)> = pairs
            .par_iter()
            .filter_map(|(f, pair)| {
                let unknown = unknown(self.options.is_level, self.options.with_scale);
                let reach_m = [last.reach_m[1]; 2];
                let settled = pair.refined(f.place, unknown, reach_m, POLISH_STEPS, MOST_POLISHED)?;
                Some((*f, pair, settled))
            })
            .collect();
        let medians = settled.iter().map(|(_, _, settled)| median(&settled.distances));
        let near_m = (NEAR * medians.fold(f64::INFINITY, f64::min)).clamp(NEAR_M[0], NEAR_M[1]);

        let mut told: Vec<Alignment> = settled
            .par_iter()
            .map(|(f, pair, settled)| self.told(f.view, pair, settled, near_m))
            .collect();
        told.retain(|alignment| alignment.evidence_m2 > 0.0);
        told.sort_by(|a, b| b.evidence_m2.total_cmp(&a.evidence_m2));
        told
    }

    /// The places at which plan images agree, the best first.
    fn everywhere(&self) -> Vec<Found> {
        let mut all: Vec<(f64, Found)> = Vec::new();
        for (number, view) in self.views.iter().enumerate() {
            let shape = Shape { surface: &view.a, free: &view.free };
            let plan = Plan::new(shape, Shape { surface: &self.b, free: &self.free_b });
            let lifts = shifts(&view.a, &self.b);
            let tried: Vec<(f64, f64)> = turns(&view.a, &self.b)
                .into_iter()
                .flat_map(|turn| lifts.iter().map(move |lift| (turn, *lift)))
                .collect();
            let places: Vec<_> = tried.par_iter().map(|(turn, lift)| plan.places(*turn, *lift)).collect();
            all.extend(places.into_iter().flatten().map(|place| {
                let turn = DQuat::from_rotation_z(place.turn_rad);
                let similarity = Similarity { turn, scale: 1.0, shift: place.shift };
                (place.score, Found { view: number, place: similarity, score: Score::default() })
            }));
        }
        all.sort_by(|a, b| b.0.total_cmp(&a.0));

        // Neighbours would all become the best of them.
        let mut apart: Vec<Found> = Vec::new();
        for (_, found) in all {
            if apart.len() == LEVELS[0].places {
                break;
            }
            if !apart.iter().any(|other| found.is_near(other, APART_M)) {
                apart.push(found);
            }
        }
        apart
    }

    /// Moves places at a level. What remains differs, and has more for it than against it; the best is first.
    fn refined(&self, found: &[Found], level: &Level, unknown: &'static [usize]) -> Vec<Found> {
        let mut all: Vec<Found> = Vec::new();
        for (number, view) in self.views.iter().enumerate() {
            let here: Vec<&Found> = found.iter().filter(|f| f.view == number).collect();
            if here.is_empty() {
                continue;
            }
            let cell_m = level.cell_m.max(self.b.cell_m).max(view.a.cell_m);
            let coarse = [&view.a, &self.b].map(|s| s.coarse(cell_m));
            let reach_m = level.reach_m[0];
            let two_sided = self.is_two_sided();
            let pair = Pair::new([&coarse[0], &coarse[1]], [cell_m; 2], reach_m, two_sided);
            let every = coarse.each_ref().map(|p| p.positions.len().div_ceil(level.most_points));
            let moved = here.par_iter().map(|f| {
                let settled =
                    pair.refined(f.place, unknown, level.reach_m, level.steps, level.most_points)?;
                let free = [&view.free, &self.free_b];
                let score = score(&pair, free, &settled.place, [level.near_m; 2], every);
                Some(Found { view: number, place: settled.place, score })
            });
            all.extend(moved.collect::<Vec<_>>().into_iter().flatten());
        }

        all.retain(|f| f.score.evidence_m2 > 0.0);
        all.sort_by(|a, b| b.score.evidence_m2.total_cmp(&a.score.evidence_m2));
        let mut different: Vec<Found> = Vec::new();
        for f in all {
            if !different.iter().any(|other| f.is_near(other, [level.same_m; 2])) {
                different.push(f);
            }
        }
        different
    }

    fn is_two_sided(&self) -> bool {
        !(self.given[0].has_sides && self.given[1].has_sides)
    }

    /// Both surfaces with all their points.
    fn pair<'s>(&'s self, view: &'s View) -> Pair<'s> {
        let spacing_m = [view.a.cell_m, self.b.cell_m];
        Pair::new([&view.a.points, &self.b.points], spacing_m, OFF_M, self.is_two_sided())
    }

    /// A place in the frames that were given, with what is known of it.
    fn told(&self, view: usize, pair: &Pair<'_>, settled: &Settled, near_m: f64) -> Alignment {
        let view = &self.views[view];
        let every = pair.points.map(|p| p.positions.len().div_ceil(MOST_SCORED));
        let score = score(pair, [&view.free, &self.free_b], &settled.place, [near_m, OFF_M], every);
        let squares = settled.distances.iter().map(|d| d * d).sum::<f64>();

        let back = Similarity { turn: self.of_b.inverse(), scale: 1.0, shift: DVec3::ZERO };
        let whole = back.after(&settled.place).after(&view.of_a);
        let [a, b] = self.given;
        let matrix3 = DMat3::from_quat(whole.turn) * whole.scale;
        let translation = whole.shift + b.middle - matrix3 * a.middle;
        let unknown = unknown(self.options.is_level, self.options.with_scale);
        Alignment {
            b_from_a: DAffine3 { matrix3, translation },
            scale: whole.scale,
            overlap: score.overlap,
            against: score.against,
            contradiction: score.contradiction,
            agreement: score.agreement,
            evidence_m2: score.evidence_m2,
            median_m: median(&settled.distances),
            rms_m: (squares / settled.distances.len().max(1) as f64).sqrt(),
            open: settled
                .open
                .iter()
                .map(|open| open_motion(open, unknown, back.turn))
                .collect(),
        }
    }
}

/// Places a little beside the best ones.
fn beside(found: &[Found]) -> Vec<Found> {
    let steps = [-BESIDE_M, 0.0, BESIDE_M];
    let level = steps.iter().flat_map(|x| steps.iter().map(|y| DVec3::new(*x, *y, 0.0)));
    let offsets: Vec<DVec3> = level
        .chain([DVec3::Z * BESIDE_M, DVec3::NEG_Z * BESIDE_M])
        .filter(|d| *d != DVec3::ZERO)
        .collect();
    let best = found.iter().take(BESIDE);
    best.flat_map(|f| {
        offsets.iter().map(|offset| {
            let turned = f.place.turn * *offset;
            Found { place: Similarity { shift: f.place.shift + turned, ..f.place }, ..f.clone() }
        })
    })
    .collect()
}

/// The median of the sizes of numbers; infinite if there are none.
fn median(distances: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = distances.iter().map(|d| d.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).copied().unwrap_or(f64::INFINITY)
}

/// An open direction as a motion of the first surface, in the frame of the second after `turn`.
fn open_motion(open: &Open, unknown: &[usize], turn: DQuat) -> OpenMotion {
    let largest = open
        .motion
        .iter()
        .fold(f64::MIN_POSITIVE, |largest: f64, m| largest.max(m.abs()));
    let mut m = [0.0; 7];
    unknown
        .iter()
        .zip(&open.motion)
        .for_each(|(&at, number)| m[at] = number / largest);
    let [x, y, z, u, v, w, _] = m;
    let motion = Motion { translation: turn * DVec3::new(x, y, z), rotation: turn * DVec3::new(u, v, w) };
    OpenMotion { share: open.share, motions: vec![(0, motion)] }
}
