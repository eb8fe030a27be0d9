//! Checks a building before it is built. Whether a thing leaves its room is found only while it is built.

use super::{Beam, Building, Filling, Item, KNEE_M, Opening, RoomPlan, Stairwell, TableBase, Thing};
use crate::{BuildingError, RangeError};
use s3d_geom::glam::Vec2;
use std::collections::BTreeSet;

/// The tolerance for numbers that should be equal, metres: rooms that share the plane of a wall do not
/// overlap.
const SLACK_M: f32 = 1e-3;
/// The longest side of a room, and the greatest distance of anything from the origin.
const LONGEST_M: f64 = 150.0;
const FARTHEST_M: f64 = 10_000.0;
/// The lowest ceiling: doors are 2.1 m high.
pub(crate) const LOWEST_CEILING_M: f64 = 2.2;
const HIGHEST_CEILING_M: f64 = 30.0;

impl Building {
    /// Checks everything that can be checked without building.
    pub(crate) fn check(&self) -> Result<(), BuildingError> {
        for (value, axis) in self.origin.to_array().into_iter().zip(["x", "y", "z"]) {
            RangeError::check(value, [-1e6, 1e6], || format!("the origin's {axis}"))?;
        }

        check_texture_scale(self.texture_scale)?;
        if self.rooms.is_empty() {
            return Err(BuildingError::NoRoom);
        }

        let mut names = BTreeSet::new();
        for (index, room) in self.rooms.iter().enumerate() {
            room.check_shell()?;
            room.check_items()?;
            if !names.insert(room.room) {
                return Err(BuildingError::SameRoom { room: room.room });
            }
            if let Some(other) = self.rooms.iter().take(index).find(|other| other.overlaps(room)) {
                return Err(BuildingError::RoomsOverlap { first: other.room, second: room.room });
            }
        }

        let mut uuids = BTreeSet::new();
        for location in &self.locations {
            let uuid = &location.uuid;
            let is_hex = uuid.len() == 32 && uuid.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'));
            if !is_hex || !uuids.insert(uuid) {
                return Err(BuildingError::Uuid { uuid: uuid.clone() });
            }
            RangeError::check(location.yaw_rad, [-1e3, 1e3], || format!("the heading of {uuid}"))?;
            if !self.rooms.iter().any(|room| room.contains(location.position)) {
                return Err(BuildingError::LocationOutside {
                    uuid: uuid.clone(),
                    position: location.position,
                });
            }
        }
        Ok(())
    }
}

/// The greatest number of panes side by side, or above one another, in a window of this length.
pub(crate) fn most_panes(length_m: f32) -> u32 {
    ((length_m / 0.2) as u32).max(1)
}

/// Checks that images of floors, walls and ceilings are neither too coarse nor too fine.
pub(crate) fn check_texture_scale(scale: f32) -> Result<(), RangeError> {
    RangeError::check(scale, [0.01, 2.0], || "the scale of textures".to_owned())
}

impl RoomPlan {
    fn check_items(&self) -> Result<(), BuildingError> {
        let range = |value: f32, range: [f64; 2], what: &str| {
            RangeError::check(value, range, || format!("{}: {what}", self.room))
        };
        self.items.iter().try_for_each(|item| Ok(item.check(&range)?))
    }

    /// Checks all but the items: size and height, openings, holes and lamps.
    pub(crate) fn check_shell(&self) -> Result<(), BuildingError> {
        let range = |value: f32, range: [f64; 2], what: &str| {
            RangeError::check(value, range, || format!("{}: {what}", self.room))
        };

        let far = [-FARTHEST_M, FARTHEST_M];
        range(self.low.x, far, "the smallest x")?;
        range(self.low.y, far, "the smallest y")?;
        range(self.high.x - self.low.x, [0.5, LONGEST_M], "the length along x")?;
        range(self.high.y - self.low.y, [0.5, LONGEST_M], "the length along y")?;
        range(self.floor_m, far, "the height of the floor")?;
        for height in self.heights_m {
            range(height, [LOWEST_CEILING_M, HIGHEST_CEILING_M], "the height of the ceiling")?;
        }

        for (index, opening) in self.openings.iter().enumerate() {
            self.check_opening(opening)?;
            if self.openings.iter().take(index).any(|other| other.overlaps(opening)) {
                let wall = opening.wall;
                let span = opening.span;
                return Err(BuildingError::OpeningsOverlap { room: self.room, wall, span });
            }
        }

        let inside = |p: Vec2| p.cmpge(self.low).all() && p.cmple(self.high).all();
        let outside = |what, index| BuildingError::Outside { room: self.room, what, index };
        if let Some([low, high]) = self.ceiling_hole
            && !(inside(low) && inside(high) && low.cmplt(high).all())
        {
            return Err(outside("ceiling hole", 0));
        }
        if let Some(Stairwell { low, high, depth_m }) = self.stairwell {
            range(depth_m, [0.05, 5.0], "the depth of the stairwell")?;
            if !(inside(low) && inside(high) && low.cmplt(high).all()) {
                return Err(outside("stairwell", 0));
            }
        }

        for (index, &[x, y, length, width]) in self.lamps.iter().enumerate() {
            range(length.min(width), [0.05, LONGEST_M], "the length of a lamp")?;
            let middle = Vec2::new(x, y);
            let half = 0.5 * Vec2::new(length, width);
            if !(inside(middle - half) && inside(middle + half)) {
                return Err(outside("lamp", index));
            }
        }
        Ok(())
    }

    fn check_opening(&self, opening: &Opening) -> Result<(), BuildingError> {
        let Opening { wall, span: [from, to], heights: [low, high], filling } = *opening;
        let (start, end) = if wall.along_x() {
            (self.low.x, self.high.x)
        } else {
            (self.low.y, self.high.y)
        };

        // Under a slanted ceiling, walls are upright only up to the knee.
        let top = if self.heights_m[0] == self.heights_m[1] {
            self.top()
        } else {
            KNEE_M
        };

        let is_door = !filling.is_window();
        // Bars and linings need room.
        let fits = from >= start
            && to <= end
            && to - from >= 0.3
            && low >= 0.0
            && high <= top
            && high - low >= if is_door { 1.5 } else { 0.65 }
            && (!is_door || low == 0.0);

        if !fits {
            return Err(BuildingError::OpeningOutside { room: self.room, wall, span: [from, to] });
        }

        let what = |what: &str| format!("{}: {what}", self.room);
        let thickness = |m: f32| RangeError::check(m, [0.01, 5.0], || what("the thickness of a doorway"));

        match filling {
            Filling::Door { thickness_m, open_deg, .. } => {
                thickness(thickness_m)?;
                RangeError::check(open_deg, [0.0, 180.0], || what("how far a door is open"))?;
            }
            Filling::Leaf { depth_m, open_deg, .. } => {
                RangeError::check(depth_m, [0.05, 5.0], || what("the thickness of a doorway"))?;
                RangeError::check(open_deg, [0.0, 180.0], || what("how far a door is open"))?;
            }
            Filling::Frame { depth_m } => thickness(depth_m)?,
            Filling::Glazing { panes, depth_m } => {
                let [columns, rows] = panes.map(|n| n as f32);
                RangeError::check(depth_m, [0.06, 5.0], || what("the depth of a window"))?;
                RangeError::check(columns, pane_range(to - from), || what("the panes beside one another"))?;
                RangeError::check(rows, pane_range(high - low), || what("the panes above one another"))?;
            }
            Filling::Window | Filling::ShutDoor | Filling::Nothing => {}
        }
        Ok(())
    }

    fn overlaps(&self, other: &Self) -> bool {
        let mut axes = self.spans().into_iter().zip(other.spans());
        !axes.any(|(a, b)| are_apart(a, b, SLACK_M))
    }

    /// Returns the interval that the room takes along each axis.
    fn spans(&self) -> [[f32; 2]; 3] {
        [[self.low.x, self.high.x], [self.low.y, self.high.y], [self.floor_m, self.floor_m + self.top()]]
    }
}

fn pane_range(m: f32) -> [f64; 2] {
    [1.0, f64::from(most_panes(m))]
}

impl Opening {
    fn overlaps(&self, other: &Self) -> bool {
        self.wall == other.wall
            && !are_apart(self.span, other.span, 0.0)
            && !are_apart(self.heights, other.heights, 0.0)
    }
}

/// Tells whether two intervals share no more than `slack_m`.
fn are_apart(a: [f32; 2], b: [f32; 2], slack_m: f32) -> bool {
    a[1] <= b[0] + slack_m || b[1] <= a[0] + slack_m
}

type Range<'a> = &'a dyn Fn(f32, [f64; 2], &str) -> Result<(), RangeError>;

/// The longest that a thing may be, metres.
pub(crate) const LARGE_M: f64 = 50.0;

impl Item {
    fn check(&self, range: Range<'_>) -> Result<(), RangeError> {
        let far = [-FARTHEST_M, FARTHEST_M];
        match self {
            Self::Standing { thing, position, yaw_deg } => {
                position
                    .to_array()
                    .into_iter()
                    .try_for_each(|p| range(p, far, "the place of a thing"))?;
                range(*yaw_deg, [-1e4, 1e4], "the turn of a thing")?;
                thing.check(range)
            }
            Self::OnWall { thing, along, .. } => {
                range(*along, far, "the place of a thing")?;
                thing.check(range)
            }
            Self::Beam(Beam { from, to, half_width_m, depth_m, .. }) => {
                range(from.distance(*to), [0.05, LARGE_M], "the length of a beam")?;
                range(*half_width_m, [0.01, LARGE_M], "half the width of a beam")?;
                range(*depth_m, [0.01, LARGE_M], "the depth of a beam")
            }
        }
    }
}

impl Thing {
    /// Checks that every part of the thing has a size.
    fn check(&self, range: Range<'_>) -> Result<(), RangeError> {
        match *self {
            Self::Table { width_m, depth_m, height_m, .. } => {
                range(width_m.min(depth_m), [0.2, LARGE_M], "the width or depth of a table")?;
                range(width_m.max(depth_m), [0.2, LARGE_M], "the width or depth of a table")?;
                range(height_m, [0.1, LARGE_M], "the height of a table")
            }
            Self::ModelTable { size_m, base, .. } => {
                let least = if base == TableBase::Trestles { 0.9 } else { 0.5 };
                check_measures(size_m, [("width", least), ("depth", 0.4), ("height", 0.3)], "a table", range)
            }
            Self::Seat { size_m: [width, seat, back], .. } => check_measures(
                [width, seat, back - seat],
                [("width", 0.35), ("seat", 0.35), ("back", 0.25)],
                "a chair",
                range,
            ),
            Self::Couch { seats, size_m, .. } => {
                range(seats as f32, [1.0, 20.0], "the seats of a sofa")?;
                check_measures(
                    size_m,
                    [("width of a seat", 0.45), ("depth", 0.6), ("height", 0.55)],
                    "a sofa",
                    range,
                )
            }
            Self::Shelves { size_m, .. } => {
                check_measures(size_m, [("width", 0.4), ("depth", 0.2), ("height", 0.5)], "a bookcase", range)
            }
            Self::PlainBoard { width_m, heights_m, .. } => {
                check_hanging(width_m, heights_m, "a board", range)
            }
            Self::Partition { depth_m, height_m } => {
                range(depth_m, [0.2, LARGE_M], "the depth of a partition")?;
                range(height_m, [0.5, LARGE_M], "the height of a partition")
            }
            Self::Desk { width_m, depth_m } => {
                range(width_m, [1.0, LARGE_M], "the width of a desk")?;
                range(depth_m, [0.4, LARGE_M], "the depth of a desk")
            }
            Self::RoundTable { radius_m, height_m, .. } => {
                range(radius_m, [0.3, LARGE_M], "the radius of a table")?;
                range(height_m, [0.1, LARGE_M], "the height of a table")
            }
            Self::Sofa { seats, .. } => range(seats as f32, [1.0, 20.0], "the seats of a sofa"),
            Self::Bookcase { width_m, shelves, .. } => {
                range(width_m, [0.3, LARGE_M], "the width of a bookcase")?;
                range(shelves as f32, [1.0, 20.0], "the shelves of a bookcase")
            }
            Self::Board { width_m, heights_m, tray_m, .. } => {
                check_hanging(width_m, heights_m, "a board", range)?;
                tray_m.map_or(Ok(()), |tray| range(tray, [0.6, LARGE_M], "the width of a tray of pens"))
            }
            Self::Picture { width_m, heights_m, .. } => check_hanging(width_m, heights_m, "a picture", range),
            Self::WallScreen { width_m, heights_m } => check_hanging(width_m, heights_m, "a screen", range),
            Self::Plant { height_m, .. } => range(height_m, [0.3, 5.0], "the height of a plant"),
            Self::Carton { size_m } => size_m
                .into_iter()
                .try_for_each(|m| range(m, [0.02, LARGE_M], "the side of a box")),
            Self::Stairs { width_m, steps, tread_m, riser_m } => {
                range(width_m, [0.3, LARGE_M], "the width of stairs")?;
                range(steps as f32, [1.0, 100.0], "the steps of stairs")?;
                range(tread_m, [0.1, 2.0], "the tread of stairs")?;
                range(riser_m, [0.05, 1.0], "the riser of stairs")
            }
            Self::Radiator { width_m } => range(width_m, [0.3, LARGE_M], "the width of a radiator"),
            Self::Column { width_m, depth_m, height_m } => [width_m, depth_m, height_m]
                .into_iter()
                .try_for_each(|m| range(m, [0.05, LARGE_M], "the side of a column")),
            Self::OfficeChair(_)
            | Self::Chair(_)
            | Self::Stool(_)
            | Self::Monitor(_)
            | Self::Keyboard
            | Self::Laptop
            | Self::Mug(_)
            | Self::Papers
            | Self::DeskLamp
            | Self::FloorLamp
            | Self::Bin(_)
            | Self::Copier
            | Self::Extinguisher
            | Self::Toilet
            | Self::Basin
            | Self::Rug => Ok(()),
        }
    }
}

fn check_hanging(width: f32, [low, high]: [f32; 2], what: &str, range: Range<'_>) -> Result<(), RangeError> {
    range(width, [0.1, LARGE_M], &format!("the width of {what}"))?;
    range(low, [0.0, LARGE_M], &format!("the lower edge of {what}"))?;
    range(high - low, [0.1, LARGE_M], &format!("the height of {what}"))
}

fn check_measures(
    size: [f32; 3],
    least: [(&str, f64); 3],
    what: &str,
    range: Range<'_>,
) -> Result<(), RangeError> {
    size.into_iter()
        .zip(least)
        .try_for_each(|(m, (word, least))| range(m, [least, LARGE_M], &format!("the {word} of {what}")))
}
