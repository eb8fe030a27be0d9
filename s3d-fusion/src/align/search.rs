//! From all places to the best ones, coarse to fine.

use super::free::FreeSpace;
use super::plan::{Plan, Shape};
use super::refine::{Pair, Settled, Similarity, unknown};
use super::score::{Score, score};
use super::surface::SurfacePoints;
use super::turns::{shifts, turns};
use super::{AlignError, AlignOptions, Alignment};
use crate::register::{Motion, Open, OpenMotion};
use rayon::prelude::*;
use s3d_geom::glam::{DAffine3, DQuat, DVec3};

/// A level of the way from coarse to fine.
struct Level {
    /// The distance between points, metres, at least that of the surfaces.
    cell_m: f64,
    /// The first and the last reach along normals, metres.
    reach_m: [f64; 2],
    /// Surfaces that are nearer are the same, metres.
    near_m: f64,
    steps: usize,
    most_points: usize,
    /// So many places begin.
    places: usize,
}

const LEVELS: [Level; 3] = [
    Level { cell_m: 0.2, reach_m: [0.4, 0.12], near_m: 0.1, steps: 10, most_points: 1_500, places: 100 },
    Level { cell_m: 0.1, reach_m: [0.15, 0.04], near_m: 0.04, steps: 8, most_points: 4_000, places: 16 },
    Level { cell_m: 0.06, reach_m: [0.06, 0.02], near_m: 0.02, steps: 25, most_points: 40_000, places: 5 },
];

/// Places that differ by less are one: shares of the first reach of a level, and radians.
const SAME_RAD: f64 = 0.03;
/// Places of plan images that are nearer are one, metres.
const APART_M: f64 = 0.4;
const APART_Z_M: f64 = 0.15;
#[doc(hidden)]
pub static TRUTH: std::sync::Mutex<Option<DAffine3>> = std::sync::Mutex::new(None);

/// A way to look at both surfaces: as they are, or tilted so that other planes are level.
struct View {
    a: SurfacePoints,
    /// How `a` was turned and grown.
    of_a: Similarity,
    free: FreeSpace,
}

/// A place that was found so far.
#[derive(Clone, Debug)]
struct Found {
    view: usize,
    place: Similarity,
    score: Score,
}

pub(super) fn search(
    a: &SurfacePoints,
    b: &SurfacePoints,
    options: &AlignOptions,
) -> Result<Vec<Alignment>, AlignError> {
    let identity = Similarity { turn: DQuat::IDENTITY, scale: 1.0, shift: DVec3::ZERO };
    let views = vec![View {
        a: a.clone(),
        of_a: identity,
        free: FreeSpace::new(&a.points, a.has_sides),
    }];
    let free_b = FreeSpace::new(&b.points, b.has_sides);
    let t0 = std::time::Instant::now();
    let mut found = everywhere(&views, b, &free_b);

    if let Some(t) = *TRUTH.lock().unwrap() {
        let turn = DQuat::from_mat3(&t.matrix3);
        let place = Similarity { turn, scale: 1.0, shift: t.transform_point3(a.middle) - b.middle };
        let at = found.iter().position(|f| f.place.turn.angle_between(turn) < 0.02 && f.place.shift.distance(place.shift) < 0.5);
        let ts = turns(a, b); let zs = shifts(a, b);
        eprintln!("  turns {} {:?} shifts {} {:?}", ts.len(), ts.iter().map(|t| DQuat::from_rotation_z(*t).angle_between(turn).to_degrees()).enumerate().min_by(|a, b| a.1.total_cmp(&b.1)), zs.len(), zs.iter().map(|z| (z - place.shift.z).abs()).enumerate().min_by(|a, b| a.1.total_cmp(&b.1)));
        if let Some(i) = at {
            let mut f = vec![found[i].clone()];
            eprintln!("  start {:.0}", 1e3 * (f[0].place.shift - place.shift));
            for (number, level) in LEVELS.iter().enumerate() {
                f = refined(&f, &views, b, &free_b, level, options, number == 2);
                if let Some(f) = f.first() { eprintln!("    {:.0} {:.2}° {:.2?}", 1e3 * (f.place.shift - place.shift), f.place.turn.angle_between(turn).to_degrees(), f.score); } else { break }
            }
        }
        let mut f = vec![Found { view: 0, place, score: Score::default() }];
        for (number, level) in LEVELS.iter().enumerate() {
            f = refined(&f, &views, b, &free_b, level, options, number == 2);
            if let Some(f) = f.first() {
            eprintln!("  truth rank {at:?} of {} level {number}: {:.1}mm {:.2?}", found.len(), 1e3 * f.place.shift.distance(place.shift), f.score); }
        }
    }
    for (number, level) in LEVELS.iter().enumerate() {
        found.truncate(level.places);
        if std::env::var("ALIGN_DEBUG").is_ok() { eprintln!("{:?}", t0.elapsed()); }
        let is_last = number + 1 == LEVELS.len();
        found = refined(&found, &views, b, &free_b, level, options, is_last);
    }
    if std::env::var("ALIGN_DEBUG").is_ok() { eprintln!("{:?}", t0.elapsed());  }
    let last = &LEVELS[LEVELS.len() - 1];
    let settled: Vec<Alignment> =
        found.iter().filter_map(|f| told(f, &views, a, b, last, options)).collect();
    if settled.is_empty() { Err(AlignError::NoFit) } else { Ok(settled) }
}

/// The places at which plan images agree, the best first.
fn everywhere(views: &[View], b: &SurfacePoints, free_b: &FreeSpace) -> Vec<Found> {
    let mut all = Vec::new();
    for (number, view) in views.iter().enumerate() {
        let shape = Shape { surface: &view.a, free: &view.free };
        let plan = Plan::new(shape, Shape { surface: b, free: free_b });
        let tried: Vec<(f64, f64)> = turns(&view.a, b)
            .into_iter()
            .flat_map(|turn| shifts(&view.a, b).into_iter().map(move |lift| (turn, lift)))
            .collect();
        let places: Vec<_> = tried.par_iter().map(|(turn, lift)| plan.places(*turn, *lift)).collect();
        all.extend(places.into_iter().flatten().map(|place| {
            let turn = DQuat::from_rotation_z(place.turn_rad);
            (place.score, Found {
                view: number,
                place: Similarity { turn, scale: 1.0, shift: place.shift },
                score: Score::default(),
            })
        }));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    // Neighbours would all become the best of them.
    let mut apart: Vec<Found> = Vec::new();
    for (_, f) in all {
        let is_same = |other: &Found| {
            f.view == other.view
                && f.place.turn.angle_between(other.place.turn) < SAME_RAD
                && f.place.shift.truncate().distance(other.place.shift.truncate()) < APART_M
                && (f.place.shift.z - other.place.shift.z).abs() < APART_Z_M
        };
        if !apart.iter().any(is_same) {
            apart.push(f);
        }
        if apart.len() >= LEVELS[0].places {
            break;
        }
    }
    apart
}

/// Moves all places at a level, and orders those that differ by what speaks for them.
fn refined(
    found: &[Found],
    views: &[View],
    b: &SurfacePoints,
    free_b: &FreeSpace,
    level: &Level,
    options: &AlignOptions,
    is_last: bool,
) -> Vec<Found> {
    let mut all: Vec<Found> = Vec::new();
    for (number, view) in views.iter().enumerate() {
        let cell_m = level.cell_m.max(b.cell_m).max(view.a.cell_m);
        let coarse = [&view.a, b].map(|s| s.coarse(cell_m));
        let is_two_sided = !(view.a.has_sides && b.has_sides);
        let reach_m = level.reach_m[0].max(1.2 * level.near_m);
        let pair = Pair::new([&coarse[0], &coarse[1]], cell_m, reach_m, is_two_sided);
        let every = coarse.each_ref().map(|p| p.positions.len().div_ceil(level.most_points));
        let free = [&view.free, free_b];

        let here: Vec<&Found> = found.iter().filter(|f| f.view == number).collect();
        let moved: Vec<Option<Found>> = here
            .par_iter()
            .map(|f| {
                let unknown = unknown(options.is_level, options.with_scale && is_last);
                let Settled { place, .. } =
                    pair.refined(f.place, unknown, level.reach_m, level.steps, level.most_points)?;
                let score = score(&pair, free, &place, level.near_m, every);
                Some(Found { view: number, place, score })
            })
            .collect();
        all.extend(moved.into_iter().flatten());
    }

    all.retain(|f| f.score.evidence_m2 > 0.0);
    all.sort_by(|a, b| b.score.evidence_m2.total_cmp(&a.score.evidence_m2));
    let mut different: Vec<Found> = Vec::new();
    for f in all {
        let is_same = |other: &Found| {
            f.view == other.view
                && f.place.turn.angle_between(other.place.turn) < SAME_RAD
                && f.place.shift.distance(other.place.shift) < level.reach_m[0]
        };
        if !different.iter().any(is_same) {
            different.push(f);
        }
    }
    different
}

fn told(
    found: &Found,
    views: &[View],
    a: &SurfacePoints,
    b: &SurfacePoints,
    level: &Level,
    options: &AlignOptions,
) -> Option<Alignment> {
    let view = &views[found.view];
    let cell_m = level.cell_m.max(b.cell_m).max(view.a.cell_m);
    let is_two_sided = !(view.a.has_sides && b.has_sides);
    let pair = Pair::new([&view.a.points, &b.points], cell_m, level.reach_m[0], is_two_sided);
    let unknown = unknown(options.is_level, options.with_scale);
    let settled = pair.refined(found.place, unknown, [level.reach_m[1]; 2], 1, level.most_points)?;
    let mut sizes: Vec<f64> = settled.distances.iter().map(|d| d.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let median_m = sizes.get(sizes.len() / 2).copied()?;
    let rms_m = (sizes.iter().map(|d| d * d).sum::<f64>() / sizes.len() as f64).sqrt();

    let whole = found.place.after(&view.of_a);
    // Back to the frames that were given.
    let shift = whole.shift + b.middle - whole.scale * (whole.turn * a.middle);
    let matrix = s3d_geom::glam::DMat3::from_quat(whole.turn) * whole.scale;
    Some(Alignment {
        b_from_a: DAffine3 { matrix3: matrix, translation: shift },
        scale: whole.scale,
        overlap: found.score.overlap,
        against: found.score.against,
        median_m,
        rms_m,
        evidence_m2: found.score.evidence_m2,
        open: settled.open.iter().map(|open| open_motion(open, unknown)).collect(),
        contradiction: found.score.contradiction,
    })
}

fn open_motion(open: &Open, unknown: &[usize]) -> OpenMotion {
    let largest = open.motion.iter().fold(f64::MIN_POSITIVE, |largest: f64, m| largest.max(m.abs()));
    let mut m = [0.0; 7];
    unknown.iter().zip(&open.motion).for_each(|(&at, number)| m[at] = number / largest);
    let [x, y, z, u, v, w, _] = m;
    let motion = Motion { translation: DVec3::new(x, y, z), rotation: DVec3::new(u, v, w) };
    OpenMotion { share: open.share, motions: vec![(0, motion)] }
}
