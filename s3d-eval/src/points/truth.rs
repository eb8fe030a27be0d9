//! The true points: they come from the S3DIS tree, in the order of its profiles.

use super::CLASSES;
use super::matching::TrueInstance;
use crate::error::Result;
use crate::tables::Unit;
use crate::task::Task;
use s3d_dataset::profile::TreeRoom;

/// A room that is tested.
pub(super) struct Room {
    /// The index of its fold.
    pub(super) fold: usize,
    pub(super) tree: TreeRoom,
}

/// The instances of a room. Its points come one instance after another.
pub(super) struct Points(Vec<TrueInstance>);

impl Room {
    /// Returns the rooms of all folds, fold by fold.
    pub(super) fn all(task: &Task<'_>) -> Result<Vec<Self>> {
        if task.data.taxonomy().is_none() {
            return Err(task.unlabelled());
        }
        let mut rooms = Vec::new();
        for (fold, areas) in task.folds.iter().enumerate() {
            for area in &areas.areas {
                rooms.extend(task.data.tree_rooms(*area)?.into_iter().map(|tree| Self { fold, tree }));
            }
        }
        if rooms.is_empty() {
            return Err(task.no_rooms());
        }
        Ok(rooms)
    }

    /// Returns its name with its area, such as `Area_5/office_1`.
    pub(super) fn name(&self) -> String {
        format!("Area_{}/{}", self.tree.area, self.tree.name)
    }

    /// Returns the unit with what was counted in the room.
    pub(super) fn unit<T>(&self, counted: T) -> Unit<T> {
        Unit { fold: self.fold, area: self.tree.area, name: self.tree.name.clone(), counted }
    }

    /// Counts its points.
    pub(super) fn points(&self, task: &Task<'_>) -> s3d_dataset::Result<Points> {
        let instances = self.tree.instances.iter().map(|instance| {
            let points = task.data.point_count(instance, task.ctx)?;
            Ok(TrueInstance { class: instance.class.index(), points })
        });
        Ok(Points(instances.collect::<s3d_dataset::Result<_>>()?))
    }
}

impl Points {
    /// Returns the instances, in the order of their points.
    pub(super) fn instances(&self) -> &[TrueInstance] {
        &self.0
    }

    /// Returns the number of points.
    pub(super) fn count(&self) -> u64 {
        self.0.iter().map(|instance| instance.points).sum()
    }

    /// Returns the instances of predictions with this number of rows. It must be the number of points of the
    /// room, or this number with the only point of an instance counted twice, like in the profile for
    /// Pointcept. `None` for another number.
    pub(super) fn of_rows(&self, rows: u64) -> Option<Vec<TrueInstance>> {
        if rows == self.count() {
            return Some(self.0.clone());
        }
        let twice = self.0.iter().map(|instance| match instance.points {
            1 => TrueInstance { points: 2, ..*instance },
            _ => *instance,
        });
        let twice = Self(twice.collect());
        (rows == twice.count()).then_some(twice.0)
    }
}

/// Describes the predictions that a room should have.
pub(super) fn rows_expected(room: &Room, points: &Points) -> String {
    format!(
        "{} has {} points, in the order of `s3d profile`: predictions are for all of them (those on voxels \
         are carried to the points in each), and of {CLASSES} classes",
        room.name(),
        points.count()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instances(points: &[u64]) -> Vec<TrueInstance> {
        points.iter().map(|&points| TrueInstance { class: 2, points }).collect()
    }

    #[test]
    fn the_only_point_of_an_instance_may_count_twice() {
        let points = Points(instances(&[5, 1, 0, 1]));
        assert_eq!(points.of_rows(7), Some(instances(&[5, 1, 0, 1])));
        assert_eq!(points.of_rows(9), Some(instances(&[5, 2, 0, 2])));
        assert_eq!(points.of_rows(8), None);
        assert_eq!(Points(instances(&[5])).of_rows(6), None);
    }
}
