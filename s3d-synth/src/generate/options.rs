//! The options of a generated building.

use super::furnish::can_furnish;
use super::outfit::can_outfit;
use super::{Models, Style, between, pick, rng};
use crate::building::check::check_texture_scale;
use crate::{BuildingError, RangeError};
use s3d_label::RoomType;

/// The options of [`Building::generate`](crate::Building::generate). The `Default` has six rooms.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildingOptions {
    /// The title: a line of text.
    pub title: String,
    /// The rooms without hallways, 1 to 1,000. Rooms of a type are numbered in this order.
    pub rooms: Vec<RoomOptions>,
    /// The number of storeys, from 1 to the number of rooms. Rooms are dealt to them in order. There are no
    /// stairs.
    pub storeys: u32,
    /// The width of hallways, 1.2 to 10 m.
    pub hallway_width_m: f32,
    /// The height of hallways, 2.4 to 10 m.
    pub hallway_height_m: f32,
    /// The thickness of walls, 0.1 to 1 m.
    pub wall_m: f32,
    /// The floor plan.
    pub plan: FloorPlan,
    /// The finishes of rooms and the materials of furniture.
    pub style: Style,
    /// Furniture, doors and windows of several models, as many as the published areas have. `None` takes the
    /// models of the demo.
    pub models: Option<Models>,
    /// The resolution of the images of floors, walls and ceilings, 0.01 to 2. At 1 a floor has 100 texels a
    /// metre.
    pub texture_scale: f32,
    /// The seed of all random choices.
    pub seed: u64,
}

/// The floor plan of a storey.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloorPlan {
    /// Rooms on both sides of one hallway.
    OneHallway,
    /// Rooms on both sides of the hallways of several wings. A cross hallway joins the wings at their west
    /// ends. This plan needs [`BuildingOptions::models`].
    Wings {
        /// The number of wings, 1 to 20. A single wing has no cross hallway.
        wings: u32,
        /// The number of hallways, divided by doors: at least one in each wing, and one for each wing in the
        /// cross hallway. Fewer are made if the doors of rooms leave no place for a wall.
        hallways: u32,
        /// The gap between two wings, 0.5 to 100 m. A wall that is thicker takes its place.
        courtyard_m: f32,
    },
}

/// A room that a building should have.
#[derive(Clone, Debug, PartialEq)]
pub struct RoomOptions {
    /// Its type: any but a hallway, which the floor plan adds. Auditoriums and WCs need
    /// [`BuildingOptions::models`].
    pub room_type: RoomType,
    /// The lengths along the hallway (1.8 to 40 m) and away from it (2.2 to 40 m).
    pub size_m: [f32; 2],
    /// The height of the ceiling at the smallest and at the largest y, 2.4 to 10 m.
    pub heights_m: [f32; 2],
    /// The number of windows in its outer wall. Each needs 1.1 m, and all together need 0.8 m more.
    pub windows: u32,
    /// The amount of furniture, from 0, nothing, to 1, as much as its type has.
    pub furnishing: f32,
    /// The number of scan locations, 1 to 100. Fewer are made if there is no place for more.
    pub locations: u32,
}

/// The types that are drawn, common ones more than once, with the ranges of their sizes.
const DRAWN: [(RoomType, [[f32; 2]; 2]); 11] = [
    (RoomType::OFFICE, [[3.0, 5.6], [3.6, 5.2]]),
    (RoomType::OFFICE, [[3.0, 5.6], [3.6, 5.2]]),
    (RoomType::OFFICE, [[3.0, 5.6], [3.6, 5.2]]),
    (RoomType::OFFICE, [[3.0, 5.6], [3.6, 5.2]]),
    (RoomType::CONFERENCE_ROOM, [[5.0, 8.5], [4.2, 6.0]]),
    (RoomType::LOUNGE, [[5.0, 8.0], [4.4, 6.0]]),
    (RoomType::OPENSPACE, [[7.0, 12.0], [5.0, 8.0]]),
    (RoomType::PANTRY, [[3.2, 4.6], [3.2, 4.6]]),
    (RoomType::COPY_ROOM, [[2.4, 3.6], [2.6, 4.0]]),
    (RoomType::STORAGE, [[2.2, 4.0], [2.6, 4.4]]),
    (RoomType::LOBBY, [[5.0, 8.0], [4.4, 6.5]]),
];

impl RoomOptions {
    /// A furnished room of a common size for its type, with windows and one scan location.
    pub fn new(room_type: RoomType) -> Self {
        let [[x0, x1], [y0, y1]] = DRAWN
            .iter()
            .find(|(t, _)| *t == room_type)
            .map_or([[4.0; 2]; 2], |(_, sizes)| *sizes);
        Self::sized(room_type, [0.5 * (x0 + x1), 0.5 * (y0 + y1)])
    }

    fn sized(room_type: RoomType, size_m: [f32; 2]) -> Self {
        let windows = (size_m[0] / 2.2) as u32;
        Self { room_type, size_m, heights_m: [2.8; 2], windows, furnishing: 1.0, locations: 1 }
    }
}

impl Default for BuildingOptions {
    fn default() -> Self {
        Self::drawn(6, 1)
    }
}

impl BuildingOptions {
    /// One storey with `rooms` rooms of random types and sizes, about half of them offices. The same `seed`
    /// gives the same options.
    pub fn drawn(rooms: u32, seed: u64) -> Self {
        let mut rng = rng(seed, u64::MAX);
        Self {
            title: format!("A building of {rooms} rooms, seed {seed}"),
            rooms: (0..rooms)
                .map(|_| {
                    let (room_type, [[x0, x1], [y0, y1]]) = pick(&mut rng, &DRAWN);
                    let mut room =
                        RoomOptions::sized(room_type, [between(&mut rng, x0, x1), between(&mut rng, y0, y1)]);
                    room.heights_m = [between(&mut rng, 2.5, 3.1); 2];
                    if pick(&mut rng, &[true, false, false, false]) {
                        room.heights_m[1] = between(&mut rng, 2.4, 3.4);
                    }
                    room
                })
                .collect(),
            storeys: 1,
            hallway_width_m: 1.8,
            hallway_height_m: 2.6,
            wall_m: 0.15,
            plan: FloorPlan::OneHallway,
            style: Style::default(),
            models: None,
            texture_scale: 1.0,
            seed,
        }
    }

    pub(super) fn check(&self) -> Result<(), BuildingError> {
        if self.rooms.is_empty() {
            return Err(BuildingError::NoRoom);
        }

        let count = self.rooms.len() as f64;
        RangeError::check(count, [1.0, 1000.0], || "the number of rooms".to_owned())?;
        RangeError::check(self.storeys, [1.0, count], || "the number of storeys".to_owned())?;

        RangeError::check(self.hallway_width_m, [1.2, 10.0], || "the width of hallways".to_owned())?;
        RangeError::check(self.hallway_height_m, HEIGHTS, || "the height of hallways".to_owned())?;
        RangeError::check(self.wall_m, [0.1, 1.0], || "the thickness of walls".to_owned())?;

        let with_models = self.models.is_some();
        self.rooms
            .iter()
            .enumerate()
            .try_for_each(|(index, room)| room.check(index, with_models))?;

        if let FloorPlan::Wings { wings, hallways, courtyard_m } = self.plan {
            if !with_models {
                return Err(BuildingError::EmptyStyle { what: "models, which wings need" });
            }
            RangeError::check(wings, [1.0, 20.0], || "the number of wings".to_owned())?;
            let least = if wings > 1 { 2 * wings } else { 1 };
            RangeError::check(hallways, [f64::from(least), 200.0], || "the number of hallways".to_owned())?;
            RangeError::check(courtyard_m, [0.5, 100.0], || "what is between wings".to_owned())?;
        }

        check_texture_scale(self.texture_scale)?;
        self.models.as_ref().map_or(Ok(()), |models| models.check(self))?;
        self.style.check()
    }
}

/// The range of ceilings. Furniture, lamps and beams find room below the lowest.
const HEIGHTS: [f64; 2] = [2.4, 10.0];

impl RoomOptions {
    fn check(&self, index: usize, with_models: bool) -> Result<(), BuildingError> {
        let is_known = can_furnish(self.room_type) || (with_models && can_outfit(self.room_type));
        if !is_known {
            return Err(BuildingError::RoomType { room_type: self.room_type });
        }
        let room = |what: &str| format!("room {index}, {}: {what}", self.room_type.name());
        let [length, depth] = self.size_m;
        // The door needs its place, and so does a scanner beyond the open leaf.
        RangeError::check(length, [1.8, 40.0], || room("the length along the hallway"))?;
        RangeError::check(depth, [2.2, 40.0], || room("the length away from the hallway"))?;
        for height in self.heights_m {
            RangeError::check(height, HEIGHTS, || room("the height of the ceiling"))?;
        }
        let most = f64::from(((length - 0.8) / 1.1).floor().max(0.0));
        RangeError::check(self.windows, [0.0, most], || room("the number of windows"))?;
        RangeError::check(self.furnishing, [0.0, 1.0], || room("how much stands in it"))?;
        RangeError::check(self.locations, [1.0, 100.0], || room("the number of locations"))?;
        Ok(())
    }
}
