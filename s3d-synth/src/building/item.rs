//! What is in a room.

use super::Wall;
use crate::look::{Look, Pattern};
use s3d_geom::glam::{Vec2, Vec3};
use s3d_label::Class;

/// Something in a room, and its place. Each item is an annotated instance of its own.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// It stands on the floor or on something else.
    Standing {
        /// What it is.
        thing: Thing,
        /// The middle of its foot: x and y of the building, z from the room's floor.
        position: Vec3,
        /// Its turn in degrees, counter-clockwise seen from above. At 0 its back is to the north.
        yaw_deg: f32,
    },
    /// It hangs on a wall or stands with its back to it.
    OnWall {
        /// What it is.
        thing: Thing,
        /// The wall.
        wall: Wall,
        /// The middle of the thing along the wall: x or y of the building.
        along: f32,
    },
    /// A beam under the ceiling.
    Beam(Beam),
}

/// A beam under the ceiling. It has no faces at its ends, which touch walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// One end in the plan, in building coordinates.
    pub from: Vec2,
    /// The other end.
    pub to: Vec2,
    /// Half of its width, metres.
    pub half_width_m: f32,
    /// How far it reaches down, metres.
    pub depth_m: f32,
    /// What it is made of.
    pub look: Look,
}

/// Things, with the measures that may differ, in metres. Unless a variant says otherwise, the middle of the
/// foot is at the origin of the thing's frame, and the thing looks along −y, with its back to a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Thing {
    /// A table: a top on four legs.
    Table {
        /// Along x, at least 0.2.
        width_m: f32,
        /// Along y, at least 0.2.
        depth_m: f32,
        /// The height of the top's upper side, at least 0.1.
        height_m: f32,
        /// The top.
        top: Look,
    },
    /// A table of 74 cm with a panel at its back and a chest of drawers under its right end.
    Desk {
        /// Along x, at least 1.
        width_m: f32,
        /// Along y, at least 0.4.
        depth_m: f32,
    },
    /// A round table on one foot.
    RoundTable {
        /// At least 0.3.
        radius_m: f32,
        /// The height of the top's upper side, at least 0.1.
        height_m: f32,
        /// The top.
        top: Look,
    },
    /// An office chair on a star of five feet.
    OfficeChair(Look),
    /// A chair with four wooden legs.
    Chair(Look),
    /// A bar stool.
    Stool(Look),
    /// A sofa.
    Sofa {
        /// How many people find room, 1 to 20; 66 cm each.
        seats: u32,
        /// What it is covered with.
        fabric: Look,
        /// The cushion in its corner.
        cushion: Look,
    },
    /// A bookcase, 30 cm deep, with books and vases.
    Bookcase {
        /// Along x, at least 0.3.
        width_m: f32,
        /// Rows of books, 1 to 20; 36 cm each.
        shelves: u32,
        /// What it is made of.
        wood: Look,
        /// Which books are in it.
        seed: u32,
    },
    /// A board on a wall: white, of cork, a plan. The origin is on the wall, at its foot.
    Board {
        /// Along the wall, at least 0.1.
        width_m: f32,
        /// The heights of its lower and upper edge, at least 0.1 apart.
        heights_m: [f32; 2],
        /// The picture on it.
        picture: Pattern,
        /// The look of its frame.
        frame: Look,
        /// The width of the tray with pens below it, if any: at least 0.6.
        tray_m: Option<f32>,
    },
    /// A picture on a wall. The origin is on the wall, at its foot.
    Picture {
        /// Along the wall, at least 0.1.
        width_m: f32,
        /// The heights of its lower and upper edge, at least 0.1 apart.
        heights_m: [f32; 2],
        /// What it shows.
        picture: Pattern,
        /// The look of its frame.
        frame: Look,
    },
    /// A large screen on a wall. The origin is on the wall, at its foot.
    WallScreen {
        /// Along the wall, at least 0.1.
        width_m: f32,
        /// The heights of its lower and upper edge, at least 0.1 apart.
        heights_m: [f32; 2],
    },
    /// A screen on a foot, for a table.
    Monitor(Pattern),
    /// A keyboard.
    Keyboard,
    /// An open laptop.
    Laptop,
    /// A mug.
    Mug(Look),
    /// Sheets of paper.
    Papers,
    /// A lamp for a desk.
    DeskLamp,
    /// A lamp that stands on the floor.
    FloorLamp,
    /// A plant in a pot.
    Plant {
        /// The height of the plant above its pot, roughly: 0.3 to 5.
        height_m: f32,
        /// The pot.
        pot: Look,
    },
    /// A closed cardboard box.
    Carton {
        /// Along x, y and z, each at least 0.02.
        size_m: [f32; 3],
    },
    /// A waste-paper basket.
    Bin(Look),
    /// A radiator for below a window. The origin is on the wall.
    Radiator {
        /// Along the wall, at least 0.3.
        width_m: f32,
    },
    /// A copier, 1.04 m high.
    Copier,
    /// Stairs of solid blocks that climb to the north. The origin is the foot of the first riser.
    Stairs {
        /// Along x, at least 0.3.
        width_m: f32,
        /// How many treads there are, 1 to 100: the floor above is one riser higher than the last.
        steps: u32,
        /// The depth of a tread, at least 0.1.
        tread_m: f32,
        /// The height of a riser, at least 0.05.
        riser_m: f32,
    },
    /// A fire extinguisher. The origin is on the wall.
    Extinguisher,
    /// A rug of 2.5 m × 2.1 m, 12 mm high.
    Rug,
    /// A table of some model.
    ModelTable {
        /// What the top rests on.
        base: TableBase,
        /// Width, depth and height of the top's upper side: at least 0.5 (0.9 on trestles), 0.4
        /// and 0.3.
        size_m: [f32; 3],
        /// The top.
        top: Look,
    },
    /// A chair of some model.
    Seat {
        /// What the seat rests on.
        base: SeatBase,
        /// Width of the seat, height of its upper side, height of the back's upper edge: at least 0.35, 0.35,
        /// and 0.25 more than the seat's.
        size_m: [f32; 3],
        /// Whether it has arms, which stand out 5 cm to either side.
        has_arms: bool,
        /// What it is covered with.
        fabric: Look,
    },
    /// A sofa of some model.
    Couch {
        /// How many people find room, 1 to 20.
        seats: u32,
        /// Width of a seat, depth of the whole, height of the back: at least 0.45, 0.6 and 0.55.
        size_m: [f32; 3],
        /// Whether it has arms, which stand out 14 cm to either side.
        has_arms: bool,
        /// What it is covered with.
        fabric: Look,
    },
    /// A bookcase of some model.
    Shelves {
        /// What covers the front of its rows.
        front: ShelfFront,
        /// Width, depth and height: at least 0.4, 0.2 and 0.5.
        size_m: [f32; 3],
        /// What it is made of.
        wood: Look,
        /// Which books are in it.
        seed: u32,
    },
    /// A board without a frame. The origin is on the wall, at its foot.
    PlainBoard {
        /// Along the wall, at least 0.1.
        width_m: f32,
        /// The heights of its lower and upper edge, at least 0.1 apart.
        heights_m: [f32; 2],
        /// The picture on it.
        picture: Pattern,
    },
    /// A toilet, 70 cm deep. The origin is on the wall.
    Toilet,
    /// A wash-basin, 45 cm deep, with a mirror above it. The origin is on the wall.
    Basin,
    /// A thin screen that stands out of a wall, such as between toilets. The origin is on the wall.
    Partition {
        /// How far it stands out of the wall, at least 0.2.
        depth_m: f32,
        /// The height of its upper edge, at least 0.5.
        height_m: f32,
    },
    /// A column at a wall. The origin is on the wall.
    Column {
        /// Along the wall, at least 0.05.
        width_m: f32,
        /// Out of the wall, at least 0.05.
        depth_m: f32,
        /// Up to the ceiling, or to a beam: its top is open. At least 0.05.
        height_m: f32,
    },
}

/// What a table's top rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableBase {
    /// Four legs of steel.
    Legs,
    /// Two trestles.
    Trestles,
    /// A panel at either end, and one at the back.
    Panels,
    /// One column on a plate.
    Pedestal,
}

/// What a chair's seat rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeatBase {
    /// Four legs.
    Legs,
    /// A column on a star of five feet.
    Star,
    /// Two runners that bend up at the front.
    Sled,
    /// A solid block down to the floor.
    Block,
}

/// What covers the front of a bookcase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShelfFront {
    /// Nothing: books are seen in all rows.
    Open,
    /// Doors.
    Doors,
    /// Doors before the lower half.
    HalfDoors,
}

impl Item {
    /// A thing at (x, y) of the building and `z` above the room's floor, turned by `yaw_deg`.
    pub fn standing(position: [f32; 3], yaw_deg: f32, thing: Thing) -> Self {
        Self::Standing { thing, position: Vec3::from_array(position), yaw_deg }
    }

    /// A thing on `wall` at `along`, x or y of the building.
    pub fn on_wall(wall: Wall, along: f32, thing: Thing) -> Self {
        Self::OnWall { thing, wall, along }
    }

    /// The class of its annotation.
    pub fn class(&self) -> Class {
        match self {
            Self::Standing { thing, .. } | Self::OnWall { thing, .. } => thing.class(),
            Self::Beam(_) => Class::BEAM,
        }
    }
}

impl Thing {
    /// The class of its annotation.
    pub fn class(&self) -> Class {
        match self {
            Self::Table { .. } | Self::Desk { .. } | Self::RoundTable { .. } | Self::ModelTable { .. } => {
                Class::TABLE
            }
            Self::OfficeChair(_) | Self::Chair(_) | Self::Stool(_) | Self::Seat { .. } => Class::CHAIR,
            Self::Sofa { .. } | Self::Couch { .. } => Class::SOFA,
            Self::Bookcase { .. } | Self::Shelves { .. } => Class::BOOKCASE,
            Self::Board { .. } | Self::PlainBoard { .. } => Class::BOARD,
            Self::Column { .. } => Class::COLUMN,
            Self::Picture { .. }
            | Self::WallScreen { .. }
            | Self::Monitor(_)
            | Self::Keyboard
            | Self::Laptop
            | Self::Mug(_)
            | Self::Papers
            | Self::DeskLamp
            | Self::FloorLamp
            | Self::Plant { .. }
            | Self::Carton { .. }
            | Self::Bin(_)
            | Self::Radiator { .. }
            | Self::Stairs { .. }
            | Self::Copier
            | Self::Extinguisher
            | Self::Toilet
            | Self::Basin
            | Self::Partition { .. }
            | Self::Rug => Class::CLUTTER,
        }
    }
}
