//! Points in the order of their instances: in memory, or in a temporary file when there are many.

use crate::{Error, Result};
use s3d_geom::PointCloud;
use s3d_geom::glam::{Vec3, vec3};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes of a point in the file: three floats and three bytes.
const POINT_BYTES: usize = 15;
/// Memory for what waits to be written to the file.
const BUFFER_BYTES: usize = 64 << 20;

/// Points that lie one instance after another.
#[derive(Debug)]
pub(crate) enum FlatStore {
    Memory { positions: Vec<Vec3>, colors: Vec<[u8; 3]> },
    Spool(Spool),
}

/// A temporary file without a name, which the system removes when it is closed.
#[derive(Debug)]
pub(crate) struct Spool {
    file: Mutex<File>,
    /// The folder that it is in, for messages.
    dir: PathBuf,
}

impl FlatStore {
    /// Appends `count` points from the `start`th on to `out`.
    pub(crate) fn read(&self, start: u64, count: u64, out: &mut PointCloud) -> Result<()> {
        match self {
            Self::Memory { positions, colors } => {
                let range = start as usize..(start + count) as usize;
                out.positions.extend_from_slice(&positions[range.clone()]);
                out.colors.extend_from_slice(&colors[range]);
                Ok(())
            }
            Self::Spool(spool) => spool.read(start, count, out).map_err(|e| Error::io(&spool.dir, READ, e)),
        }
    }
}

const READ: &str = "read back points from a temporary file in";
const WRITE: &str = "write points to a temporary file in";

impl Spool {
    fn read(&self, start: u64, count: u64, out: &mut PointCloud) -> std::io::Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(start * POINT_BYTES as u64))?;
        let mut bytes = vec![0; POINT_BYTES * (count.min(65_536) as usize)];
        let mut left = count;
        while left > 0 {
            let n = left.min(65_536);
            let piece = &mut bytes[..POINT_BYTES * n as usize];
            file.read_exact(piece)?;
            for point in piece.as_chunks::<POINT_BYTES>().0 {
                let float =
                    |i: usize| f32::from_le_bytes([point[i], point[i + 1], point[i + 2], point[i + 3]]);
                out.positions.push(vec3(float(0), float(4), float(8)));
                out.colors.push([point[12], point[13], point[14]]);
            }
            left -= n;
        }
        Ok(())
    }
}

/// Puts points that come in any order into the file, each instance's beside one another.
pub(crate) struct SpoolWriter {
    file: File,
    dir: PathBuf,
    /// What waits, by instance.
    waiting: Vec<Vec<u8>>,
    /// Where each instance goes on, in points, and where it ends.
    next: Vec<u64>,
    ends: Vec<u64>,
    /// Bytes of an instance that may wait.
    most: usize,
}

impl SpoolWriter {
    /// A file for instances of these numbers of points, in `dir` or where the system keeps such files.
    pub(crate) fn create(dir: Option<&Path>, counts: &[u64]) -> Result<Self> {
        let dir = dir.map_or_else(std::env::temp_dir, Path::to_owned);
        let file = tempfile::tempfile_in(&dir).map_err(|e| Error::io(&dir, WRITE, e))?;
        let ends: Vec<u64> = counts
            .iter()
            .scan(0, |end, n| {
                *end += n;
                Some(*end)
            })
            .collect();
        let next = ends.iter().zip(counts).map(|(end, n)| end - n).collect();
        let share = BUFFER_BYTES / counts.len().max(1) / POINT_BYTES;
        let most = share.clamp(1, 16_384) * POINT_BYTES;
        Ok(Self { file, dir, waiting: vec![Vec::new(); counts.len()], next, ends, most })
    }

    /// Adds a point of an instance; `false` if that has as many as were promised.
    pub(crate) fn push(&mut self, instance: usize, position: Vec3, color: [u8; 3]) -> Result<bool> {
        let waiting = &mut self.waiting[instance];
        if self.next[instance] + (waiting.len() / POINT_BYTES) as u64 >= self.ends[instance] {
            return Ok(false);
        }
        for coordinate in position.to_array() {
            waiting.extend_from_slice(&coordinate.to_le_bytes());
        }
        waiting.extend_from_slice(&color);
        if waiting.len() >= self.most {
            self.write(instance)?;
        }
        Ok(true)
    }

    fn write(&mut self, instance: usize) -> Result<()> {
        let waiting = &mut self.waiting[instance];
        let at = SeekFrom::Start(self.next[instance] * POINT_BYTES as u64);
        let written = self.file.seek(at).and_then(|_| self.file.write_all(waiting));
        written.map_err(|e| Error::io(&self.dir, WRITE, e))?;
        self.next[instance] += (waiting.len() / POINT_BYTES) as u64;
        waiting.clear();
        Ok(())
    }

    /// The points, to be read; `None` if fewer came than were promised.
    pub(crate) fn finish(mut self) -> Result<Option<FlatStore>> {
        for instance in 0..self.waiting.len() {
            self.write(instance)?;
        }
        let complete = self.next == self.ends;
        Ok(complete.then(|| FlatStore::Spool(Spool { file: Mutex::new(self.file), dir: self.dir })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_that_overflow_are_written_where_they_belong() {
        // More than the 16,384 points that wait, of two instances by turns.
        let counts = [40_000, 0, 20_000];
        let mut writer = SpoolWriter::create(None, &counts).unwrap();
        for i in 0..60_000u32 {
            let instance = if i % 3 == 2 { 2 } else { 0 };
            assert!(writer.push(instance, Vec3::splat(i as f32), [i as u8; 3]).unwrap());
        }
        assert!(!writer.push(1, Vec3::ZERO, [0; 3]).unwrap());
        assert!(!writer.push(2, Vec3::ZERO, [0; 3]).unwrap());
        let store = writer.finish().unwrap().unwrap();
        let mut cloud = PointCloud::default();
        store.read(40_000, 20_000, &mut cloud).unwrap();
        assert!(cloud.positions.iter().enumerate().all(|(k, p)| *p == Vec3::splat((3 * k + 2) as f32)));
        assert!(cloud.colors.iter().enumerate().all(|(k, c)| *c == [(3 * k + 2) as u8; 3]));
        cloud.clear();
        store.read(0, 40_000, &mut cloud).unwrap();
        assert_eq!(cloud.positions[39_999], Vec3::splat(59_998.0));
    }

    #[test]
    fn points_that_did_not_come_are_noticed() {
        let mut writer = SpoolWriter::create(None, &[2]).unwrap();
        assert!(writer.push(0, Vec3::ONE, [1; 3]).unwrap());
        assert!(writer.finish().unwrap().is_none());
    }
}
