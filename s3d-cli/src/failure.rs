//! Why a command did not do what it was called for, and the exit code that says so.

use crate::resume_hint;
use s3d_io::Error;
use std::error::Error as StdError;
use std::io::{self, ErrorKind};
use thiserror::Error as ThisError;

/// The result of a command.
pub(crate) type Outcome<T> = Result<T, Failure>;

/// The exit code of a failure that may be none the next time: `EX_TEMPFAIL` of BSD's sysexits.h.
pub(crate) const TRY_AGAIN: u8 = 75;

/// Why a command failed.
#[derive(Debug, ThisError)]
pub(crate) enum Failure {
    /// The call is wrong: exit code 2.
    #[error("{0}")]
    Call(String),
    /// A file is wrong or the disk refuses: exit code 1.
    #[error(transparent)]
    File(Error),
    /// The input does not fit together: exit code 1.
    #[error("{0}")]
    Input(String),
    /// Nothing is wrong with the call or the input, and what was done so far is kept: the same call may go on later. Exit
    /// code 75.
    #[error("{0}; {hint}", hint = resume_hint())]
    Again(String),
}

impl From<Error> for Failure {
    /// A file that is wrong, or a system that may do better the next time: see [`passes`].
    fn from(error: Error) -> Self {
        if passes(&error) { Self::Again(error.to_string()) } else { Self::File(error) }
    }
}

impl Failure {
    /// The exit code: 1 for the input or the disk, 2 for the call, 75 for what may go better the next time.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::File(_) | Self::Input(_) => 1,
            Self::Call(_) => 2,
            Self::Again(_) => TRY_AGAIN,
        }
    }
}

/// Whether an error, or one that it comes from, may pass: the same call may succeed later, or on another machine.
///
/// These are what is used up now and is given back by others (space, quota, memory, open files, threads, locks), what a
/// network or a file system on one does (timeouts, stale handles, lost connections), and EIO: the system says it for a
/// broken disk as for a network file system that was away (NFS mounted "soft", Lustre after an eviction). It cannot be told
/// apart; a scheduler, which bounds its tries, loses a few of them in the first case and a night's work in the second if it
/// is not tried. Everything else — missing files, permissions, read-only file systems, files too large for theirs — stays as
/// it is until somebody does something.
pub(crate) fn passes(error: &(dyn StdError + 'static)) -> bool {
    let mut next = Some(error);
    while let Some(error) = next {
        if let Some(io) = error.downcast_ref::<io::Error>() {
            if passes_io(io) {
                return true;
            }
            // The source of an error made by `io::Error::other` is that of what is in it.
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

    fn failure(source: io::Error) -> Failure {
        Error::io(Path::new("out/a.png"), "write", source).into()
    }

    #[test]
    fn what_may_pass_is_tried_again() {
        for kind in [
            ErrorKind::StorageFull,
            ErrorKind::QuotaExceeded,
            ErrorKind::TimedOut,
            ErrorKind::StaleNetworkFileHandle,
        ] {
            assert_eq!(failure(kind.into()).exit_code(), 75, "{kind:?}");
            // Writers of other crates wrap what they are given.
            assert_eq!(failure(io::Error::other(io::Error::from(kind))).exit_code(), 75, "{kind:?}");
        }
        for kind in [ErrorKind::NotFound, ErrorKind::PermissionDenied, ErrorKind::ReadOnlyFilesystem] {
            assert_eq!(failure(kind.into()).exit_code(), 1, "{kind:?}");
        }
        let e = Failure::from(Error::format(Path::new("a.obj"), "no face"));
        assert!(matches!(e, Failure::File(_)) && e.exit_code() == 1);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_systems_own_numbers() {
        // EIO, EAGAIN, ENOMEM, EBUSY, ENFILE, EMFILE, ENOSPC, ENOLCK, ENOTCONN, ESHUTDOWN, ETIMEDOUT, ESTALE, EDQUOT.
        for code in [5, 11, 12, 16, 23, 24, 28, 37, 107, 108, 110, 116, 122] {
            assert_eq!(failure(io::Error::from_raw_os_error(code)).exit_code(), 75, "{code}");
        }
        // EPERM, ENOENT, EACCES, ENOTDIR, EISDIR, EINVAL, EFBIG, EROFS, ENAMETOOLONG.
        for code in [1, 2, 13, 20, 21, 22, 27, 30, 36] {
            assert_eq!(failure(io::Error::from_raw_os_error(code)).exit_code(), 1, "{code}");
        }
    }

    #[test]
    fn another_try_is_told_with_its_command() {
        let text = failure(ErrorKind::StorageFull.into()).to_string();
        assert!(text.starts_with("out/a.png: cannot write: ") && text.contains("; go on with: "), "{text}");
    }
}
