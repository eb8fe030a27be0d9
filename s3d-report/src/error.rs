//! Why a report was not made.

use crate::options::{DPI, MESH_FACES, PANO_WIDTHS, ReportOptions, THUMB_WIDTHS};
use std::path::PathBuf;
use thiserror::Error as ThisError;

/// The result of the calls of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why a report was not made. Nothing that was there before is lost.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// A number of the options is out of range.
    #[error(
        "panoramas of {} and views of {} pixels across, meshes of {} faces: {} to {}, {} to {}, and {} to {} \
         are possible",
        .0.pano_width, .0.thumbs, .0.mesh_faces, PANO_WIDTHS.start(), PANO_WIDTHS.end(), THUMB_WIDTHS.start(),
        THUMB_WIDTHS.end(), MESH_FACES.start(), MESH_FACES.end()
    )]
    OutOfRange(ReportOptions),
    /// Figures have no such number of pixels an inch.
    #[error("{} pixels an inch: {} to {} are possible", .0, DPI.start(), DPI.end())]
    Resolution(u32),
    /// There is a file in the place of the report that is no report.
    #[error("{} is there already, and was not written by s3d report: choose another name", .0.display())]
    Occupied(PathBuf),
    /// A result of `s3d eval` is of another data set, or of another state of this one.
    #[error("{}: these scores are of another data set: its list of files differs", .0.display())]
    OtherDataSet(PathBuf),
    /// A poster shows a mesh, and the data set has none.
    #[error(
        "{}: there is no mesh to make a poster of{}",
        .root.display(), if *.is_finished { "" } else { " yet: the export did not finish" }
    )]
    NoMesh {
        /// The folder of the data set.
        root: PathBuf,
        /// Whether the export finished.
        is_finished: bool,
    },
    /// The data set has nothing that figures show.
    #[error("{}: there is no image and no mesh to draw figures of", .0.display())]
    NoFigure(PathBuf),
    /// The place of the poster lies in the report, which is written as a whole.
    #[error("{}: the poster lies in the report's own place: choose another one", .0.display())]
    PosterInReport(PathBuf),
    /// The report is too large for a single file.
    #[error(
        "one file of more than {} MB would open slowly or not at all: make a folder, or smaller images",
        .0 / 1_000_000
    )]
    TooLarge(u64),
    /// A file is wrong or missing, the disk refuses, the place is in use, or the call was cancelled.
    #[error(transparent)]
    Dataset(#[from] s3d_dataset::Error),
}

impl From<s3d_io::Error> for Error {
    fn from(error: s3d_io::Error) -> Self {
        Self::Dataset(error.into())
    }
}
