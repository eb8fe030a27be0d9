//! Scan locations for a scan without labels: where a tripod could stand inside, few of them, that see much.
//!
//! Three steps, a file each: `standing` (on a `grid`) finds where a person with a tripod can stand and walk,
//! `visibility` what is seen from there, `cover` which few of these places to take. docs/formats.md ("Scan
//! locations by free space") has every number.

mod cover;
mod grid;
mod standing;
mod visibility;

use crate::context::Context;
use crate::error::{InputError, Result};
use crate::place::HEIGHT_M;
use crate::survey::surface_seen::SurfaceSeen;
use cover::Cover;
use glam::DVec3;
use grid::{MOST_STEP_M, STEP_M};
use rayon::prelude::*;
use s3d_geom::{NearestFaces, Pose, TriMesh};
use s3d_io::camera::{ScanLocation, uuid_from_name};
use s3d_render::{Scene, cast_ray};
use s3d_sample::poisson_disk_where;
use standing::{Facing, Ground, Place};
use visibility::{Enclosure, Surface};

/// One candidate a square of this edge, metres, unless there would be more than [`MOST_CANDIDATES`].
const CELL_M: f64 = 0.5;

/// From how many places the surface that is seen is counted.
const MOST_CANDIDATES: usize = 4000;

/// How many places a pattern of given distance is chosen from.
const MOST_OF_PATTERN: usize = 12_000;

/// A share of the surface below which locations are refused: what they would show is not the scan.
const LEAST_SEEN: f64 = 0.05;

/// A share of the surface below which a warning says so.
const FEW_SEEN: f64 = 0.4;

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeSpaceOptions {
    /// Of the surface that can be seen from anywhere, the share to be seen, above 0 and at most 1.
    pub(crate) share: f64,
    /// A Poisson-disk pattern of this distance instead, metres.
    pub(crate) distance_m: Option<f64>,
    pub(crate) seed: u64,
}

/// Where a person could be, m² of floor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FloorFound {
    /// What faces up.
    pub(crate) up_facing_m2: f64,
    /// Of it what is free up to the height of a location.
    pub(crate) headroom_m2: f64,
    /// Of it what is free around, and no top of a table or the like.
    pub(crate) walkable_m2: f64,
    /// Of it what is inside.
    pub(crate) inside_m2: f64,
}

/// What [`place_in_free_space`] found.
#[derive(Clone, Debug)]
pub(crate) struct FreeSpace {
    /// The locations: those that were chosen for the surface that they see, in the order of choice.
    pub(crate) locations: Vec<ScanLocation>,
    pub(crate) seen: SurfaceSeen,
    pub(crate) floor: FloorFound,
    /// A sentence each.
    pub(crate) warnings: Vec<String>,
}

/// Puts scan locations where a tripod could stand inside: 1.5 m above surfaces that face up, with free space
/// above and around, where rays end on front sides. They are chosen one by one, each where most surface is
/// seen that was not seen before, until `share` of what can be seen from anywhere is, and from no place more
/// than half of what it sees is unseen. With a distance they follow a Poisson-disk pattern instead: no two
/// that see each other are nearer. All look along +Y.
///
/// The same for the same mesh, options and seed, for any number of threads.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if there is no such place, or if hardly any surface is seen: what was found, and what may
/// be wrong. [`Error::Cancelled`](crate::Error::Cancelled).
pub(crate) fn place_in_free_space(
    ctx: &Context,
    area: u32,
    scene: &Scene<'_>,
    nearest: &NearestFaces<'_>,
    options: FreeSpaceOptions,
) -> Result<FreeSpace> {
    let most = options.distance_m.map_or(MOST_CANDIDATES, |_| MOST_OF_PATTERN);
    let cell_m = options.distance_m.map_or(CELL_M, |d| (0.25 * d).clamp(STEP_M, CELL_M));
    let mesh = scene.mesh();
    let search = Search { ctx, scene, nearest, cell_m, most };
    let found = search.run(Facing::Fronts)?;
    if found.places.is_empty() {
        return Err(InputError::UnfitArea { area, why: search.explain(&found)? }.into());
    }
    let surface = Surface::sample(mesh, options.seed);
    let eyes: Vec<DVec3> = found.places.iter().map(Place::eye).collect();
    let lists = if eyes.len() <= MOST_CANDIDATES {
        surface.seen_from(ctx, scene, &eyes)?
    } else {
        // A part of them, spread evenly, tells what can be seen.
        let every = eyes.len().div_ceil(MOST_CANDIDATES);
        let some: Vec<DVec3> = eyes.iter().step_by(every).copied().collect();
        surface.seen_from(ctx, scene, &some)?
    };
    let (chosen, cover) = match options.distance_m {
        None => {
            let weights: Vec<u64> = found.places.iter().map(Place::weight).collect();
            cover::greedy(&lists, &weights, surface.len(), options.share)
        }
        Some(distance_m) => {
            let chosen = pattern(scene, &found.places, &eyes, distance_m, options.seed, area);
            let at: Vec<DVec3> = chosen.iter().map(|&i| eyes[i]).collect();
            let seen = surface.seen_from(ctx, scene, &at)?;
            let cover = Cover::of(&seen, lists.iter().chain(&seen), surface.len());
            (chosen, cover)
        }
    };
    let m2 = |samples: usize| samples as f64 * surface.m2_per_sample;
    let seen = SurfaceSeen {
        surface_m2: m2(surface.len()),
        visible_m2: m2(cover.visible),
        seen_m2: cover.seen_by.map(m2),
    };
    let mut warnings = Vec::new();
    let share = seen.seen_m2[0] / seen.surface_m2;
    if share < LEAST_SEEN {
        return Err(InputError::UnfitArea {
            area,
            why: format!(
                "{} scan locations in free space see only {:.1} of {:.1} m² of surface; {HINTS} If \
             the scan is as it should be, list scan locations",
                chosen.len(),
                seen.seen_m2[0],
                seen.surface_m2
            ),
        }
        .into());
    }
    if share < FEW_SEEN {
        warnings.push(format!(
            "area {area}: {} scan locations in free space see {:.0} % of the surface; the rest shows its \
             back, is hidden, or is where no place is free inside",
            chosen.len(),
            100.0 * share
        ));
    }
    let locate = |(number, &index): (usize, &usize)| {
        let [x, y, z] = eyes[index].to_array();
        let name = format!("s3d free space {area} {number} {} {x} {y} {z}", options.seed);
        ScanLocation { uuid: uuid_from_name(&name), pose: Pose::level(eyes[index], 0.0), line: 0 }
    };
    let locations = chosen.iter().enumerate().map(locate).collect();
    Ok(FreeSpace { locations, seen, floor: found.floor, warnings })
}

/// Places on a Poisson-disk pattern: of those with room enough around, and of narrower ones where none of
/// these is near. The wall between two rooms lets both have places.
fn pattern(
    scene: &Scene<'_>,
    places: &[Place],
    eyes: &[DVec3],
    distance_m: f64,
    seed: u64,
    area: u32,
) -> Vec<usize> {
    let (wide, narrow): (Vec<usize>, Vec<usize>) = (0..places.len()).partition(|&i| places[i].is_wide());
    let is_near =
        |a: usize, b: usize| eyes[a].distance(eyes[b]) < distance_m && sees(scene, eyes[a], eyes[b]);
    let mut offered: Vec<usize> = narrow
        .into_par_iter()
        .filter(|&a| !wide.iter().any(|&b| is_near(a, b)))
        .collect();
    offered.extend(wide);
    offered.sort_unstable();
    let points: Vec<[f64; 3]> = offered.iter().map(|&i| eyes[i].to_array()).collect();
    let is_in_sight = |a: usize, b: usize| sees(scene, eyes[offered[a]], eyes[offered[b]]);
    let chosen = poisson_disk_where(&points, distance_m, seed, &format!("area_{area}"), is_in_sight);
    chosen.into_iter().map(|i| offered[i]).collect()
}

/// What to look at where nothing is found.
const HINTS: &str =
    "is `up` the axis that points up, is `units` right, and do faces have their fronts inside?";

/// Whether nothing is between two eyes.
fn sees(scene: &Scene<'_>, from: DVec3, to: DVec3) -> bool {
    cast_ray(scene, from, to - from).is_none_or(|hit| hit.t >= 1.0)
}

/// A search for places.
struct Search<'a> {
    ctx: &'a Context,
    scene: &'a Scene<'a>,
    nearest: &'a NearestFaces<'a>,
    cell_m: f64,
    most: usize,
}

/// Places inside, and how much floor there was on the way to them.
struct Found {
    places: Vec<Place>,
    floor: FloorFound,
    /// What was around the places that are not inside: mean shares of all directions.
    around: Enclosure,
}

impl Search<'_> {
    fn run(&self, facing: Facing) -> Result<Found> {
        let ground = Ground::find(self.ctx, self.scene, self.nearest, facing)?;
        let candidates = ground.candidates(self.cell_m, self.most);
        let around = candidates
            .par_iter()
            .map(|place| {
                self.ctx.check()?;
                Ok(Enclosure::of(self.scene, place.eye(), facing))
            })
            .collect::<Result<Vec<_>>>()?;
        let mut floor = ground.floor;
        let (mut places, mut outside) = (Vec::new(), Vec::new());
        for (place, around) in candidates.into_iter().zip(around) {
            if around.is_inside() {
                floor.inside_m2 += place.stands_for_m2;
                places.push(place);
            } else {
                outside.push(around);
            }
        }
        Ok(Found { places, floor, around: Enclosure::mean(&outside) })
    }

    /// Why no place was found.
    fn explain(&self, found: &Found) -> Result<String> {
        let floor = found.floor;
        let size = size_of(self.scene.mesh());
        let mut text =
            format!("no place for a scan location inside: of {size}, {:.2} m² face up", floor.up_facing_m2);
        if floor.up_facing_m2 > 0.0 {
            text += &format!(", {:.2} m² of these are free to {HEIGHT_M} m above", floor.headroom_m2);
        }
        if floor.headroom_m2 > 0.0 {
            text += &format!(", {:.2} m² of these are floor to walk on", floor.walkable_m2);
        }
        if floor.walkable_m2 > 0.0 {
            let [front, back, none] = found.around.percent();
            text += &format!(
                ", and none of these is inside: rays from there end on a front side in {front:.0} % of all \
                 directions, on a back side in {back:.0} %, on nothing in {none:.0} %"
            );
        }
        let turned = self.run(Facing::Backs)?;
        text += &if turned.floor.inside_m2 > 0.0 {
            format!(
                "; it is either an object seen from outside or a room whose faces are inside out: with \
                 fronts and backs exchanged {:.2} m² are inside",
                turned.floor.inside_m2
            )
        } else {
            format!("; {HINTS} If it is an object and no room, list scan locations around it")
        };
        Ok(text)
    }
}

/// How large a mesh is, as words.
fn size_of(mesh: &TriMesh) -> String {
    let size = mesh.aabb().size();
    format!("a mesh of {:.2} × {:.2} × {:.2} m (x, y, up)", size.x, size.y, size.z)
}

// Two feet a step apart have balls of free space that meet: see `standing`.
const _: () = assert!(STEP_M < MOST_STEP_M && CELL_M > MOST_STEP_M);

#[cfg(test)]
mod tests;
