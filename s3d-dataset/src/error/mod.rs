//! Why a call of this crate did not do what it was asked for.

mod input;
mod names;
mod temporary;
mod usage;

pub use input::InputError;
pub use names::{FieldNames, OptionNames};
pub use temporary::{Activity, TemporaryError};
pub use usage::{Difference, Held, Overwriting, UsageError};

use std::error::Error as StdError;
use std::io::{self, ErrorKind};
use thiserror::Error as ThisError;

/// What calls of this crate return.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why a call failed. Nothing that was there before is lost by any of them.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// The call cannot be made: options that exclude each other, a folder that holds something else.
    #[error(transparent)]
    Usage(#[from] UsageError),
    /// A file is wrong or the disk refuses.
    #[error(transparent)]
    File(s3d_io::Error),
    /// The input does not fit together.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Nothing is wrong with the call or the input, and everything that was done so far is kept: the same
    /// call may go on later.
    #[error(transparent)]
    Temporary(#[from] TemporaryError),
    /// The call was [cancelled](crate::Cancel). Everything that was done so far is kept: the same call goes
    /// on.
    #[error("cancelled; the same call goes on where it stopped")]
    Cancelled,
}

impl Error {
    /// Whether the same call may succeed later, or go on: [`Error::Temporary`] and [`Error::Cancelled`].
    pub fn is_temporary(&self) -> bool {
        matches!(self, Self::Temporary(_) | Self::Cancelled)
    }

    /// Returns the message with options named by `names`.
    pub fn message(&self, names: &dyn OptionNames) -> String {
        match self {
            Self::Usage(error) => error.message(names),
            Self::Input(error) => error.message(names),
            Self::File(_) | Self::Temporary(_) | Self::Cancelled => self.to_string(),
        }
    }

    /// The input in `path` does not fit, because of `why`.
    pub(crate) fn unfit(path: impl Into<std::path::PathBuf>, why: impl Into<String>) -> Self {
        InputError::Unfit { path: path.into(), why: why.into() }.into()
    }
}

impl From<s3d_io::Error> for Error {
    /// A file that is wrong, or a system that may do better the next time: [`Error::Temporary`].
    fn from(error: s3d_io::Error) -> Self {
        if passes(&error) {
            TemporaryError::System(error).into()
        } else {
            Self::File(error)
        }
    }
}

/// Whether an error, or one that it comes from, may pass: the same call may succeed later, or on another
/// machine.
///
/// These are what is used up now and is given back by others (space, quota, memory, open files, threads,
/// locks), what a network or a file system on one does (timeouts, stale handles, lost connections), and EIO:
/// the system says it for a broken disk as for a network file system that was away (NFS mounted "soft",
/// Lustre after an eviction). It cannot be told apart; a scheduler, which bounds its tries, loses a few of
/// them in the first case and a night's work in the second if it is not tried. Everything else — missing
/// files, permissions, read-only file systems, files too large for theirs — stays as it is until somebody
/// does something.
pub(crate) fn passes(error: &(dyn StdError + 'static)) -> bool {
    let mut next = Some(error);
    while let Some(error) = next {
        if let Some(io) = error.downcast_ref::<io::Error>() {
            if passes_io(io) {
                return true;
            }
            // `source` of an `io::Error` skips the error that it holds.
            if let Some(inner) = io.get_ref()
                && passes(inner)
            {
                return true;
            }
        }
        next = error.source();
    }
    false
}

pub(crate) fn passes_io(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull
            | ErrorKind::QuotaExceeded
            | ErrorKind::OutOfMemory
            | ErrorKind::Interrupted
            | ErrorKind::WouldBlock
            | ErrorKind::ResourceBusy
            | ErrorKind::TimedOut
            | ErrorKind::StaleNetworkFileHandle
            | ErrorKind::NotConnected
            | ErrorKind::ConnectionAborted
            | ErrorKind::ConnectionReset
            | ErrorKind::HostUnreachable
            | ErrorKind::NetworkUnreachable
            | ErrorKind::NetworkDown
    ) || error.raw_os_error().is_some_and(passes_raw)
}

/// Those that std has no kind for.
#[cfg(unix)]
pub(crate) fn passes_raw(code: i32) -> bool {
    [libc::EIO, libc::EMFILE, libc::ENFILE, libc::ENOLCK, libc::ENOBUFS, libc::ESHUTDOWN].contains(&code)
}

/// Those that std has no kind for: ERROR_TOO_MANY_OPEN_FILES, ERROR_SHARING_VIOLATION, ERROR_LOCK_VIOLATION,
/// ERROR_NETNAME_DELETED, ERROR_IO_DEVICE.
#[cfg(windows)]
pub(crate) fn passes_raw(code: i32) -> bool {
    [4, 32, 33, 64, 1117].contains(&code)
}

#[cfg(not(any(unix, windows)))]
pub(crate) fn passes_raw(_: i32) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn is_temporary(source: io::Error) -> bool {
        matches!(s3d_io::Error::io(Path::new("out/a.png"), "write", source).into(), Error::Temporary(_))
    }

    #[test]
    fn what_may_pass_is_temporary() {
        for kind in [
            ErrorKind::StorageFull,
            ErrorKind::QuotaExceeded,
            ErrorKind::TimedOut,
            ErrorKind::StaleNetworkFileHandle,
        ] {
            assert!(is_temporary(kind.into()), "{kind:?}");
            // Writers of other crates wrap what they are given.
            assert!(is_temporary(io::Error::other(io::Error::from(kind))), "{kind:?}");
        }
        for kind in [ErrorKind::NotFound, ErrorKind::PermissionDenied, ErrorKind::ReadOnlyFilesystem] {
            assert!(!is_temporary(kind.into()), "{kind:?}");
        }
        let e = Error::from(s3d_io::Error::format(Path::new("a.obj"), "no face"));
        assert!(matches!(e, Error::File(_)));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_systems_own_numbers() {
        // EIO, EAGAIN, ENOMEM, EBUSY, ENFILE, EMFILE, ENOSPC, ENOLCK, ENOTCONN, ESHUTDOWN, ETIMEDOUT, ESTALE,
        // EDQUOT.
        for code in [5, 11, 12, 16, 23, 24, 28, 37, 107, 108, 110, 116, 122] {
            assert!(is_temporary(io::Error::from_raw_os_error(code)), "{code}");
        }
        // EPERM, ENOENT, EACCES, ENOTDIR, EISDIR, EINVAL, EFBIG, EROFS, ENAMETOOLONG.
        for code in [1, 2, 13, 20, 21, 22, 27, 30, 36] {
            assert!(!is_temporary(io::Error::from_raw_os_error(code)), "{code}");
        }
    }
}
