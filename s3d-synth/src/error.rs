//! What can go wrong.

use thiserror::Error;

/// Why a scan was not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ScanError {
    /// A file or folder cannot be written.
    #[error(transparent)]
    File(#[from] s3d_io::Error),
    /// The caller did not want to go on.
    #[error("cancelled")]
    Cancelled,
}
