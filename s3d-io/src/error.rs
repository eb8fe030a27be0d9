//! The errors of reading and writing files.

use s3d_geom::MeshError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The result of reading or writing a file.
pub type Result<T> = std::result::Result<T, Error>;

/// The place of a fault in a file.
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
    /// The operating system refused: the file does not exist, may not be read or written, or the disk is
    /// full.
    #[error("{path}: cannot {action}: {words}", path = path.display(), words = words(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The action that failed: "read", "write", "create the folder"…
        action: &'static str,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The content of the file is wrong. The message says what is wrong and, if possible, what to do.
    #[error("{path}{place}: {message}", path = path.display(), place = place_suffix(*place))]
    Format {
        /// The file.
        path: PathBuf,
        /// The place in the file.
        place: Place,
        /// What is wrong, with the offending value.
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
    /// The file uses something that this reader does not support. The message names it, and what to do
    /// instead.
    #[error("{path}: {message}", path = path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not supported, and what to do instead.
        message: String,
    },
}

/// The system's words, without the number that the standard library adds.
fn words(error: &std::io::Error) -> String {
    let mut words = error.to_string();
    if let Some(at) = words.find(" (os error ") {
        words.truncate(at);
    }
    words
}

fn place_suffix(place: Place) -> String {
    match place {
        Place::File => String::new(),
        Place::Line(line) => format!(", line {line}"),
    }
}

impl Error {
    /// Returns an [`Error::Io`] for `path`.
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), action, source }
    }

    /// Returns an [`Error::Format`] for the whole file.
    pub fn format(path: &Path, message: impl Into<String>) -> Self {
        Self::Format { path: path.to_owned(), place: Place::File, message: message.into() }
    }

    /// Returns an [`Error::Format`] for a line, counted from 1.
    pub fn line(path: &Path, line: u64, message: impl Into<String>) -> Self {
        Self::Format { path: path.to_owned(), place: Place::Line(line), message: message.into() }
    }

    /// Returns an [`Error::Unsupported`] for `path`.
    pub fn unsupported(path: &Path, message: impl Into<String>) -> Self {
        Self::Unsupported { path: path.to_owned(), message: message.into() }
    }

    /// Returns an [`Error::Unsupported`] for a format whose reader is not in this build.
    pub(crate) fn not_built_in(path: &Path, feature: &str) -> Self {
        let message = format!("is read by s3d-io's cargo feature `{feature}`, which this build is without");
        Self::unsupported(path, message)
    }

    /// Returns the message without the file: "line 3: …", "cannot read: …".
    pub fn message(&self) -> String {
        match self {
            Self::Io { action, source, .. } => format!("cannot {action}: {}", words(source)),
            Self::Format { message, place: Place::Line(line), .. } => format!("line {line}: {message}"),
            Self::Format { message, .. } | Self::Unsupported { message, .. } => message.clone(),
            Self::Mesh { source, .. } => source.to_string(),
        }
    }

    /// Returns the file that the error is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::Io { path, .. } | Self::Format { path, .. } | Self::Mesh { path, .. } => path,
            Self::Unsupported { path, .. } => path,
        }
    }
}
