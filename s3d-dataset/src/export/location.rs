//! Where an area's scan locations are, what each sees, and in which room it stands.

use crate::context::Context;
use crate::error::Result;
use crate::export::input::area::AreaInput;
use crate::export::input::cameras::Cameras;
use crate::options::placing::{Placing, SHARE};
use crate::place::free_space::{FreeSpaceOptions, place_in_free_space};
use crate::place::{Ground, Placement, place_locations};
use crate::survey::annotated::Annotated;
use crate::survey::rooms_around::{RoomsAround, nearest_room};
use crate::survey::surface_seen::SurfaceSeen;
use glam::DVec3;
use s3d_geom::NearestFaces;
use s3d_io::camera::ScanLocation;
use s3d_label::{LabelTable, Room, UNKNOWN_ROOM};
use s3d_render::Scene;

/// A location sees a room if at least this many of the rays around it end there.
const FEW_RAYS: u32 = 3;

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
    let surroundings = Surroundings { scene, annotated, table };
    match &area.cameras {
        Cameras::Listed(locations, told) => {
            let rooms = locations
                .iter()
                .zip(told)
                .map(|(location, told)| surroundings.room_of_listed(ctx, area.number, location, *told))
                .collect();
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
                .map(|location| surroundings.room_of(location.pose.location))
                .collect();
            Ok(Located { locations: placed.locations, rooms, surface_seen: Some(seen) })
        }
    }
}

/// A room's name in file names and poses.
pub(crate) fn room_name(room: Option<Room>) -> String {
    room.map_or_else(|| UNKNOWN_ROOM.to_owned(), |room| room.to_string())
}

/// The labelled mesh of an area, which tells in which room a camera is.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) annotated: &'a Annotated,
    pub(crate) table: &'a LabelTable,
}

impl Surroundings<'_> {
    /// Returns the room in which a camera is: the room of the labelled surface below and around it, or where
    /// there is little, the room whose floor outline and heights are nearest. Returns `None` if there is no
    /// room.
    pub(crate) fn room_of(&self, place: DVec3) -> Option<Room> {
        let rooms = &self.annotated.rooms;
        if rooms.is_empty() {
            return None;
        }
        self.rooms_around(place)
            .stands_in()
            .or_else(|| nearest_room(rooms, place))
    }

    /// Returns the room of a listed location: the room that its list tells, unless there is none of that name
    /// or the location sees nothing of it.
    fn room_of_listed(
        &self,
        ctx: &Context,
        area: u32,
        location: &ScanLocation,
        told: Option<Room>,
    ) -> Option<Room> {
        let place = location.pose.location;
        let known = told.filter(|told| self.annotated.rooms.iter().any(|room| room.room == *told));
        let Some(told) = known else { return self.room_of(place) };

        let around = self.rooms_around(place);
        if around.rays_to(&told) >= FEW_RAYS {
            return Some(told);
        }
        let Some(stands_in) = around.stands_in() else { return Some(told) };
        ctx.warn(format_args!(
            "area {area}: location {} is in {told} by its list, but sees nothing of that room. Its images \
             are named after {stands_in}, whose surface is around it",
            location.uuid
        ));
        Some(stands_in)
    }

    fn rooms_around(&self, place: DVec3) -> RoomsAround<Room> {
        RoomsAround::of(self.scene, place, |face| {
            let label = self.annotated.label_of_face[face as usize];
            Some(self.table.get(label)?.room)
        })
    }
}
