//! The points of an instance of a table.

use crate::cloud::annotations::{InstancePoints, PointBlocks, Skipped};
use crate::cloud::table::store::PointStore;
use crate::error::Result;
use s3d_geom::PointCloud;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// An instance, as a range of the points of all instances.
#[derive(Debug)]
pub(super) struct TablePoints {
    pub(super) store: Arc<PointStore>,
    pub(super) start: u64,
    pub(super) count: u64,
    pub(super) path: PathBuf,
    pub(super) part: String,
    pub(super) are_vertices: bool,
}

impl InstancePoints for TablePoints {
    fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        self.store.read(self.start, self.count, out)?;
        Ok(Skipped::default())
    }

    fn path(&self) -> &Path {
        &self.path
    }

    fn part(&self) -> String {
        self.part.clone()
    }

    fn are_vertices(&self) -> bool {
        self.are_vertices
    }

    fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        Ok(Box::new(TableBlocks { points: self, done: 0 }))
    }
}

/// The points of an instance, block by block.
struct TableBlocks<'a> {
    points: &'a TablePoints,
    done: u64,
}

impl PointBlocks for TableBlocks<'_> {
    fn read_block(&mut self, points: usize, out: &mut PointCloud) -> Result<bool> {
        let TablePoints { store, start, count, .. } = self.points;
        let n = (points as u64).min(count - self.done);
        store.read(start + self.done, n, out)?;
        self.done += n;
        Ok(self.done < *count)
    }

    fn skipped(&mut self) -> Skipped {
        Skipped::default()
    }
}
