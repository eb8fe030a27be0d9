//! Where an area's scan locations are, what each sees, and in which room it stands.

use crate::context::Context;
use crate::error::Result;
use crate::export::input::AreaInput;
use crate::export::input::cameras::{Cameras, Placing, SHARE};
use crate::export::labels::annotate::{Annotated, SurveyedRoom};
use crate::place::free_space::{FreeSpaceOptions, SurfaceSeen, place_in_free_space};
use crate::place::{Ground, Placement, place_locations};
use glam::DVec3;
use rayon::prelude::*;
use s3d_geom::{Camera, NearestFaces};
use s3d_io::camera::ScanLocation;
use s3d_label::{LabelId, LabelTable, Room, UNKNOWN_ROOM};
use s3d_render::{NO_FACE, Scene, cast};

/// Width of the small panorama that tells what a location sees.
const PROBE_WIDTH: u32 = 256;

/// A location that sees less of the mesh than this is told of.
pub(crate) const LOW_COVERAGE: f64 = 0.5;

/// A location that sees more back sides than this is told of.
const MANY_BACK_SIDES: f64 = 0.5;

/// A location nearer to a surface than this is told of, in metres.
const VERY_NEAR_M: f32 = 0.1;

/// What a location sees of the mesh, by solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outlook {
    /// Share of all directions in which there is a surface.
    pub(crate) coverage: f64,
    /// Share of those in which its back side is seen.
    pub(crate) back_sides: f64,
    /// The nearest surface seen, metres; infinite if there is none.
    pub(crate) nearest_m: f32,
}

impl Outlook {
    /// Looks around from `location`.
    pub(crate) fn of(scene: &Scene<'_>, location: &ScanLocation) -> Self {
        let camera = Camera::equirectangular(location.pose, PROBE_WIDTH);
        let (hits, rays) = (cast(scene, &camera), camera.rays());
        let (mut all, mut seen, mut back, mut nearest_m) = (0.0, 0.0, 0.0, f32::INFINITY);
        for y in 0..camera.height {
            for x in 0..camera.width {
                let direction = rays.at(x, y);
                // A row's pixels cover the sphere in proportion to the cosine of its latitude.
                let weight = (direction.x * direction.x + direction.y * direction.y).sqrt();
                all += weight;
                let face = hits.face.at(x, y);
                if face == NO_FACE {
                    continue;
                }
                seen += weight;
                nearest_m = nearest_m.min(hits.depth.at(x, y));
                if scene.mesh().normal(face).as_dvec3().dot(direction) > 0.0 {
                    back += weight;
                }
            }
        }
        Self { coverage: seen / all, back_sides: if seen > 0.0 { back / seen } else { 0.0 }, nearest_m }
    }

    /// What looks wrong about it, as a sentence for each.
    pub(crate) fn warnings(&self, location: &ScanLocation) -> Vec<String> {
        let mut warnings = Vec::new();
        let name = &location.uuid;
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        if self.coverage == 0.0 {
            warnings.push(format!(
                "location {name} sees nothing of the mesh (coverage 0 %): is it in the mesh's frame?"
            ));
        } else if self.coverage < LOW_COVERAGE {
            warnings.push(format!(
                "location {name} sees the mesh in only part of its panorama (coverage {}): it may stand \
                 outside, or near a hole",
                percent(self.coverage)
            ));
        }
        if self.back_sides > MANY_BACK_SIDES {
            warnings.push(format!(
                "location {name} sees back sides in {} of what it sees (coverage {}): it may stand inside \
                 something solid, or the faces are wound the other way",
                percent(self.back_sides),
                percent(self.coverage)
            ));
        }
        if self.nearest_m < VERY_NEAR_M {
            warnings.push(format!(
                "location {name} is {:.0} mm from a surface (coverage {}): it may stand inside a wall or a \
                 thing",
                1000.0 * self.nearest_m,
                percent(self.coverage)
            ));
        }
        warnings
    }
}

/// What each scan location sees.
pub(crate) fn look_around(
    ctx: &Context,
    scene: &Scene<'_>,
    locations: &[ScanLocation],
) -> Result<Vec<Outlook>> {
    let outlooks = locations.par_iter().map(|location| {
        ctx.check()?;
        Ok(Outlook::of(scene, location))
    });
    outlooks.collect()
}

/// Of what scan locations see, by solid angle, the share that has no label; nothing if they see nothing.
pub(crate) fn unlabelled_share(
    scene: &Scene<'_>,
    locations: &[ScanLocation],
    label_of_face: &[LabelId],
) -> Option<f64> {
    let seen_and_unlabelled = |location: &ScanLocation| {
        let camera = Camera::equirectangular(location.pose, PROBE_WIDTH);
        let faces = cast(scene, &camera).face;
        let (mut seen, mut unlabelled) = (0.0, 0.0);
        for y in 0..camera.height {
            let latitude = (0.5 - (f64::from(y) + 0.5) / f64::from(camera.height)) * std::f64::consts::PI;
            for x in 0..camera.width {
                let face = faces.at(x, y);
                if face != NO_FACE {
                    seen += latitude.cos();
                    unlabelled += if label_of_face[face as usize].is_null() {
                        latitude.cos()
                    } else {
                        0.0
                    };
                }
            }
        }
        (seen, unlabelled)
    };
    let each: Vec<(f64, f64)> = locations.par_iter().map(seen_and_unlabelled).collect();
    let (seen, unlabelled) = each.iter().fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    (seen > 0.0).then(|| unlabelled / seen)
}

/// An area's scan locations, each with its room if there are rooms, and what they see if they were placed by
/// it.
#[derive(Default)]
pub(crate) struct Located {
    pub(crate) locations: Vec<ScanLocation>,
    pub(crate) rooms: Vec<Option<Room>>,
    pub(crate) surface_seen: Option<SurfaceSeen>,
}

/// An area's scan locations: those that are listed, or some that are placed.
pub(crate) fn locate(
    ctx: &Context,
    area: &AreaInput,
    scene: &Scene<'_>,
    nearest: &NearestFaces<'_>,
    annotated: &Annotated,
    table: &LabelTable,
    seed: u64,
) -> Result<Located> {
    let room = |l: &ScanLocation| room_of(&annotated.rooms, l.pose.location);
    match &area.cameras {
        Cameras::Listed(locations, told) => {
            let is_known = |room: &Room| annotated.rooms.iter().any(|r| r.room == *room);
            let rooms = locations
                .iter()
                .zip(told)
                .map(|(l, told)| told.filter(is_known).or_else(|| room(l)));
            Ok(Located { locations: locations.clone(), rooms: rooms.collect(), surface_seen: None })
        }
        Cameras::Placed(Placing::Apart(distance_m)) if area.is_labelled => {
            let ground = Ground {
                area: area.number,
                scene,
                nearest,
                label_of_face: &annotated.label_of_face,
                table,
                rooms: &annotated.rooms,
            };
            let (placed, warnings) = place_locations(&ground, Placement { distance_m: *distance_m, seed })?;
            warnings.iter().for_each(|w| ctx.warn(w));
            ctx.info(format_args!("area {}: {} scan locations placed", area.number, placed.len()));
            let (locations, rooms) = placed.into_iter().map(|(l, room)| (l, Some(room))).unzip();
            Ok(Located { locations, rooms, surface_seen: None })
        }
        Cameras::Placed(_) => {
            let (distance_m, share) = (area.cameras.distance_m(), area.cameras.share().unwrap_or(SHARE));
            let wanted = FreeSpaceOptions { share, distance_m, seed };
            let placed = place_in_free_space(ctx, area.number, scene, nearest, wanted)?;
            placed.warnings.iter().for_each(|w| ctx.warn(w));
            let seen = placed.seen;
            let (number, count, floor_m2) = (area.number, placed.locations.len(), placed.floor.inside_m2);
            ctx.info(format_args!(
                "area {number}: {count} scan locations placed on {floor_m2:.0} m² of floor: {seen}"
            ));
            let rooms = placed.locations.iter().map(room).collect();
            Ok(Located { locations: placed.locations, rooms, surface_seen: Some(seen) })
        }
    }
}

/// A room's name in file names and poses.
pub(crate) fn room_name(room: Option<Room>) -> String {
    room.map_or_else(|| UNKNOWN_ROOM.to_owned(), |room| room.to_string())
}

/// The room in which a point stands: the one whose floor outline holds it, or else the nearest outline; the
/// first by name where several do. A room with too few points for an outline has its points' box instead. A
/// building of one storey an area is assumed, as in the data set. `None` if there is no room.
pub(crate) fn room_of(rooms: &[SurveyedRoom], point: DVec3) -> Option<Room> {
    let mut best = (f64::INFINITY, rooms.first()?.room);
    for r in rooms {
        let (min, max) = (r.bbox.min.as_dvec3().truncate(), r.bbox.max.as_dvec3().truncate());
        let mut distance = point.truncate().distance(point.truncate().clamp(min, max));
        // An outline lies in the box: it is no nearer, but for rounding.
        if distance > 1.000_001 * best.0 {
            continue;
        }
        if !r.footprint.polygons.is_empty() {
            distance = r.footprint.distance(point.x, point.y);
        }
        if distance < best.0 {
            best = (distance, r.room);
        }
    }
    Some(best.1)
}
