//! What is measured once of a mesh and its segments.

use super::cells::Cells;
use super::descriptor::{Descriptor, Sums};
use crate::segments::{FaceIndex, Segments};
use s3d_geom::TriMesh;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A surface that faces straight up has at least this much of its normal along z.
const LEVEL: f32 = 0.9;

/// Levels of storeys are at least so far apart, metres.
const STOREY_M: f32 = 1.9;

/// A storey has a floor of at least this share of the largest one's area.
const LEAST_FLOOR: f64 = 0.3;

/// Heights are counted in steps of this, metres.
const STEP_M: f32 = 0.1;

/// What is measured once of a mesh and its segments: where there is surface, the floors, and the size, shape
/// and colour of each node of the tree. It takes about 60 bytes a face, and 300,000 faces take less than a
/// second.
#[derive(Clone, Debug)]
pub struct Surroundings {
    pub(super) cells: Cells,
    index: Arc<FaceIndex>,
    pub(super) of_node: Vec<Sums>,
    /// The heights of the floors, ascending, world metres.
    floors_m: Vec<f32>,
}

impl Surroundings {
    /// Measures a mesh. `index` is that of the mesh and the segments.
    ///
    /// # Panics
    /// If the segments are of another mesh.
    pub fn new(mesh: &TriMesh, segments: &Segments, index: Arc<FaceIndex>) -> Self {
        assert_eq!(segments.segment_of_face.len(), mesh.faces().len(), "each face has a segment");
        let origin = mesh.aabb().min;
        let tree = &segments.tree;

        let mut of_node = vec![Sums::default(); tree.leaf_count() as usize];
        for (face, segment) in (0u32..).zip(&segments.segment_of_face) {
            of_node[*segment as usize].add(&Sums::of_face(mesh, face, index.color(face), origin));
        }
        for node in tree.leaf_count()..tree.node_count() {
            let mut sums = Sums::default();
            for child in tree.children(node).into_iter().flatten() {
                sums.add(&of_node[child as usize]);
            }
            of_node.push(sums);
        }
        Self { cells: Cells::new(mesh), index, of_node, floors_m: floors(mesh) }
    }

    /// The faces of a node that have no label.
    pub(super) fn open_faces(&self, segments: &Segments, node: u32, instance_of_face: &[u32]) -> Vec<u32> {
        let mut open: Vec<u32> = self
            .index
            .faces_of_node(&segments.tree, node)
            .filter(|face| instance_of_face[*face as usize] == 0)
            .collect();
        open.sort_unstable();
        open
    }

    /// Returns what a surface is like.
    pub(super) fn descriptor(&self, sums: &Sums) -> Descriptor {
        sums.descriptor(self.floor_under(sums.bottom_m()))
    }

    /// Returns the sums of some faces.
    pub(super) fn sums(&self, mesh: &TriMesh, faces: impl Iterator<Item = u32>) -> Sums {
        let origin = mesh.aabb().min;
        let mut sums = Sums::default();
        for face in faces {
            sums.add(&Sums::of_face(mesh, face, self.index.color(face), origin));
        }
        sums
    }

    /// Returns the sums of each instance that has a face.
    pub(super) fn of_instances(&self, mesh: &TriMesh, instance_of_face: &[u32]) -> BTreeMap<u32, Sums> {
        let origin = mesh.aabb().min;
        let mut sums: BTreeMap<u32, Sums> = BTreeMap::new();
        for (face, &instance) in (0u32..).zip(instance_of_face).filter(|(_, instance)| **instance != 0) {
            let of_face = Sums::of_face(mesh, face, self.index.color(face), origin);
            sums.entry(instance).or_default().add(&of_face);
        }
        sums
    }

    /// Returns the height of the floor on which something stands or hangs whose lowest point is at `z`: the
    /// highest floor not above it, up to a little.
    pub(super) fn floor_under(&self, z: f32) -> f32 {
        let below = self.floors_m.iter().rev().find(|floor| **floor <= z + 3.0 * STEP_M);
        below.or(self.floors_m.first()).copied().unwrap_or(z)
    }
}

/// Returns the heights at which most of the level surface lies that faces up, storeys apart from each other.
fn floors(mesh: &TriMesh) -> Vec<f32> {
    let low = mesh.aabb().min.z;
    let mut area_at: BTreeMap<u32, f64> = BTreeMap::new();
    for face in 0..mesh.faces().len() as u32 {
        if mesh.normal(face).z > LEVEL {
            let z = mesh.triangle(face).iter().map(|corner| corner.z).sum::<f32>() / 3.0;
            *area_at.entry(((z - low) / STEP_M) as u32).or_default() += mesh.area(face);
        }
    }

    // The largest first; of equal ones, the lowest.
    let mut steps: Vec<(u32, f64)> = area_at.into_iter().collect();
    steps.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let least_m2 = steps.first().map_or(0.0, |(_, area_m2)| LEAST_FLOOR * area_m2);

    let mut floors: Vec<f32> = Vec::new();
    for (step, _) in steps.into_iter().take_while(|(_, area_m2)| *area_m2 >= least_m2) {
        let z = low + (step as f32 + 0.5) * STEP_M;
        if floors.iter().all(|floor| (z - floor).abs() >= STOREY_M) {
            floors.push(z);
        }
    }
    floors.sort_by(f32::total_cmp);
    floors
}
