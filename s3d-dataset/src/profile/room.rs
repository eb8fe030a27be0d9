//! The rooms of an S3DIS tree, and their points as numpy would read them.

use super::Source;
use crate::error::Result;
use s3d_geom::PointCloud;
use s3d_io::cloud::{AnnotationTree, OnFault, PointReader, TreeOptions};
use s3d_io::dataset::Layout;
use s3d_label::{Class, Taxonomy};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Points that are read at a time.
const CHUNK: usize = 1 << 16;

/// A room of the S3DIS tree of a data set, as its [profiles](crate::Profile) hand it to loaders: they put the
/// points of one instance after those of another, each in the order of its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeRoom {
    /// The number of its area.
    pub area: u32,
    /// Such as `office_3`.
    pub name: String,
    /// Its instances, in the order of their file names as strings: `chair_10` before `chair_2`, as
    /// `sorted(glob(…))` gives them.
    pub instances: Vec<TreeInstance>,
}

/// An instance of a room of the S3DIS tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeInstance {
    /// Which class of S3DIS it counts as: loaders of S3DIS know no others.
    pub class: Class,
    /// The name of its file for them, `chair_1.txt`.
    pub name: String,
    /// The file of its points in the data set.
    pub path: PathBuf,
}

impl TreeRoom {
    /// `Area_1_office_3`: how loaders call it.
    pub(super) fn stem(&self) -> String {
        format!("Area_{}_{}", self.area, self.name)
    }

    /// `Area_1/office_3/Annotations`: how their lists call it.
    pub(super) fn annotations(&self) -> String {
        format!("Area_{}/{}/Annotations", self.area, self.name)
    }
}

/// The rooms of an area that hold points, by type and number.
pub(crate) fn rooms_of(layout: &Layout, taxonomy: &Taxonomy, area: u32) -> Result<Vec<TreeRoom>> {
    let dir = layout.s3dis_area_dir(area);
    let is_empty = std::fs::read_dir(&dir).is_ok_and(|mut e| !e.any(|e| e.is_ok_and(|e| e.path().is_dir())));
    if is_empty {
        return Ok(Vec::new());
    }
    let options = TreeOptions { taxonomy: taxonomy.clone(), ..TreeOptions::default() };
    let tree = AnnotationTree::open_with(&dir, &options)?;
    let rooms = tree.rooms.into_iter().map(|room| {
        // Classes that count as one share its numbers.
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

/// Hands out the points of a file, some at a time.
pub(super) fn for_each_piece(
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

/// The number that stands in the file, as the nearest `f64`. Files hold millimetres, and a coordinate in them
/// is the nearest `f32`, so that the whole millimetre next to it is what stood there, or nothing lies between
/// the two.
pub(super) fn as_written(coordinate: f32) -> f64 {
    (f64::from(coordinate) * 1000.0).round() / 1000.0
}

/// The number of points of an instance, and their least coordinates.
pub(super) fn count_and_min(source: &Source<'_>, path: &Path) -> Result<(u64, [f64; 3])> {
    let (mut count, mut min) = (0, [f64::INFINITY; 3]);
    for_each_piece(source, path, |piece| {
        count += piece.len() as u64;
        for p in &piece.positions {
            for (min, c) in min.iter_mut().zip(p.to_array()) {
                *min = min.min(as_written(c));
            }
        }
        Ok(())
    })?;
    Ok((count, min))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn millimetres_are_read_as_numpy_reads_them() {
        for millimetres in (-9_000_000i32..9_000_000).step_by(997) {
            let text = format!(
                "{}{}.{:03}",
                if millimetres < 0 { "-" } else { "" },
                millimetres.abs() / 1000,
                millimetres.abs() % 1000
            );
            let (single, double): (f32, f64) = (text.parse().unwrap(), text.parse().unwrap());
            if f64::from(single.abs().next_up() - single.abs()) < 0.001 {
                assert_eq!(as_written(single), double, "{text}");
            }
        }
    }
}
