//! Writes the indices of an instance's points by voxel, without holding all of them.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

/// The largest number of a voxel's indices that wait to be written.
const MOST_WAITING: usize = 1 << 14;

/// Writes the indices of points into a file by voxel. The points come in their own order.
pub(crate) struct VoxelMembers<'a> {
    file: &'a mut File,
    voxels: Vec<Voxel>,
    /// The index of the next point.
    next: u32,
    /// The place in the file at which the last voxel's indices end, bytes.
    end: u64,
}

/// The indices of a voxel that wait to be written.
struct Voxel {
    waiting: Vec<u8>,
    /// The place in the file at which the next indices are written, bytes.
    at: u64,
    /// The place in the file at which the voxel's indices end, bytes.
    end: u64,
}

impl<'a> VoxelMembers<'a> {
    /// Starts voxels with these numbers of points, one after another from the position of `file`.
    pub(crate) fn new(file: &'a mut File, counts: &[u32]) -> io::Result<Self> {
        let mut end = file.stream_position()?;
        let mut voxels = Vec::with_capacity(counts.len());
        for count in counts {
            let at = end;
            end += 4 * u64::from(*count);
            voxels.push(Voxel { waiting: Vec::new(), at, end });
        }
        Ok(Self { file, voxels, next: 0, end })
    }

    /// Adds the next points, given the voxel of each. Points that were not counted are an error: their file
    /// has changed.
    pub(crate) fn add(&mut self, cells: &[u8]) -> io::Result<()> {
        for cell in cells {
            let voxel = self.voxels.get_mut(usize::from(*cell)).ok_or_else(changed)?;
            voxel.waiting.extend_from_slice(&self.next.to_le_bytes());
            if voxel.waiting.len() >= 4 * MOST_WAITING {
                voxel.write(self.file)?;
            }
            self.next = self.next.checked_add(1).ok_or_else(changed)?;
        }
        Ok(())
    }

    /// Writes the waiting indices, and leaves the file at the end of all indices.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        for voxel in &mut self.voxels {
            voxel.write(self.file)?;
            if voxel.at != voxel.end {
                return Err(changed());
            }
        }
        self.file.seek(SeekFrom::Start(self.end))?;
        Ok(())
    }
}

impl Voxel {
    fn write(&mut self, file: &mut File) -> io::Result<()> {
        let end = self.at + self.waiting.len() as u64;
        if end > self.end {
            return Err(changed());
        }
        file.seek(SeekFrom::Start(self.at))?;
        file.write_all(&self.waiting)?;
        self.at = end;
        self.waiting.clear();
        Ok(())
    }
}

fn changed() -> io::Error {
    io::Error::other("the points changed while they were read")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// Returns the numbers that are written from byte 4 on.
    fn written(cells: &[u8], counts: &[u32]) -> io::Result<Vec<u32>> {
        let mut file = tempfile::tempfile()?;
        file.write_all(b"head")?;
        let mut members = VoxelMembers::new(&mut file, counts)?;
        cells.chunks(1000).try_for_each(|block| members.add(block))?;
        members.finish()?;
        file.write_all(b"tail")?;
        file.seek(SeekFrom::Start(0))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        assert!(bytes.starts_with(b"head") && bytes.ends_with(b"tail"));
        let numbers = bytes[4..bytes.len() - 4].as_chunks::<4>().0;
        Ok(numbers.iter().map(|n| u32::from_le_bytes(*n)).collect())
    }

    #[test]
    fn each_voxel_has_its_points_in_order() {
        // Voxel 3 has so many points that it is written early; voxel 2 has none.
        let cells: Vec<u8> = (0..5 * MOST_WAITING).map(|i| [0, 3, 3, 1, 3][i % 5]).collect();
        let mut counts = [0; 4];
        cells.iter().for_each(|c| counts[usize::from(*c)] += 1);
        let mut expected: Vec<u32> = (0..cells.len() as u32).collect();
        expected.sort_by_key(|i| cells[*i as usize]);
        assert_eq!(written(&cells, &counts).unwrap(), expected);
        assert!(written(&[], &[0; 4]).unwrap().is_empty());
    }

    #[test]
    fn points_that_changed_are_noticed() {
        for counts in [[2, 1], [1, 2], [3, 1], [2, 2]] {
            let found = written(&[0, 1, 0], &counts);
            assert_eq!(found.is_ok(), counts == [2, 1], "{counts:?}");
        }
    }
}
