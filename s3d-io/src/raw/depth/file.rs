//! The numbers of one depth picture: a PNG, PGM, EXR or NPY file, or a part of a recording.

use crate::camera::{RecordedFrame, Recording, read_picture_size};
use crate::error::{Error, Result};
use crate::fs::{open_file, read_file};
use crate::image::read_gray16;
use crate::raw::depth::pgm;
use s3d_geom::Raster;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A depth picture on the disk, and what its numbers mean.
#[derive(Clone, Debug)]
pub(super) struct DepthFile {
    pub(super) place: DepthPlace,
    /// Metres of the world a step.
    pub(super) unit_m: f64,
    /// A number that stands for no depth, beside 0.
    pub(super) missing: Option<u16>,
}

/// Where a depth picture is.
#[derive(Clone, Debug)]
pub(super) enum DepthPlace {
    File(PathBuf),
    /// A frame of a recording.
    Frame(Arc<Recording>, usize),
}

/// The kinds of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Png,
    Pgm,
    Exr,
    Npy,
}

impl DepthPlace {
    /// Returns the file.
    pub(super) fn path(&self) -> &Path {
        match self {
            Self::File(path) => path,
            Self::Frame(recording, _) => &recording.path,
        }
    }

    /// Returns the width and height in pixels, from the file's first bytes.
    pub(super) fn size(&self) -> Result<[u32; 2]> {
        let path = match self {
            Self::File(path) => path,
            Self::Frame(recording, _) => return Ok(recording.depth.0),
        };
        let start = start_of(path)?;
        match kind_of(&start, path)? {
            Kind::Png => read_picture_size(path).map(|(width, height)| [width, height]),
            Kind::Pgm => pgm::header(&start, path).map(|header| header.size),
            Kind::Exr => exr_size(path),
            Kind::Npy => npy_size(path),
        }
    }

    fn frame(&self) -> Option<(&Recording, &RecordedFrame)> {
        match self {
            Self::Frame(recording, number) => Some((recording, recording.frames.get(*number)?)),
            Self::File(_) => None,
        }
    }

    /// Reads the numbers of a file of whole numbers.
    fn integers(&self) -> Result<Option<Raster<u16>>> {
        if let Some((recording, frame)) = self.frame() {
            return recording.read_depth(frame).map(Some);
        }
        let path = self.path();
        match kind_of(&start_of(path)?, path)? {
            Kind::Png => read_gray16(path).map(Some),
            Kind::Pgm => pgm::decode(&read_file(path)?, path).map(Some),
            Kind::Exr | Kind::Npy => Ok(None),
        }
    }

    /// Reads the numbers of a file of floats.
    fn floats(&self) -> Result<Raster<f32>> {
        let path = self.path();
        match kind_of(&start_of(path)?, path)? {
            Kind::Exr => read_exr(path),
            _ => read_npy(path),
        }
    }
}

impl DepthFile {
    pub(super) fn path(&self) -> &Path {
        self.place.path()
    }

    /// Reads the depths: metres, NaN where there is none.
    pub(super) fn read(&self) -> Result<Raster<f32>> {
        let numbers = match self.place.integers()? {
            Some(numbers) => numbers.map(|number| match Some(number) == self.missing {
                true => 0.0,
                false => f32::from(number),
            }),
            None => self.place.floats()?,
        };
        let unit_m = self.unit_m;
        // A number may be too small or too large for metres of 32 bits.
        Ok(numbers.map(|number| match (f64::from(number) * unit_m) as f32 {
            metres if metres > 0.0 && metres.is_finite() => metres,
            _ => f32::NAN,
        }))
    }
}

/// Returns the first bytes of a file.
fn start_of(path: &Path) -> Result<Vec<u8>> {
    let mut start = Vec::new();
    open_file(path)?
        .take(pgm::LONGEST_HEADER as u64)
        .read_to_end(&mut start)
        .map_err(|e| Error::io(path, "read", e))?;
    Ok(start)
}

/// Returns the kind of a file, by its first bytes.
fn kind_of(start: &[u8], path: &Path) -> Result<Kind> {
    let kinds = [(&b"\x89PNG"[..], Kind::Png), (b"\x76\x2f\x31\x01", Kind::Exr), (b"\x93NUMPY", Kind::Npy)];
    if let Some((_, kind)) = kinds.iter().find(|(magic, _)| start.starts_with(magic)) {
        return Ok(*kind);
    }
    if pgm::is_pgm(start) {
        return Ok(Kind::Pgm);
    }

    let message = match start {
        [] => "is empty: copy the recording again",
        [0xff, 0xd8, ..] => {
            "is a JPEG, which cannot hold depth: PNG of 16 bits, PGM, OpenEXR and NPY are read"
        }
        _ => "is no depth picture that is read: PNG of 16 bits, PGM, OpenEXR and NPY are",
    };
    Err(Error::unsupported(path, message))
}

#[cfg(feature = "exr")]
fn read_exr(path: &Path) -> Result<Raster<f32>> {
    crate::raw::depth::exr::read(path)
}

#[cfg(feature = "exr")]
fn exr_size(path: &Path) -> Result<[u32; 2]> {
    crate::raw::depth::exr::size(path)
}

#[cfg(not(feature = "exr"))]
fn read_exr(path: &Path) -> Result<Raster<f32>> {
    Err(Error::not_built_in(path, "exr"))
}

#[cfg(not(feature = "exr"))]
fn exr_size(path: &Path) -> Result<[u32; 2]> {
    Err(Error::not_built_in(path, "exr"))
}

/// Reads an array of rows and columns.
#[cfg(feature = "npy")]
fn read_npy(path: &Path) -> Result<Raster<f32>> {
    let mut array = crate::cloud::NpyArray::open(path)?;
    let [width, height] = sides_of(&array, path)?;
    let mut numbers = Vec::new();
    let mut values: Vec<f32> = Vec::new();
    while array.read_floats(&mut numbers)? > 0 {
        values.extend(numbers.drain(..).map(|number| number as f32));
    }
    Ok(Raster::from_vec(width, height, values))
}

#[cfg(feature = "npy")]
fn npy_size(path: &Path) -> Result<[u32; 2]> {
    sides_of(&crate::cloud::NpyArray::open(path)?, path)
}

/// Returns the width and height of an array of rows and columns. A side of 1 before or after them does not
/// count.
#[cfg(feature = "npy")]
fn sides_of<R: Read>(array: &crate::cloud::NpyArray<R>, path: &Path) -> Result<[u32; 2]> {
    let sides: Vec<u64> = array.shape().iter().copied().filter(|side| *side != 1).collect();
    let (&[height, width], false) = (sides.as_slice(), array.is_column_major()) else {
        let message = format!(
            "has the shape {:?}: a depth picture is an array of rows and columns, in C's order",
            array.shape()
        );
        return Err(Error::format(path, message));
    };
    let are_sides = [width, height].iter().all(|side| *side <= 65_535);
    if !are_sides {
        return Err(Error::format(path, format!("claims {width} × {height} pixels")));
    }

    Ok([width as u32, height as u32])
}

#[cfg(not(feature = "npy"))]
fn read_npy(path: &Path) -> Result<Raster<f32>> {
    Err(Error::not_built_in(path, "npy"))
}

#[cfg(not(feature = "npy"))]
fn npy_size(path: &Path) -> Result<[u32; 2]> {
    Err(Error::not_built_in(path, "npy"))
}
