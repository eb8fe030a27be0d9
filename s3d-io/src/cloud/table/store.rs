//! Points sorted by instance: in memory, or in a temporary file when there are many.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::{Error, Result};
use s3d_geom::PointCloud;
use s3d_geom::glam::{Vec3, vec3};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes of a point in the file: three floats and three bytes.
const POINT_BYTES: usize = 15;
/// Points that are read back at a time.
const POINTS_AT_ONCE: usize = 65_536;
/// Memory for points that wait to be written to the file.
const BUFFER_BYTES: usize = 64 << 20;

/// Points, one instance after another.
#[derive(Debug)]
pub(crate) enum PointStore {
    Memory { positions: Vec<Vec3>, colors: Vec<[u8; 3]> },
    Spool(Spool),
}

/// A temporary file without a name, which the system removes when it is closed.
#[derive(Debug)]
pub(crate) struct Spool {
    file: Mutex<File>,
    /// The folder of the file, for messages.
    dir: PathBuf,
}

impl PointStore {
    /// Appends `count` points to `out`, from point `start` on.
    ///
    /// # Panics
    /// If there are not so many points in memory.
    #[expect(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        clippy::cast_possible_truncation,
        reason = "places and counts are those by which the store was filled; what is in memory has a size in \
                  usize"
    )]
    pub(crate) fn read(&self, start: u64, count: u64, out: &mut PointCloud) -> Result<()> {
        match self {
            Self::Memory { positions, colors } => {
                let range = start as usize..(start + count) as usize;
                out.positions.extend_from_slice(&positions[range.clone()]);
                out.colors.extend_from_slice(&colors[range]);
                Ok(())
            }
            Self::Spool(spool) => spool
                .read(start, count, out)
                .map_err(|e| Error::io(&spool.dir, READ, e)),
        }
    }
}

/// The first byte of a point in the file. The system refuses to seek beyond what a file can have.
fn byte_of(point: u64) -> u64 {
    point.saturating_mul(POINT_BYTES as u64)
}

const READ: &str = "read back points from a temporary file in";
const WRITE: &str = "write points to a temporary file in";

impl Spool {
    fn read(&self, start: u64, count: u64, out: &mut PointCloud) -> std::io::Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(byte_of(start)))?;
        let mut bytes = Vec::new();
        let mut left = count;
        while left > 0 {
            let n = usize::try_from(left).map_or(POINTS_AT_ONCE, |left| left.min(POINTS_AT_ONCE));
            bytes.resize(n.saturating_mul(POINT_BYTES), 0);
            file.read_exact(&mut bytes)?;
            for p in bytes.as_chunks::<POINT_BYTES>().0 {
                out.positions.push(vec3(
                    f32::from_le_bytes([p[0], p[1], p[2], p[3]]),
                    f32::from_le_bytes([p[4], p[5], p[6], p[7]]),
                    f32::from_le_bytes([p[8], p[9], p[10], p[11]]),
                ));
                out.colors.push([p[12], p[13], p[14]]);
            }
            left = left.saturating_sub(n as u64);
        }
        Ok(())
    }
}

/// Sorts points that come in any order into the file, by instance.
pub(crate) struct SpoolWriter {
    file: File,
    dir: PathBuf,
    buffers: Vec<InstanceBuffer>,
    /// The most bytes of an instance that may wait.
    most: usize,
}

/// The points of an instance that wait for their place in the file.
struct InstanceBuffer {
    /// Bytes that wait to be written.
    waiting: Vec<u8>,
    /// Where the next bytes belong, in points.
    next: u64,
    /// How many points are still to come.
    left: u64,
}

impl SpoolWriter {
    /// Creates a file for instances with these numbers of points, in `dir` or in the system's folder for
    /// temporary files.
    pub(crate) fn create(dir: Option<&Path>, counts: &[u64]) -> Result<Self> {
        let dir = dir.map_or_else(std::env::temp_dir, Path::to_owned);
        let file = tempfile::tempfile_in(&dir).map_err(|e| Error::io(&dir, WRITE, e))?;
        let buffers = counts.iter().scan(0u64, |end, n| {
            let next = *end;
            *end = end.saturating_add(*n);
            Some(InstanceBuffer { waiting: Vec::new(), next, left: *n })
        });
        let share = BUFFER_BYTES.checked_div(counts.len()).unwrap_or(BUFFER_BYTES);
        Ok(Self { file, dir, buffers: buffers.collect(), most: share.clamp(1, 16_384 * POINT_BYTES) })
    }

    /// Adds a point of an instance. Returns `false` if the instance is complete already.
    pub(crate) fn push(&mut self, instance: usize, position: Vec3, color: [u8; 3]) -> Result<bool> {
        let Some(buffer) = self.buffers.get_mut(instance) else { return Ok(false) };
        let Some(left) = buffer.left.checked_sub(1) else { return Ok(false) };
        buffer.left = left;
        for coordinate in position.to_array() {
            buffer.waiting.extend_from_slice(&coordinate.to_le_bytes());
        }
        buffer.waiting.extend_from_slice(&color);
        if buffer.waiting.len() >= self.most {
            buffer
                .write(&mut self.file)
                .map_err(|e| Error::io(&self.dir, WRITE, e))?;
        }
        Ok(true)
    }

    /// Returns the points, to be read. Returns `None` if fewer points came than were promised.
    pub(crate) fn finish(mut self) -> Result<Option<PointStore>> {
        for buffer in &mut self.buffers {
            buffer
                .write(&mut self.file)
                .map_err(|e| Error::io(&self.dir, WRITE, e))?;
        }
        let complete = self.buffers.iter().all(|buffer| buffer.left == 0);
        Ok(complete.then(|| PointStore::Spool(Spool { file: Mutex::new(self.file), dir: self.dir })))
    }
}

impl InstanceBuffer {
    fn write(&mut self, file: &mut File) -> std::io::Result<()> {
        file.seek(SeekFrom::Start(byte_of(self.next)))?;
        file.write_all(&self.waiting)?;
        let written = self.waiting.len() / POINT_BYTES;
        self.next = self.next.saturating_add(written as u64);
        self.waiting.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn expected(k: usize) -> usize {
        3 * k + 2
    }

    #[test]
    fn buffers_that_overflow_are_written_where_they_belong() {
        // More points than the 16,384 that wait, of two instances in turn.
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
        assert!(
            cloud
                .positions
                .iter()
                .enumerate()
                .all(|(k, p)| *p == Vec3::splat(expected(k) as f32))
        );
        assert!(
            cloud
                .colors
                .iter()
                .enumerate()
                .all(|(k, c)| *c == [expected(k) as u8; 3])
        );

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
