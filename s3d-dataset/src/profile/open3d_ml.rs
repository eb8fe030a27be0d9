//! Open3D-ML: the points and boxes of a room in a pickle.
//!
//! Its `S3DIS` data set (`ml3d/datasets/s3dis.py`) reads `original_pkl/*.pkl` if the folder exists. Otherwise
//! it makes the folder from its own list of the 272 published rooms, and stops at the first that is missing,
//! so another data set can only come as pickles. `Area_1_office_3.pkl` is a list of two. The first is the
//! points: float64, N × 7, with rows `x y z r g b label` in world metres (not moved; classes as for
//! PointNet). The second is a list of boxes, `[class, x, y, z, w, h, l, yaw]` for each instance: the middle;
//! the extents along the two principal axes of its points seen from above (w, l) and upwards (h); and the
//! angle of the first axis, in radians. Here the first axis has the longer spread; the loader takes the one
//! that its linear algebra returns first.
//!
//! `dataset_path` is the profile's folder. `test_area_idx` picks the area to test on.

use super::pickle::Pickle;
use super::room::{TreeInstance, TreeRoom, for_each_piece};
use super::{Source, for_each_room};
use crate::error::Result;
use glam::{DMat2, DVec2, DVec3, dvec2, dvec3};
use s3d_io::cloud::s3dis_coordinate;
use s3d_io::fs::create_dir;
use std::path::Path;

/// Writes the pickles.
pub(super) fn write(source: &Source<'_>, dir: &Path, rooms: &[TreeRoom]) -> Result<()> {
    let dir = dir.join("original_pkl");
    create_dir(&dir)?;

    for_each_room(source.ctx, rooms, |room| {
        let boxes = room
            .instances
            .iter()
            .map(|i| OrientedBox::of(source, i))
            .collect::<Result<Vec<_>>>()?;

        let mut pickle = Pickle::create(&dir.join(format!("{}.pkl", room.stem())))?;
        pickle.list(|pickle| {
            pickle.begin_array(boxes.iter().map(|b| b.points).sum(), 7)?;
            let mut bytes = Vec::new();
            for instance in &room.instances {
                let class = instance.class.index() as f64;
                for_each_piece(source, &instance.path, |piece| {
                    bytes.clear();
                    for (p, color) in piece.positions.iter().zip(&piece.colors) {
                        let row = p
                            .to_array()
                            .map(s3dis_coordinate)
                            .into_iter()
                            .chain(color.map(f64::from))
                            .chain([class]);
                        bytes.extend(row.flat_map(f64::to_le_bytes));
                    }
                    Ok(pickle.put(&bytes)?)
                })?;
            }
            pickle.end_array()?;

            pickle.list(|pickle| {
                for (instance, b) in room.instances.iter().zip(&boxes) {
                    pickle.list(|pickle| {
                        pickle.text(instance.class.name())?;
                        Ok(b.numbers().into_iter().try_for_each(|n| pickle.float(n))?)
                    })?;
                }
                Ok(())
            })
        })?;

        pickle.finish()?;
        Ok(())
    })
}

/// The box of an instance, along the principal axes of its points seen from above.
struct OrientedBox {
    points: u64,
    middle: DVec3,
    /// The extents along the first axis, the second axis, and upwards.
    extent: DVec3,
    yaw_rad: f64,
}

impl OrientedBox {
    fn of(source: &Source<'_>, instance: &TreeInstance) -> Result<Self> {
        // The sums are relative to the first point, so that little precision is lost.
        let mut points = 0u64;
        let mut origin = DVec2::ZERO;
        let mut sum = DVec2::ZERO;
        let mut xx = 0.0;
        let mut xy = 0.0;
        let mut yy = 0.0;
        for_each_piece(source, &instance.path, |piece| {
            for p in &piece.positions {
                let p = point_as_written(p).truncate();
                if points == 0 {
                    origin = p;
                }
                let d = p - origin;
                points += 1;
                sum += d;
                xx += d.x * d.x;
                xy += d.x * d.y;
                yy += d.y * d.y;
            }
            Ok(())
        })?;

        // The angle of the first principal axis, from the covariance.
        let mean = sum / points.max(1) as f64;
        let n = points as f64;
        xx -= n * mean.x * mean.x;
        xy -= n * mean.x * mean.y;
        yy -= n * mean.y * mean.y;
        let yaw_rad = if points > 1 {
            0.5 * libm::atan2(2.0 * xy, xx - yy)
        } else {
            0.0
        };

        let (sin, cos) = libm::sincos(yaw_rad);
        let axes = DMat2::from_cols(dvec2(cos, sin), dvec2(-sin, cos));

        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for_each_piece(source, &instance.path, |piece| {
            for p in &piece.positions {
                let p = point_as_written(p);
                let turned = (axes.transpose() * p.truncate()).extend(p.z);
                low = low.min(turned);
                high = high.max(turned);
            }
            Ok(())
        })?;

        let middle = 0.5 * (low + high);
        let middle = (axes * middle.truncate()).extend(middle.z);
        Ok(Self { points, middle, extent: high - low, yaw_rad })
    }

    /// Returns x y z w h l yaw.
    fn numbers(&self) -> [f64; 7] {
        let middle = self.middle;
        let extent = self.extent;
        [middle.x, middle.y, middle.z, extent.x, extent.z, extent.y, self.yaw_rad]
    }
}

fn point_as_written(p: &glam::Vec3) -> DVec3 {
    dvec3(s3dis_coordinate(p.x), s3dis_coordinate(p.y), s3dis_coordinate(p.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::Context;
    use crate::record::data_set::Listed;
    use s3d_io::dataset::{FileRecord, Layout};
    use s3d_label::Class;

    /// Returns the box of a table with these points.
    fn box_of(points: &str) -> OrientedBox {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("table_1.txt");
        std::fs::write(&path, points).unwrap();

        let files = Listed::of(dir.path(), [FileRecord::of_file(dir.path(), &path).unwrap()]);
        let ctx = &Context::default();
        let layout = &Layout::new(dir.path());
        let table = TreeInstance { class: Class::TABLE, name: "table_1.txt".to_owned(), path };
        OrientedBox::of(&Source { ctx, layout, files: &files, taxonomy: &Default::default() }, &table)
            .unwrap()
    }

    #[test]
    fn a_turned_table_has_its_own_axes() {
        let (sin, cos) = libm::sincos(0.5);
        let mut text = String::new();
        for i in -50..=50 {
            for j in -20..=20 {
                let u = f64::from(i) * 0.02;
                let v = f64::from(j) * 0.02;
                let x = 4.0 + u * cos - v * sin;
                let y = -3.0 + u * sin + v * cos;
                text += &format!("{x:.3} {y:.3} 0.7 0 0 0\n{x:.3} {y:.3} 0.75 0 0 0\n");
            }
        }

        let b = box_of(&text);
        assert_eq!(b.points, 2 * 101 * 41);
        let expected = [4.0, -3.0, 0.725, 2.0, 0.05, 0.8, 0.5];
        for (got, expected) in b.numbers().into_iter().zip(expected) {
            assert!((got - expected).abs() < 0.002, "{:?}", b.numbers());
        }

        let b = box_of("1 2 3 4 5 6\n");
        assert_eq!(b.numbers(), [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
