//! What may pass: the same call may succeed later.

use s3d_io::Error as FileError;
use std::path::PathBuf;
use thiserror::Error as ThisError;

/// Why the same call may succeed later, or on another machine. Everything that was done so far is kept.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum TemporaryError {
    /// The system refuses now, and may not the next time: a full disk, a quota, a network file system.
    #[error(transparent)]
    System(FileError),
    /// Another process works on a file or folder.
    #[error("{}: {}", .path.display(), .by.sentence())]
    InUse {
        /// The file or folder.
        path: PathBuf,
        /// What that process does.
        by: Activity,
    },
    /// Something was changed while it was read.
    #[error("{what}")]
    Changed {
        /// What was changed, in a sentence.
        what: String,
    },
}

/// What another process does with a file or folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// It exports into it.
    Exporting,
    /// Shards of another call export into it.
    OtherShards,
    /// It writes it.
    Writing,
}

impl Activity {
    fn sentence(self) -> &'static str {
        match self {
            Self::Exporting => "another process exports into it",
            Self::OtherShards => "shards of another call are at work in it",
            Self::Writing => "another process is writing it",
        }
    }
}
