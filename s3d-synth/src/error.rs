//! Errors that are not about buildings alone.

use thiserror::Error;

/// A number is out of its range, or is no number.
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
    /// Returns an error about `what` unless `value` is from `min` to `max`.
    pub(crate) fn check(
        value: impl Into<f64>,
        [min, max]: [f64; 2],
        what: impl FnOnce() -> String,
    ) -> Result<(), Self> {
        let value = value.into();
        if (min.min(single(min))..=max.max(single(max))).contains(&value) {
            Ok(())
        } else {
            Err(Self { what: what(), value, min, max })
        }
    }
}

/// Rounds a bound to `f32`: a value of 1.8 may come as an `f32` a little below it.
fn single(bound: f64) -> f64 {
    f64::from(bound as f32)
}

/// Why a scan was not written.
#[cfg(feature = "files")]
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ScanError {
    /// A file or folder cannot be written.
    #[error(transparent)]
    File(#[from] s3d_io::Error),
    /// A number of the options is out of its range, or is no number.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// Another scan is in the folder.
    #[error("{} is there and differs from the scan", .0.display())]
    Differs(std::path::PathBuf),
    /// The caller did not want to go on.
    #[error("cancelled")]
    Cancelled,
}
