//! Places scan locations for a scan without labels: few of them, inside, where a tripod could stand, that see
//! much.
//!
//! There are three steps, in a file each. `standing` (on a `grid`) finds where a person with a tripod can
//! stand and walk, `visibility` finds what such places see, and `cover` chooses few of them.
//! [`s3d_io::formats`] ("Scan locations by free space") has every number.

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
use standing::Facing;
pub(super) use standing::{BODY_M, CLEARANCE_M, Ground, HIP_M, Standpoint};
use visibility::{Enclosure, Surface};

/// The edge of the squares with one candidate each, metres. Squares grow if there would be more than
/// [`MOST_CANDIDATES`].
const CELL_M: f64 = 0.5;

/// The largest number of places whose view is counted.
const MOST_CANDIDATES: usize = 4000;

/// The largest number of places from which a pattern is chosen.
const MOST_OF_PATTERN: usize = 12_000;

/// The share of the surface below which locations are refused, since they would not show the scan.
const LEAST_SEEN: f64 = 0.05;

/// The share of the surface below which there is a warning.
const FEW_SEEN: f64 = 0.4;

/// How places are chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeSpaceOptions {
    /// The share of the visible surface that locations must see, above 0 and at most 1.
    pub(crate) share: f64,
    /// The distance of a Poisson-disk pattern, which replaces `share`, metres.
    pub(crate) distance_m: Option<f64>,
    pub(crate) seed: u64,
}

/// The floor where a person could be, in m².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FloorFound {
    /// All surface that faces up.
    pub(crate) up_facing_m2: f64,
    /// The part of it that is free up to the height of a location.
    pub(crate) headroom_m2: f64,
    /// The part of that with free space around, without table tops and the like.
    pub(crate) walkable_m2: f64,
    /// The part of that inside.
    pub(crate) inside_m2: f64,
}

/// The result of [`place_in_free_space`].
#[derive(Clone, Debug)]
pub(crate) struct FreeSpace {
    /// The locations. Those chosen by what they see are in the order of choice.
    pub(crate) locations: Vec<ScanLocation>,
    pub(crate) seen: SurfaceSeen,
    pub(crate) floor: FloorFound,
    /// Warnings, a sentence each.
    pub(crate) warnings: Vec<String>,
}

/// Places scan locations inside, where a tripod could stand: 1.5 m above surfaces that face up, with free
/// space above and around, where rays end on front sides. Places are chosen one by one. Each sees as much new
/// surface as possible, until `share` of the visible surface is seen, and at least half of what each place
/// sees. With a distance they follow a Poisson-disk pattern instead: two that see each other are never
/// nearer. All look along +Y.
///
/// The same mesh, options and seed give the same locations, for any number of threads.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if there is no such place, or hardly any surface is seen; the error
/// says what was found and what may be wrong. [`Error::Cancelled`](crate::Error::Cancelled).
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

    // Find the places, and what can be seen from them.
    let search = Search { ctx, scene, nearest, cell_m, most };
    let Interior { standpoints, floor, .. } = match search.run(Facing::Fronts)? {
        none if none.standpoints.is_empty() => {
            return Err(InputError::UnfitArea { area, why: search.explain(&none)? }.into());
        }
        some => some,
    };

    let surface = Surface::sample(mesh, options.seed);
    let eyes: Vec<DVec3> = standpoints.iter().map(Standpoint::eye).collect();
    let lists = if eyes.len() <= MOST_CANDIDATES {
        surface.seen_from(ctx, scene, &eyes)?
    } else {
        // An evenly spread part of the places tells what can be seen.
        let every = eyes.len().div_ceil(MOST_CANDIDATES);
        let some: Vec<DVec3> = eyes.iter().step_by(every).copied().collect();
        surface.seen_from(ctx, scene, &some)?
    };

    let (chosen, cover) = match options.distance_m {
        None => {
            let weights: Vec<u64> = standpoints.iter().map(Standpoint::weight).collect();
            cover::greedy(&lists, &weights, surface.len(), options.share)
        }
        Some(distance_m) => {
            let chosen = pattern(scene, &standpoints, &eyes, distance_m, options.seed, area);
            let at: Vec<DVec3> = chosen.iter().map(|&i| eyes[i]).collect();
            let seen = surface.seen_from(ctx, scene, &at)?;
            let cover = Cover::of(&seen, lists.iter().chain(&seen), surface.len());
            (chosen, cover)
        }
    };

    let seen = SurfaceSeen {
        surface_m2: surface.m2(surface.len()),
        visible_m2: surface.m2(cover.visible),
        seen_m2: cover.seen_by.map(|samples| surface.m2(samples)),
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

    let mut locations = Vec::with_capacity(chosen.len());
    for (number, &index) in chosen.iter().enumerate() {
        let eye = eyes[index];
        let name = format!("s3d free space {area} {number} {} {} {} {}", options.seed, eye.x, eye.y, eye.z);
        locations.push(ScanLocation { uuid: uuid_from_name(&name), pose: Pose::level(eye, 0.0), line: 0 });
    }
    Ok(FreeSpace { locations, seen, floor, warnings })
}

/// Finds where a person can stand and walk inside, with a standpoint each half metre.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if that is nowhere; the error says what was found and what may be
/// wrong. [`Error::Cancelled`](crate::Error::Cancelled).
pub(super) fn interior(ctx: &Context, scene: &Scene<'_>, nearest: &NearestFaces<'_>) -> Result<Interior> {
    let search = Search { ctx, scene, nearest, cell_m: CELL_M, most: MOST_CANDIDATES };
    let interior = search.run(Facing::Fronts)?;
    if interior.standpoints.is_empty() {
        return Err(InputError::Unfit { path: "the mesh".into(), why: search.explain(&interior)? }.into());
    }
    Ok(interior)
}

/// Chooses places on a Poisson-disk pattern: wide ones, and narrow ones where no wide one is near. Rooms on
/// both sides of a wall get places.
fn pattern(
    scene: &Scene<'_>,
    standpoints: &[Standpoint],
    eyes: &[DVec3],
    distance_m: f64,
    seed: u64,
    area: u32,
) -> Vec<usize> {
    let (wide, narrow): (Vec<usize>, Vec<usize>) =
        (0..standpoints.len()).partition(|&i| standpoints[i].is_wide());
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

/// What the user should check if nothing is found.
const HINTS: &str =
    "is `up` the axis that points up, is `units` right, and do faces have their fronts inside?";

/// Returns whether nothing is between two eyes.
pub(super) fn sees(scene: &Scene<'_>, from: DVec3, to: DVec3) -> bool {
    cast_ray(scene, from, to - from).is_none_or(|hit| hit.t >= 1.0)
}

/// A search for standpoints inside.
struct Search<'a> {
    ctx: &'a Context,
    scene: &'a Scene<'a>,
    nearest: &'a NearestFaces<'a>,
    cell_m: f64,
    most: usize,
}

/// The standpoints inside, and the floor on the way to them.
pub(super) struct Interior {
    pub(super) ground: Ground,
    pub(super) standpoints: Vec<Standpoint>,
    floor: FloorFound,
    /// The mean enclosure of the standpoints that are not inside.
    around: Enclosure,
}

impl Search<'_> {
    fn run(&self, facing: Facing) -> Result<Interior> {
        let ground = Ground::find(self.ctx, self.scene, self.nearest, facing)?;
        let candidates = ground.candidates(self.cell_m, self.most);
        let around = candidates
            .par_iter()
            .map(|standpoint| {
                self.ctx.check()?;
                Ok(Enclosure::of(self.scene, standpoint.eye(), facing))
            })
            .collect::<Result<Vec<_>>>()?;
        let mut floor = ground.floor;

        let mut standpoints = Vec::new();
        let mut outside = Vec::new();
        for (standpoint, around) in candidates.into_iter().zip(around) {
            if around.is_inside() {
                floor.inside_m2 += standpoint.stands_for_m2;
                standpoints.push(standpoint);
            } else {
                outside.push(around);
            }
        }
        Ok(Interior { ground, standpoints, floor, around: Enclosure::mean(&outside) })
    }

    /// Returns why no place was found.
    fn explain(&self, interior: &Interior) -> Result<String> {
        let floor = interior.floor;
        let size = size_of(self.scene.mesh());

        // Each number is told only if the one before it is not 0.
        let mut text =
            format!("no place for a scan location inside: of {size}, {:.2} m² face up", floor.up_facing_m2);
        if floor.up_facing_m2 > 0.0 {
            text += &format!(", {:.2} m² of these are free to {HEIGHT_M} m above", floor.headroom_m2);
        }
        if floor.headroom_m2 > 0.0 {
            text += &format!(", {:.2} m² of these are floor to walk on", floor.walkable_m2);
        }
        if floor.walkable_m2 > 0.0 {
            let [front, back, none] = interior.around.percent();
            text += &format!(
                ", and none of these is inside: rays from there end on a front side in {front:.0} % of all \
                 directions, on a back side in {back:.0} %, on nothing in {none:.0} %"
            );
        }

        // Exchanging fronts and backs tells whether the mesh is inside out.
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

/// Returns the size of a mesh in words.
fn size_of(mesh: &TriMesh) -> String {
    let size = mesh.aabb().size();
    format!("a mesh of {:.2} × {:.2} × {:.2} m (x, y, up)", size.x, size.y, size.z)
}

// The balls of free space of two feet a step apart must meet: see `standing`.
const _: () = assert!(STEP_M < MOST_STEP_M && CELL_M > MOST_STEP_M);

#[cfg(test)]
mod tests;
