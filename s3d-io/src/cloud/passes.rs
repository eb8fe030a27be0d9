//! Passes over the points of an instance in blocks, so that instances of any size need little memory.

use crate::cloud::annotations::{AnnotatedInstance, PointBlocks, Skipped};
use crate::error::{Error, Result};
use s3d_geom::PointCloud;
use s3d_geom::glam::{Vec3, vec3};
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

/// Points that can be read in blocks any number of times, each time in the same order.
pub trait PointPasses {
    /// The number of points.
    fn len(&self) -> u64;

    /// Whether there are no points.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All positions, if they are in memory.
    fn in_memory(&self) -> Option<&[Vec3]>;

    /// Hands all positions to `each`, block after block: world metres.
    ///
    /// # Errors
    /// The errors of `each`, which end the pass; [`Error::Io`] and [`Error::Format`] from the points' own
    /// file.
    fn pass(&mut self, each: &mut dyn FnMut(&[Vec3]) -> Result<()>) -> Result<()>;
}

impl PointPasses for &[Vec3] {
    fn len(&self) -> u64 {
        <[Vec3]>::len(self) as u64
    }

    fn in_memory(&self) -> Option<&[Vec3]> {
        Some(self)
    }

    fn pass(&mut self, each: &mut dyn FnMut(&[Vec3]) -> Result<()>) -> Result<()> {
        each(self)
    }
}

/// Reads the points of instances in blocks, one instance after another. It holds three blocks and keeps their
/// memory.
///
/// ```
/// # let dir = tempfile::tempdir()?;
/// # let folder = dir.path().join("office_1/Annotations");
/// # std::fs::create_dir_all(&folder)?;
/// # std::fs::write(folder.join("chair_1.txt"), "1 2 3 4 5 6\n7 8 9 10 11 12\n")?;
/// use s3d_io::cloud::{Annotations, InstanceReader, PointPasses};
/// use s3d_io::Error;
///
/// let area = Annotations::open(&[dir.path().to_owned()], &Default::default())?;
/// let mut reader = InstanceReader::new(1);
/// let mut top = f32::MIN;
/// let (mut points, _) = reader.read(&area.rooms[0].instances[0], None, |block, _| {
///     top = block.positions.iter().fold(top, |top, p| top.max(p.z));
///     Ok::<(), Error>(())
/// })?;
/// let mut below = 0;
/// points.pass(&mut |block| Ok(below += block.iter().filter(|p| p.z < top).count()))?;
/// assert_eq!((points.len(), below), (2, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct InstanceReader<'a> {
    block_points: usize,
    /// The current block, and the next.
    now: PointCloud,
    next: PointCloud,
    /// An instance whose first block has been read ahead, into `first`.
    ahead: Option<(&'a AnnotatedInstance, Result<Begun<'a>>)>,
    first: PointCloud,
}

/// An instance whose first block has been read.
struct Begun<'a> {
    source: Box<dyn PointBlocks + 'a>,
    more: bool,
}

impl<'a> Begun<'a> {
    fn new(instance: &'a AnnotatedInstance, points: usize, block: &mut PointCloud) -> Result<Self> {
        let mut source = instance.open()?;
        block.clear();
        let more = source.read_block(points, block)?;
        Ok(Self { source, more })
    }
}

/// The points of an instance that [`InstanceReader::read`] has read once, to be read again.
pub struct InstancePasses<'r, 'a> {
    instance: &'a AnnotatedInstance,
    reader: &'r mut InstanceReader<'a>,
    len: u64,
    /// A copy of the positions, if reading the instance's own file again would take longer.
    copy: Option<PositionFile>,
}

impl<'a> InstanceReader<'a> {
    /// Creates a reader of blocks of `block_points` points: 15 bytes each, and 4 more if their faces are
    /// known.
    ///
    /// # Panics
    /// If `block_points` is 0.
    pub fn new(block_points: usize) -> Self {
        assert!(block_points > 0, "blocks of no points");
        let (now, next, first) = Default::default();
        Self { block_points, now, next, ahead: None, first }
    }

    /// Hands all points of an instance to `each`, block after block, with all that
    /// [`AnnotatedInstance::read`] gives; the flag tells whether the block is the whole instance. An instance
    /// without points gives no block. Meanwhile the next block is read on another thread of the current rayon
    /// pool; during the last block, this is the first block of `then`, the instance to be read after this
    /// one. Returns the points, to be read again, and the lines or records left out.
    ///
    /// # Errors
    /// The errors of `each`, which end the reading, and of [`AnnotatedInstance::read`].
    pub fn read<E: From<Error> + Send>(
        &mut self,
        instance: &'a AnnotatedInstance,
        then: Option<&'a AnnotatedInstance>,
        mut each: impl FnMut(&PointCloud, bool) -> std::result::Result<(), E> + Send,
    ) -> std::result::Result<(InstancePasses<'_, 'a>, Skipped), E> {
        let Self { block_points, now, next, ahead, first } = self;
        let points = *block_points;

        let Begun { mut source, mut more } = match ahead.take() {
            Some((begun, of)) if std::ptr::eq(begun, instance) => {
                std::mem::swap(now, first);
                of?
            }
            _ => Begun::new(instance, points, now)?,
        };
        let mut len = 0;
        let mut copy = None;
        if more && let Some(dir) = instance.copy_to() {
            copy = Some(PositionFile::create(dir)?);
        }

        while !now.is_empty() {
            let is_whole = len == 0 && !more;
            len += now.len() as u64;
            let done = || -> std::result::Result<(), E> {
                copy.iter_mut().try_for_each(|file| file.append(&now.positions))?;
                each(now, is_whole)
            };

            if !more {
                let begin = || then.map(|then| (then, Begun::new(then, points, first)));
                let (begun, done) = rayon::join(begin, done);
                done?;
                *ahead = begun;
                break;
            }

            next.clear();
            let (read, done) = rayon::join(|| source.read_block(points, next), done);
            done?;
            more = read?;
            if next.is_empty() {
                break;
            }
            std::mem::swap(now, next);
        }

        copy.iter_mut().try_for_each(PositionFile::finish)?;
        let skipped = source.skipped();
        drop(source);
        Ok((InstancePasses { instance, reader: self, len, copy }, skipped))
    }
}

impl PointPasses for InstancePasses<'_, '_> {
    fn len(&self) -> u64 {
        self.len
    }

    fn in_memory(&self) -> Option<&[Vec3]> {
        let positions = &self.reader.now.positions;
        (positions.len() as u64 == self.len).then_some(positions)
    }

    fn pass(&mut self, each: &mut dyn FnMut(&[Vec3]) -> Result<()>) -> Result<()> {
        if let Some(all) = self.in_memory() {
            return each(all);
        }
        let InstanceReader { block_points, next, .. } = self.reader;
        if let Some(copy) = &mut self.copy {
            return copy.pass(*block_points, &mut next.positions, each);
        }
        let mut source = self.instance.open()?;
        loop {
            next.clear();
            let more = source.read_block(*block_points, next)?;
            if !next.is_empty() {
                each(&next.positions)?;
            }
            if !more {
                return Ok(());
            }
        }
    }
}

/// Positions in a temporary file without a name, which the system removes when it is closed.
#[derive(Debug)]
struct PositionFile {
    file: BufWriter<File>,
    points: u64,
    /// The folder of the file, for messages.
    dir: PathBuf,
}

impl PositionFile {
    fn create(dir: PathBuf) -> Result<Self> {
        let file = tempfile::tempfile_in(&dir).map_err(|e| Error::io(&dir, WRITE, e))?;
        Ok(Self { file: BufWriter::with_capacity(1 << 16, file), points: 0, dir })
    }

    fn append(&mut self, positions: &[Vec3]) -> Result<()> {
        self.points += positions.len() as u64;
        let mut numbers = positions.iter().flat_map(|p| p.to_array());
        let written = numbers.try_for_each(|v| self.file.write_all(&v.to_le_bytes()));
        written.map_err(|e| Error::io(&self.dir, WRITE, e))
    }

    fn finish(&mut self) -> Result<()> {
        self.file.flush().map_err(|e| Error::io(&self.dir, WRITE, e))
    }

    fn pass(
        &mut self,
        block_points: usize,
        block: &mut Vec<Vec3>,
        each: &mut dyn FnMut(&[Vec3]) -> Result<()>,
    ) -> Result<()> {
        let failed = |e| Error::io(&self.dir, "read back points from a temporary file in", e);
        let mut file = self.file.get_ref();
        file.seek(SeekFrom::Start(0)).map_err(failed)?;
        let mut file = BufReader::with_capacity(1 << 16, file);

        let mut left = self.points;
        while left > 0 {
            let n = left.min(block_points as u64);
            block.clear();
            for _ in 0..n {
                let mut bytes = [[0; 4]; 3];
                file.read_exact(bytes.as_flattened_mut()).map_err(failed)?;
                let [x, y, z] = bytes.map(f32::from_le_bytes);
                block.push(vec3(x, y, z));
            }
            each(block)?;
            left -= n;
        }
        Ok(())
    }
}

const WRITE: &str = "write points to a temporary file in";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::annotations::{AnnotationOptions, Annotations};
    use crate::cloud::on_fault::OnFault;
    use std::fmt::Write as _;
    use std::fs;

    /// The same instance of `points` points twice: in a tree, and in a cloud, an ASCII PLY file.
    fn instances(dir: &std::path::Path, points: u32) -> [AnnotatedInstance; 2] {
        let folder = dir.join("Area_1/office_1/Annotations");
        fs::create_dir_all(&folder).unwrap();
        let mut text = String::new();
        let mut ply = format!(
            "ply\nformat ascii 1.0\nelement vertex {points}\nproperty float x\nproperty float y\n\
             property float z\n\
             property uchar class\nend_header\n"
        );

        for i in 0..points {
            let _ = writeln!(text, "{i} 0.5 -{i} 1 2 3");
            let _ = writeln!(ply, "{i} 0.5 -{i} 1");
        }

        fs::write(folder.join("wall_1.txt"), text).unwrap();
        fs::write(dir.join("office_1.ply"), ply).unwrap();

        let options = AnnotationOptions {
            classes: [("1".to_owned(), Some(s3d_label::Class::WALL))].into(),
            points_in_memory: 3,
            ..AnnotationOptions::default()
        };

        let tree = Annotations::open(&[dir.join("Area_1")], &AnnotationOptions::default()).unwrap();
        let cloud = Annotations::open(&[dir.join("office_1.ply")], &options).unwrap();
        [tree, cloud].map(|a| a.rooms[0].instances[0].clone())
    }

    #[test]
    fn every_pass_sees_the_same_points() {
        for points in [1, 4, 7, 8, 9, 100] {
            let dir = tempfile::tempdir().unwrap();
            for instance in instances(dir.path(), points) {
                let mut whole = PointCloud::default();
                instance.read(&mut whole).unwrap();

                let mut reader = InstanceReader::new(8);
                let mut first = PointCloud::default();
                let mut most = 0;
                let (mut passes, skipped) = reader
                    .read(&instance, None, |block, is_whole| {
                        assert!(!is_whole || block.len() == points as usize);
                        most = most.max(block.len());
                        first.positions.extend(&block.positions);
                        first.colors.extend(&block.colors);
                        Ok::<(), Error>(())
                    })
                    .unwrap();

                assert_eq!(first, whole);
                assert!(most <= 8 && skipped.count == 0);
                assert_eq!(passes.len(), u64::from(points));
                assert_eq!(passes.in_memory().is_some(), points <= 8);

                for _ in 0..2 {
                    let mut again: Vec<Vec3> = Vec::new();
                    passes
                        .pass(&mut |block| {
                            assert!(block.len() <= 8);
                            again.extend(block);
                            Ok(())
                        })
                        .unwrap();
                    assert_eq!(again, whole.positions);
                }
            }
        }
    }

    #[test]
    fn a_reader_goes_from_instance_to_instance() {
        for points in [1, 6, 20] {
            let dir = tempfile::tempdir().unwrap();
            let [tree, cloud] = instances(dir.path(), points);
            let mut whole = PointCloud::default();
            tree.read(&mut whole).unwrap();
            let mut reader = InstanceReader::new(6);
            // An instance that was announced, one that was not, and nothing.
            for (instance, then) in [
                (&tree, Some(&cloud)),
                (&cloud, Some(&cloud)),
                (&tree, Some(&tree)),
                (&tree, None),
                (&cloud, None),
            ] {
                let mut positions = Vec::new();
                let (mut passes, _) = reader
                    .read(instance, then, |block, _| {
                        positions.extend(&block.positions);
                        Ok::<(), Error>(())
                    })
                    .unwrap();
                assert_eq!((passes.len(), &positions), (u64::from(points), &whole.positions));
                positions.clear();
                passes
                    .pass(&mut |block| {
                        positions.extend(block);
                        Ok(())
                    })
                    .unwrap();
                assert_eq!(positions, whole.positions);
            }
        }
    }

    #[test]
    fn what_is_wrong_with_the_next_instance_is_told_when_it_is_read() {
        let dir = tempfile::tempdir().unwrap();
        let [tree, cloud] = instances(dir.path(), 5);
        fs::write(tree.path(), "1 2 3 4 5 x\n").unwrap();
        let mut reader = InstanceReader::new(6);
        let (passes, _) = reader.read(&cloud, Some(&tree), |_, _| Ok::<(), Error>(())).unwrap();
        assert_eq!(passes.len(), 5);
        let read = reader.read(&tree, None, |_, _| Ok::<(), Error>(()));
        assert!(read.is_err_and(|e| e.to_string().contains("wall_1.txt")));
    }

    #[test]
    fn no_point_is_no_block_and_skipped_lines_are_told() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("office_1/Annotations");
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("wall_1.txt"), "x\n").unwrap();
        let options = AnnotationOptions { on_fault: OnFault::Skip, ..Default::default() };
        let area = Annotations::open(&[dir.path().to_owned()], &options).unwrap();
        let mut reader = InstanceReader::new(6);
        let mut blocks = 0;
        let (passes, skipped) = reader
            .read(&area.rooms[0].instances[0], None, |_, _| {
                blocks += 1;
                Ok::<(), Error>(())
            })
            .unwrap();
        assert!(passes.is_empty() && passes.in_memory().is_some());
        assert_eq!((skipped.count, blocks), (1, 0));
    }

    fn failure() -> Error {
        Error::format(std::path::Path::new("x"), "enough")
    }

    #[test]
    fn the_first_failure_ends_a_pass() {
        let dir = tempfile::tempdir().unwrap();
        let [tree, _] = instances(dir.path(), 20);
        let mut reader = InstanceReader::new(6);
        let mut blocks = 0;
        let read = reader.read(&tree, None, |_, _| {
            blocks += 1;
            if blocks == 2 { Err(failure()) } else { Ok(()) }
        });
        assert!(read.is_err() && blocks == 2);
        let (mut passes, _) = reader.read(&tree, None, |_, _| Ok::<(), Error>(())).unwrap();
        assert!(passes.pass(&mut |_| Err(failure())).is_err());
    }
}
