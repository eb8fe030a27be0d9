//! Reads back the point clouds that [`PlyPointWriter`](crate::cloud::PlyPointWriter) writes.

use crate::error::{Error, Result};
use crate::fs::open::open_file;
use s3d_geom::glam::Vec3;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The bytes of a point: three floats, three bytes, two integers.
const POINT_BYTES: usize = 3 * 4 + 3 + 2 * 4;
/// The properties of a point, in order.
const PROPERTIES: [&str; 8] =
    ["float x", "float y", "float z", "uchar red", "uchar green", "uchar blue", "uint label", "uint face"];

/// A point of a labelled cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelledPoint {
    /// World metres, Z-up.
    pub position: Vec3,
    /// R G B.
    pub color: [u8; 3],
    /// An index into `semantic_labels.json`, 0 for the null label.
    pub label: u32,
    /// The face of the mesh that the point was drawn from; 4294967295 if unknown.
    pub face: u32,
}

/// The points of a file, piece by piece.
#[derive(Debug)]
pub struct LabelledPoints<R = File> {
    path: PathBuf,
    file: BufReader<R>,
    count: u64,
    left: u64,
}

impl LabelledPoints {
    /// Reads the header of `path`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the file is no PLY file of labelled points, or is shorter or
    /// longer than its header says.
    pub fn open(path: &Path) -> Result<Self> {
        Self::new(open_file(path)?, path)
    }
}

impl<R: Read + Seek> LabelledPoints<R> {
    /// Reads like [`LabelledPoints::open`], from a reader of the file's bytes. Errors call the file `name`.
    ///
    /// # Errors
    /// The errors of [`LabelledPoints::open`].
    pub fn new(mut reader: R, name: &Path) -> Result<Self> {
        let path = name;
        let io = |e| Error::io(path, "read", e);
        let other = || Error::format(path, "is no PLY file of labelled points, as an export has it");
        let bytes = reader
            .seek(SeekFrom::End(0))
            .and_then(|n| reader.rewind().map(|()| n))
            .map_err(io)?;

        let mut file = BufReader::with_capacity(1 << 18, reader);
        let mut count = None;
        let mut properties = Vec::new();
        let mut header = 0u64;
        let mut line = Vec::new();
        loop {
            line.clear();
            // Headers are short. A long line or a long header belongs to another kind of file.
            let read = file.by_ref().take(4096).read_until(b'\n', &mut line).map_err(io)? as u64;
            header += read;
            let text = String::from_utf8_lossy(&line).trim().to_owned();
            if read == 0 || header > 65_536 || header == read && text != "ply" {
                return Err(other());
            }
            if let Some(n) = text.strip_prefix("element vertex ") {
                count = Some(n.parse::<u64>().map_err(|_| other())?);
            } else if let Some(property) = text.strip_prefix("property ") {
                properties.push(property.to_owned());
            } else if text.starts_with("format ") && text != "format binary_little_endian 1.0" {
                return Err(other());
            } else if text == "end_header" {
                break;
            }
        }

        let count = count.filter(|_| properties == PROPERTIES).ok_or_else(other)?;
        let expected = count
            .checked_mul(POINT_BYTES as u64)
            .and_then(|b| b.checked_add(header));
        if expected != Some(bytes) {
            return Err(Error::format(path, format!("{count} points do not fill its {bytes} bytes")));
        }
        Ok(Self { path: path.to_owned(), file, count, left: count })
    }

    /// The number of points in the file.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Replaces the contents of `out` by the next points, up to `most` of them. Returns whether there were
    /// any.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read(&mut self, most: usize, out: &mut Vec<LabelledPoint>) -> Result<bool> {
        out.clear();
        let n = self.left.min(most as u64);
        let mut bytes = [0; POINT_BYTES];
        for _ in 0..n {
            self.file
                .read_exact(&mut bytes)
                .map_err(|e| Error::io(&self.path, "read", e))?;
            let [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3, r, g, b, l0, l1, l2, l3, f0, f1, f2, f3] =
                bytes;
            let [x, y, z] = [[x0, x1, x2, x3], [y0, y1, y2, y3], [z0, z1, z2, z3]].map(f32::from_le_bytes);
            out.push(LabelledPoint {
                position: Vec3::new(x, y, z),
                color: [r, g, b],
                label: u32::from_le_bytes([l0, l1, l2, l3]),
                face: u32::from_le_bytes([f0, f1, f2, f3]),
            });
        }
        self.left -= n;
        Ok(n > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::ply::write::PlyPointWriter;
    use s3d_geom::PointCloud;

    #[test]
    fn points_come_back_and_other_files_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let n = 10u32;
        let cloud = PointCloud {
            positions: (0..n).map(|i| Vec3::new(i as f32, -0.5, 1e-3)).collect(),
            colors: (0..n).map(|i| [i as u8, 2, 3]).collect(),
            faces: (0..n).rev().collect(),
        };
        let mut writer = PlyPointWriter::create(&path, u64::from(n)).unwrap();
        writer
            .append(&cloud, &(0..n).map(|i| 100 * i).collect::<Vec<_>>())
            .unwrap();
        writer.finish().unwrap();

        let mut points = LabelledPoints::open(&path).unwrap();
        assert_eq!(points.count(), 10);
        let mut piece = Vec::new();
        let mut all = Vec::new();
        while points.read(4, &mut piece).unwrap() {
            all.extend_from_slice(&piece);
        }
        assert_eq!(all.len(), 10);
        let last =
            LabelledPoint { position: Vec3::new(9.0, -0.5, 1e-3), color: [9, 2, 3], label: 900, face: 0 };
        assert_eq!(all[9], last);

        let good = std::fs::read(&path).unwrap();
        let end = good.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let text = String::from_utf8_lossy(&good[..end]).into_owned();
        for (bytes, words) in [
            (good[..good.len() - 1].to_vec(), "10 points do not fill"),
            (good[1..].to_vec(), "no PLY file of labelled points"),
            (text.replace("uint face", "uint side").into_bytes(), "no PLY file of labelled points"),
            (text.replace("vertex 10", "vertex 18446744073709551615").into_bytes(), "do not fill"),
            (b"ply\n".to_vec(), "no PLY file of labelled points"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let e = LabelledPoints::open(&path).unwrap_err().to_string();
            assert!(e.contains(words), "{e}");
        }
    }
}
