//! How a report is made.

use crate::pixels::Widths;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// The widths that panoramas may have, in pixels.
pub(crate) const PANO_WIDTHS: RangeInclusive<u32> = 16..=16_384;
/// The width of the sharpest colours of panoramas: all graphics cards have textures so wide.
const SHARP_WIDTH: u32 = 4096;
/// The widths that views may have, in pixels.
pub(crate) const THUMB_WIDTHS: RangeInclusive<u32> = 16..=2048;
/// The numbers of faces that a mesh may have.
pub(crate) const MESH_FACES: RangeInclusive<u32> = 1000..=10_000_000;

/// The options of a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportOptions {
    /// The width of panoramas in pixels. Smaller panoramas keep their width. The colours of a panorama also
    /// have a file twice as wide, up to 4096 pixels, where that shows more.
    pub pano_width: u32,
    /// The width of views in pixels. The colours of a large view are twice as wide.
    pub thumbs: u32,
    /// The most faces of the mesh of an area. A larger mesh is simplified.
    pub mesh_faces: u32,
    /// Whether to verify every pixel of the data set, and show the result.
    pub verify: bool,
    /// Whether to write a single file, which is easier to send or publish. For small data sets.
    pub single: bool,
    /// Results of predictions on the data set to show: files that `s3d eval --json` wrote.
    pub scores: Vec<PathBuf>,
    /// A file for the picture that [`poster`](crate::poster()) draws. It appears together with the report.
    pub poster: Option<PathBuf>,
    /// Whether to replace an earlier report, and an earlier poster.
    pub overwrite: bool,
}

impl Default for ReportOptions {
    fn default() -> Self {
        Self {
            pano_width: 2048,
            thumbs: 256,
            mesh_faces: 300_000,
            verify: false,
            single: false,
            scores: Vec::new(),
            poster: None,
            overwrite: false,
        }
    }
}

impl ReportOptions {
    /// Returns the widths of the images of panoramas.
    pub(crate) fn of_panoramas(&self) -> Widths {
        Widths {
            lossless: self.pano_width,
            rgb: self.pano_width,
            thumb: Some(2 * self.thumbs),
            sharp: Some((2 * self.pano_width).min(SHARP_WIDTH)),
        }
    }

    /// Returns the widths of the images of views.
    pub(crate) fn of_views(&self) -> Widths {
        Widths { lossless: self.thumbs, rgb: 2 * self.thumbs, thumb: Some(self.thumbs), sharp: None }
    }
}
