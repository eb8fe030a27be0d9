//! What can go wrong.

use crate::building::Wall;
use s3d_geom::MeshError;
use s3d_geom::glam::DVec3;
use s3d_label::{Room, RoomType};
use thiserror::Error;

/// A number is out of its range, or none at all.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{what} is {value}, and must be from {min} to {max}", value = short(*value))]
pub struct RangeError {
    /// What the number is, in words: "office_1: the width".
    pub what: String,
    /// The number.
    pub value: f64,
    /// The smallest that it may be.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

/// A number as it was written: most come as `f32`.
fn short(value: f64) -> String {
    let single = value as f32;
    if f64::from(single) == value {
        single.to_string()
    } else {
        value.to_string()
    }
}

impl RangeError {
    /// Nothing if `value` is from `min` to `max`, or else the error, with `what` in its words.
    pub(crate) fn check(
        value: impl Into<f64>,
        [min, max]: [f64; 2],
        what: impl FnOnce() -> String,
    ) -> Result<(), Self> {
        let value = value.into();
        // What is written as 1.8 may come as an `f32` a little below that.
        let single = |bound: f64| f64::from(bound as f32);
        if (min.min(single(min))..=max.max(single(max))).contains(&value) {
            Ok(())
        } else {
            Err(Self { what: what(), value, min, max })
        }
    }
}

/// Why a building cannot be built or generated.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BuildingError {
    /// A number is out of its range, or none at all.
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
        /// From where to where along the wall.
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
        /// Where the second lies along the wall.
        span: [f32; 2],
    },
    /// What was built leaves its room.
    #[error("{room}: {what} {index} leaves the room")]
    Outside {
        /// The room.
        room: Room,
        /// "item", "lamp", "ceiling hole" or "stairwell".
        what: &'static str,
        /// Its place in the list, from 0.
        index: usize,
    },
    /// Two locations have the same uuid, or one has none of 32 lower-case hexadecimal digits.
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
    /// Nothing is known of how to furnish rooms of this type.
    #[error("rooms of the type {} cannot be generated", room_type.name())]
    RoomType {
        /// The type.
        room_type: RoomType,
    },
    /// A list of what to choose from is empty.
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

/// Why a scan was not written.
#[cfg(feature = "files")]
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ScanError {
    /// A file or folder cannot be written.
    #[error(transparent)]
    File(#[from] s3d_io::Error),
    /// A number of the options is out of its range, or none at all.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// The caller did not want to go on.
    #[error("cancelled")]
    Cancelled,
}
