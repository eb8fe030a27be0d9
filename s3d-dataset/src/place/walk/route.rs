//! Finds a way over the floor that comes near every place.

use super::curve::Surroundings;
use super::{WalkOptions, no_way};
use crate::context::Context;
use crate::error::Result;
use crate::place::HEIGHT_M;
use crate::place::free_space::{BODY_M, CLEARANCE_M, Ground, Interior, Standpoint, sees};
use glam::{DVec3, Vec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use s3d_geom::{DisjointSets, NearestFaces};
use s3d_render::{Scene, cast_ray};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap, HashMap};

/// A place is visited if the walk comes this near to it and sees it, metres.
const VISIT_M: f64 = 2.0;

/// A narrow place is not visited if a wide one is this near and in sight, metres.
const BESIDE_M: f64 = 1.0;

/// How much longer a way seems where there is no room at its sides. It leads through the middle of doors.
const NARROW: f64 = 3.0;

/// The shortest way that is a walk, metres.
const LEAST_M: f64 = 1.0;

/// A growing walk over feet of the ground.
pub(super) struct Route<'a> {
    ground: &'a Ground,
    scene: &'a Scene<'a>,
    /// Whether the camera has room above each foot.
    fits: Vec<bool>,
    /// The places to visit, as feet, and whether each was visited.
    places: BTreeMap<usize, bool>,
    feet: Vec<usize>,
    length_m: f64,
    height_m: f64,
}

impl<'a> Route<'a> {
    /// Begins at one of the places inside, in the part with most floor of those that one cannot walk between.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) if the camera has no room anywhere.
    pub(super) fn begin(
        inside: &'a Interior,
        &Surroundings { scene, nearest }: &Surroundings<'a>,
        options: &WalkOptions,
    ) -> Result<Self> {
        let ground = &inside.ground;
        let height_m = options.height_m;
        let fits = with_room(ground, scene, nearest, height_m);
        let part = parts(ground, scene, &fits);
        let fitting = || inside.standpoints.iter().filter(|place| fits[place.index]);

        let mut floor_m2: BTreeMap<u32, f64> = BTreeMap::new();
        fitting().for_each(|place| {
            *floor_m2.entry(part[place.index]).or_default() += place.stands_for_m2;
        });
        let largest = floor_m2.iter().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0)));
        let Some((&largest, _)) = largest else { return Err(no_way(height_m, None)) };
        let mut places: Vec<&Standpoint> = fitting().filter(|place| part[place.index] == largest).collect();
        let narrow = beside_wide(&places, ground, scene, height_m);
        places.retain(|place| !narrow.contains(&place.index));

        let drawn = ChaCha8Rng::seed_from_u64(options.seed).next_u64() % places.len() as u64;
        let start = places[drawn as usize].index;
        let places = places.into_iter().map(|place| (place.index, false)).collect();
        let mut route = Self { ground, scene, fits, places, feet: vec![start], length_m: 0.0, height_m };
        route.visit(start);
        Ok(route)
    }

    /// Goes on from place to place until the walk has a length. After each leg, `tell` is told the metres so
    /// far.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) if no other place can be reached;
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub(super) fn extend_to(
        &mut self,
        length_m: f64,
        ctx: &Context,
        mut tell: impl FnMut(f64),
    ) -> Result<()> {
        while self.length_m < length_m {
            ctx.check()?;
            let leg = match self.way_to_unvisited() {
                Way::Found(leg) => leg,
                Way::Farthest(leg) => {
                    // All is visited. Begin anew, with what is farthest if all is near.
                    if self.metres(&leg) < LEAST_M {
                        return Err(no_way(self.height_m, Some(self.ground.foot(self.here()))));
                    }
                    self.places.values_mut().for_each(|visited| *visited = false);
                    self.visit(self.here());
                    match self.way_to_unvisited() {
                        Way::Found(again) => again,
                        Way::Farthest(_) => leg,
                    }
                }
            };

            self.length_m += self.metres(&leg);
            leg.iter().for_each(|&foot| self.visit(foot));
            self.feet.extend(leg);
            tell(self.length_m);
        }
        Ok(())
    }

    /// Returns the positions of the camera above all feet so far.
    pub(super) fn eyes(&self) -> impl Iterator<Item = DVec3> {
        self.feet.iter().map(|&foot| self.eye(foot))
    }

    fn eye(&self, foot: usize) -> DVec3 {
        self.ground.foot(foot) + self.height_m * DVec3::Z
    }

    /// Returns the length of a way from here.
    fn metres(&self, leg: &[usize]) -> f64 {
        let feet = leg.iter().map(|&foot| self.ground.foot(foot));
        let mut at = self.ground.foot(self.here());
        feet.map(|foot| foot.distance(std::mem::replace(&mut at, foot))).sum()
    }

    fn here(&self) -> usize {
        self.feet[self.feet.len() - 1]
    }

    /// Marks the places that are near a foot and seen from above it.
    fn visit(&mut self, foot: usize) {
        let from = self.eye(foot);
        let up = self.height_m * DVec3::Z;
        for (&place, visited) in self.places.iter_mut().filter(|(_, visited)| !**visited) {
            let to = self.ground.foot(place) + up;
            *visited = from.distance(to) < VISIT_M && sees(self.scene, from, to);
        }
    }

    /// Finds the easiest way from here to the nearest place that was not visited, or to the farthest place if
    /// all that can be reached were (Dijkstra 1959). The way is feet, without the first.
    fn way_to_unvisited(&self) -> Way {
        let start = self.here();
        // The cost and the foot before, of feet that are reached. Costs are whole, so that sums are exact.
        let mut reached: HashMap<usize, (u64, usize)> = HashMap::from([(start, (0, start))]);
        let mut waiting = BinaryHeap::from([Reverse((0, start))]);
        let mut last = start;
        while let Some(Reverse((cost, foot))) = waiting.pop() {
            if reached.get(&foot).is_some_and(|(best, _)| *best < cost) {
                continue;
            }
            if let Some(&visited) = self.places.get(&foot).filter(|_| foot != start) {
                last = foot;
                if !visited {
                    return Way::Found(back(&reached, start, last));
                }
            }
            for (next, step_m) in self.ground.steps(self.scene, foot) {
                if !self.fits[next] {
                    continue;
                }
                let room = f64::from(self.ground.clearance_m(next) / CLEARANCE_M);
                let cost = cost + (1e6 * step_m * (1.0 + NARROW * (1.0 - room))) as u64;
                if reached.get(&next).is_none_or(|(best, _)| cost < *best) {
                    reached.insert(next, (cost, foot));
                    waiting.push(Reverse((cost, next)));
                }
            }
        }
        Way::Farthest(back(&reached, start, last))
    }
}

/// A way to a place.
enum Way {
    /// To the nearest that was not visited.
    Found(Vec<usize>),
    /// To the farthest, since all were visited.
    Farthest(Vec<usize>),
}

/// Returns the feet from `start`, without it, to `end`.
fn back(reached: &HashMap<usize, (u64, usize)>, start: usize, end: usize) -> Vec<usize> {
    let mut feet = Vec::new();
    let mut foot = end;
    while foot != start {
        feet.push(foot);
        foot = reached[&foot].1;
    }
    feet.reverse();
    feet
}

/// Returns the feet of narrow places that have a wide one nearby. Nobody needs to go there to see the same.
fn beside_wide(places: &[&Standpoint], ground: &Ground, scene: &Scene<'_>, height_m: f64) -> BTreeSet<usize> {
    let eye = |place: &Standpoint| ground.foot(place.index) + height_m * DVec3::Z;
    let (wide, narrow): (Vec<&Standpoint>, Vec<&Standpoint>) =
        places.iter().partition(|place| place.is_wide());
    let is_beside = |place: &&&Standpoint| {
        let from = eye(place);
        wide.iter()
            .map(|wide| eye(wide))
            .any(|to| from.distance(to) < BESIDE_M && sees(scene, from, to))
    };
    narrow.par_iter().filter(is_beside).map(|place| place.index).collect()
}

/// Returns the first foot of each foot's part: one can walk from any foot of a part to any other.
fn parts(ground: &Ground, scene: &Scene<'_>, fits: &[bool]) -> Vec<u32> {
    let mut sets = DisjointSets::new(ground.len());
    for a in (0..ground.len()).filter(|&a| fits[a]) {
        let steps = ground.steps(scene, a).filter(|&(b, _)| fits[b]);
        steps.for_each(|(b, _)| sets.unite(a as u32, b as u32));
    }
    sets.roots()
}

/// Returns of each foot whether somebody walks there, and a camera above it has room.
fn with_room(ground: &Ground, scene: &Scene<'_>, nearest: &NearestFaces<'_>, height_m: f64) -> Vec<bool> {
    let mut fits: Vec<bool> = (0..ground.len()).map(|foot| ground.is_walkable(foot)).collect();
    // What the ground tells is about this height.
    if height_m == HEIGHT_M {
        return fits;
    }
    let walkable: Vec<usize> = (0..ground.len()).filter(|&foot| fits[foot]).collect();
    let eyes: Vec<Vec3> = walkable
        .iter()
        .map(|&foot| (ground.foot(foot) + height_m * DVec3::Z).as_vec3())
        .collect();
    let mut found = Vec::new();
    nearest.nearest_many(&eyes, &mut found);
    for (&foot, near) in walkable.iter().zip(&found) {
        let known = ground.foot(foot) + HEIGHT_M * DVec3::Z;
        let higher = (height_m - HEIGHT_M) * DVec3::Z;
        fits[foot] = near.distance_m >= BODY_M
            && (higher.z <= 0.0 || cast_ray(scene, known, higher).is_none_or(|hit| hit.t > 1.0));
    }
    fits
}
