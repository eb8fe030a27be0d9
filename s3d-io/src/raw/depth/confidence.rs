//! Pictures of how sure a depth sensor was of each pixel.

use crate::error::{Error, Result};
use crate::image::read_numbers8;
use s3d_geom::Raster;
use std::path::{Path, PathBuf};

/// A picture of how sure the sensor was. Apple's phones have three levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Confidence {
    path: PathBuf,
    /// The least number of a pixel that is medium, and the least that is high.
    from: [u8; 2],
}

impl Confidence {
    /// Returns a picture with the numbers 0, 1 and 2, as ARKitScenes has them.
    pub(super) fn numbered(path: PathBuf) -> Self {
        Self { path, from: [1, 2] }
    }

    /// Returns a picture in which the levels are shades from black to white, as Polycam has them.
    pub(super) fn shaded(path: PathBuf) -> Self {
        Self { path, from: [43, 213] }
    }

    /// Returns the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the levels of a picture of this size: 0 low, 1 medium, 2 high.
    pub(super) fn read(&self, size: [u32; 2]) -> Result<Raster<u8>> {
        let numbers = read_numbers8(&self.path)?;
        let found = [numbers.width(), numbers.height()];
        if found != size {
            let message = format!(
                "has {} × {} pixels, and its depth picture {} × {}",
                found[0], found[1], size[0], size[1]
            );
            return Err(Error::format(&self.path, message));
        }
        let [medium, high] = self.from;
        Ok(numbers.map(|number| u8::from(number >= medium) + u8::from(number >= high)))
    }
}
