//! Reads truth and predictions from files.

use crate::images::PANORAMA;
use s3d_dataset::{DataSet, Result};
use s3d_geom::Raster;
use s3d_io::Error as FileError;
use s3d_io::cloud::{NpyArray, NpzArchive};
use s3d_io::dataset::{DatasetImage, Domain};
use s3d_io::image::{decode_gray16, decode_rgb8};
use std::fmt;
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

/// What the array of a prediction holds.
#[derive(Clone, Copy)]
pub(super) enum Holds {
    /// So many floats a pixel.
    Floats(usize),
    /// One number a pixel, whole or not.
    Numbers,
    /// The number of a class, or a float for each of so many classes, of which the largest counts.
    Classes(usize),
}

impl Holds {
    /// Returns how many numbers a pixel has in an array of floats, or of whole numbers; `None` if there may
    /// be no such array.
    fn channels(self, is_float: bool) -> Option<usize> {
        match self {
            Self::Floats(channels) => is_float.then_some(channels),
            Self::Numbers => Some(1),
            Self::Classes(count) => Some(if is_float { count } else { 1 }),
        }
    }
}

impl fmt::Display for Holds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Floats(1) | Self::Numbers => f.write_str("H × W"),
            Self::Floats(n) => write!(f, "H × W × {n} or {n} × H × W"),
            Self::Classes(n) => {
                write!(f, "H × W whole numbers, or of H × W × {n} or {n} × H × W floats")
            }
        }
    }
}

/// Reads the width, the height and the numbers of an NPY file, or of the only array of an NPZ file: row by
/// row, the numbers of a pixel together. Of floats for classes it returns the number of the largest, the
/// first of equal ones, or NaN if one of them is NaN. The size must be one of `sizes`.
pub(super) fn array(file: &Path, sizes: &[[u32; 2]], holds: Holds) -> Result<([u32; 2], Vec<f64>)> {
    if file
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("npy"))
    {
        return numbers_of(NpyArray::open(file)?, file, sizes, holds);
    }
    let mut archive = NpzArchive::open(file)?;
    match archive.names() {
        [name] => numbers_of(archive.array(&name.clone())?, file, sizes, holds),
        names => {
            let message = format!("holds {} arrays: save one, the prediction", names.len());
            Err(FileError::format(file, message).into())
        }
    }
}

fn numbers_of<R: Read>(
    mut array: NpyArray<R>,
    file: &Path,
    sizes: &[[u32; 2]],
    holds: Holds,
) -> Result<([u32; 2], Vec<f64>)> {
    let wrong = |message: String| Err(FileError::format(file, message).into());
    let Some(channels) = holds.channels(array.is_float()) else {
        return wrong("holds whole numbers: save floats, or a PNG in the data set's encoding".to_owned());
    };
    let Some((size, axes)) = axes(&array, channels, sizes) else {
        return wrong(format!("is an array of the shape {:?}: save one of {holds}", array.shape()));
    };
    check_size(file, size, sizes)?;

    let pixels = size[0] as usize * size[1] as usize;
    let are_scores = array.is_float() && matches!(holds, Holds::Classes(_));
    // Most arrays have the order of the result.
    if !are_scores && axes[0].pixels == size[0] as usize && axes[2].channels == 1 {
        let mut values = Vec::with_capacity(pixels * channels);
        while array.read_floats(&mut values)? > 0 {}
        return Ok((size, values));
    }

    let mut values = vec![0.0; pixels * if are_scores { 1 } else { channels }];
    let mut best = vec![f64::NEG_INFINITY; if are_scores { pixels } else { 0 }];

    let mut places = places(axes);
    let mut block = Vec::new();
    while array.read_floats(&mut block)? > 0 {
        for (value, (pixel, channel)) in block.drain(..).zip(places.by_ref()) {
            if !are_scores {
                values[pixel * channels + channel] = value;
            } else if value > best[pixel] || value.is_nan() {
                best[pixel] = value;
                values[pixel] = if value.is_nan() { value } else { channel as f64 };
            }
        }
    }
    Ok((size, values))
}

/// An axis of an array: its length, and how far a step along it leads in the pixels of an image, row by row,
/// and in the numbers of a pixel.
#[derive(Clone, Copy)]
struct Axis {
    length: usize,
    pixels: usize,
    channels: usize,
}

/// Returns the size of the image in an array, and the axes in the order of the file, the slowest first.
/// `None` if the array is no image with so many channels. Channels are last, unless only as the first they
/// leave one of `sizes`.
fn axes<R: Read>(array: &NpyArray<R>, channels: usize, sizes: &[[u32; 2]]) -> Option<([u32; 2], [Axis; 3])> {
    // A batch of one image or a single channel is a side of 1.
    let sides: Vec<u64> = array.shape().iter().copied().filter(|side| *side != 1).collect();
    let [last, first] = match sides[..] {
        [height, width] if channels == 1 => [Some([width, height]), None],
        [a, b, c] => {
            let are = |n: u64| n == channels as u64;
            [are(c).then_some([b, a]), are(a).then_some([c, b])]
        }
        _ => [None; 2],
    };
    let [last, first] = [last, first].map(|size| size.map(|size| size.map(side)));
    let (are_last, size) = match [last, first] {
        [Some(size), _] if sizes.contains(&size) => (true, size),
        [_, Some(size)] if sizes.contains(&size) => (false, size),
        [Some(size), _] => (true, size),
        [None, Some(size)] => (false, size),
        [None, None] => return None,
    };

    let y = Axis { length: size[1] as usize, pixels: size[0] as usize, channels: 0 };
    let x = Axis { length: size[0] as usize, pixels: 1, channels: 0 };
    let channel = Axis { length: channels, pixels: 0, channels: 1 };
    let mut axes = if are_last { [y, x, channel] } else { [channel, y, x] };
    if array.is_column_major() {
        axes.reverse();
    }
    Some((size, axes))
}

/// Returns the pixel and the channel of each number of an array, given its axes, the slowest first.
fn places([slow, middle, fast]: [Axis; 3]) -> impl Iterator<Item = (usize, usize)> {
    let along = |axis: Axis, pixel: usize, channel: usize| {
        (0..axis.length).map(move |at| (pixel + at * axis.pixels, channel + at * axis.channels))
    };
    along(slow, 0, 0)
        .flat_map(move |(pixel, channel)| along(middle, pixel, channel))
        .flat_map(move |(pixel, channel)| along(fast, pixel, channel))
}

fn side(n: u64) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// The pixels of an image that are evaluated.
pub(super) struct Places {
    whole: [u32; 2],
    evaluated: [u32; 2],
    columns: Vec<u32>,
    rows: Vec<u32>,
}

impl Places {
    /// Selects the pixels of a panorama of the size `whole` at 1024 × 512, by a rule for each axis.
    pub(super) fn new(whole: [u32; 2], nearest: fn(u32, u32) -> Vec<u32>) -> Self {
        let [columns, rows] = [0, 1].map(|axis| nearest(whole[axis], PANORAMA[axis]));
        Self { whole, evaluated: PANORAMA, columns, rows }
    }

    /// Selects all pixels of an image.
    pub(super) fn all(whole: [u32; 2]) -> Self {
        let [columns, rows] = whole.map(|length| (0..length).collect());
        Self { whole, evaluated: whole, columns, rows }
    }

    /// Returns the sizes that predictions may have: the size of the evaluation first, then the image's.
    pub(super) fn sizes(&self) -> Vec<[u32; 2]> {
        let mut sizes = vec![self.evaluated, self.whole];
        sizes.dedup();
        sizes
    }

    /// Returns the width and the height of the evaluated pixels.
    pub(super) fn evaluated(&self) -> [u32; 2] {
        self.evaluated
    }

    /// Returns the evaluated pixels of an image, which has the size of the truth.
    pub(super) fn sample<T: Copy>(&self, pixels: &[T]) -> Vec<T> {
        let of_row = |row: &u32| &pixels[*row as usize * self.whole[0] as usize..];
        self.rows
            .iter()
            .flat_map(|row| self.columns.iter().map(move |at| of_row(row)[*at as usize]))
            .collect()
    }

    /// Returns the evaluated pixels of a prediction, which has one of [`sizes`](Self::sizes).
    pub(super) fn sample_prediction<T: Copy>(&self, size: [u32; 2], pixels: Vec<T>) -> Vec<T> {
        if size == self.evaluated {
            pixels
        } else {
            self.sample(&pixels)
        }
    }

    /// Returns the column and the row of evaluated pixel `at` in a prediction of this size.
    pub(super) fn place(&self, size: [u32; 2], at: usize) -> [u32; 2] {
        let width = self.evaluated[0] as usize;
        let [x, y] = [at % width, at / width];
        if size == self.evaluated {
            [x as u32, y as u32]
        } else {
            [self.columns[x], self.rows[y]]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_last_where_both_ways_fit() {
        let order = |shape: &str, size: [u32; 2]| {
            let text = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': {shape}, }}\n");
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            bytes.extend(u16::try_from(text.len()).unwrap().to_le_bytes());
            bytes.extend(text.as_bytes());
            let array = NpyArray::new(&bytes[..], Path::new("a.npy")).unwrap();
            let (found, axes) = axes(&array, 3, &[size])?;
            assert_eq!(axes.map(|axis| axis.length as u64), array.shape());
            Some((found, axes[2].channels == 1))
        };
        assert_eq!(order("(3, 3, 3)", [3, 3]), Some(([3, 3], true)));
        assert_eq!(order("(3, 5, 3)", [5, 3]), Some(([5, 3], true)));
        assert_eq!(order("(3, 5, 3)", [3, 5]), Some(([3, 5], false)));
        assert_eq!(order("(3, 5, 3)", [9, 9]), Some(([5, 3], true)));
        assert_eq!(order("(3, 5, 4)", [9, 9]), Some(([4, 5], false)));
        assert_eq!(order("(5, 4, 2)", [4, 5]), None);
    }
}
