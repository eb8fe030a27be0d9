//! What can go wrong with a file, and whose fault it is.

use s3d_geom::MeshError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The result of reading or writing a file.
pub type Result<T> = std::result::Result<T, Error>;

/// Where in a file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text file, from 1.
    Line(u64),
}

/// Why a file could not be read or written. Every variant names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused: the file is not there, may not be read or written, or the disk is full.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried: "read", "write", "create the folder"…
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file does not hold what it should: the sentence says what is wrong and, where it can, what to do.
    #[error("{path}{place}: {message}", path = path.display(), place = place_suffix(*place))]
    Format {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What is wrong with it, with the offending value.
        message: String,
    },
    /// The file is well-formed, but its mesh cannot be used.
    #[error("{path}: {source}", path = path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with the mesh.
        source: MeshError,
    },
    /// The file uses something that this reader does not support: the sentence names it and a way out.
    #[error("{path}: {message}", path = path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not supported, and what to do instead.
        message: String,
    },
}

fn place_suffix(place: Place) -> String {
    match place {
        Place::File => String::new(),
        Place::Line(line) => format!(", line {line}"),
    }
}

impl Error {
    /// An [`Error::Io`] for `path`.
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), action, source }
    }

    /// An [`Error::Format`] for the file as a whole.
    pub fn format(path: &Path, message: impl Into<String>) -> Self {
        Self::Format { path: path.to_owned(), place: Place::File, message: message.into() }
    }

    /// An [`Error::Format`] for a line, counted from 1.
    pub fn line(path: &Path, line: u64, message: impl Into<String>) -> Self {
        Self::Format { path: path.to_owned(), place: Place::Line(line), message: message.into() }
    }

    /// An [`Error::Unsupported`] for `path`.
    pub fn unsupported(path: &Path, message: impl Into<String>) -> Self {
        Self::Unsupported { path: path.to_owned(), message: message.into() }
    }

    /// An [`Error::Unsupported`] for a format whose reader was left out of this build.
    pub(crate) fn not_built_in(path: &Path, feature: &str) -> Self {
        let message = format!("is read by s3d-io's cargo feature `{feature}`, which this build is without");
        Self::unsupported(path, message)
    }

    /// What is wrong, without the file: "line 3: …", "cannot read: …".
    pub fn message(&self) -> String {
        match self {
            Self::Io { action, source, .. } => format!("cannot {action}: {source}"),
            Self::Format { message, place: Place::Line(line), .. } => format!("line {line}: {message}"),
            Self::Format { message, .. } | Self::Unsupported { message, .. } => message.clone(),
            Self::Mesh { source, .. } => source.to_string(),
        }
    }

    /// The file that it is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::Io { path, .. } | Self::Format { path, .. } | Self::Mesh { path, .. } => path,
            Self::Unsupported { path, .. } => path,
        }
    }
}
