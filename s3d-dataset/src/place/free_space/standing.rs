//! Finds where a person with a tripod can stand and walk.
//!
//! A grid of vertical lines meets every surface that faces up, and each meeting is a foot. A foot with
//! headroom and free space around is walkable. Walkable feet of neighbouring lines are joined if a person can
//! step from one to the other. Joined feet form a component, such as all floors and stairs of a building.
//! Components with a drop around them, such as table tops, are left out.

use super::FloorFound;
use super::grid::{Foot, Grid, Side, sides_within};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::place::{FOOT_M, HEIGHT_M, LEVEL};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use s3d_geom::{DisjointSets, NearestFaces, TriMesh};
use s3d_render::{Hit, Scene, cast_ray};
use std::collections::BTreeMap;

/// Half the width of a person, metres. This much must be free around at 1 m and at 1.5 m.
pub(in crate::place) const BODY_M: f32 = 0.2;

/// The heights above a foot at which the free space around is measured, metres: at the knees, the hips, and
/// the location.
const KNEE_M: f64 = 0.6;
pub(in crate::place) const HIP_M: f64 = 1.0;

/// The free space that a location wants around itself, metres. A place with less has less weight.
pub(in crate::place) const CLEARANCE_M: f32 = 0.5;

/// The free space that a place needs around itself, metres.
const LEAST_CLEARANCE_M: f32 = 0.1;

/// A surface nearer than this above a foot is the foot's own surface, metres.
const SKIN_M: f64 = 0.005;

/// The height of a step that a person can climb, metres, and the slope in addition, 35°.
const RISER_M: f64 = 0.13;
const SLOPE: f64 = 0.7;

/// A tripod stands where the floor is even to the first distance within the second, metres, so not on stairs.
const UNEVEN_M: f64 = 0.05;
const LEGS_M: f64 = 0.3;

/// The largest drop around furniture, metres. A storey is higher.
const DROP_M: f64 = 2.2;

/// A component is furniture if at least this share of its rim is such a drop, …
const DROP_SHARE: f64 = 0.25;

/// … unless it has more floor than any table, m².
const LARGEST_TABLE_M2: f64 = 20.0;

/// The smallest floor of a component that is kept, m².
const SMALLEST_M2: f64 = 0.25;

/// The side of a face that counts as its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Facing {
    Fronts,
    /// Tells whether a mesh is inside out.
    Backs,
}

impl Facing {
    /// Returns the normal of a face on the side that counts.
    pub(super) fn normal(self, mesh: &TriMesh, face: u32) -> Vec3 {
        match self {
            Self::Fronts => mesh.normal(face),
            Self::Backs => -mesh.normal(face),
        }
    }
}

/// A place where a tripod with the scanner can stand.
#[derive(Clone, Copy, Debug)]
pub(in crate::place) struct Standpoint {
    /// The number of the foot of [`Ground`].
    pub(in crate::place) index: usize,
    pub(super) foot: DVec3,
    /// The free space around, metres, at most [`CLEARANCE_M`].
    clearance_m: f32,
    /// The walkable floor that this place represents, in m².
    pub(in crate::place) stands_for_m2: f64,
}

impl Standpoint {
    pub(super) fn eye(&self) -> DVec3 {
        // The position is rounded to `f32` as it is written, since the mesh has no more digits.
        (self.foot + HEIGHT_M * DVec3::Z).as_vec3().as_dvec3()
    }

    /// Returns whether there is as much room around as a location wants.
    pub(in crate::place) fn is_wide(&self) -> bool {
        self.clearance_m >= CLEARANCE_M
    }

    /// Returns the weight of a square metre that the place sees. It is less with less clearance than a
    /// location wants.
    pub(super) fn weight(&self) -> u64 {
        (1000.0 * self.clearance_m) as u64
    }
}

/// All feet, by column and height.
pub(in crate::place) struct Ground {
    grid: Grid,
    feet: Vec<Foot>,
    /// The first foot of each foot's component.
    component: Vec<u32>,
    /// Whether a tripod may stand on each foot: walkable, level, and in a component that is kept.
    is_place: Vec<bool>,
    pub(super) floor: FloorFound,
}

impl Ground {
    /// Finds all feet, and which of them are places.
    pub(super) fn find(
        ctx: &Context,
        scene: &Scene<'_>,
        nearest: &NearestFaces<'_>,
        facing: Facing,
    ) -> Result<Self> {
        let mesh = scene.mesh();
        let up: Vec<u32> = (0..mesh.faces().len() as u32)
            .into_par_iter()
            .filter(|&face| facing.normal(mesh, face).z > LEVEL)
            .collect();
        // A sum of nothing would be -0.
        let m2 = up
            .iter()
            .fold(0.0, |m2, &f| m2 + mesh.area(f) * f64::from(mesh.normal(f).z.abs()));

        let grid = Grid::new(mesh, m2)?;
        ctx.check()?;
        let mut feet = grid.feet(mesh, &up);
        drop(up);
        ctx.check()?;

        feet.par_iter_mut().try_for_each(|foot| {
            ctx.check()?;
            foot.has_headroom = has_headroom(scene, grid.at(foot), facing);
            Ok::<(), Error>(())
        })?;
        room_around(&grid, nearest, &mut feet);
        ctx.check()?;

        let square = grid.step * grid.step;
        let headroom_m2 = feet.iter().filter(|foot| foot.has_headroom).count() as f64 * square;
        let floor = FloorFound { up_facing_m2: m2, headroom_m2, ..FloorFound::default() };
        let mut ground = Self { component: Vec::new(), is_place: vec![false; feet.len()], grid, feet, floor };

        ground.join(scene);
        ground.judge();
        Ok(ground)
    }

    /// Joins walkable feet into components.
    fn join(&mut self, scene: &Scene<'_>) {
        let mut sets = DisjointSets::new(self.feet.len());
        for a in 0..self.feet.len() {
            if !self.feet[a].walkable {
                continue;
            }
            for (side, b) in self.neighbours(a, &HALF) {
                if self.feet[b].walkable && self.is_step(a, b, side) && self.is_way(scene, a, b) {
                    sets.unite(a as u32, b as u32);
                }
            }
        }

        self.component = sets.roots();
    }

    /// Decides which components are floors, and which of their feet are places.
    fn judge(&mut self) {
        let mut tallies: BTreeMap<u32, Tally> = BTreeMap::new();
        // Count each component's feet, and the sides on which it ends or drops.
        for a in (0..self.feet.len()).filter(|&a| self.feet[a].walkable) {
            let tally = tallies.entry(self.component[a]).or_default();
            tally.feet += 1;
            for side in SIDES {
                let next = self.beside(a, side);
                let goes_on = next.clone().any(|b| {
                    self.is_step(a, b, side)
                        && self.component[b] == self.component[a]
                        && self.feet[b].walkable
                });
                tally.rim += u64::from(!goes_on);
                tally.drops += u64::from(self.is_drop(a, side));
            }
        }

        let square = self.grid.step * self.grid.step;
        let floors: Vec<u32> = tallies
            .iter()
            .filter(|(_, tally)| tally.is_floor(square))
            .map(|(&first, _)| first)
            .collect();

        let mut walkable = 0;
        for a in 0..self.feet.len() {
            self.feet[a].walkable &= floors.binary_search(&self.component[a]).is_ok();
            walkable += u64::from(self.feet[a].walkable);
        }

        let around = sides_within(LEGS_M / self.grid.step);
        self.is_place = (0..self.feet.len())
            .into_par_iter()
            .map(|a| is_free(&self.feet[a]) && self.is_level(a, &around))
            .collect();
        self.floor.walkable_m2 = walkable as f64 * square;

        if !self.is_place.contains(&true) {
            // No foot is level, as in a rough scan. The tripod then stands askew.
            self.is_place = self.feet.iter().map(is_free).collect();
        }
    }

    /// Returns the lowest and the highest foot of the component with the most feet.
    #[cfg(test)]
    pub(super) fn heights_of_largest(&self) -> [f64; 2] {
        let mut all: BTreeMap<u32, (usize, [f64; 2])> = BTreeMap::new();
        for (foot, component) in self.feet.iter().zip(&self.component).filter(|(foot, _)| foot.walkable) {
            let (feet, [low, high]) = all.entry(*component).or_insert((0, [f64::MAX, f64::MIN]));
            *feet += 1;
            *low = low.min(foot.z);
            *high = high.max(foot.z);
        }
        all.into_values().max_by_key(|(feet, _)| *feet).unwrap().1
    }

    /// Returns the places with most room around, one for each square of `cell_m` or larger, in the order of
    /// the grid. There are at most `most` places, or one for each component if that is more.
    pub(super) fn candidates(&self, cell_m: f64, most: usize) -> Vec<Standpoint> {
        let square = self.grid.step * self.grid.step;
        let mut cell_m = cell_m.max(self.grid.step);
        loop {
            // The best place of each square, if it has one, and its walkable floor.
            let mut cells: BTreeMap<(u32, [i64; 3]), (Option<usize>, f64)> = BTreeMap::new();
            for a in (0..self.feet.len()).filter(|&a| self.feet[a].walkable) {
                let at = self.grid.at(&self.feet[a]) - self.grid.origin;
                // The height is part of the key, since a component may span storeys.
                let cell = [at.x / cell_m, at.y / cell_m, at.z / DROP_M].map(|c| c.floor() as i64);
                let best = cells.entry((self.component[a], cell)).or_insert((None, 0.0));
                best.1 += square;
                if !self.is_place[a] {
                    continue;
                }

                let is_better = best.0.is_none_or(|old| {
                    let this_m = self.feet[a].clearance_m;
                    let old_m = self.feet[old].clearance_m;
                    this_m > old_m
                        || this_m == old_m && self.off(a, cell, cell_m) < self.off(old, cell, cell_m)
                });
                if is_better {
                    best.0 = Some(a);
                }
            }

            let mut found: Vec<(usize, f64)> =
                cells.into_values().filter_map(|(a, m2)| Some((a?, m2))).collect();

            // Stop also if squares are larger than the building, since they do not become fewer.
            if found.len() <= most || cell_m > self.grid.extent_m() {
                found.sort_by_key(|(a, _)| *a);
                return found
                    .into_iter()
                    .map(|(a, stands_for_m2)| Standpoint {
                        index: a,
                        foot: self.grid.at(&self.feet[a]),
                        clearance_m: self.feet[a].clearance_m,
                        stands_for_m2,
                    })
                    .collect();
            }

            cell_m *= (found.len() as f64 / most as f64).sqrt().max(1.1);
        }
    }

    /// Returns the number of feet.
    pub(in crate::place) fn len(&self) -> usize {
        self.feet.len()
    }

    /// Returns the position of a foot.
    pub(in crate::place) fn foot(&self, a: usize) -> DVec3 {
        self.grid.at(&self.feet[a])
    }

    /// Returns whether a person fits on a foot, which is floor.
    pub(in crate::place) fn is_walkable(&self, a: usize) -> bool {
        self.feet[a].walkable
    }

    /// Returns the free space around a walkable foot, metres, at most that of [`Standpoint::is_wide`].
    pub(in crate::place) fn clearance_m(&self, a: usize) -> f32 {
        self.feet[a].clearance_m
    }

    /// Returns the walkable feet to which a person can step, and how far they are, metres.
    pub(in crate::place) fn steps<'a>(
        &'a self,
        scene: &'a Scene<'_>,
        a: usize,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        self.neighbours(a, &SIDES)
            .filter(move |&(side, b)| {
                self.feet[b].walkable && self.is_step(a, b, side) && self.is_way(scene, a, b)
            })
            .map(move |(_, b)| (b, self.foot(a).distance(self.foot(b))))
    }

    /// Returns the squared distance of a foot from the middle of its square, in squares.
    fn off(&self, foot: usize, [i, j, _]: [i64; 3], cell_m: f64) -> f64 {
        let at = self.grid.at(&self.feet[foot]) - self.grid.origin;
        (at.x / cell_m - i as f64 - 0.5).powi(2) + (at.y / cell_m - j as f64 - 0.5).powi(2)
    }

    /// Returns whether the floor continues evenly at all of these sides, as far as anything is known there.
    fn is_level(&self, a: usize, sides: &[Side]) -> bool {
        sides.iter().all(|&side| {
            let mut steps = self.beside(a, side).filter(|&b| self.is_step(a, b, side));
            steps.all(|b| (self.feet[b].z - self.feet[a].z).abs() <= UNEVEN_M) && !self.is_drop(a, side)
        })
    }

    /// Returns whether one side has nothing to step on, but something below that is not the next storey.
    fn is_drop(&self, a: usize, side: Side) -> bool {
        let mut next = self.beside(a, side);
        if next.clone().any(|b| self.is_step(a, b, side)) {
            return false;
        }
        next.any(|b| (0.0..DROP_M).contains(&(self.feet[a].z - self.feet[b].z)))
    }

    /// Returns whether a person can step from `a` to `b` on the line at `side`.
    fn is_step(&self, a: usize, b: usize, side: Side) -> bool {
        let along = self.grid.step * (f64::from(side.0 * side.0 + side.1 * side.1)).sqrt();
        (self.feet[a].z - self.feet[b].z).abs() <= RISER_M + SLOPE * along
    }

    /// Returns whether the way is free. If the balls of free space at both ends overlap, no surface fits
    /// between.
    fn is_way(&self, scene: &Scene<'_>, a: usize, b: usize) -> bool {
        let [from, to] = [a, b].map(|i| self.grid.at(&self.feet[i]) + HIP_M * DVec3::Z);
        from.distance(to) <= 2.0 * f64::from(BODY_M)
            || cast_ray(scene, from, to - from).is_none_or(|h| h.t > 1.0)
    }

    /// Returns the feet on the lines at some sides of a foot.
    fn neighbours<'a>(&'a self, a: usize, sides: &'a [Side]) -> impl Iterator<Item = (Side, usize)> + 'a {
        sides
            .iter()
            .flat_map(move |&side| self.beside(a, side).map(move |b| (side, b)))
    }

    /// Returns the feet on the line at one side of a foot.
    fn beside(&self, a: usize, side: Side) -> std::ops::Range<usize> {
        let Some(column) = self.grid.beside(self.feet[a].column, side) else { return 0..0 };
        let start = self.feet.partition_point(|f| f.column < column);
        let len = self.feet.iter().skip(start).take_while(|f| f.column == column).count();
        start..start + len
    }
}

const SIDES: [Side; 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// What is counted of a component's feet.
#[derive(Default)]
struct Tally {
    feet: u64,
    /// Sides on which the component ends.
    rim: u64,
    /// Sides on which it drops.
    drops: u64,
}

impl Tally {
    /// Returns whether the component is a floor, and no furniture. `square` is the area of a foot in m².
    fn is_floor(&self, square: f64) -> bool {
        let m2 = self.feet as f64 * square;
        let is_furniture = self.drops as f64 > DROP_SHARE * self.rim as f64 && m2 < LARGEST_TABLE_M2;
        m2 >= SMALLEST_M2 && !is_furniture
    }
}

/// Half of the sides, so that every pair of neighbours comes once.
const HALF: [Side; 4] = [(1, 0), (1, 1), (0, 1), (-1, 1)];

/// Returns whether a tripod has room at a foot.
fn is_free(foot: &Foot) -> bool {
    foot.walkable && foot.clearance_m >= LEAST_CLEARANCE_M
}

/// Returns whether nothing is above a foot up to the height of a location. A surface right above it that does
/// not face down like a ceiling is the floor's own unevenness.
fn has_headroom(scene: &Scene<'_>, foot: DVec3, facing: Facing) -> bool {
    match hit_above(scene, foot, SKIN_M) {
        Some((height, hit)) if height < FOOT_M && facing.normal(scene.mesh(), hit.face).z > -LEVEL => {
            hit_above(scene, foot, FOOT_M).is_none()
        }
        hit => hit.is_none(),
    }
}

/// Returns the first hit above a foot between the height `from` and the height of a location, with its height
/// above the foot.
fn hit_above(scene: &Scene<'_>, foot: DVec3, from: f64) -> Option<(f64, Hit)> {
    let way = (HEIGHT_M - from) * DVec3::Z;
    let hit = cast_ray(scene, foot + from * DVec3::Z, way).filter(|hit| hit.t <= 1.0)?;
    Some((from + hit.t * way.z, hit))
}

/// Measures the free space around feet with headroom.
fn room_around(grid: &Grid, nearest: &NearestFaces<'_>, feet: &mut [Foot]) {
    for foot in feet.iter_mut() {
        foot.walkable = foot.has_headroom;
        foot.clearance_m = CLEARANCE_M;
    }

    // Each height narrows what the one before left.
    let mut found = Vec::new();
    for (height, least) in [(HEIGHT_M, BODY_M), (HIP_M, BODY_M), (KNEE_M, 0.0)] {
        let asked: Vec<usize> = (0..feet.len()).filter(|&i| feet[i].walkable).collect();
        let points: Vec<Vec3> = asked
            .iter()
            .map(|&i| (grid.at(&feet[i]) + height * DVec3::Z).as_vec3())
            .collect();
        nearest.nearest_many(&points, &mut found);
        for (&i, n) in asked.iter().zip(&found) {
            feet[i].clearance_m = feet[i].clearance_m.min(n.distance_m);
            feet[i].walkable = n.distance_m >= least;
        }
    }
}
