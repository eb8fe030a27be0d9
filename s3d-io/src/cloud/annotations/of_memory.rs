//! Annotations from points in memory.

use crate::cloud::annotations::{
    AnnotatedInstance, AnnotatedRoom, Annotations, InstancePoints, PointBlocks, Skipped,
};
use crate::error::{Error, Result};
use s3d_geom::PointCloud;
use s3d_label::{Class, Room, Taxonomy};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Stands for a file's path in messages.
const PLACE: &str = "annotations in memory";

/// The points of one instance.
#[derive(Clone, Debug)]
pub struct AnnotatedPoints {
    /// The room of the instance.
    pub room: Room,
    /// Its class.
    pub class: Class,
    /// Its number among the room's instances of the same class, from 1.
    pub number: u32,
    /// Its points, world metres, Z-up. Without colours they are black. With [`PointCloud::faces`] each point
    /// votes for its own face, otherwise for the nearest one.
    pub points: PointCloud,
}

impl Annotations {
    /// Makes annotations of these points, which may come in any order. If their classes are not S3DIS's,
    /// assign [`Annotations::taxonomy`].
    ///
    /// ```
    /// use s3d_geom::{PointCloud, glam::vec3};
    /// use s3d_io::cloud::{AnnotatedPoints, Annotations};
    /// use s3d_label::Class;
    ///
    /// let points = PointCloud { positions: vec![vec3(0.0, 0.0, 0.4)], ..PointCloud::default() };
    /// let chair = AnnotatedPoints { room: "office_1".parse()?, class: Class::CHAIR, number: 1, points };
    /// let annotations = Annotations::from_points([chair])?;
    /// assert_eq!(annotations.rooms[0].instances[0].class, Class::CHAIR);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Format`] if there is no instance; and for an instance that is there twice, has the number 0,
    /// no points or a coordinate that is not finite, or whose colours or faces are not as many as its points.
    pub fn from_points(instances: impl IntoIterator<Item = AnnotatedPoints>) -> Result<Self> {
        let mut rooms: BTreeMap<Room, BTreeMap<(Class, u32), PointCloud>> = BTreeMap::new();
        for AnnotatedPoints { room, class, number, mut points } in instances {
            let refuse = |what: &str| {
                Err(Error::format(Path::new(PLACE), format!("{class}_{number} of {room}: {what}")))
            };
            if points.colors.is_empty() {
                points.colors.resize(points.positions.len(), [0; 3]);
            }
            if number == 0 {
                return refuse("instances count from 1");
            }
            if points.positions.is_empty() {
                return refuse("has no points");
            }
            if points.colors.len() != points.len() || ![0, points.len()].contains(&points.faces.len()) {
                return refuse(
                    "needs one colour a point or none at all, and one face a point or none at all",
                );
            }
            if !points.positions.iter().all(|p| p.is_finite()) {
                return refuse("has coordinates that are not finite");
            }
            if rooms.entry(room).or_default().insert((class, number), points).is_some() {
                return refuse("is there twice");
            }
        }

        if rooms.is_empty() {
            return Err(Error::format(Path::new(PLACE), "there is no instance"));
        }

        let rooms = rooms.into_iter().map(|(room, instances)| {
            let instances = instances.into_iter().map(|((class, number), points)| {
                let part = format!("{class}_{number} of {room}");
                AnnotatedInstance::new(class, number, Arc::new(PointsInMemory { part, points }))
            });
            AnnotatedRoom { room, instances: instances.collect() }
        });
        Ok(Self {
            taxonomy: Taxonomy::s3dis(),
            rooms: rooms.collect(),
            warnings: Vec::new(),
            companions: Vec::new(),
        })
    }
}

#[derive(Debug)]
struct PointsInMemory {
    part: String,
    points: PointCloud,
}

impl InstancePoints for PointsInMemory {
    fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        self.open()?.read_block(usize::MAX, out)?;
        Ok(Skipped::default())
    }

    fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        Ok(Box::new(BlocksInMemory { points: &self.points, next: 0 }))
    }

    fn path(&self) -> &Path {
        Path::new(PLACE)
    }

    fn part(&self) -> String {
        self.part.clone()
    }
}

struct BlocksInMemory<'a> {
    points: &'a PointCloud,
    next: usize,
}

impl PointBlocks for BlocksInMemory<'_> {
    fn read_block(&mut self, points: usize, out: &mut PointCloud) -> Result<bool> {
        let PointCloud { positions, colors, faces } = self.points;
        let end = self.next.saturating_add(points).min(positions.len());
        let range = self.next..end;
        // `from_points` compared the lengths.
        out.positions
            .extend_from_slice(positions.get(range.clone()).unwrap_or_default());
        out.colors
            .extend_from_slice(colors.get(range.clone()).unwrap_or_default());
        out.faces.extend_from_slice(faces.get(range).unwrap_or_default());
        self.next = end;
        Ok(end < positions.len())
    }

    fn skipped(&mut self) -> Skipped {
        Skipped::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::Vec3;

    fn instance(room: &str, class: Class, number: u32, count: usize) -> AnnotatedPoints {
        let positions = (0..count).map(|i| Vec3::splat(i as f32)).collect();
        let points = PointCloud { positions, ..PointCloud::default() };
        AnnotatedPoints { room: room.parse().unwrap(), class, number, points }
    }

    #[test]
    fn points_come_back_in_blocks_and_whole() {
        let given = [
            instance("office_2", Class::WALL, 1, 3),
            instance("WC_1", Class::FLOOR, 1, 1),
            instance("office_2", Class::CHAIR, 7, 5),
        ];
        let found = Annotations::from_points(given).unwrap();
        let names: Vec<String> = found.rooms.iter().map(|r| r.room.to_string()).collect();
        assert_eq!(names.len(), 2);

        let office = found.rooms.iter().find(|r| r.instances.len() == 2).unwrap();
        let chair = office.instances.iter().find(|i| i.class == Class::CHAIR).unwrap();
        assert_eq!(chair.number, 7);
        let mut whole = PointCloud::default();
        let mut blocks = PointCloud::default();

        chair.read(&mut whole).unwrap();
        let mut source = chair.open().unwrap();
        assert!(source.read_block(2, &mut blocks).unwrap());
        assert_eq!(blocks.len(), 2);
        while source.read_block(2, &mut blocks).unwrap() {}
        assert_eq!((whole.positions.len(), &whole.positions), (5, &blocks.positions));
        assert_eq!(whole.colors, [[0; 3]; 5]);
    }

    fn refused(given: Vec<AnnotatedPoints>) -> String {
        Annotations::from_points(given).unwrap_err().to_string()
    }

    #[test]
    fn what_is_no_annotation_is_refused() {
        assert!(refused(vec![]).contains("no instance"));
        assert!(refused(vec![instance("WC_1", Class::WALL, 0, 1)]).contains("count from 1"));
        assert!(refused(vec![instance("WC_1", Class::WALL, 1, 0)]).contains("wall_1 of WC_1: has no points"));

        let twice = instance("WC_1", Class::WALL, 1, 1);
        assert!(refused(vec![twice.clone(), twice.clone()]).contains("twice"));
        let mut bad = twice.clone();
        bad.points.colors = vec![[0; 3]; 2];
        assert!(refused(vec![bad]).contains("one colour"));
        let mut bad = twice;
        bad.points.positions[0].x = f32::NAN;
        assert!(refused(vec![bad]).contains("not finite"));
    }
}
