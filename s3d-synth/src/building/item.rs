//! What is in a room.

use super::Wall;
use crate::look::{Look, Pattern};
use s3d_geom::glam::{Vec2, Vec3};
use s3d_label::Class;

/// Something in a room, and where. Each is an annotated instance of its own.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// It stands on the floor or on something else.
    Standing {
        /// What it is.
        thing: Thing,
        /// The middle of its foot: x and y of the building, z from the room's floor.
        position: Vec3,
        /// By how much it is turned, degrees, counter-clockwise seen from above. Without a turn its back is
        /// to the north.
        yaw_deg: f32,
    },
    /// It hangs on a wall or stands with its back to it.
    OnWall {
        /// What it is.
        thing: Thing,
        /// The wall.
        wall: Wall,
        /// Where its middle is along the wall: x or y of the building.
        along: f32,
    },
    /// A beam under the ceiling.
    Beam(Beam),
}

/// A beam that touches the ceiling. Its ends are open, as they touch walls.
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

/// Things, with the measures that may differ: metres. Where nothing else is said they stand with the middle
/// of their foot at the origin of their frame and look along −y: their back goes to a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Thing {
    /// A table: a top on four legs.
    Table {
        /// Along x, at least 0.2.
        width_m: f32,
        /// Along y, at least 0.2.
        depth_m: f32,
        /// Of the top's upper side, at least 0.1.
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
        /// Of the top's upper side, at least 0.1.
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
        /// From which height to which, at least 0.1 apart.
        heights_m: [f32; 2],
        /// What is on it.
        picture: Pattern,
        /// What it is framed with.
        frame: Look,
        /// The width of the tray with pens below it, if any: at least 0.6.
        tray_m: Option<f32>,
    },
    /// A picture on a wall. The origin is on the wall, at its foot.
    Picture {
        /// Along the wall, at least 0.1.
        width_m: f32,
        /// From which height to which, at least 0.1 apart.
        heights_m: [f32; 2],
        /// What it shows.
        picture: Pattern,
        /// What it is framed with.
        frame: Look,
    },
    /// A large screen on a wall. The origin is on the wall, at its foot.
    WallScreen {
        /// Along the wall, at least 0.1.
        width_m: f32,
        /// From which height to which, at least 0.1 apart.
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
        /// Of the plant above its pot, roughly: 0.3 to 5.
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

impl Item {
    /// A thing at (x, y) of the building and `z` above the room's floor, turned by `yaw_deg`.
    pub fn standing(position: [f32; 3], yaw_deg: f32, thing: Thing) -> Self {
        Self::Standing { thing, position: Vec3::from_array(position), yaw_deg }
    }

    /// A thing on `wall` at `along`, x or y of the building.
    pub fn on_wall(wall: Wall, along: f32, thing: Thing) -> Self {
        Self::OnWall { thing, wall, along }
    }

    /// The class that it is annotated as.
    pub fn class(&self) -> Class {
        match self {
            Self::Standing { thing, .. } | Self::OnWall { thing, .. } => thing.class(),
            Self::Beam(_) => Class::BEAM,
        }
    }
}

impl Thing {
    /// The class that it is annotated as.
    pub fn class(&self) -> Class {
        match self {
            Self::Table { .. } | Self::Desk { .. } | Self::RoundTable { .. } => Class::TABLE,
            Self::OfficeChair(_) | Self::Chair(_) | Self::Stool(_) => Class::CHAIR,
            Self::Sofa { .. } => Class::SOFA,
            Self::Bookcase { .. } => Class::BOOKCASE,
            Self::Board { .. } => Class::BOARD,
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
            | Self::Rug => Class::CLUTTER,
        }
    }
}
