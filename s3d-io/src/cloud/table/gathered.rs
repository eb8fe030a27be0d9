//! Gathers the points of a cloud: counts them by room, class and instance, before the meaning of these is
//! known.

use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::meaning::Group;
use crate::cloud::table::rows::{CloudTags, NO_TAG, Reading, Rows};
use crate::error::{Error, Result};
use s3d_geom::glam::Vec3;
use std::collections::HashMap;
use std::path::Path;

/// The most instances that a cloud may have. More of them mean that the column is wrong.
pub(super) const MAX_GROUPS: usize = 1_000_000;
/// Farther from the origin than this, metres in `f32` have steps of a millimetre.
const FAR_M: f64 = 10_000.0;

/// The points of a cloud by group.
#[derive(Default)]
pub(super) struct Gathered {
    pub(super) groups: Vec<Group>,
    /// The index of a group, by room, class and instance number.
    pub(super) index: HashMap<(u32, u32, i64), u32>,
    /// The number of points.
    pub(super) points: u64,
    /// The points as they came, with the index of their group. Empty if there are too many.
    pub(super) positions: Vec<Vec3>,
    pub(super) colors: Vec<[u8; 3]>,
    pub(super) group_of: Vec<u32>,
}

impl Gathered {
    /// Reads every file once. Returns the index of a file whose colours turn out to be wide; everything must
    /// then be read again.
    pub(super) fn read(
        &mut self,
        clouds: &[&dyn Cloud],
        colors: &[ColorRange],
        options: &AnnotationOptions,
        tags: &mut CloudTags,
        warnings: &mut Vec<String>,
    ) -> Result<Option<usize>> {
        let mut without_instances: Vec<&Path> = Vec::new();
        for ((file, cloud), colors) in clouds.iter().enumerate().zip(colors) {
            let path = cloud.path();
            let mut sink = |rows: &Rows| self.add(file, path, rows, options.points_in_memory);
            let room = default_room(*cloud, options, tags);
            let mut reading = Reading::new(path, options, room, tags, &mut sink);
            if !cloud.read(*colors, &mut reading)? {
                return Ok(Some(file));
            }
            reading.end()?;

            let skipped = std::mem::take(&mut reading.skipped);
            let farthest_m = reading.farthest_m;
            if reading.has_points && !reading.has_instances && options.columns.is_empty() {
                without_instances.push(path);
            }
            warnings.append(&mut reading.notes);
            if let Some(first) = skipped.first {
                warnings.push(format!("{}: {} records left out; {first}", path.display(), skipped.count));
            }
            if farthest_m > FAR_M {
                warnings.push(format!(
                    "{}: coordinates up to {farthest_m:.0} m from the origin are rounded by up to {:.1} mm; \
                     give an offset (`offset_m`) that brings them near to it, the mesh's",
                    path.display(),
                    1e3 * farthest_m * f64::from(f32::EPSILON)
                ));
            }
        }

        if let Some(first) = without_instances.first() {
            let files = without_instances.len();
            let others = if files > 1 {
                format!(" and {} other files", files - 1)
            } else {
                String::new()
            };
            warnings.push(format!(
                "{}{others}: no instance numbers, so the points of a class in a room are one instance; if a \
                 column has them, name it, as in instance = \"object\" in [annotations]",
                first.display()
            ));
        }
        Ok(None)
    }

    /// Whether all points so far were kept.
    pub(super) fn has_all_points(&self) -> bool {
        self.group_of.len() as u64 == self.points
    }

    /// Counts rows of a file, and keeps them as long as no more than `in_memory` points came.
    fn add(&mut self, file: usize, path: &Path, rows: &Rows, in_memory: u64) -> Result<()> {
        let kept = self.has_all_points();
        self.points += rows.len() as u64;
        let keep = kept && self.points <= in_memory;
        if keep {
            self.positions.extend_from_slice(&rows.positions);
            self.colors.extend_from_slice(&rows.colors);
        } else if kept {
            (self.positions, self.colors, self.group_of) = Default::default();
        }

        // Rows of one group often follow one another.
        let mut last = ((NO_TAG, NO_TAG, 0), 0);
        for ((room, class), instance) in rows.rooms.iter().zip(&rows.classes).zip(&rows.instances) {
            let key = (*room, *class, *instance);
            if key != last.0 {
                last = (key, self.group(key, file, path)?);
            }
            #[expect(clippy::indexing_slicing, reason = "each index in the map is that of a group")]
            let group = &mut self.groups[last.1 as usize];
            group.points += 1;
            if keep {
                self.group_of.push(last.1);
            }
        }
        Ok(())
    }

    /// The index of a group, which is added if it is new.
    fn group(&mut self, key: (u32, u32, i64), file: usize, path: &Path) -> Result<u32> {
        let next = self.groups.len() as u32;
        let index = *self.index.entry(key).or_insert(next);
        if index == next {
            let (room, class, instance) = key;
            self.groups.push(Group { room, class, instance, file, points: 0 });
            if self.groups.len() > MAX_GROUPS {
                let message = format!("tells of more than {MAX_GROUPS} instances: is it the right column?");
                return Err(Error::format(path, message));
            }
        }
        Ok(index)
    }
}

/// The index of the room for points that name none, or [`NO_TAG`].
pub(super) fn default_room(cloud: &dyn Cloud, options: &AnnotationOptions, tags: &mut CloudTags) -> u32 {
    let room = options.room.or_else(|| cloud.room(&options.taxonomy));
    room.and_then(|r| tags.rooms.name(&r.to_string())).unwrap_or(NO_TAG)
}
