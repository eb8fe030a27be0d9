//! Why labels could not be opened, changed or written.

use super::fault::Fault;
use std::path::PathBuf;
use thiserror::Error;

/// The result of work on a folder of labels.
pub type Result<T> = std::result::Result<T, Error>;

/// Why labels could not be opened, changed or written. Nothing was changed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written, or its content is damaged. It names the file, and the line of a
    /// log.
    #[error(transparent)]
    File(#[from] s3d_io::Error),
    /// The folder holds labels of another mesh.
    #[error(
        "{path}: the labels are about another mesh, of {labelled} faces; this one has {faces}: carry them \
         over to this mesh into a new folder, or open the mesh that was labelled",
        path = path.display()
    )]
    OtherMesh {
        /// The log of the labels.
        path: PathBuf,
        /// The number of faces of the mesh that was labelled.
        labelled: u32,
        /// The number of faces of the mesh at hand.
        faces: u32,
    },
    /// Another process labels in this folder now.
    #[error("{path}: another process labels in this folder: end it, or wait", path = path.display())]
    InUse {
        /// The folder.
        path: PathBuf,
    },
    /// The folder has other files and no log of labels.
    #[error("{path}: this folder has other files and no labels: name a new folder", path = path.display())]
    NoLabels {
        /// The folder.
        path: PathBuf,
    },
    /// The call was made from an older revision: somebody else has changed the labels since.
    #[error("made from revision {given}, but the labels are at revision {now}: look at them again first")]
    Stale {
        /// The revision that the call named.
        given: u64,
        /// The revision of the labels.
        now: u64,
    },
    /// The action does not fit the labels.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// A word is no class of the taxonomy.
    #[error(transparent)]
    Class(#[from] s3d_label::UnknownClass),
    /// A word is no type of room of the taxonomy.
    #[error(transparent)]
    RoomType(#[from] s3d_label::UnknownRoomType),
    /// An event could not be written before, nor what was written of it be removed. The log has to be opened
    /// again, which drops it.
    #[error("{path}: an event was written in part before, and the rest failed: open the labels again",
        path = path.display())]
    Broken {
        /// The log.
        path: PathBuf,
    },
}
