//! Annotated instances that several parts of a scene show.

use crate::cloud::annotations::{AnnotatedInstance, InstancePoints, PointBlocks, Skipped};
use crate::error::Result;
use s3d_geom::glam::DAffine3;
use s3d_geom::{NO_INDEX, PointCloud, moved_point};
use s3d_label::Class;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// An annotated instance, as a part of a scene shows it, and where the part lies in the scene.
#[derive(Clone, Debug)]
pub struct PlacedInstance {
    /// The instance, in the world of its part.
    pub instance: AnnotatedInstance,
    /// The transform from the world of the part to the world of the scene.
    pub scene_from_part: DAffine3,
    /// For each face of the part's mesh its number in the scene's mesh, or [`NO_INDEX`] if it is not there.
    pub face_of_face: Arc<[u32]>,
}

impl AnnotatedInstance {
    /// Makes one instance of what the parts of a scene show of it. Its points are moved, and follow in the
    /// order of `parts`. Points whose faces are known vote for the same faces, as the scene numbers them; if
    /// such a face is not in the scene, its points know no face.
    ///
    /// # Panics
    /// If there is no part.
    pub fn joined(class: Class, number: u32, parts: Vec<PlacedInstance>) -> Self {
        assert!(!parts.is_empty(), "an instance of no part");
        Self::new(class, number, Arc::new(Joined { parts }))
    }
}

#[derive(Debug)]
struct Joined {
    parts: Vec<PlacedInstance>,
}

impl Joined {
    #[expect(clippy::indexing_slicing, reason = "there is a part: see `AnnotatedInstance::joined`")]
    fn first(&self) -> &AnnotatedInstance {
        &self.parts[0].instance
    }
}

impl InstancePoints for Joined {
    fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        let mut blocks = self.open()?;
        let mut block = PointCloud::default();
        let mut know_faces = out.is_empty() || !out.faces.is_empty();
        let mut has_more = true;
        while has_more {
            block.clear();
            has_more = blocks.read_block(usize::MAX, &mut block)?;
            know_faces &= block.is_empty() || !block.faces.is_empty();
            out.positions.append(&mut block.positions);
            out.colors.append(&mut block.colors);
            out.faces.append(&mut block.faces);
        }
        if !know_faces {
            out.faces.clear();
        }
        Ok(blocks.skipped())
    }

    fn path(&self) -> &Path {
        self.first().path()
    }

    fn part(&self) -> String {
        self.first().points.part()
    }

    fn are_vertices(&self) -> bool {
        self.parts.iter().all(|part| part.instance.are_vertices())
    }

    fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        Ok(Box::new(JoinedBlocks { left: &self.parts, ..JoinedBlocks::default() }))
    }

    fn copy_to(&self) -> Option<PathBuf> {
        self.parts.iter().find_map(|part| part.instance.copy_to())
    }
}

/// The points of all parts, block by block. Either all points of a block know their faces, or none. A block
/// is of one part, and only the last one may be empty.
#[derive(Default)]
struct JoinedBlocks<'a> {
    /// The parts that are left, the current one first.
    left: &'a [PlacedInstance],
    /// The current part, once it is open, and whether its end was read.
    open: Option<(Box<dyn PointBlocks + 'a>, bool)>,
    /// Points of the current part whose faces are not in the scene. They follow at its end.
    faceless: PointCloud,
    block: PointCloud,
    skipped: Skipped,
}

impl<'a> JoinedBlocks<'a> {
    /// Appends a block of the current part, without points of other columns than the block has.
    fn read_part(&mut self, part: &'a PlacedInstance, points: usize, out: &mut PointCloud) -> Result<()> {
        let (source, is_at_end) = match &mut self.open {
            Some(open) => open,
            None => self.open.insert((part.instance.open()?, false)),
        };
        if *is_at_end {
            out.positions.append(&mut self.faceless.positions);
            out.colors.append(&mut self.faceless.colors);
            return Ok(());
        }

        self.block.clear();
        *is_at_end = !source.read_block(points, &mut self.block)?;
        if *is_at_end {
            self.skipped.add(source.skipped());
        }
        let PointCloud { positions, colors, faces } = &self.block;
        for (at, position) in positions.iter().enumerate() {
            let new_face = |face: &u32| part.face_of_face.get(*face as usize).copied().unwrap_or(NO_INDEX);
            let face = faces.get(at).map(new_face);
            let to = if face == Some(NO_INDEX) {
                &mut self.faceless
            } else {
                &mut *out
            };
            to.positions.push(moved_point(&part.scene_from_part, *position));
            to.colors.push(colors.get(at).copied().unwrap_or_default());
            to.faces.extend(face.filter(|face| *face != NO_INDEX));
        }
        Ok(())
    }
}

impl PointBlocks for JoinedBlocks<'_> {
    fn read_block(&mut self, points: usize, out: &mut PointCloud) -> Result<bool> {
        let before = out.len();
        while let Some((part, others)) = self.left.split_first()
            && out.len() == before
        {
            self.read_part(part, points, out)?;
            if self.faceless.is_empty() && self.open.as_ref().is_some_and(|(_, is_at_end)| *is_at_end) {
                (self.left, self.open) = (others, None);
            }
        }
        Ok(!self.left.is_empty())
    }

    fn skipped(&mut self) -> Skipped {
        std::mem::take(&mut self.skipped)
    }
}

impl Skipped {
    fn add(&mut self, other: Self) {
        self.count += other.count;
        self.mended += other.mended;
        self.first = self.first.take().or(other.first);
        self.first_mended = self.first_mended.take().or(other.first_mended);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::annotations::Annotations;
    use crate::cloud::{AnnotatedPoints, InstanceReader, PointPasses};
    use s3d_geom::TriMesh;
    use s3d_geom::glam::{DVec3, Vec3};
    use s3d_label::Label;

    /// Two triangles that are one wall, and a wall of two points that know no faces.
    fn walls() -> [AnnotatedInstance; 2] {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
        let mesh = TriMesh::from_faces(positions, vec![[0, 1, 2], [1, 3, 2]]).unwrap();
        let label: Label = "wall_1_office_1_1".parse().unwrap();
        let of_faces = Annotations::from_face_labels(Path::new("a.obj"), &mesh, &[label], &[0, 0]).unwrap();
        let points = PointCloud { positions: vec![Vec3::X, Vec3::Y], ..PointCloud::default() };
        let room = label.room;
        let of_points = AnnotatedPoints { room, class: Class::WALL, number: 1, points };
        let of_points = Annotations::from_points([of_points]).unwrap();
        [of_faces, of_points].map(|annotations| annotations.rooms[0].instances[0].clone())
    }

    /// A part that is 10 m higher, whose faces become these.
    fn placed(instance: &AnnotatedInstance, face_of_face: &[u32]) -> PlacedInstance {
        PlacedInstance {
            instance: instance.clone(),
            scene_from_part: DAffine3::from_translation(10.0 * DVec3::Z),
            face_of_face: face_of_face.into(),
        }
    }

    /// The blocks of an instance: their numbers of points, and the faces of these.
    fn blocks(instance: &AnnotatedInstance) -> Vec<(usize, Vec<u32>)> {
        let mut blocks = Vec::new();
        let mut reader = InstanceReader::new(2);
        let mut all = Vec::new();
        let (mut passes, _) = reader
            .read(instance, None, |block, _| {
                let mut faces = block.faces.clone();
                faces.dedup();
                blocks.push((block.len(), faces));
                all.extend(block.positions.clone());
                Ok::<(), crate::Error>(())
            })
            .unwrap();
        assert!(all.iter().all(|p| p.z >= 10.0));
        let mut again = Vec::new();
        passes
            .pass(&mut |block| {
                again.extend(block);
                Ok(())
            })
            .unwrap();
        assert_eq!(all, again);
        blocks
    }

    #[test]
    fn points_move_and_take_the_numbers_of_their_faces_along() {
        let [of_faces, of_points] = walls();
        let alone = blocks(&placed_alone(&of_faces, &[7, 4]));
        let whole: usize = alone.iter().map(|(count, _)| count).sum();
        assert_eq!(alone.iter().map(|(_, faces)| faces.clone()).collect::<Vec<_>>(), [vec![7], vec![4]]);

        // The first face is not in the scene: its points follow without one.
        let rest = blocks(&placed_alone(&of_faces, &[NO_INDEX, 4]));
        assert_eq!(rest[0].1, [4]);
        assert_eq!((rest[1].1.len(), rest[0].0 + rest[1].0), (0, whole));
        // All faces are gone.
        let none = blocks(&placed_alone(&of_faces, &[]));
        assert_eq!(none, [(whole, Vec::new())]);

        let parts = vec![placed(&of_points, &[]), placed(&of_faces, &[1, 0]), placed(&of_points, &[])];
        let joined = AnnotatedInstance::joined(Class::WALL, 3, parts);
        let found = blocks(&joined);
        let counts = [2, alone[0].0, alone[1].0, 2];
        let faces = [vec![], vec![1], vec![0], vec![]];
        assert_eq!(found, counts.into_iter().zip(faces).collect::<Vec<_>>());
        let mut cloud = PointCloud::default();
        joined.read(&mut cloud).unwrap();
        assert_eq!((cloud.len(), cloud.faces.len()), (whole + 4, 0));
        assert!(!joined.are_vertices() && joined.number == 3);
    }

    fn placed_alone(instance: &AnnotatedInstance, face_of_face: &[u32]) -> AnnotatedInstance {
        AnnotatedInstance::joined(Class::WALL, 1, vec![placed(instance, face_of_face)])
    }
}
