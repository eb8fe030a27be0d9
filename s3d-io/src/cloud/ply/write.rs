//! Writes labelled point clouds as binary PLY files.
//!
//! Own code: ply-rs holds all points before it writes the first. This writer takes the millions of points of
//! an area in pieces (`points_come_back_from_several_pieces`).

use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use crate::fs::open::open_file;
use s3d_geom::glam::DVec3;
use s3d_geom::{NO_INDEX, PointCloud};
use std::io::{BufRead, BufReader, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The bytes of a point: three floats, three bytes, two integers.
const POINT_BYTES: usize = 3 * 4 + 3 + 2 * 4;

/// The number of points that are turned into bytes at a time.
const BATCH: usize = 4096;

/// Writes a point cloud of any size piece by piece as a binary little-endian PLY file. The file appears whole
/// or not at all.
///
/// Columns: `x y z` (float, world metres, Z-up), `red green blue` (uchar; black if the cloud has no colours),
/// `label` (uint, index into `semantic_labels.json`), `face` (uint, the face of the mesh that the point was
/// drawn from; 4294967295 if unknown).
#[derive(Debug)]
pub struct PlyPointWriter<W = AtomicFile> {
    file: W,
    name: PathBuf,
    promised: u64,
    written: u64,
    buffer: Vec<u8>,
}

impl PlyPointWriter {
    /// Creates the file `path`, which will hold `count` points.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(path: &Path, count: u64) -> Result<Self> {
        Self::create_moved(path, count, DVec3::ZERO)
    }

    /// Creates a file like [`PlyPointWriter::create`], for points from which `offset_m` was subtracted. A
    /// comment in the header says so, unless the offset is 0.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create_moved(path: &Path, count: u64, offset_m: DVec3) -> Result<Self> {
        Self::new_moved(AtomicFile::create(path)?, path, count, offset_m)
    }

    /// Gives the file its name, and returns its size in bytes.
    ///
    /// # Errors
    /// The errors of [`PlyPointWriter::into_inner`]. After an error there is no file.
    pub fn finish(self) -> Result<u64> {
        self.into_inner()?.commit()
    }
}

impl<W: Write> PlyPointWriter<W> {
    /// Starts a file of `count` points in `file`. Errors call it `name`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(file: W, name: &Path, count: u64) -> Result<Self> {
        Self::new_moved(file, name, count, DVec3::ZERO)
    }

    /// Starts a file like [`PlyPointWriter::new`], for points from which `offset_m` was subtracted.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new_moved(mut file: W, name: &Path, count: u64, offset_m: DVec3) -> Result<Self> {
        let frame = frame_comment(offset_m);

        let header = format!(
            "ply\n\
             format binary_little_endian 1.0\n\
             comment x y z: metres, Z up, right-handed\n\
             {frame}\
             comment label: index into semantic_labels.json, 0 for the null label\n\
             comment face: index of the face of the mesh that the point lies on, {NO_INDEX} if unknown\n\
             element vertex {count}\n\
             property float x\n\
             property float y\n\
             property float z\n\
             property uchar red\n\
             property uchar green\n\
             property uchar blue\n\
             property uint label\n\
             property uint face\n\
             end_header\n"
        );

        file.write_all(header.as_bytes())
            .map_err(|e| Error::io(name, "write", e))?;
        let name = name.to_owned();
        Ok(Self { file, name, promised: count, written: 0, buffer: Vec::with_capacity(BATCH * POINT_BYTES) })
    }

    /// Appends the points of `cloud`, with the label of each in `labels`.
    ///
    /// # Errors
    /// [`Error::Io`].
    ///
    /// # Panics
    /// If `labels`, or a column of the cloud that is not empty, does not have one entry a point.
    pub fn append(&mut self, cloud: &PointCloud, labels: &[u32]) -> Result<()> {
        let n = cloud.len();
        assert_eq!(labels.len(), n, "{n} points need as many labels");
        assert!(
            cloud.colors.is_empty() || cloud.colors.len() == n,
            "{} colours for {n} points",
            cloud.colors.len()
        );
        assert!(
            cloud.faces.is_empty() || cloud.faces.len() == n,
            "{} faces for {n} points",
            cloud.faces.len()
        );

        for first in (0..n).step_by(BATCH) {
            self.buffer.clear();
            put_points(&mut self.buffer, cloud, labels, first..n.min(first + BATCH));
            self.file
                .write_all(&self.buffer)
                .map_err(|e| Error::io(&self.name, "write", e))?;
        }
        self.written += n as u64;
        Ok(())
    }

    /// Returns the complete file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if fewer or more points came than were promised.
    pub fn into_inner(self) -> Result<W> {
        check_count(&self.name, self.promised, self.written)?;
        Ok(self.file)
    }
}

/// Fails unless as many points were written to the file `name` as its header says.
pub(super) fn check_count(name: &Path, promised: u64, written: u64) -> Result<()> {
    if written == promised {
        return Ok(());
    }
    Err(Error::format(name, format!("{promised} points were promised, {written} came")))
}

/// The line of a header that tells what was subtracted from coordinates; empty for nothing.
pub(super) fn frame_comment(offset_m: DVec3) -> String {
    match offset_m.to_array() {
        [0.0, 0.0, 0.0] => String::new(),
        [x, y, z] => format!("comment offset_m {x:?} {y:?} {z:?}: add it for the scan's own coordinates\n"),
    }
}

/// Appends the bytes of some points of a cloud. It is not generic, so that it is compiled here, once.
fn put_points(buffer: &mut Vec<u8>, cloud: &PointCloud, labels: &[u32], which: Range<usize>) {
    let points = cloud.positions.iter().zip(labels).enumerate();
    for (i, (position, label)) in points.skip(which.start).take(which.len()) {
        let face = cloud.faces.get(i).copied().unwrap_or(NO_INDEX);
        let mut point = [0; POINT_BYTES];
        point[0..4].copy_from_slice(&position.x.to_le_bytes());
        point[4..8].copy_from_slice(&position.y.to_le_bytes());
        point[8..12].copy_from_slice(&position.z.to_le_bytes());
        point[12..15].copy_from_slice(&cloud.colors.get(i).copied().unwrap_or([0; 3]));
        point[15..19].copy_from_slice(&label.to_le_bytes());
        point[19..23].copy_from_slice(&face.to_le_bytes());
        buffer.extend_from_slice(&point);
    }
}

/// The number of points that the header of the PLY file `path` states.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file has no such header.
pub fn read_ply_point_count(path: &Path) -> Result<u64> {
    let file = open_file(path)?;
    // Headers are short. A longer start belongs to another kind of file.
    for line in BufReader::new(file.take(65_536)).split(b'\n') {
        let line = line.map_err(|e| Error::io(path, "read", e))?;
        let text = String::from_utf8_lossy(&line);
        if let Some(count) = text.trim().strip_prefix("element vertex ") {
            return count
                .trim()
                .parse()
                .map_err(|_| Error::format(path, format!("\"{count}\" is no number of points")));
        }
        if text.trim() == "end_header" {
            break;
        }
    }
    Err(Error::format(path, "no \"element vertex\" in its header: not a PLY file of points"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    /// Reads exactly this kind of file, as the specification of PLY describes it.
    fn read(path: &Path) -> (String, Vec<[u8; POINT_BYTES]>) {
        let bytes = std::fs::read(path).unwrap();
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let (points, rest) = bytes[end..].as_chunks();
        assert!(rest.is_empty());
        (String::from_utf8(bytes[..end].to_vec()).unwrap(), points.to_vec())
    }

    fn uint_at(p: &[u8; POINT_BYTES], at: usize) -> u32 {
        u32::from_le_bytes(p[at..at + 4].try_into().unwrap())
    }

    fn float_at(p: &[u8; POINT_BYTES], at: usize) -> f32 {
        f32::from_le_bytes(p[at..at + 4].try_into().unwrap())
    }

    #[test]
    fn points_come_back_from_several_pieces() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let n = 2 * BATCH + 7;
        let cloud = PointCloud {
            positions: (0..n).map(|i| vec3(i as f32, -0.5, 1e-3)).collect(),
            colors: (0..n).map(|i| [i as u8, 2, 3]).collect(),
            faces: (0..n as u32).rev().collect(),
        };
        let bare = PointCloud { positions: vec![vec3(7.0, 8.0, 9.0)], ..PointCloud::default() };
        let labels: Vec<u32> = (0..n as u32).map(|i| i % 300).collect();

        let mut writer = PlyPointWriter::create(&path, n as u64 + 1).unwrap();
        writer.append(&cloud, &labels).unwrap();
        writer.append(&PointCloud::default(), &[]).unwrap();
        writer.append(&bare, &[9815]).unwrap();
        let bytes = writer.finish().unwrap();
        assert_eq!(bytes, std::fs::metadata(&path).unwrap().len());

        let (header, points) = read(&path);
        assert!(header.contains(&format!("element vertex {}\n", n + 1)));
        assert!(header.lines().filter(|l| l.starts_with("property")).count() == 8);
        for (i, p) in points[..n].iter().enumerate() {
            assert_eq!(vec3(float_at(p, 0), float_at(p, 4), float_at(p, 8)), cloud.positions[i]);
            assert_eq!(
                (&p[12..15], uint_at(p, 15), uint_at(p, 19)),
                (&cloud.colors[i][..], labels[i], cloud.faces[i])
            );
        }
        let last = &points[n];
        assert_eq!(
            (float_at(last, 0), &last[12..15], uint_at(last, 15), uint_at(last, 19)),
            (7.0, &[0u8; 3][..], 9815, NO_INDEX)
        );
    }

    #[test]
    fn a_wrong_count_is_an_error_and_leaves_no_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let mut writer = PlyPointWriter::create(&path, 2).unwrap();
        writer
            .append(&PointCloud { positions: vec![vec3(0.0, 0.0, 0.0)], ..PointCloud::default() }, &[0])
            .unwrap();
        let e = writer.finish().unwrap_err();
        assert!(e.to_string().ends_with("cloud.ply: 2 points were promised, 1 came"), "{e}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
