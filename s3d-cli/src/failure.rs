//! Why a command did not do what it was called for, and the exit code that says so.

use crate::flags::Flags;
use crate::hint::resume_hint;
use crate::stop;
use s3d_dataset::Error;
use std::fmt;

/// The result of a command.
pub(crate) type Outcome<T> = Result<T, Failure>;

/// The exit code of a failure that may be none the next time: `EX_TEMPFAIL` of BSD's sysexits.h.
pub(crate) const TRY_AGAIN: u8 = 75;

/// Why a command failed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The call did not succeed.
    Call(Error),
    /// The call cannot be, whatever the files hold. The text names options as on the command line.
    Usage(String),
    /// The input does not fit together.
    Input(String),
    /// The call succeeded, and its answer is a failure: faults were found.
    Answer(String),
}

impl<E: Into<Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Call(error.into())
    }
}

impl Failure {
    /// The exit code: 1 for the input or the disk, 2 for the call, 75 for what may go better the next time.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Call(e) if e.is_temporary() => TRY_AGAIN,
            Self::Call(Error::Usage(_)) | Self::Usage(_) => 2,
            Self::Call(_) | Self::Input(_) | Self::Answer(_) => 1,
        }
    }
}

impl fmt::Display for Failure {
    /// Options are named as flags. What may be tried again ends with the command that does.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Call(Error::Cancelled) => {
                write!(f, "stopped by {}; {}", stop::signal_name(), resume_hint())
            }
            Self::Call(e) if e.is_temporary() => write!(f, "{e}; {}", resume_hint()),
            Self::Call(e) => f.write_str(&e.message(&Flags)),
            Self::Usage(text) | Self::Input(text) | Self::Answer(text) => f.write_str(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_dataset::error::{InputError, UsageError};

    #[test]
    fn options_are_named_as_flags() {
        let exists = UsageError::Exists { path: "a.ply".into(), note: None };
        let text = Failure::from(exists).to_string();
        assert_eq!(text, "a.ply is there already: replace it with --overwrite");
    }

    #[test]
    fn another_try_is_told_with_its_command() {
        let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
        let failure = Failure::from(s3d_io::Error::io("out/a.png".as_ref(), "write", full));
        let text = failure.to_string();
        assert!(text.starts_with("out/a.png: cannot write: ") && text.contains("; go on with: "), "{text}");
        assert_eq!(failure.exit_code(), 75);
    }

    fn code(error: Error) -> u8 {
        Failure::from(error).exit_code()
    }

    #[test]
    fn exit_codes_tell_whose_fault_it_is() {
        let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
        assert_eq!(code(UsageError::NoShards.into()), 2);
        assert_eq!(code(InputError::Labels { why: "b".into() }.into()), 1);
        assert_eq!(code(s3d_io::Error::io("out".as_ref(), "write", full).into()), 75);
        assert_eq!(code(Error::Cancelled), 75);
        assert_eq!(Failure::Usage("a".into()).exit_code(), 2);
        assert_eq!(Failure::Input("b".into()).exit_code(), 1);
        assert_eq!(Failure::Answer("2 faults".into()).exit_code(), 1);
    }
}
