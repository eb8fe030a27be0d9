//! Writes clouds of positions and colours.

use super::write::{check_count, frame_comment};
use crate::error::Result;
use crate::fs::atomic::AtomicFile;
use s3d_geom::PointCloud;
use s3d_geom::glam::DVec3;
use std::path::{Path, PathBuf};

/// Writes points of any number piece by piece as a binary little-endian PLY file of positions (float, metres)
/// and colours (uchar; black if a piece has none). Viewers and Gaussian splatting read it. The file appears
/// whole or not at all.
#[derive(Debug)]
pub struct ColoredPointWriter {
    file: AtomicFile,
    path: PathBuf,
    promised: u64,
    written: u64,
}

impl ColoredPointWriter {
    /// Creates the file `path` for `count` points from which `offset_m` was subtracted. A comment in the
    /// header says so, unless the offset is 0.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn create(path: &Path, count: u64, offset_m: DVec3) -> Result<Self> {
        Self::begin(path, count, offset_m, "")
    }

    fn begin(path: &Path, count: u64, offset_m: DVec3, more: &str) -> Result<Self> {
        let mut file = AtomicFile::create(path)?;
        let header = format!(
            "ply\n\
             format binary_little_endian 1.0\n\
             {}element vertex {count}\n\
             property float x\n\
             property float y\n\
             property float z\n\
             property uchar red\n\
             property uchar green\n\
             property uchar blue\n\
             {more}end_header\n",
            frame_comment(offset_m)
        );
        file.put(header.as_bytes())?;
        Ok(Self { file, path: path.to_owned(), promised: count, written: 0 })
    }

    /// Appends points.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    ///
    /// # Panics
    /// If the cloud has colours, but not one a point.
    pub fn append(&mut self, cloud: &PointCloud) -> Result<()> {
        self.put(cloud, &[])
    }

    fn put(&mut self, cloud: &PointCloud, labels: &[i32]) -> Result<()> {
        let n = cloud.len();
        for (what, found) in [("colours", cloud.colors.len()), ("labels", labels.len())] {
            assert!(found == 0 || found == n, "{found} {what} for {n} points");
        }
        for (i, position) in cloud.positions.iter().enumerate() {
            let mut point = [0; 15];
            for (bytes, v) in point.as_chunks_mut().0.iter_mut().zip(position.to_array()) {
                *bytes = v.to_le_bytes();
            }
            point[12..].copy_from_slice(cloud.colors.get(i).unwrap_or(&[0; 3]));
            self.file.put(&point)?;
            if let Some(label) = labels.get(i) {
                self.file.put(&label.to_le_bytes())?;
            }
        }
        self.written += n as u64;
        Ok(())
    }

    /// Gives the file its name, and returns its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io); [`Error::Format`](crate::Error::Format) if fewer or more points came
    /// than were promised. There is no file then.
    pub fn finish(self) -> Result<u64> {
        check_count(&self.path, self.promised, self.written)?;
        self.file.commit()
    }
}

/// Writes a cloud as [`ColoredPointWriter`] does, with labels (int) if there are any. Returns the file's size
/// in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// If the cloud has colours, or there are labels, but not one a point.
pub fn write_colored_points(path: &Path, cloud: &PointCloud, labels: &[i32]) -> Result<u64> {
    let more = if labels.is_empty() { "" } else { "property int label\n" };
    let mut writer = ColoredPointWriter::begin(path, cloud.len() as u64, DVec3::ZERO, more)?;
    writer.put(cloud, labels)?;
    writer.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::read_point_sample;
    use s3d_geom::glam::Vec3;

    fn cloud(points: std::ops::Range<u8>) -> PointCloud {
        let positions = points.clone().map(|i| Vec3::splat(f32::from(i))).collect();
        PointCloud { positions, colors: points.map(|i| [i, 0, 255 - i]).collect(), ..PointCloud::default() }
    }

    #[test]
    fn a_cloud_comes_back_from_a_file_of_its_own() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let bytes = write_colored_points(&path, &cloud(0..200), &[]).unwrap();
        assert_eq!(bytes, std::fs::metadata(&path).unwrap().len());
        assert_eq!(read_point_sample(&path, 200).unwrap(), cloud(0..200));
    }

    #[test]
    fn pieces_make_one_cloud_and_fewer_points_than_promised_none() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let mut writer = ColoredPointWriter::create(&path, 200, DVec3::new(100.0, -0.5, 0.0)).unwrap();
        writer.append(&cloud(0..70)).unwrap();
        writer.append(&cloud(70..200)).unwrap();
        let bytes = writer.finish().unwrap();
        let content = std::fs::read(&path).unwrap();
        assert_eq!(bytes, content.len() as u64);
        assert!(String::from_utf8_lossy(&content).contains("comment offset_m 100.0 -0.5 0.0"));
        assert_eq!(read_point_sample(&path, 200).unwrap(), cloud(0..200));

        let short = dir.path().join("short.ply");
        let mut writer = ColoredPointWriter::create(&short, 200, DVec3::ZERO).unwrap();
        writer.append(&cloud(0..199)).unwrap();
        assert!(writer.finish().unwrap_err().to_string().contains("199 came"));
        assert!(!short.exists());
    }
}
