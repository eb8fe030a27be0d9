//! Where the bytes of a picture are: a file of its own, or a part of a larger one.

use crate::camera::picture::{check_encoded, check_picture, decode_picture, read_picture, turn_of};
use crate::error::{Error, Result};
use crate::fs::open::open_file;
use s3d_geom::Raster;
use std::fmt;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A picture that a list of cameras names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureFile {
    /// The file that holds the picture.
    pub path: PathBuf,
    /// The bytes of the file that are the picture. `None`: all of them.
    pub part: Option<Range<u64>>,
}

impl From<PathBuf> for PictureFile {
    /// Returns the picture that is a whole file.
    fn from(path: PathBuf) -> Self {
        Self { path, part: None }
    }
}

impl fmt::Display for PictureFile {
    /// Writes the path, and the place in the file if the picture is a part of it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.part {
            None => write!(f, "{}", self.path.display()),
            Some(part) => write!(f, "{}, byte {}", self.path.display(), part.start),
        }
    }
}

impl PictureFile {
    /// Reads the picture as 8-bit R G B.
    ///
    /// # Errors
    /// Like [`read_picture`].
    pub fn read(&self) -> Result<Raster<[u8; 3]>> {
        match self.encoded()? {
            None => read_picture(&self.path),
            Some(bytes) => decode_picture(bytes, &self.name()),
        }
    }

    /// Returns the width and height of the picture in pixels, like [`check_picture`].
    ///
    /// # Errors
    /// Like [`check_picture`].
    pub fn check(&self) -> Result<(u32, u32)> {
        match self.encoded()? {
            None => check_picture(&self.path),
            Some(bytes) => check_encoded(&mut Cursor::new(bytes), &self.name()),
        }
    }

    /// Returns how the picture asks to be turned, like
    /// [`read_picture_turn`](crate::camera::read_picture_turn).
    ///
    /// # Errors
    /// Like [`read_picture`].
    pub fn turn(&self) -> Result<u8> {
        match self.encoded()? {
            None => crate::camera::picture::read_picture_turn(&self.path),
            Some(bytes) => turn_of(Cursor::new(bytes), &self.name()),
        }
    }

    /// Returns the bytes of a picture that is a part of its file.
    fn encoded(&self) -> Result<Option<Vec<u8>>> {
        let Some(part) = &self.part else { return Ok(None) };
        read_part(&self.path, part).map(Some)
    }

    /// Returns the name of the picture in messages.
    fn name(&self) -> PathBuf {
        self.to_string().into()
    }
}

/// Reads these bytes of a file.
pub(crate) fn read_part(path: &Path, part: &Range<u64>) -> Result<Vec<u8>> {
    let failed = |e| Error::io(path, "read", e);
    let mut file = open_file(path)?;
    let length = file.metadata().map_err(failed)?.len();
    if part.start > part.end || part.end > length {
        let message = format!("has {length} bytes, and a part of it ends at {}: it is cut short", part.end);
        return Err(Error::format(path, message));
    }

    file.seek(SeekFrom::Start(part.start)).map_err(failed)?;
    let mut bytes = Vec::new();
    file.take(part.end - part.start)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    Ok(bytes)
}
