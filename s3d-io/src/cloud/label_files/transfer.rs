//! Hands the labels of one mesh to the faces of another that shows the same surfaces.

use crate::cloud::annotations::push_middles;
use s3d_geom::glam::Vec3;
use s3d_geom::{Aabb, NO_INDEX, Nearest, NearestFaces, TriMesh};
use std::ops::RangeInclusive;

/// Corners that belong together may be rounded by this, metres.
const ROUNDED_M: f32 = 1e-3;
/// Surfaces that are farther apart than this are not the same, metres.
const SAME_SURFACE_M: f32 = 0.1;
/// How many parts an edge of a face is cut into, for the places that ask for a label.
const ROWS: RangeInclusive<u32> = 2..=16;

/// Returns whether two meshes have the same faces in the same order. Rounded positions count as the same.
pub(crate) fn are_same_faces(a: &TriMesh, b: &TriMesh) -> bool {
    let count = a.faces().len();
    count == b.faces().len()
        && (0..count as u32).all(|face| {
            let [p, q, r] = a.triangle(face);
            let [a, b, c] = b.triangle(face);
            let orders = [[a, b, c], [b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]];
            orders
                .iter()
                .any(|&[a, b, c]| is_near(p, a) && is_near(q, b) && is_near(r, c))
        })
}

fn is_near(p: Vec3, q: Vec3) -> bool {
    (p - q).abs().max_element() <= ROUNDED_M
}

/// Returns the share of the volume of two boxes that they have in common, 0 to 1. Flat boxes have a thickness
/// of 1 cm.
pub(crate) fn overlap(a: Aabb, b: Aabb) -> f64 {
    let volume = |min: Vec3, max: Vec3| {
        let size = (max - min).as_dvec3();
        if size.min_element() < 0.0 {
            0.0
        } else {
            (size + 0.01).element_product()
        }
    };
    let common = volume(a.min.max(b.min), a.max.min(b.max));
    common / (volume(a.min, a.max) + volume(b.min, b.max) - common)
}

/// Returns for each face of `to` the label of the surface of `from` at its place. `label_of_face` has the
/// label of each face of `from`.
///
/// A face takes the label that most of its places find on the nearest face within 10 cm; the smaller label
/// wins a tie. A face is unlabelled ([`NO_INDEX`]) if most of its places find no label.
///
/// # Panics
/// If `label_of_face` has fewer entries than `from` has faces.
#[expect(clippy::indexing_slicing, reason = "a column of another mesh is a caller's mistake: see Panics")]
pub fn labels_by_place(from: &TriMesh, label_of_face: &[u32], to: &TriMesh) -> Vec<u32> {
    let nearest_faces = NearestFaces::new(from);
    let mut labels = vec![NO_INDEX; to.faces().len()];
    let mut places = Vec::new();
    let mut counts = Vec::new();
    let mut nearest: Vec<Nearest> = Vec::new();
    let mut votes = Vec::new();

    let faces: Vec<u32> = (0..to.faces().len() as u32).collect();
    for block in faces.chunks(BLOCK_FACES) {
        places.clear();
        counts.clear();
        for &face in block {
            let before = places.len();
            push_middles(to.triangle(face), ROWS, &mut places);
            counts.push(places.len() - before);
        }
        nearest_faces.nearest_many(&places, &mut nearest);

        let mut found = nearest.iter();
        for (&face, &count) in block.iter().zip(&counts) {
            votes.clear();
            votes.extend(found.by_ref().take(count).map(|place| match place.face {
                face if face != NO_INDEX && place.distance_m <= SAME_SURFACE_M => {
                    label_of_face[face as usize]
                }
                _ => NO_INDEX,
            }));
            labels[face as usize] = most_frequent(&mut votes);
        }
    }
    labels
}

/// The faces whose places are looked up together: a few million places at most.
const BLOCK_FACES: usize = 1 << 14;

/// Returns the most frequent of some labels, and the smallest of several.
fn most_frequent(votes: &mut [u32]) -> u32 {
    votes.sort_unstable();
    let mut most = (0, NO_INDEX);
    for group in votes.chunk_by(|a, b| a == b) {
        if let Some(&label) = group.first()
            && group.len() > most.0
        {
            most = (group.len(), label);
        }
    }
    most.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    /// A strip of `n` squares of 1 m along x, at height `z`, two faces each.
    fn strip(n: u32, z: f32) -> TriMesh {
        let positions = (0..=n).flat_map(|i| [vec3(i as f32, 0.0, z), vec3(i as f32, 1.0, z)]);
        let faces = (0..n).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]]);
        TriMesh::from_faces(positions.collect(), faces.collect()).unwrap()
    }

    #[test]
    fn faces_are_the_same_in_any_order_of_corners() {
        let mesh = strip(2, 0.0);
        assert!(are_same_faces(&mesh, &strip(2, 0.0005)));
        assert!(!are_same_faces(&mesh, &strip(2, 0.01)) && !are_same_faces(&mesh, &strip(3, 0.0)));
        let turned = mesh.faces().iter().map(|&[a, b, c]| [b, a, c]).collect();
        assert!(are_same_faces(&mesh, &TriMesh::from_faces(mesh.positions().to_vec(), turned).unwrap()));
        let moved = mesh.faces().iter().rev().copied().collect();
        assert!(!are_same_faces(&mesh, &TriMesh::from_faces(mesh.positions().to_vec(), moved).unwrap()));
    }

    #[test]
    fn labels_follow_the_surface_whatever_its_faces() {
        // Two squares against a mesh of one face for both, and against one of small faces 4 cm away.
        let from = strip(2, 0.0);
        let labels = [0, 0, 1, NO_INDEX];
        assert_eq!(labels_by_place(&from, &labels, &from), labels);
        assert_eq!(labels_by_place(&from, &labels, &strip(2, 0.04)), labels);
        assert_eq!(labels_by_place(&from, &labels, &strip(2, 0.2)), [NO_INDEX; 4]);

        let corners = vec![vec3(0.0, 0.0, 0.0), vec3(1.5, 0.0, 0.0), vec3(0.0, 1.0, 0.0)];
        let across = TriMesh::from_faces(corners, vec![[0, 1, 2]]).unwrap();
        assert_eq!(labels_by_place(&from, &labels, &across), [0]);
        let few =
            TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, vec3(0.9, 0.1, 0.0)], vec![[0, 1, 2]]).unwrap();
        assert_eq!(labels_by_place(&few, &[7], &from), [NO_INDEX; 4]);
    }

    #[test]
    fn the_most_frequent_label_is_the_smallest_of_several() {
        assert_eq!(most_frequent(&mut [3, 1, 3, 1, 2]), 1);
        assert_eq!(most_frequent(&mut [NO_INDEX, 4]), 4);
        assert_eq!(most_frequent(&mut []), NO_INDEX);
    }

    #[test]
    fn boxes_overlap_by_their_volume() {
        let room = Aabb { min: Vec3::ZERO, max: vec3(4.0, 3.0, 2.6) };
        let lying = Aabb { min: vec3(0.0, -2.6, 0.0), max: vec3(4.0, 0.0, 3.0) };
        assert_eq!(overlap(room, room), 1.0);
        assert!(overlap(room, lying) < 0.01, "{}", overlap(room, lying));
    }
}
