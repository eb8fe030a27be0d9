//! The rooms of an S3DIS tree, with their points as numpy would read them.

use super::Source;
use crate::error::Result;
use s3d_geom::PointCloud;
use s3d_io::cloud::{AnnotationTree, OnFault, PointReader, TreeOptions, s3dis_coordinate};
use s3d_io::dataset::Layout;
use s3d_label::{Class, Taxonomy};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The number of points that are read at a time.
const CHUNK: usize = 1 << 16;

/// A room of a data set's S3DIS tree, as its [profiles](crate::options::Profile) give it to loaders. Loaders
/// concatenate the points of the instances, each in the order of its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeRoom {
    /// The number of its area.
    pub area: u32,
    /// Its name, such as `office_3`.
    pub name: String,
    /// Its instances, in the order of their file names as strings: `chair_10` before `chair_2`, as
    /// `sorted(glob(…))` orders them.
    pub instances: Vec<TreeInstance>,
}

/// An instance of a room of the S3DIS tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeInstance {
    /// The S3DIS class that it counts as. S3DIS loaders know no other classes.
    pub class: Class,
    /// The name of its file for loaders, such as `chair_1.txt`.
    pub name: String,
    /// The path of its points in the data set.
    pub path: PathBuf,
}

impl TreeRoom {
    /// Returns the room's name for loaders: `Area_1_office_3`.
    pub(super) fn stem(&self) -> String {
        format!("Area_{}_{}", self.area, self.name)
    }

    /// Returns the room's name in their lists: `Area_1/office_3/Annotations`.
    pub(super) fn annotations(&self) -> String {
        format!("Area_{}/{}/Annotations", self.area, self.name)
    }
}

/// Returns the rooms of an area that have points, by type and number.
pub(crate) fn rooms_of(layout: &Layout, taxonomy: &Taxonomy, area: u32) -> Result<Vec<TreeRoom>> {
    let dir = layout.s3dis_area_dir(area);
    let is_empty = std::fs::read_dir(&dir).is_ok_and(|mut e| !e.any(|e| e.is_ok_and(|e| e.path().is_dir())));
    if is_empty {
        return Ok(Vec::new());
    }
    let options = TreeOptions { taxonomy: taxonomy.clone(), ..TreeOptions::default() };
    let tree = AnnotationTree::open_with(&dir, &options)?;
    let rooms = tree.rooms.into_iter().map(|room| {
        // Classes that count as the same S3DIS class share its numbers.
        let mut last: BTreeMap<Class, u32> = BTreeMap::new();
        let named = room.instances.into_iter().map(|i| {
            let class = i.class.s3dis();
            let number = last.entry(class).and_modify(|number| *number += 1).or_insert(1);
            let number = if taxonomy.is_s3dis() { i.number } else { *number };
            TreeInstance { class, name: format!("{class}_{number}.txt"), path: i.path }
        });
        let mut instances: Vec<TreeInstance> = named.collect();
        instances.sort_by(|a, b| a.name.cmp(&b.name));
        TreeRoom { area, name: room.room.to_string(), instances }
    });
    Ok(rooms.collect())
}

/// Reads the points of a file, and hands them out piece by piece.
pub(crate) fn for_each_piece(
    source: &Source<'_>,
    path: &Path,
    mut each: impl FnMut(&PointCloud) -> Result<()>,
) -> Result<()> {
    let mut reader = PointReader::new(source.files.open(path)?, path, OnFault::Stop);
    let mut piece = PointCloud::default();
    while reader.read_chunk(CHUNK, &mut piece)? > 0 {
        source.ctx.check()?;
        each(&piece)?;
        piece.clear();
    }
    Ok(())
}

/// Returns the number of points of an instance, and their smallest coordinates.
pub(crate) fn count_and_min(source: &Source<'_>, path: &Path) -> Result<(u64, [f64; 3])> {
    let mut count = 0;
    let mut min = [f64::INFINITY; 3];
    for_each_piece(source, path, |piece| {
        count += piece.len() as u64;
        for p in &piece.positions {
            for (min, c) in min.iter_mut().zip(p.to_array()) {
                *min = min.min(s3dis_coordinate(c));
            }
        }
        Ok(())
    })?;
    Ok((count, min))
}
