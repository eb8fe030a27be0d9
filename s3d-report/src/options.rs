//! How a report is made.

use crate::pixels::Widths;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// The pixels of an inch of a figure that are possible.
pub(crate) const DPI: RangeInclusive<u32> = 30..=1200;
/// The widths that panoramas may have, in pixels.
pub(crate) const PANO_WIDTHS: RangeInclusive<u32> = 16..=16_384;
/// The width of the sharpest colours of panoramas: all graphics cards have textures so wide.
const SHARP_WIDTH: u32 = 4096;
/// The widths that views may have, in pixels.
pub(crate) const THUMB_WIDTHS: RangeInclusive<u32> = 16..=2048;
/// The numbers of faces that a mesh may have.
pub(crate) const MESH_FACES: RangeInclusive<u32> = 1000..=10_000_000;

/// The options of a report.
///
/// This is the one place that says an option. With the feature `clap` it is a group of arguments of a command
/// line: comments of fields are help texts.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct ReportOptions {
    /// Width of panoramas in the report, in pixels. Smaller panoramas keep their width. Their colours are
    /// twice as wide, up to 4096 pixels, where that shows more.
    #[cfg_attr(feature = "clap", arg(long, value_name = "PIXELS", default_value_t = 2048,
        value_parser = clap::value_parser!(u32).range(16..=16_384)))]
    pub pano_width: u32,
    /// Width of views in the report, in pixels. The colours of a large view are twice as wide.
    #[cfg_attr(feature = "clap", arg(long, value_name = "PIXELS", default_value_t = 256,
        value_parser = clap::value_parser!(u32).range(16..=2048)))]
    pub thumbs: u32,
    /// The most faces of the mesh of an area in the report. A larger mesh is simplified.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FACES", default_value_t = 300_000,
        value_parser = clap::value_parser!(u32).range(1000..=10_000_000)))]
    pub mesh_faces: u32,
    /// Verify every pixel of the data set as well, and show the result.
    #[cfg_attr(feature = "clap", arg(long))]
    pub verify: bool,
    /// Write one file, to send or publish, instead of a folder. For small data sets.
    #[cfg_attr(feature = "clap", arg(long))]
    pub single: bool,
    /// Show the scores in a file that `s3d eval --json` wrote. May be given several times.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SCORES.json"))]
    pub scores: Vec<PathBuf>,
    /// Also draw the building from above, half in colours and half in classes: a PNG of 1600 × 1000 pixels,
    /// which appears together with the report.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE.png"))]
    pub poster: Option<PathBuf>,
    /// Replace an earlier report, and an earlier poster.
    #[cfg_attr(feature = "clap", arg(long))]
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
