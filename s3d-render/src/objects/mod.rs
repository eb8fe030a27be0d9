//! What a camera sees of objects: the pixels of each, what it would cover if it stood alone, and what hides
//! it.

mod bounds;
mod seen;

pub use seen::{Beyond, Mask, SeenObject, SeenObjects};

use crate::scene::Scene;
use glam::Vec3;
use s3d_geom::TriMesh;
use std::collections::BTreeMap;

/// Stands for "no object" among the objects of faces.
pub const NO_OBJECT: u32 = u32::MAX;

/// The meshes of objects, each alone. [`ObjectScenes`] borrows them.
#[derive(Debug)]
pub struct ObjectMeshes(BTreeMap<u32, TriMesh>);

impl ObjectMeshes {
    /// Takes a mesh apart. Face f belongs to object `object_of_face[f]`, or to none for [`NO_OBJECT`]. Memory
    /// grows with the faces of the mesh.
    ///
    /// # Panics
    /// If `object_of_face` has not one entry for each face.
    pub fn new(mesh: &TriMesh, object_of_face: &[u32]) -> Self {
        let faces = mesh.faces().len();
        assert_eq!(object_of_face.len(), faces, "one object for each face");
        let object_of = |face: &u32| object_of_face[*face as usize];
        let mut sorted: Vec<u32> = (0..faces as u32).filter(|face| object_of(face) != NO_OBJECT).collect();
        sorted.sort_by_key(object_of);

        let objects = sorted.chunk_by(|a, b| object_of(a) == object_of(b));
        Self(
            objects
                .filter_map(|faces| Some((object_of(faces.first()?), alone(mesh, faces)?)))
                .collect(),
        )
    }
}

/// Returns the mesh of some faces. A part of a mesh is one, so there always is a mesh.
fn alone(mesh: &TriMesh, faces: &[u32]) -> Option<TriMesh> {
    let corner_of = |face: &u32| mesh.faces()[*face as usize];
    let mut corners: Vec<u32> = faces.iter().flat_map(corner_of).collect();
    corners.sort_unstable();
    corners.dedup();

    let positions: Vec<Vec3> = corners
        .iter()
        .map(|corner| mesh.positions()[*corner as usize])
        .collect();
    let place = |corner: u32| corners.partition_point(|other| *other < corner) as u32;
    let faces = faces.iter().map(|face| corner_of(face).map(place)).collect();
    TriMesh::from_faces(positions, faces).ok()
}

/// Objects that can each be drawn alone. It is built once for a mesh, and any number of threads use it.
#[derive(Debug)]
pub struct ObjectScenes<'m>(BTreeMap<u32, Scene<'m>>);

impl<'m> ObjectScenes<'m> {
    /// Builds a tree over the faces of each object.
    pub fn new(meshes: &'m ObjectMeshes) -> Self {
        Self(
            meshes
                .0
                .iter()
                .map(|(object, mesh)| (*object, Scene::new(mesh)))
                .collect(),
        )
    }

    /// Returns the objects that have a face, sorted.
    pub fn objects(&self) -> impl Iterator<Item = u32> {
        self.0.keys().copied()
    }

    /// Returns the scene of an object; `None` if it has no face.
    pub fn get(&self, object: u32) -> Option<&Scene<'m>> {
        self.0.get(&object)
    }
}
