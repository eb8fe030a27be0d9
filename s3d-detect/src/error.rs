//! Why a call of this crate failed.

use std::path::PathBuf;
use thiserror::Error as ThisError;

/// The result of the calls of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why a call failed.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// The data set has no labels.
    #[error("{} has no labels to learn from: give scenes [annotations]", root.display())]
    Unlabelled {
        /// The folder of the data set.
        root: PathBuf,
    },
    /// The data set lacks an area.
    #[error("{} has no area {area}: it has {areas:?}", root.display())]
    UnknownArea {
        /// The folder of the data set.
        root: PathBuf,
        /// The area that it lacks.
        area: u32,
        /// The areas that it has.
        areas: Vec<u32>,
    },
    /// No space has an annotated element.
    #[error("areas {areas:?} have no annotated element to learn from")]
    NoElements {
        /// The areas of the spaces.
        areas: Vec<u32>,
    },
    /// The areas make no fold of the paper.
    #[error("areas {areas:?} make no fold: the published folds need areas of two of 1, 3, 6 / 2, 4 / 5")]
    NoFold {
        /// The areas.
        areas: Vec<u32>,
    },
    /// Most points of a found element have a room that the area's list of rooms lacks. Areas that are read
    /// never do.
    #[error("area {area} has a point in room {room}, and names for {rooms} rooms: give each room a name")]
    UnnamedRoom {
        /// The area.
        area: u32,
        /// The room, from 0.
        room: u32,
        /// The number of rooms that have names.
        rooms: usize,
    },
    /// A file is wrong, the disk refuses, or the call was cancelled.
    #[error(transparent)]
    Dataset(#[from] s3d_dataset::Error),
}

impl From<s3d_io::Error> for Error {
    fn from(error: s3d_io::Error) -> Self {
        Self::Dataset(error.into())
    }
}
