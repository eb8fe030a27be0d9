//! Labels for faces without a vote, from the labelled surface next to them.

use crate::LabelId;
use s3d_geom::glam::{DVec3, Vec3};
use s3d_geom::{NearestFaces, TriMesh};
use std::cmp::{Ordering, Reverse};
use std::collections::{BinaryHeap, HashMap, HashSet};

/// The cosine of 45°, the largest angle at which a surface continues. At a sharper edge another thing
/// begins.
const SMOOTH: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The largest step between two pieces of surface that are flush: 5 mm.
const FLUSH_M: f64 = 0.005;

/// A face with more cells around it counts as near, without a look at each cell.
const MOST_CELLS: f64 = 1000.0;

/// Labels the faces with [`LabelId::NULL`] like the nearest labelled surface, if their middles are at most
/// `within_m` metres away. Returns the indices of the faces that got a label, ascending.
///
/// A label first spreads along the surface, from face to face across shared edges (edges are shared if the
/// places of their corners are equal). It does not cross an edge at which normals differ by more than 45°,
/// so it does not go around a sharp edge. The length of a way counts from the edge of the labelled surface
/// through the middles of edges and faces.
///
/// The mesh may be in pieces. A face that no way reaches takes the label of the nearest labelled face by
/// straight line, if the two are flush: normals differ by at most 45°, and the face is at most 5 mm above or
/// below. If two labels are equally near, the smaller wins. The result is the same for any number of threads.
///
/// # Panics
/// If there is not one label per face, or `within_m` is NaN.
///
/// ```
/// use s3d_geom::{TriMesh, glam::vec3};
/// use s3d_label::{LabelId, fill_labels};
///
/// // A strip of two squares of 10 cm, two faces each, with a wall at its far end.
/// let corner = |i: u32| vec3(0.1 * (i / 2) as f32, 0.1 * (i % 2) as f32, 0.0);
/// let mut corners: Vec<_> = (0..6).map(corner).collect();
/// corners.push(vec3(0.2, 0.0, 0.1));
/// let faces = vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5], [4, 6, 5]];
/// let mesh = TriMesh::from_faces(corners, faces)?;
/// let floor = LabelId(7);
/// let mut labels = [floor, floor, LabelId::NULL, LabelId::NULL, LabelId::NULL];
/// assert_eq!(fill_labels(&mesh, &mut labels, 0.05), [2]);
/// assert_eq!(fill_labels(&mesh, &mut labels, 0.5), [3]);
/// assert_eq!(labels, [floor, floor, floor, floor, LabelId::NULL]);
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub fn fill_labels(mesh: &TriMesh, label_of_face: &mut [LabelId], within_m: f64) -> Vec<u32> {
    assert_eq!(mesh.faces().len(), label_of_face.len(), "one label per face");
    assert!(!within_m.is_nan(), "within_m is not a number");

    let mut filled = along_the_surface(mesh, label_of_face, within_m);
    let reached: HashSet<u32> = filled.iter().map(|(face, _)| *face).collect();
    filled.extend(across_gaps(mesh, label_of_face, &reached, within_m));
    filled.sort_unstable();

    for &(face, label) in &filled {
        if let Some(place) = label_of_face.get_mut(face as usize) {
            *place = label;
        }
    }
    filled.into_iter().map(|(face, _)| face).collect()
}

fn faces_with(label_of_face: &[LabelId], null: bool) -> impl Iterator<Item = (u32, LabelId)> {
    (0u32..)
        .zip(label_of_face.iter().copied())
        .filter(move |(_, label)| label.is_null() == null)
}

fn middle(mesh: &TriMesh, face: u32) -> DVec3 {
    mesh.triangle(face).map(|c| c.as_dvec3()).iter().sum::<DVec3>() / 3.0
}

/// Returns the unit normal in `f64`. The mesh has it in `f32`.
fn normal(mesh: &TriMesh, face: u32) -> DVec3 {
    let [a, b, c] = mesh.triangle(face).map(|c| c.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero()
}

/// An edge, as the places of its ends, the smaller first.
type Edge = [[u32; 3]; 2];

/// Returns the edges of a face, whether the face runs from the smaller end to the larger, and the middles.
fn edges(mesh: &TriMesh, face: u32) -> [(Edge, bool, DVec3); 3] {
    let [a, b, c] = mesh.triangle(face);
    [[a, b], [b, c], [c, a]].map(|[from, to]| {
        let start = place_key(from);
        let end = place_key(to);
        let edge = if start < end { [start, end] } else { [end, start] };
        (edge, start < end, (from.as_dvec3() + to.as_dvec3()) / 2.0)
    })
}

/// Returns the place as bits. Adding 0 turns −0 into 0.
fn place_key(p: Vec3) -> [u32; 3] {
    (p + 0.0).to_array().map(f32::to_bits)
}

/// A way to a face. The shortest way is the smallest.
#[derive(PartialEq)]
struct Way {
    length_m: f64,
    label: LabelId,
    face: u32,
}

impl Eq for Way {}

impl Ord for Way {
    fn cmp(&self, other: &Self) -> Ordering {
        self.length_m
            .total_cmp(&other.length_m)
            .then_with(|| (self.label, self.face).cmp(&(other.label, other.face)))
    }
}

impl PartialOrd for Way {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Returns the faces that the shortest ways over smooth edges reach, with their labels, in the order of the
/// lengths. This is Dijkstra's algorithm.
fn along_the_surface(mesh: &TriMesh, label_of_face: &[LabelId], within_m: f64) -> Vec<(u32, LabelId)> {
    // For each edge, the unlabelled faces at it, and their directions along it.
    let mut at_edge: HashMap<Edge, Vec<(u32, bool)>> = HashMap::new();
    for (face, _) in faces_with(label_of_face, true) {
        for (edge, forwards, _) in edges(mesh, face) {
            at_edge.entry(edge).or_default().push((face, forwards));
        }
    }

    let mut ways: BinaryHeap<Reverse<Way>> = BinaryHeap::new();
    // Adds the ways on from a face with a label. They start at its edge if it was labelled before.
    let go_on = |ways: &mut BinaryHeap<Reverse<Way>>, from: u32, label: LabelId, so_far: Option<f64>| {
        for (edge, forwards, at) in edges(mesh, from) {
            let start_m = so_far.map_or(0.0, |m| m + at.distance(middle(mesh, from)));
            for &(face, other_forwards) in at_edge.get(&edge).into_iter().flatten() {
                // Two faces with the same orientation run along their edge in opposite directions.
                let turned = if forwards == other_forwards { -1.0 } else { 1.0 };
                if face == from || turned * normal(mesh, from).dot(normal(mesh, face)) < SMOOTH {
                    continue;
                }
                let length_m = start_m + at.distance(middle(mesh, face));
                if length_m <= within_m {
                    ways.push(Reverse(Way { length_m, label, face }));
                }
            }
        }
    };

    for (face, label) in faces_with(label_of_face, false) {
        go_on(&mut ways, face, label, None);
    }
    let mut reached: HashSet<u32> = HashSet::new();
    let mut filled = Vec::new();
    while let Some(Reverse(Way { length_m, label, face })) = ways.pop() {
        if reached.insert(face) {
            filled.push((face, label));
            go_on(&mut ways, face, label, Some(length_m));
        }
    }
    filled
}

/// Returns the faces that are flush with a labelled face nearby, with their labels. Faces in `reached` are
/// left out.
fn across_gaps(
    mesh: &TriMesh,
    label_of_face: &[LabelId],
    reached: &HashSet<u32>,
    within_m: f64,
) -> Vec<(u32, LabelId)> {
    let unlabelled = faces_with(label_of_face, true).map(|(face, _)| face);
    let left: Vec<(u32, DVec3)> = unlabelled
        .filter(|face| !reached.contains(face))
        .map(|face| (face, middle(mesh, face)))
        .collect();

    // A hierarchy of all labelled faces would be large. Only those near a face that is left are needed.
    let cell_m = within_m.max(0.01);
    let cells: HashSet<_> = left.iter().map(|(_, at)| cell_of(*at, cell_m)).collect();
    let is_near = |face: u32| {
        let corners = mesh.triangle(face).map(|c| c.as_dvec3());
        let min = cell_of(corners.iter().copied().reduce(DVec3::min).unwrap_or_default() - within_m, cell_m);
        let max = cell_of(corners.iter().copied().reduce(DVec3::max).unwrap_or_default() + within_m, cell_m);
        let count = (max - min).as_dvec3() + 1.0;
        count.element_product() > MOST_CELLS.max(cells.len() as f64)
            || (min.x..=max.x)
                .any(|x| (min.y..=max.y).any(|y| (min.z..=max.z).any(|z| cells.contains(&(x, y, z).into()))))
    };

    let labelled: Vec<(u32, LabelId)> = faces_with(label_of_face, false)
        .filter(|(face, _)| !left.is_empty() && is_near(*face))
        .collect();
    let positions: Vec<Vec3> = labelled.iter().flat_map(|(face, _)| mesh.triangle(*face)).collect();
    let faces = (0..labelled.len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    // Faces of a mesh have areas, so this only fails without faces. Then nothing is near.
    let Ok(part) = TriMesh::from_faces(positions, faces) else { return Vec::new() };

    let mut nearest = Vec::new();
    let middles: Vec<Vec3> = left.iter().map(|(_, at)| at.as_vec3()).collect();
    NearestFaces::new(&part).nearest_many(&middles, &mut nearest);
    left.iter()
        .zip(&nearest)
        .filter_map(|((face, at), nearest)| {
            let (other, label) = *labelled.get(nearest.face as usize)?;
            let up = normal(mesh, other);
            let is_flush = up.dot(normal(mesh, *face)) >= SMOOTH
                && up.dot(*at - nearest.point.as_dvec3()).abs() <= FLUSH_M;
            (f64::from(nearest.distance_m) <= within_m && is_flush).then_some((*face, label))
        })
        .collect()
}

fn cell_of(p: DVec3, cell_m: f64) -> s3d_geom::glam::I64Vec3 {
    (p / cell_m).floor().as_i64vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_geom::glam::vec3;

    /// Returns a horizontal strip of squares of 10 cm along x from `x_m`, two faces each. Faces do not share
    /// vertices.
    fn strip(squares: usize, x_m: f32, z_m: f32) -> Vec<[Vec3; 3]> {
        let square = |i: usize| {
            let at = |dx: usize, y: f32| vec3(x_m + 0.1 * (i + dx) as f32, y, z_m);
            let [a, b, c, d] = [at(0, 0.), at(1, 0.), at(1, 0.1), at(0, 0.1)];
            [[a, b, c], [a, c, d]]
        };
        (0..squares).flat_map(square).collect()
    }

    fn mesh_of(triangles: &[[Vec3; 3]]) -> TriMesh {
        let faces = (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        TriMesh::from_faces(triangles.concat(), faces).unwrap()
    }

    fn filled(triangles: &[[Vec3; 3]], labels: &[u32], within_m: f64) -> Vec<u32> {
        let mut labels: Vec<LabelId> = labels.iter().map(|l| LabelId(*l)).collect();
        fill_labels(&mesh_of(triangles), &mut labels, within_m);
        labels.iter().map(|l| l.0).collect()
    }

    #[test]
    fn two_labels_meet_in_the_middle_and_a_short_way_ends_early() {
        let strip = strip(6, 0.0, 0.0);
        let mut labels = [0; 12];
        labels[..2].fill(4);
        labels[10..].fill(2);
        assert_eq!(filled(&strip, &labels, 9.0), [4, 4, 4, 4, 4, 4, 2, 2, 2, 2, 2, 2]);
        // The first face beyond is 3.7 cm away, the next 8.4 cm.
        assert_eq!(filled(&strip, &labels, 0.05), [4, 4, 0, 4, 0, 0, 0, 0, 2, 0, 2, 2]);
        assert_eq!(filled(&strip, &labels, 0.0), labels);
        assert_eq!(filled(&strip, &[0; 12], 9.0), [0; 12]);
    }

    #[test]
    fn no_label_goes_around_a_sharp_edge() {
        // Two squares of floor, and one at their end, bent by 40° and by 50°.
        for (degrees, expected) in [(40.0f32, [3, 3, 3, 3, 3, 3]), (50.0, [3, 3, 3, 3, 0, 0])] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let mut faces = strip(3, 0.0, 0.0);
            for corner in faces.iter_mut().flatten().filter(|c| c.x > 0.25) {
                *corner = vec3(0.2 + 0.1 * cos, corner.y, 0.1 * sin);
            }
            assert_eq!(filled(&faces, &[3, 3, 0, 0, 0, 0], 1.0), expected, "{degrees}°");
            // A face with the other winding is at the same angle.
            faces[2].swap(0, 1);
            assert_eq!(filled(&faces, &[3, 3, 0, 0, 0, 0], 1.0), expected, "{degrees}°, turned");
        }
    }

    fn is_filled_beside(gap_m: f32, step_m: f32, within_m: f64) -> bool {
        let faces = [strip(1, 0.0, 0.0), strip(1, 0.1 + gap_m, step_m)].concat();
        filled(&faces, &[5, 5, 0, 0], within_m)[2..] == [5, 5]
    }

    #[test]
    fn gaps_are_crossed_where_pieces_are_flush() {
        assert!(is_filled_beside(0.01, 0.004, 0.1) && is_filled_beside(0.01, -0.004, 0.1));
        assert!(!is_filled_beside(0.01, 0.006, 0.1), "a step");
        assert!(!is_filled_beside(0.01, 0.0, 0.05), "the farther of the two is 7.7 cm away");
        // The other side of a thin board is another thing.
        let mut board = [strip(1, 0.0, 0.0), strip(1, 0.0, 0.003)].concat();
        board[2..].iter_mut().for_each(|face| face.swap(0, 1));
        assert_eq!(filled(&board, &[5, 5, 0, 0], 1.0), [5, 5, 0, 0]);
    }

    fn place((x, y, z): (i8, i8, i8)) -> Vec3 {
        vec3(x.into(), y.into(), f32::from(z) * 0.5)
    }

    fn any_corner() -> impl Strategy<Value = (i8, i8, i8)> {
        (0..5i8, 0..5i8, 0..2i8)
    }

    /// Makes triangles on a coarse lattice, each with a label or none.
    fn any_labelled() -> impl Strategy<Value = (TriMesh, Vec<LabelId>)> {
        prop::collection::vec(([any_corner(), any_corner(), any_corner()], 0..6u32), 1..40).prop_filter_map(
            "no area",
            |faces| {
                let triangles: Vec<[Vec3; 3]> = faces.iter().map(|(corners, _)| corners.map(place)).collect();
                let parts = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
                let mesh = TriMesh::from_faces(triangles.concat(), parts).ok()?;
                let labels = faces.iter().map(|(_, l)| LabelId(l.saturating_sub(3)));
                (mesh.faces().len() == faces.len()).then(|| (mesh, labels.collect()))
            },
        )
    }

    /// The plain reference: the length of the shortest way to each face, and its label. It shortens ways
    /// until none can be shortened.
    fn shortest_ways(mesh: &TriMesh, labels: &[LabelId]) -> Vec<(f64, LabelId)> {
        let count = labels.len() as u32;
        let mut ways: Vec<(f64, LabelId)> = labels
            .iter()
            .map(|l| (if l.is_null() { f64::INFINITY } else { 0.0 }, *l))
            .collect();
        let mut pairs = Vec::new();
        for (a, b) in (0..count)
            .flat_map(|a| (0..count).map(move |b| (a, b)))
            .filter(|(a, b)| a != b)
        {
            for (edge, forwards, at) in edges(mesh, a) {
                for (other, other_forwards, _) in edges(mesh, b) {
                    let cos = normal(mesh, a).dot(normal(mesh, b));
                    let cos = if forwards == other_forwards { -cos } else { cos };
                    if edge == other && cos >= SMOOTH && labels[b as usize].is_null() {
                        pairs.push((a as usize, b as usize, at));
                    }
                }
            }
        }

        for _ in 0..count {
            for &(a, b, at) in &pairs {
                let (so_far, label) = ways[a];
                let first = if labels[a].is_null() {
                    at.distance(middle(mesh, a as u32))
                } else {
                    0.0
                };
                let way = (so_far + first + at.distance(middle(mesh, b as u32)), label);
                if way < ways[b] {
                    ways[b] = way;
                }
            }
        }
        ways
    }

    proptest! {
        #[test]
        fn labels_are_those_of_the_shortest_ways(
            (mesh, labels) in any_labelled(),
            within_m in 0.0..6.0f64,
        ) {
            let found = along_the_surface(&mesh, &labels, within_m);
            let expected: Vec<(u32, LabelId)> = (0..)
                .zip(shortest_ways(&mesh, &labels))
                .filter(|(face, (length_m, _))| labels[*face as usize].is_null() && *length_m <= within_m)
                .map(|(face, (_, label))| (face, label))
                .collect();
            let mut sorted = found.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, expected);
        }

        #[test]
        fn labels_that_are_there_stay(
            (mesh, labels) in any_labelled(),
            within_m in 0.0..6.0f64,
        ) {
            let mut filled = labels.clone();
            let faces = fill_labels(&mesh, &mut filled, within_m);
            let changed = (0u32..).zip(labels.iter().zip(&filled)).filter(|(_, (a, b))| a != b);
            prop_assert_eq!(&faces, &changed.map(|(face, _)| face).collect::<Vec<_>>());
            prop_assert!(faces.iter().all(|face| labels[*face as usize].is_null()));
        }
    }
}
