//! Annotations from labels of a mesh's faces.

use crate::cloud::annotations::{
    AnnotatedInstance, AnnotatedRoom, Annotations, InstancePoints, PointBlocks, Skipped,
};
use crate::error::{Error, Result};
use s3d_geom::glam::Vec3;
use s3d_geom::{NO_INDEX, PointCloud, TriMesh};
use s3d_label::{Class, Label, Room, Taxonomy};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A face and its corners.
type Face = (u32, [Vec3; 3]);

/// The largest distance between neighbouring points of a face, metres, as far as [`MOST_ROWS`] allows.
const SPACING_M: f32 = 0.05;
/// The most parts that an edge is cut into.
const MOST_ROWS: u32 = 256;

impl Annotations {
    /// Makes annotations from labels of faces: `label_of_face` has an index into `labels` for each face of
    /// `mesh`, or [`NO_INDEX`].
    ///
    /// The points of an instance are the corners of its faces and places about 5 cm apart on them. They are
    /// black, and each knows its face ([`PointCloud::faces`]), so no other face gets its vote. The instances
    /// of a room are numbered in the order of their numbers in the area. Messages name the file `path`.
    ///
    /// Labels of other classes than S3DIS's need their taxonomy: assign [`Annotations::taxonomy`].
    ///
    /// # Errors
    /// [`Error::Format`] for `path` if no face has a label.
    ///
    /// # Panics
    /// If `label_of_face` has another length than the faces, or an entry that is no index into `labels`.
    pub fn from_face_labels(
        path: &Path,
        mesh: &TriMesh,
        labels: &[Label],
        label_of_face: &[u32],
    ) -> Result<Self> {
        Self::from_labelled_faces(path, mesh, labels, label_of_face, true)
    }

    /// Makes annotations like [`Annotations::from_face_labels`]. If the points do not know their faces, since
    /// another mesh is labelled, they are not at the corners, which neighbours share.
    pub(crate) fn from_labelled_faces(
        path: &Path,
        mesh: &TriMesh,
        labels: &[Label],
        label_of_face: &[u32],
        know_faces: bool,
    ) -> Result<Self> {
        let count = mesh.faces().len();
        assert_eq!(label_of_face.len(), count, "{count} faces need as many labels");

        let mut faces: BTreeMap<(Room, Class, u32), Vec<Face>> = BTreeMap::new();
        for (face, place) in (0u32..).zip(label_of_face).filter(|(_, place)| **place != NO_INDEX) {
            #[expect(clippy::indexing_slicing, reason = "entries are indices into `labels`: see Panics")]
            let label = labels[*place as usize];
            let key = (label.room, label.class, label.instance);
            faces.entry(key).or_default().push((face, mesh.triangle(face)));
        }

        let mut rooms: Vec<AnnotatedRoom> = Vec::new();
        for ((room, class, instance), faces) in faces {
            if rooms.last().is_none_or(|r| r.room != room) {
                rooms.push(AnnotatedRoom { room, instances: Vec::new() });
            }
            let Some(AnnotatedRoom { instances, .. }) = rooms.last_mut() else { continue };
            let number = instances.last().filter(|i| i.class == class).map_or(0, |i| i.number) + 1;
            let part = format!("{class}_{instance}_{room}");
            let points = FacePoints { path: path.to_owned(), part, faces, know_faces };
            instances.push(AnnotatedInstance::new(class, number, Arc::new(points)));
        }

        if rooms.is_empty() {
            return Err(Error::format(path, "labels no face"));
        }
        Ok(Self { taxonomy: Taxonomy::s3dis(), rooms, warnings: Vec::new(), companions: Vec::new() })
    }
}

/// The faces of an instance.
#[derive(Debug)]
struct FacePoints {
    path: PathBuf,
    part: String,
    faces: Vec<Face>,
    know_faces: bool,
}

impl InstancePoints for FacePoints {
    fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        self.open()?.read_block(usize::MAX, out)?;
        Ok(Skipped::default())
    }

    fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        Ok(Box::new(FaceBlocks { faces: &self.faces, know_faces: self.know_faces }))
    }

    fn path(&self) -> &Path {
        &self.path
    }

    fn part(&self) -> String {
        self.part.clone()
    }
}

/// The points of an instance's faces, block by block. All points of a face are in one block, which may be
/// longer than asked for by the points of one face.
struct FaceBlocks<'a> {
    /// The faces that are left.
    faces: &'a [Face],
    know_faces: bool,
}

impl PointBlocks for FaceBlocks<'_> {
    fn read_block(&mut self, points: usize, out: &mut PointCloud) -> Result<bool> {
        let faces_before = if self.know_faces { out.len() } else { 0 };
        assert!(out.faces.len() == faces_before, "points with faces beside points without");
        let end = out.len().saturating_add(points);
        while let Some((&(face, corners), rest)) = self.faces.split_first() {
            if self.know_faces {
                out.positions.extend(corners);
            }
            push_middles(corners, 1..=MOST_ROWS, &mut out.positions);
            if self.know_faces {
                out.faces.resize(out.positions.len(), face);
            }
            self.faces = rest;
            if out.positions.len() >= end {
                break;
            }
        }
        out.colors.resize(out.positions.len(), [0; 3]);
        Ok(!self.faces.is_empty())
    }

    fn skipped(&mut self) -> Skipped {
        Skipped::default()
    }
}

/// Appends the middles of the congruent triangles that a face is cut into. They are about 5 cm apart, as far
/// as the number of parts of an edge, which is in `rows`, allows.
pub(crate) fn push_middles([a, b, c]: [Vec3; 3], rows: RangeInclusive<u32>, positions: &mut Vec<Vec3>) {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let rows = ((longest / SPACING_M).ceil() as u32).clamp(*rows.start(), *rows.end());
    let u = (b - a) / rows as f32;
    let v = (c - a) / rows as f32;
    for i in 0..rows {
        for j in 0..rows - i {
            let corner = a + u * i as f32 + v * j as f32;
            positions.push(corner + (u + v) / 3.0);
            // The triangle that points the other way, if there is room for it.
            if i + j + 1 < rows {
                positions.push(corner + (u + v) * (2.0 / 3.0));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    #[test]
    fn each_face_votes_for_itself() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, vec3(0.02, 0.0, 0.0), vec3(0.0, 0.02, 0.0)];
        let mesh = TriMesh::from_faces(positions, vec![[0, 1, 2], [0, 3, 4], [1, 2, 3]]).unwrap();
        let label =
            |class, instance, room: &str| Label { class, instance, room: room.parse().unwrap(), area: 3 };
        let labels = [
            label(Class::WALL, 9, "office_2"),
            label(Class::WALL, 4, "office_2"),
            label(Class::WALL, 5, "WC_1"),
        ];

        let path = Path::new("semantic.obj");
        let found = Annotations::from_face_labels(path, &mesh, &labels, &[0, 1, NO_INDEX]).unwrap();
        assert_eq!((found.rooms.len(), found.rooms[0].instances.len()), (1, 2));
        let [four, nine] = &found.rooms[0].instances[..] else { panic!() };
        assert_eq!((four.number, nine.number), (1, 2));
        assert_eq!(nine.source(), "semantic.obj, wall_9_office_2");

        let mut cloud = PointCloud::default();
        four.read(&mut cloud).unwrap();
        assert_eq!((cloud.len(), &cloud.faces[..]), (4, &[1; 4][..]));
        nine.read(&mut cloud).unwrap();
        // √2 m in parts of 5 cm: 29 rows.
        assert_eq!(cloud.len(), 4 + 3 + 29 * 29);
        assert!(cloud.faces[4..].iter().all(|f| *f == 0) && cloud.colors.len() == cloud.len());
        assert!(
            cloud
                .positions
                .iter()
                .all(|p| p.x >= 0.0 && p.y >= 0.0 && p.x + p.y <= 1.0 + 1e-6 && p.z == 0.0)
        );
        let center = cloud.positions[7..].iter().sum::<Vec3>() / (29.0 * 29.0);
        assert!(center.abs_diff_eq(vec3(1.0 / 3.0, 1.0 / 3.0, 0.0), 1e-5), "{center}");

        let none = Annotations::from_face_labels(path, &mesh, &labels, &[NO_INDEX; 3]);
        assert!(none.unwrap_err().to_string().contains("semantic.obj: labels no face"));
    }
}
