//! Reads the points of a scan, in the world.

use crate::cloud::table::measured::ScanBlock;
use crate::error::{Error, Result};
use crate::raw::laser::{LaserScans, Trajectory};
use s3d_geom::glam::{DAffine3, DVec3};

/// A point nearer to the scanner is a ray without a return, metres.
const NO_RANGE_M: f64 = 1e-3;

/// What was read of a scan.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadScan {
    /// The number of points that were handed on.
    pub points: u64,
    /// The number of points that were left out because they are at the scanner itself.
    pub without_range: u64,
    /// The number of points that were left out because the trajectory does not tell where the scanner was.
    pub without_place: u64,
    /// The number of faulty lines or records that were left out.
    pub faulty: u64,
    /// What was left out: a sentence each, for the user.
    pub warnings: Vec<String>,
}

impl LaserScans {
    /// Hands the points of a scan, by its number from 0, to `each`, block after block of up to 65,536 points.
    /// Every call gives the same points in the same order.
    ///
    /// Points that the file marks as invalid, and rays without a return, are left out.
    ///
    /// # Errors
    /// The errors of `each`, which end the reading. [`Error::Io`]; [`Error::Format`] if there is no such
    /// scan, if the file is damaged, or if the trajectory and the points have no time in common.
    pub fn read<E: From<Error>>(
        &self,
        scan: usize,
        mut each: impl FnMut(&ScanBlock) -> std::result::Result<(), E>,
    ) -> std::result::Result<ReadScan, E> {
        let mut stopped = None;
        let read = self.read_blocks(scan, &mut |block| {
            each(block).map_err(|e| {
                stopped = Some(e);
                // It never leaves this function.
                Error::format("".as_ref(), "")
            })
        });
        match stopped {
            Some(e) => Err(e),
            None => Ok(read?),
        }
    }

    fn read_blocks(&self, number: usize, each: &mut dyn FnMut(&ScanBlock) -> Result<()>) -> Result<ReadScan> {
        let (scan, source) = self.scan(number)?;
        let origin = scan.origin_m.filter(|_| self.trajectory.is_none());
        let mut read = ReadScan::default();
        let mut times = Times::default();

        let passed = source.read(&self.columns, self.on_fault, &mut |block| {
            move_into_world(block, &self.world_from_file);
            if let Some(trajectory) = &self.trajectory {
                if block.times_s.is_empty() {
                    let message = "has no times, so the trajectory does not tell where the scanner was";
                    return Err(Error::format(&scan.path, message));
                }
                times.see(&block.times_s);
                read.without_place += place(block, trajectory);
            }
            read.without_range += drop_without_range(block, origin);
            read.points += block.len() as u64;
            if block.is_empty() { Ok(()) } else { each(block) }
        })?;

        if let Some(trajectory) = &self.trajectory
            && read.points == 0
            && read.without_place > 0
        {
            let [first, last] = trajectory.times_s();
            let message = format!(
                "its points were measured from {} s to {} s, and the trajectory goes from {first} s to \
                 {last} s: bring both to the same clock",
                times.first, times.last
            );
            return Err(Error::format(&scan.path, message));
        }
        read.faulty = passed.skipped;
        read.warnings = passed.notes;
        let shown = scan.path.display();
        for (count, what) in [
            (read.without_range, "are at the scanner itself"),
            (read.without_place, "were measured when the trajectory does not tell where the scanner was"),
            (read.faulty, "are faulty"),
        ] {
            if count > 0 {
                read.warnings.push(format!("{shown}: {count} points {what}, left out"));
            }
        }
        Ok(read)
    }
}

/// Moves a block from the frame of the files to the world.
pub(super) fn move_into_world(block: &mut ScanBlock, world_from_file: &DAffine3) {
    if *world_from_file != DAffine3::IDENTITY {
        let positions = block.positions_m.iter_mut();
        positions.for_each(|position| *position = world_from_file.transform_point3(*position));
    }
}

/// The first and last time of points.
struct Times {
    first: f64,
    last: f64,
}

impl Default for Times {
    fn default() -> Self {
        Self { first: f64::INFINITY, last: f64::NEG_INFINITY }
    }
}

impl Times {
    fn see(&mut self, times_s: &[f64]) {
        for time in times_s {
            self.first = self.first.min(*time);
            self.last = self.last.max(*time);
        }
    }
}

/// Gives each point the place of the scanner at its time. Points without a place are dropped. Returns their
/// number.
fn place(block: &mut ScanBlock, trajectory: &Trajectory) -> u64 {
    let origins: Vec<Option<DVec3>> = block.times_s.iter().map(|time| trajectory.place_at(*time)).collect();
    let is_known: Vec<bool> = origins.iter().map(Option::is_some).collect();
    keep(block, &is_known);
    block.origins_m.extend(origins.into_iter().flatten());
    is_known.iter().filter(|known| !**known).count() as u64
}

/// Drops the points at the scanner's place. Returns their number.
fn drop_without_range(block: &mut ScanBlock, origin: Option<DVec3>) -> u64 {
    let is_far = |(i, position): (usize, &DVec3)| {
        let origin = origin.or_else(|| block.origins_m.get(i).copied());
        origin.is_none_or(|origin| position.distance(origin) >= NO_RANGE_M)
    };
    let has_range: Vec<bool> = block.positions_m.iter().enumerate().map(is_far).collect();
    let without = has_range.iter().filter(|has| !**has).count() as u64;
    if without > 0 {
        keep(block, &has_range);
    }
    without
}

/// Keeps the points whose flag is set.
fn keep(block: &mut ScanBlock, flags: &[bool]) {
    fn column<T>(values: &mut Vec<T>, flags: &[bool]) {
        let mut flag = flags.iter();
        values.retain(|_| flag.next().copied().unwrap_or(true));
    }
    column(&mut block.positions_m, flags);
    column(&mut block.colors, flags);
    column(&mut block.intensities, flags);
    column(&mut block.cells, flags);
    column(&mut block.times_s, flags);
    column(&mut block.origins_m, flags);
}
