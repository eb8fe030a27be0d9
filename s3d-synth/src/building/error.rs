//! Why a building is impossible.

use super::Wall;
use crate::RangeError;
use s3d_geom::MeshError;
use s3d_geom::glam::DVec3;
use s3d_label::{Room, RoomType};
use thiserror::Error;

/// Why a building cannot be built or generated.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BuildingError {
    /// A number is out of its range, or is no number.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// There is no room.
    #[error("a building needs a room")]
    NoRoom,
    /// Two rooms have the same type and number.
    #[error("two rooms are called {room}")]
    SameRoom {
        /// Their name.
        room: Room,
    },
    /// Two rooms share more than a wall.
    #[error("{first} and {second} overlap")]
    RoomsOverlap {
        /// The one.
        first: Room,
        /// The other.
        second: Room,
    },
    /// An opening is not within its wall.
    #[error("{room}: the opening from {from} to {to} of its {wall:?} wall is not within that \
             wall", from = span[0], to = span[1])]
    OpeningOutside {
        /// The room.
        room: Room,
        /// The wall.
        wall: Wall,
        /// The stretch of the wall that it takes.
        span: [f32; 2],
    },
    /// Two openings of a wall overlap.
    #[error("{room}: two openings of its {wall:?} wall overlap, from {from} to \
             {to}", from = span[0], to = span[1])]
    OpeningsOverlap {
        /// The room.
        room: Room,
        /// The wall.
        wall: Wall,
        /// The stretch of the wall that the second one takes.
        span: [f32; 2],
    },
    /// A part of the room leaves it.
    #[error("{room}: {what} {index} leaves the room")]
    Outside {
        /// The room.
        room: Room,
        /// "item", "lamp", "ceiling hole" or "stairwell".
        what: &'static str,
        /// Its index in the list.
        index: usize,
    },
    /// Two locations have the same uuid, or the uuid of one is not made of 32 lower-case hexadecimal digits.
    #[error("{uuid:?} is no uuid of 32 lower-case hexadecimal digits, or another location has it too")]
    Uuid {
        /// The uuid.
        uuid: String,
    },
    /// A location is in no room.
    #[error("the location {uuid} at {position} is in no room")]
    LocationOutside {
        /// Its uuid.
        uuid: String,
        /// Where it is, in building coordinates.
        position: DVec3,
    },
    /// The generator cannot furnish rooms of this type.
    #[error("rooms of the type {} cannot be generated", room_type.name())]
    RoomType {
        /// The type.
        room_type: RoomType,
    },
    /// A list of choices is empty.
    #[error("the style has no {what}")]
    EmptyStyle {
        /// The list.
        what: &'static str,
    },
    /// Some faces have no area.
    #[error("{faces} faces would have no area")]
    NoArea {
        /// How many.
        faces: usize,
    },
    /// What was built is no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}
