//! Buildings as plain data: rooms with their openings and finishes, what stands in them, and where a scanner
//! stood.
//!
//! A [`Building`] says what is where, and nothing about triangles. [`Building::build`] makes an
//! [`AnnotatedScene`](crate::AnnotatedScene) of it. Coordinates are the building's own: metres, x to the
//! east, y to the north, z up. The walls of rooms are parallel to the axes.

pub(crate) mod check;
mod demo;
mod error;
mod item;
mod two_storeys;

pub use error::BuildingError;
pub use item::{Beam, Item, SeatBase, ShelfFront, TableBase, Thing};

use crate::look::{CeilingFinish, FloorFinish, Look, Paint};
use s3d_geom::glam::{DVec3, Vec2, Vec3, vec2};
use s3d_label::{Class, Room};

/// The height below which walls are upright, and at which openings end, metres. Above it a slanted ceiling
/// squeezes the walls.
pub(crate) const KNEE_M: f32 = 2.1;

/// A building. [`Building::build`] makes a scene of it. The `Default` is [`Building::demo`].
///
/// ```
/// use s3d_geom::glam::vec2;
/// use s3d_synth::Building;
///
/// // The building of the demo without its furniture, its office a metre wider to the west.
/// let mut building = Building { texture_scale: 0.1, ..Building::demo() };
/// building.rooms.iter_mut().for_each(|room| room.items.clear());
/// building.rooms[0].low = vec2(-1.0, 0.0);
/// let scene = building.build()?;
/// assert_eq!(scene.mesh.aabb().min.x, building.origin.x - 1.0);
/// assert!(!scene.instances.iter().any(|i| i.class == s3d_label::Class::CHAIR));
/// # Ok::<(), s3d_synth::BuildingError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Building {
    /// What it is called: a line of text, the first of the scene file.
    pub title: String,
    /// Where the origin of its coordinates lies in the world, metres.
    pub origin: Vec3,
    /// The rooms. No two of them overlap. The faces of the scene come in the order of the rooms.
    pub rooms: Vec<RoomPlan>,
    /// The places where the scanner stood, each in a room.
    pub locations: Vec<ScanLocation>,
    /// How fine the images of floors, walls and ceilings are: at 1 a floor has 100 texels a metre.
    pub texture_scale: f32,
}

/// A room: a box with openings in its walls, finishes, and what is in it.
#[derive(Clone, Debug, PartialEq)]
pub struct RoomPlan {
    /// The type and number, unique in the building.
    pub room: Room,
    /// Its smallest corner in the plan.
    pub low: Vec2,
    /// Its largest corner in the plan.
    pub high: Vec2,
    /// The height of the floor in the building. All other heights are counted from it.
    pub floor_m: f32,
    /// The height of the ceiling at the smallest and at the largest y. If they differ, the ceiling is
    /// slanted, and openings end at 2.1 m at most.
    pub heights_m: [f32; 2],
    /// What is cut out of the walls.
    pub openings: Vec<Opening>,
    /// A rectangle that is missing from the ceiling, as if it had not been captured: its smallest and largest
    /// corner.
    pub ceiling_hole: Option<[Vec2; 2]>,
    /// A rectangle that is missing from the floor, for stairs that come up through it.
    pub stairwell: Option<Stairwell>,
    /// Lamps under the ceiling: x and y of the middle, and the lengths along x and y.
    pub lamps: Vec<[f32; 4]>,
    /// What covers the walls.
    pub paint: Paint,
    /// A wall with a paint of its own.
    pub accent: Option<(Wall, Paint)>,
    /// What covers the floor.
    pub floor: FloorFinish,
    /// What covers the ceiling.
    pub ceiling: CeilingFinish,
    /// Furniture, structure and everything else. Instances of a class are numbered in this order, after
    /// openings and lamps.
    pub items: Vec<Item>,
}

/// A rectangle that is missing from a floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stairwell {
    /// Its smallest corner in the plan.
    pub low: Vec2,
    /// Its largest corner in the plan.
    pub high: Vec2,
    /// How far its sides reach down, metres: to the ceiling below, which has a hole of the same corners.
    pub depth_m: f32,
}

/// A wall of a room. The order is the one in which walls pass by when one turns right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wall {
    /// At the smallest y.
    South,
    /// At the smallest x.
    West,
    /// At the largest y.
    North,
    /// At the largest x.
    East,
}

/// A rectangle cut out of a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// The wall.
    pub wall: Wall,
    /// The stretch of the wall that it takes: x or y of the building.
    pub span: [f32; 2],
    /// The heights of its lower and upper edge.
    pub heights: [f32; 2],
    /// What it holds.
    pub filling: Filling,
}

/// What fills an opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filling {
    /// A window with an opaque pane, 16 cm behind the wall.
    Window,
    /// A doorway with a door that stands open into the room.
    Door {
        /// How deep the doorway is: the thickness of the wall, metres.
        thickness_m: f32,
        /// Whether the door hangs on the left, seen by someone who looks at the wall, or on the right.
        hinge_left: bool,
        /// How far it stands open, degrees.
        open_deg: f32,
    },
    /// A door that is shut.
    ShutDoor,
    /// A window whose opaque pane is divided by mullions.
    Glazing {
        /// How many panes lie beside and above one another: one for each 20 cm at most.
        panes: [u32; 2],
        /// How far the pane is behind the wall, at least 0.06 m.
        depth_m: f32,
    },
    /// A doorway with a door of some model, open into the room or shut. The doorway beyond `depth_m` belongs
    /// to the room on the other side, as [`Filling::Frame`], or as another leaf if the door is shut.
    Leaf {
        /// How the leaf is made.
        model: LeafModel,
        /// What it is made of.
        look: Look,
        /// How deep this side of the doorway is, metres, at least 0.05: half of the wall.
        depth_m: f32,
        /// Whether the door hangs on the left, seen by someone who looks at the wall, or on the right.
        hinge_left: bool,
        /// How far it stands open, degrees: 0 is shut, 2 cm before the end of this side.
        open_deg: f32,
    },
    /// The far side of a doorway whose leaf is in the other room: lining and frame, which are a door of this
    /// room too.
    Frame {
        /// How deep this side of the doorway is, metres.
        depth_m: f32,
    },
    /// Nothing: the doorway belongs to the room on the other side.
    Nothing,
}

/// How the leaf of a door is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafModel {
    /// Flat.
    Flush,
    /// With two raised panels on either side.
    Panelled,
    /// A wide frame around a pane that lies 1 cm deeper.
    Glazed,
}

/// A place from which a scene was captured.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanLocation {
    /// 32 lower-case hexadecimal digits.
    pub uuid: String,
    /// The scanner: metres, in the building's coordinates in a [`Building`] and in the world's in a scene.
    pub position: DVec3,
    /// Heading of the level camera in [0, 2π) or any other turn: 0 along +Y, growing to the left.
    pub yaw_rad: f64,
}

impl Filling {
    /// Whether it is a window. All other fillings belong to doorways.
    pub fn is_window(self) -> bool {
        matches!(self, Self::Window | Self::Glazing { .. })
    }

    /// The class of its annotation. `None` for [`Filling::Nothing`].
    pub fn class(self) -> Option<Class> {
        match self {
            Self::Window | Self::Glazing { .. } => Some(Class::WINDOW),
            Self::Door { .. } | Self::ShutDoor | Self::Leaf { .. } | Self::Frame { .. } => Some(Class::DOOR),
            Self::Nothing => None,
        }
    }
}

impl Default for Building {
    fn default() -> Self {
        Self::demo()
    }
}

impl Wall {
    /// All four walls. Seen from inside the room, each follows the wall to its left.
    pub const ALL: [Self; 4] = [Self::South, Self::West, Self::North, Self::East];

    /// The direction in the plan that is to the right of someone who looks at the wall.
    pub fn right(self) -> Vec2 {
        match self {
            Self::South => Vec2::NEG_X,
            Self::West => Vec2::Y,
            Self::North => Vec2::X,
            Self::East => Vec2::NEG_Y,
        }
    }

    /// The unit vector into the room.
    pub fn normal(self) -> Vec3 {
        -self.right().perp().extend(0.0)
    }

    /// The turn of a frame that looks at the wall: degrees, counter-clockwise seen from above.
    pub fn yaw_deg(self) -> f32 {
        match self {
            Self::South => 180.0,
            Self::West => 90.0,
            Self::North => 0.0,
            Self::East => 270.0,
        }
    }

    /// Whether it runs along x. The other two run along y.
    pub fn along_x(self) -> bool {
        matches!(self, Self::South | Self::North)
    }
}

impl RoomPlan {
    /// The height of the ceiling at `y`, from the room's floor, metres.
    pub fn ceiling_at(&self, y: f32) -> f32 {
        let t = (y - self.low.y) / (self.high.y - self.low.y);
        self.heights_m[0] + (self.heights_m[1] - self.heights_m[0]) * t
    }

    /// The greatest height of the ceiling.
    pub(crate) fn top(&self) -> f32 {
        self.heights_m[0].max(self.heights_m[1])
    }

    /// The point of the plan on `wall` at `along`, its x or y.
    pub(crate) fn on_wall(&self, wall: Wall, along: f32) -> Vec2 {
        match wall {
            Wall::South => vec2(along, self.low.y),
            Wall::West => vec2(self.low.x, along),
            Wall::North => vec2(along, self.high.y),
            Wall::East => vec2(self.high.x, along),
        }
    }

    /// How long `wall` is, metres.
    pub(crate) fn length(&self, wall: Wall) -> f32 {
        let size = self.high - self.low;
        if wall.along_x() { size.x } else { size.y }
    }

    /// Whether `p`, in building coordinates, is in the room, below its ceiling.
    pub fn contains(&self, p: DVec3) -> bool {
        let plan = p.truncate().as_vec2();
        let height = p.z as f32 - self.floor_m;
        plan.cmpge(self.low).all()
            && plan.cmple(self.high).all()
            && (0.0..=self.ceiling_at(plan.y)).contains(&height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_of_a_wall_looks_at_it() {
        for wall in Wall::ALL {
            let turn = Vec2::from_angle(wall.yaw_deg().to_radians());
            assert!(turn.distance(wall.right()) < 1e-6);
            assert!((turn.perp().extend(0.0) + wall.normal()).length() < 1e-6);
        }
    }
}
