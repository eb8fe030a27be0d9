//! Where an area's scan locations are, what each sees, and in which room it stands.

use crate::context::Context;
use crate::error::Result;
use crate::export::input::area::AreaInput;
use crate::export::input::cameras::Cameras;
use crate::options::placing::{Placing, SHARE};
use crate::place::free_space::{FreeSpaceOptions, place_in_free_space};
use crate::place::{Ground, Placement, place_locations};
use crate::survey::annotated::{Annotated, SurveyedRoom};
use crate::survey::surface_seen::SurfaceSeen;
use glam::DVec3;
use s3d_geom::NearestFaces;
use s3d_io::camera::ScanLocation;
use s3d_label::{LabelTable, Room, UNKNOWN_ROOM};
use s3d_render::Scene;

/// An area's scan locations, each with its room if there are rooms. `surface_seen` is there if the locations
/// were placed by it.
#[derive(Default)]
pub(crate) struct Located {
    pub(crate) locations: Vec<ScanLocation>,
    pub(crate) rooms: Vec<Option<Room>>,
    pub(crate) surface_seen: Option<SurfaceSeen>,
}

/// Returns an area's scan locations: the listed ones, or placed ones.
pub(crate) fn locate(
    ctx: &Context,
    area: &AreaInput,
    scene: &Scene<'_>,
    nearest: &NearestFaces<'_>,
    annotated: &Annotated,
    table: &LabelTable,
    seed: u64,
) -> Result<Located> {
    match &area.cameras {
        Cameras::Listed(locations, told) => {
            let mut rooms = Vec::with_capacity(locations.len());
            for (location, told) in locations.iter().zip(told) {
                let known = told.filter(|told| annotated.rooms.iter().any(|r| r.room == *told));
                rooms.push(known.or_else(|| room_of(&annotated.rooms, location.pose.location)));
            }
            Ok(Located { locations: locations.clone(), rooms, surface_seen: None })
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
            let distance_m = area.cameras.distance_m();
            let share = area.cameras.share().unwrap_or(SHARE);
            let wanted = FreeSpaceOptions { share, distance_m, seed };
            let placed = place_in_free_space(ctx, area.number, scene, nearest, wanted)?;
            placed.warnings.iter().for_each(|w| ctx.warn(w));

            let seen = placed.seen;
            let number = area.number;
            let count = placed.locations.len();
            let floor_m2 = placed.floor.inside_m2;
            ctx.info(format_args!(
                "area {number}: {count} scan locations placed on {floor_m2:.0} m² of floor: {seen}"
            ));

            let rooms = placed
                .locations
                .iter()
                .map(|location| room_of(&annotated.rooms, location.pose.location))
                .collect();
            Ok(Located { locations: placed.locations, rooms, surface_seen: Some(seen) })
        }
    }
}

/// A room's name in file names and poses.
pub(crate) fn room_name(room: Option<Room>) -> String {
    room.map_or_else(|| UNKNOWN_ROOM.to_owned(), |room| room.to_string())
}

/// Returns the room in which a point stands: the room whose floor outline holds it, or else the room with the
/// nearest outline. The first by name wins a tie. A room with too few points for an outline has the box of
/// its points instead. An area is taken for one storey, as in the data set. Returns `None` if there is no
/// room.
pub(crate) fn room_of(rooms: &[SurveyedRoom], point: DVec3) -> Option<Room> {
    let mut best = (f64::INFINITY, rooms.first()?.room);
    for r in rooms {
        let min = r.bbox.min.as_dvec3().truncate();
        let max = r.bbox.max.as_dvec3().truncate();
        let mut distance = point.truncate().distance(point.truncate().clamp(min, max));
        // The outline lies in the box: it is no nearer, but for rounding.
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
