//! Reads truth and predictions from files.

use crate::images::panorama::PANORAMA;
use s3d_dataset::{DataSet, Result};
use s3d_geom::Raster;
use s3d_io::Error as FileError;
use s3d_io::cloud::{NpyArray, NpzArchive};
use s3d_io::dataset::{DatasetImage, Domain};
use s3d_io::image::{decode_gray16, decode_rgb8};
use std::io::Read;
use std::path::Path;

/// Reads an 8-bit image of the data set.
pub(super) fn rgb8(data: &DataSet, image: &DatasetImage, domain: Domain) -> Result<Raster<[u8; 3]>> {
    let path = image.path(data.layout(), domain);
    Ok(decode_rgb8(&data.read(&path)?, &path)?)
}

/// Reads a 16-bit image of the data set.
pub(super) fn gray16(data: &DataSet, image: &DatasetImage, domain: Domain) -> Result<Raster<u16>> {
    let path = image.path(data.layout(), domain);
    Ok(decode_gray16(&data.read(&path)?, &path)?)
}

/// Whether a file is an image rather than an array.
pub(super) fn is_png(file: &Path) -> bool {
    file.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
}

/// Refuses a prediction whose width and height are not among `sizes`.
pub(super) fn check_size(file: &Path, found: [u32; 2], sizes: &[[u32; 2]]) -> Result<()> {
    if sizes.contains(&found) {
        return Ok(());
    }
    let due: Vec<String> = sizes
        .iter()
        .map(|[width, height]| format!("{width} × {height}"))
        .collect();
    let message = format!("is {} × {} pixels, and should be {}", found[0], found[1], due.join(" or "));
    Err(FileError::format(file, message).into())
}

/// Reads the width, the height and the floats of an NPY or NPZ file, row by row, with `channels` floats a
/// pixel. The size must be one of `sizes`.
pub(super) fn floats(file: &Path, sizes: &[[u32; 2]], channels: u64) -> Result<([u32; 2], Vec<f64>)> {
    if file
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("npy"))
    {
        return floats_of(NpyArray::open(file)?, file, sizes, channels);
    }
    let mut archive = NpzArchive::open(file)?;
    match archive.names() {
        [name] => floats_of(archive.array(&name.clone())?, file, sizes, channels),
        names => {
            let message = format!("holds {} arrays: save one, the prediction", names.len());
            Err(FileError::format(file, message).into())
        }
    }
}

fn floats_of<R: Read>(
    mut array: NpyArray<R>,
    file: &Path,
    sizes: &[[u32; 2]],
    channels: u64,
) -> Result<([u32; 2], Vec<f64>)> {
    let wrong = |message: String| Err(FileError::format(file, message).into());
    // A batch of one image or a single channel is a side of 1.
    let shape: Vec<u64> = array.shape().iter().copied().filter(|side| *side != 1).collect();
    let (of_pixel, form) = if channels == 1 {
        (&[][..], "H × W")
    } else {
        (&[channels][..], "H × W × 3")
    };
    let [height, width] = match shape.split_at_checked(2) {
        Some((&[height, width], rest)) if rest == of_pixel => [height, width],
        _ => return wrong(format!("is an array of the shape {:?}: save one of {form}", array.shape())),
    };
    let size = [side(width), side(height)];
    check_size(file, size, sizes)?;

    if !array.is_float() {
        return wrong("holds whole numbers: save floats, or a PNG in the data set's encoding".to_owned());
    }
    if array.is_column_major() {
        return wrong("is stored column by column: save numpy.ascontiguousarray(array)".to_owned());
    }

    let mut values = Vec::with_capacity(size[0] as usize * size[1] as usize * channels as usize);
    while array.read_floats(&mut values)? > 0 {}
    Ok((size, values))
}

fn side(n: u64) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// The pixels of a panorama that are evaluated at 1024 × 512.
pub(super) struct Places {
    whole: [u32; 2],
    columns: Vec<u32>,
    rows: Vec<u32>,
}

impl Places {
    /// Selects the pixels of a panorama of the size `whole` by a rule for each axis.
    pub(super) fn new(whole: [u32; 2], nearest: fn(u32, u32) -> Vec<u32>) -> Self {
        let [columns, rows] = [0, 1].map(|axis| nearest(whole[axis], PANORAMA[axis]));
        Self { whole, columns, rows }
    }

    /// Returns the sizes that predictions may have.
    pub(super) fn sizes(&self) -> [[u32; 2]; 2] {
        [PANORAMA, self.whole]
    }

    /// Returns the evaluated pixels of an image, which has the size of the panorama.
    pub(super) fn sample<T: Copy>(&self, pixels: &[T]) -> Vec<T> {
        let of_row = |row: &u32| &pixels[*row as usize * self.whole[0] as usize..];
        self.rows
            .iter()
            .flat_map(|row| self.columns.iter().map(move |at| of_row(row)[*at as usize]))
            .collect()
    }

    /// Returns the evaluated pixels of a prediction, which has one of [`sizes`](Self::sizes).
    pub(super) fn sample_prediction<T: Copy>(&self, size: [u32; 2], pixels: Vec<T>) -> Vec<T> {
        if size == PANORAMA { pixels } else { self.sample(&pixels) }
    }

    /// Returns the column and the row of evaluated pixel `at` in a prediction of this size.
    pub(super) fn place(&self, size: [u32; 2], at: usize) -> [u32; 2] {
        let [x, y] = [at % PANORAMA[0] as usize, at / PANORAMA[0] as usize];
        if size == PANORAMA {
            [x as u32, y as u32]
        } else {
            [self.columns[x], self.rows[y]]
        }
    }
}
