//! Why a command did not do what it was called for, and the exit code that says so.

use s3d_io::Error;
use std::process::ExitCode;
use thiserror::Error as ThisError;

/// The result of a command.
pub(crate) type Outcome<T> = Result<T, Failure>;

/// Why a command failed.
#[derive(Debug, ThisError)]
pub(crate) enum Failure {
    /// The call is wrong: exit code 2.
    #[error("{0}")]
    Call(String),
    /// A file is wrong or the disk refuses: exit code 1.
    #[error(transparent)]
    File(#[from] Error),
    /// The input does not fit together: exit code 1.
    #[error("{0}")]
    Input(String),
}

impl Failure {
    /// The exit code: 1 for the input or the disk, 2 for the call.
    pub(crate) fn exit_code(&self) -> ExitCode {
        match self {
            Self::File(_) | Self::Input(_) => ExitCode::from(1),
            Self::Call(_) => ExitCode::from(2),
        }
    }
}
