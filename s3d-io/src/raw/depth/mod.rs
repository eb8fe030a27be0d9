//! Depth pictures with poses: what scanners and phones record before a mesh is made of it.
//!
//! [`DepthPictures`] lists the pictures of a folder or recording; each [`DepthPicture`] is read when it is
//! asked for. The forms of the programs are in `forms`, a file each.

mod colors;
mod confidence;
#[cfg(feature = "exr")]
mod exr;
mod file;
mod forms;
mod list;
mod pgm;
mod units;

#[cfg(test)]
mod tests;

use crate::camera::{PictureFile, PosedCamera};
use crate::error::{Error, Result};
use crate::raw::form::RawForm;
pub use confidence::Confidence;
use file::DepthFile;
pub(super) use forms::find;
use s3d_geom::{PhotoLens, Pose, Raster};
use std::path::{Path, PathBuf};

/// The depth pictures of a scan.
#[derive(Clone, Debug)]
pub struct DepthPictures {
    /// What wrote them.
    pub form: RawForm,
    /// The pictures, in the order of the recording; at least one.
    pub pictures: Vec<DepthPicture>,
    /// The number of depth pictures that were left out, because no pose of theirs is known.
    pub untracked: usize,
    /// What is doubtful or was left out: a sentence each, for the user.
    pub warnings: Vec<String>,
    /// The files with poses and intrinsics that were read.
    pub files: Vec<PathBuf>,
}

/// A depth picture with the camera that took it. Its pixels stay in the file until they are read.
#[derive(Clone, Debug)]
pub struct DepthPicture {
    /// The name in the recording.
    pub name: String,
    /// The place and rotation of the depth camera, in the world (metres, +Z up).
    pub pose: Pose,
    /// The lens of the depth camera, for the size of the picture: its own intrinsics, or the colour camera's,
    /// scaled.
    pub lens: PhotoLens,
    /// The picture of how sure the sensor was, if there is one.
    pub confidence: Option<Confidence>,
    /// The colour picture that was taken at the same time, if there is one.
    pub color: Option<ColorPicture>,
    depth: DepthFile,
}

/// A colour picture that was taken together with a depth picture.
#[derive(Clone, Debug)]
pub struct ColorPicture {
    /// The picture.
    pub picture: PictureFile,
    /// The place and rotation of the colour camera, in the world (metres, +Z up).
    pub pose: Pose,
    /// How the colour camera maps directions to pixels, as the recording tells it.
    pub camera: PosedCamera,
}

impl DepthPicture {
    /// Reads the depths: metres along the optical axis in the world's scale, NaN where nothing was measured.
    /// The size is the lens's.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the picture is damaged, cut short, of another size than its lens,
    /// or no picture of depths; [`Error::Unsupported`] for a kind of file that is not read.
    pub fn read_depth(&self) -> Result<Raster<f32>> {
        let depth = self.depth.read()?;
        let found = [depth.width(), depth.height()];
        let told = self.lens.size();
        if found != told {
            let message = format!(
                "has {} × {} pixels, and its camera is for {} × {}",
                found[0], found[1], told[0], told[1]
            );
            return Err(Error::format(self.path(), message));
        }
        Ok(depth)
    }

    /// Reads how sure the sensor was of each pixel: 0 low, 1 medium, 2 high. `None`: there is no such
    /// picture.
    ///
    /// # Errors
    /// Like [`read_depth`](Self::read_depth).
    pub fn read_confidence(&self) -> Result<Option<Raster<u8>>> {
        self.confidence
            .as_ref()
            .map(|confidence| confidence.read(self.lens.size()))
            .transpose()
    }

    /// Returns the file that holds the depths.
    pub fn path(&self) -> &Path {
        self.depth.path()
    }

    /// Returns how many metres of the world a step of the file's numbers is.
    pub fn unit_m(&self) -> f64 {
        self.depth.unit_m
    }
}
