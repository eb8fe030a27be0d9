//! Pairs of images that see the same surface: `pairs.npz`.

use crate::cloud::npy::npz::{NpzReader, NpzWriter, bytes, numbers};
use crate::dataset::instances::{padded_units, text_of_units};
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use crate::fs::open::open_file;
use std::io;
use std::path::Path;

/// The arrays of `pairs.npz`: a sparse matrix of N images by N images in rows (CSR), with M pairs in both
/// directions.
///
/// Row i has what image i shows: its pairs are those from `start[i]` to `start[i + 1]`, sorted by the other
/// image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairColumns {
    /// The names of the images, N: `data/camera_UUID_ROOM_frame_J` of a view,
    /// `pano/camera_UUID_ROOM_frame_equirectangular` of a panorama.
    pub images: Vec<String>,
    /// The place of the first pair of each image, and at the end M: N + 1.
    pub start: Vec<u64>,
    /// The place of the other image, M.
    pub other: Vec<u32>,
    /// The share of image i's points that the other image sees, too, M.
    pub overlap: Vec<f32>,
    /// The median angle at those points between the directions to both cameras, degrees, M. NaN without such
    /// a point.
    pub angle_deg: Vec<f32>,
    /// The median size of a pixel there in image i by that in the other image, M. NaN without such a point.
    pub scale: Vec<f32>,
    /// The distance between both cameras, metres, M.
    pub distance_m: Vec<f32>,
    /// The angle of the rotation from one camera to the other, degrees, M.
    pub turn_deg: Vec<f32>,
}

impl PairColumns {
    fn values(&self) -> [(&'static str, &[f32]); 5] {
        [
            ("overlap", &self.overlap),
            ("angle_deg", &self.angle_deg),
            ("scale", &self.scale),
            ("distance_m", &self.distance_m),
            ("turn_deg", &self.turn_deg),
        ]
    }
}

/// Writes the archive, whole or not at all. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If the columns do not have the lengths that [`PairColumns`] tells of.
pub fn write_pairs(path: &Path, pairs: &PairColumns) -> Result<u64> {
    let count = pairs.other.len();
    assert!(pairs.start.len() == pairs.images.len() + 1, "a start for each image, and the end");
    assert!(pairs.values().iter().all(|(_, column)| column.len() == count), "columns of one length");
    let file = AtomicFile::create(path)?;
    write_archive(file, pairs)
        .map_err(|e| Error::io(path, "write", e))?
        .commit()
}

fn write_archive(file: AtomicFile, pairs: &PairColumns) -> io::Result<AtomicFile> {
    let mut archive = NpzWriter::new(file);
    let images = pairs.images.len() as u64;
    let count = pairs.other.len() as u64;
    let width = pairs
        .images
        .iter()
        .map(|name| name.chars().count())
        .max()
        .unwrap_or(0)
        .max(1);
    let names = pairs.images.iter().flat_map(|name| padded_units(name, width));
    archive.array("images", &format!("<U{width}"), &[images], bytes(names, u32::to_le_bytes))?;
    archive.array("start", "<u8", &[images + 1], bytes(pairs.start.iter().copied(), u64::to_le_bytes))?;
    archive.array("other", "<u4", &[count], bytes(pairs.other.iter().copied(), u32::to_le_bytes))?;
    for (name, column) in pairs.values() {
        archive.array(name, "<f4", &[count], bytes(column.iter().copied(), f32::to_le_bytes))?;
    }
    archive.finish()
}

/// Reads an archive that [`write_pairs`] wrote.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is not such an archive, is damaged, or its arrays do not fit each
/// other.
pub fn read_pairs(path: &Path) -> Result<PairColumns> {
    let mut archive = NpzReader::new(open_file(path)?, path)?;
    let start = archive.whole("start", |_| "<u8".to_owned(), |bytes| vec![bytes as u64 / 8])?;
    let start = numbers(&start, u64::from_le_bytes);
    let images = start.len().saturating_sub(1);
    let width = |bytes: usize| (bytes / 4).checked_div(images).unwrap_or(1).max(1);
    let names = archive.whole("images", |bytes| format!("<U{}", width(bytes)), |_| vec![images as u64])?;
    let units = numbers(&names, u32::from_le_bytes);

    let mut column =
        |array: &str, kind: &str| archive.whole(array, |_| kind.to_owned(), |bytes| vec![bytes as u64 / 4]);
    let other = numbers(&column("other", "<u4")?, u32::from_le_bytes);
    let mut values = |array: &str| Ok::<_, Error>(numbers(&column(array, "<f4")?, f32::from_le_bytes));
    let pairs = PairColumns {
        images: units.chunks_exact(width(names.len())).map(text_of_units).collect(),
        start,
        other,
        overlap: values("overlap")?,
        angle_deg: values("angle_deg")?,
        scale: values("scale")?,
        distance_m: values("distance_m")?,
        turn_deg: values("turn_deg")?,
    };

    let count = pairs.other.len();
    let are_rows = pairs.start.first() == Some(&0)
        && pairs.start.is_sorted()
        && pairs.start.last() == Some(&(count as u64))
        && pairs.images.len() == images
        && pairs.other.iter().all(|other| (*other as usize) < images)
        && pairs.values().iter().all(|(_, column)| column.len() == count);
    if !are_rows {
        return Err(Error::format(path, "its arrays do not fit each other"));
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_read_back_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pairs.npz");
        let pairs = PairColumns {
            images: vec!["data/a".into(), "pano/long".into(), "data/c".into()],
            start: vec![0, 1, 2, 2],
            other: vec![1, 0],
            overlap: vec![0.5, 0.25],
            angle_deg: vec![1.0, 2.0],
            scale: vec![2.0, 0.5],
            distance_m: vec![3.0, 3.0],
            turn_deg: vec![90.0, 90.0],
        };
        write_pairs(&path, &pairs).unwrap();
        assert_eq!(read_pairs(&path).unwrap(), pairs);

        let empty = PairColumns { start: vec![0], ..PairColumns::default() };
        write_pairs(&path, &empty).unwrap();
        assert_eq!(read_pairs(&path).unwrap(), empty);

        for wrong in [
            PairColumns { other: vec![1, 3], ..pairs.clone() },
            PairColumns { start: vec![0, 2, 1, 2], ..pairs.clone() },
            PairColumns { start: vec![0, 1, 1, 1], ..pairs.clone() },
        ] {
            write_pairs(&path, &wrong).unwrap();
            assert!(read_pairs(&path).unwrap_err().to_string().contains("do not fit"));
        }
    }
}
