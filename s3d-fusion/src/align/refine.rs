//! Moves one surface onto another, by point to plane.

use crate::register::{Arm, Grid, Open, Reach, ScanPoints, System};
use s3d_geom::glam::{DMat3, DQuat, DVec3};

/// A rotation, a scale and a shift, in this order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Similarity {
    pub(super) turn: DQuat,
    pub(super) scale: f64,
    pub(super) shift: DVec3,
}

impl Similarity {
    pub(super) fn apply(&self, p: DVec3) -> DVec3 {
        self.turn * (self.scale * p) + self.shift
    }

    pub(super) fn apply_back(&self, p: DVec3) -> DVec3 {
        self.turn.inverse() * (p - self.shift) / self.scale
    }

    /// The similarity that does `first`, then this.
    pub(super) fn after(&self, first: &Self) -> Self {
        Self {
            turn: (self.turn * first.turn).normalize(),
            scale: self.scale * first.scale,
            shift: self.apply(first.shift),
        }
    }
}

/// Which numbers of a motion are unknown: a shift, a turn about each axis, a growth.
pub(super) fn unknown(is_level: bool, with_scale: bool) -> &'static [usize] {
    match (is_level, with_scale) {
        (true, false) => &[0, 1, 2, 5],
        (true, true) => &[0, 1, 2, 5, 6],
        (false, false) => &[0, 1, 2, 3, 4, 5],
        (false, true) => &[0, 1, 2, 3, 4, 5, 6],
    }
}

/// Two surfaces with their grids.
pub(super) struct Pair<'a> {
    pub(super) points: [&'a ScanPoints; 2],
    pub(super) grids: [Grid<'a>; 2],
    /// The distance between neighbours of each surface, and the larger one, metres.
    pub(super) spacing_m: [f64; 2],
    cell_m: f64,
    pub(super) is_two_sided: bool,
}

/// A point of one surface on the other one.
pub(super) struct Match {
    /// The moved point of `a`, or the point of `b`.
    from: DVec3,
    /// The unit normal of the other surface there.
    normal: DVec3,
    /// The distance along it, metres.
    pub(super) distance: f64,
}

/// What the last step said.
pub(super) struct Settled {
    pub(super) place: Similarity,
    pub(super) open: Vec<Open>,
    /// Distances along normals, in both directions.
    pub(super) distances: Vec<f64>,
}

/// The largest angle between normals of one surface.
const MOST_ANGLE_RAD: f64 = 0.5;
/// The least width of the weights, as a share of the reach.
const WIDTH: f64 = 0.4;
/// A motion of which less is along normals is left alone.
const LEAST_SHARE: f64 = 0.003;
/// A step below this, metres and radians, is the last.
const LAST_STEP: f64 = 1e-5;
/// Fewer matches decide nothing.
const LEAST_MATCHES: usize = 30;

impl<'a> Pair<'a> {
    /// `reach_m` is the largest distance along normals that will be asked for.
    pub(super) fn new(
        points: [&'a ScanPoints; 2],
        spacing_m: [f64; 2],
        reach_m: f64,
        is_two_sided: bool,
    ) -> Self {
        let cell_m = spacing_m[0].max(spacing_m[1]);
        let edge_m = reach_m.hypot(1.5 * cell_m);
        Self { points, grids: points.map(|p| Grid::new(p, edge_m)), spacing_m, cell_m, is_two_sided }
    }

    fn reach(&self, along_m: f64) -> Reach {
        Reach {
            along_m,
            across_m: 1.5 * self.cell_m,
            cosine: libm::cos(MOST_ANGLE_RAD),
            is_two_sided: self.is_two_sided,
        }
    }

    /// The partner of each point of a surface (0: `a`) on the other one; `None` without one.
    pub(super) fn partners<'s>(
        &'s self,
        place: &'s Similarity,
        side: usize,
        along_m: f64,
        every: usize,
    ) -> impl Iterator<Item = Option<Match>> + 's {
        let (from, to) = (self.points[side], self.points[1 - side]);
        let reach = self.reach(along_m);
        let all = from.positions.iter().zip(&from.normals).step_by(every.max(1));
        all.map(move |(p, n)| {
            let (p, n) = (p.as_dvec3(), n.as_dvec3());
            let (q, m) = match side {
                0 => (place.apply(p), place.turn * n),
                _ => (place.apply_back(p), place.turn.inverse() * n),
            };
            let partner = self.grids[1 - side].nearest(q, m, &reach)? as usize;
            let (partner, normal) = (to.positions[partner].as_dvec3(), to.normals[partner].as_dvec3());
            let distance = normal.dot(q - partner);
            Some(match side {
                0 => Match { from: q, normal, distance },
                _ => Match { from: p, normal: place.turn * normal, distance: distance * place.scale },
            })
        })
    }

    /// Moves `a` onto `b`, in so many steps at most, while the reach shrinks from the first to the second
    /// number. `None` if the surfaces lose each other.
    pub(super) fn refined(
        &self,
        start: Similarity,
        unknown: &'static [usize],
        reach_m: [f64; 2],
        steps: usize,
        most_points: usize,
    ) -> Option<Settled> {
        let mut place = start;
        let mut reach = reach_m[0];
        let every = self.points.map(|p| p.positions.len().div_ceil(most_points.max(1)));
        let mut open = Vec::new();
        for _ in 0..steps {
            let found: [Vec<Match>; 2] =
                [0, 1].map(|side| self.partners(&place, side, reach, every[side]).flatten().collect());
            let (moved, next_open, largest, width) = step(&found, &place, unknown, WIDTH * reach)?;
            (place, open) = (moved, next_open);
            let least = reach_m[1].max(3.0 * width).min(reach_m[0]);
            if largest < LAST_STEP && reach <= least {
                break;
            }
            reach = least.max(0.7 * reach);
        }
        let distances = [0, 1].iter().flat_map(|&side| {
            self.partners(&place, side, reach_m[1], every[side])
                .flatten()
                .map(|m| m.distance)
        });
        let distances = distances.collect();
        Some(Settled { place, open, distances })
    }
}

/// One step of Gauss and Newton: the new place, what it leaves open, its largest number, and the width of the
/// weights.
fn step(
    found: &[Vec<Match>; 2],
    place: &Similarity,
    unknown: &'static [usize],
    least_width: f64,
) -> Option<(Similarity, Vec<Open>, f64, f64)> {
    let count: usize = found.iter().map(Vec::len).sum();
    if count < LEAST_MATCHES {
        return None;
    }
    let all = || found.iter().flatten();
    let middle = all().map(|m| m.from).sum::<DVec3>() / count as f64;
    let mut sizes: Vec<f64> = all().map(|m| m.distance.abs()).collect();
    let (_, median, _) = sizes.select_nth_unstable_by(count / 2, f64::total_cmp);
    // Twice the standard deviation, if distances were normal. Where floors fit, most distances are small, and
    // walls still count.
    let width = (2.0 * 1.4826 * *median).max(least_width);

    let mut system = System::new(1, unknown);
    for (side, matches) in found.iter().enumerate() {
        for m in matches {
            let arms = [Arm { place: Some(0), arm: m.from - middle }, Arm { place: None, arm: DVec3::ZERO }];
            let spread = 1.0 + (m.distance / width) * (m.distance / width);
            // A point of `b` is passed by the surface of `a`, which moves against its own distance.
            let (normal, distance) = if side == 0 {
                (m.normal, m.distance)
            } else {
                (-m.normal, m.distance)
            };
            system.add(arms, normal, distance, 1.0 / (spread * spread));
        }
    }

    let (numbers, open) = system.solve(LEAST_SHARE);
    let mut motion = [0.0; 7];
    unknown
        .iter()
        .zip(&numbers)
        .for_each(|(&at, number)| motion[at] = *number);
    let [x, y, z, u, v, w, grow] = motion;
    let turn = DQuat::from_scaled_axis(DVec3::new(u, v, w));
    let scale = 1.0 + grow.clamp(-0.5, 0.5);
    let moved = Similarity {
        turn: (turn * place.turn).normalize(),
        scale: place.scale * scale,
        shift: DMat3::from_quat(turn) * (scale * (place.shift - middle)) + middle + DVec3::new(x, y, z),
    };
    let largest = numbers.iter().fold(0.0, |largest: f64, n| largest.max(n.abs()));
    Some((moved, open, largest, width))
}
