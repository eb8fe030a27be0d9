//! The boxes of the faces of each label.

use rayon::prelude::*;
use s3d_geom::glam::Vec3;
use s3d_geom::{Aabb, OrientedBox, TriMesh, main_normals};
use std::collections::BTreeMap;

/// The normals of large faces that are tried as an axis of a box.
const NORMALS: usize = 12;

/// Boxes around the faces of a label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoxesOfFaces {
    /// The box along the axes of the world.
    pub(crate) bbox: Aabb,
    /// The smallest upright box.
    pub(crate) upright: OrientedBox,
    /// A smallest box in any orientation.
    pub(crate) oriented: OrientedBox,
}

/// Returns the boxes of each label that a face has, without the null label, 0. Runs on the threads of the
/// current rayon pool.
pub(crate) fn boxes_of_faces(mesh: &TriMesh, label_of_face: &[u32]) -> BTreeMap<u32, BoxesOfFaces> {
    let mut faces: Vec<u32> = (0..label_of_face.len() as u32).collect();
    faces.retain(|face| label_of_face[*face as usize] != 0);
    faces.sort_by_key(|face| label_of_face[*face as usize]);

    let of_labels: Vec<&[u32]> = faces
        .chunk_by(|a, b| label_of_face[*a as usize] == label_of_face[*b as usize])
        .collect();
    of_labels
        .into_par_iter()
        .filter_map(|faces| Some((label_of_face[*faces.first()? as usize], boxes(mesh, faces)?)))
        .collect()
}

/// Returns the boxes of some faces.
fn boxes(mesh: &TriMesh, faces: &[u32]) -> Option<BoxesOfFaces> {
    let mut corners: Vec<u32> = faces.iter().flat_map(|face| mesh.faces()[*face as usize]).collect();
    corners.sort_unstable();
    corners.dedup();

    let points: Vec<Vec3> = corners
        .iter()
        .map(|corner| mesh.positions()[*corner as usize])
        .collect();
    let likely = main_normals(mesh, faces, NORMALS);
    Some(BoxesOfFaces {
        bbox: Aabb::from_points(points.iter().copied()),
        upright: OrientedBox::upright(&points)?,
        oriented: OrientedBox::smallest(&points, &likely)?,
    })
}
