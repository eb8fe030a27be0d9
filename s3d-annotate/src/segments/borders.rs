//! Where faces meet: the edges that they share.

use rayon::prelude::*;
use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;

/// So many faces at one edge are all neighbours of each other. At an edge of more faces, each is the
/// neighbour of the next.
const FACES_AT_AN_EDGE: usize = 4;

/// An edge that two faces share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Border {
    /// The smaller face first.
    pub(super) faces: [u32; 2],
    pub(super) length_m: f32,
    /// Whether the fronts of the two faces lie on different sides of the surface.
    pub(super) is_flipped: bool,
}

/// Returns the edges that faces share, in an order that does not depend on threads. Edges are shared if the
/// places of their ends are equal, so a mesh that repeats its vertices is connected all the same.
pub(super) fn borders(mesh: &TriMesh) -> Vec<Border> {
    let place_of_vertex = places(mesh.positions());
    let corners = |face: u32| mesh.faces()[face as usize].map(|vertex| place_of_vertex[vertex as usize]);

    // Each face at each of its edges. An edge is its two places, the smaller first.
    let mut sides: Vec<(u32, u32, u32)> = (0..mesh.faces().len() as u32)
        .into_par_iter()
        .flat_map_iter(|face| {
            let [a, b, c] = corners(face);
            [(a, b), (b, c), (c, a)]
                .into_iter()
                .filter(|(from, to)| from != to)
                .map(move |(from, to)| (from.min(to), from.max(to), face))
        })
        .collect();
    sides.par_sort_unstable();

    let runs_forwards = |(start, end, face): (u32, u32, u32)| {
        let [a, b, c] = corners(face);
        [(a, b), (b, c), (c, a)].contains(&(start, end))
    };
    let mut found = Vec::with_capacity(sides.len() / 2);
    for at_edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for (i, &one) in at_edge.iter().enumerate() {
            let others = if at_edge.len() <= FACES_AT_AN_EDGE {
                at_edge.len()
            } else {
                i + 2
            };
            for &other in at_edge.iter().take(others).skip(i + 1).filter(|other| other.2 != one.2) {
                found.push(Border {
                    faces: [one.2, other.2],
                    length_m: length(mesh, one),
                    // The faces of a surface run through their common edge in opposite directions.
                    is_flipped: runs_forwards(one) == runs_forwards(other),
                });
            }
        }
    }
    found
}

/// Numbers the places of vertices. Vertices at one place have one number.
fn places(positions: &[Vec3]) -> Vec<u32> {
    // Adding 0 turns −0 into 0, so that equal positions have equal bits.
    let bits = |vertex: u32| (positions[vertex as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|&vertex| (bits(vertex), vertex));

    // The first vertex at a place gives it its number.
    let mut place_of_vertex = vec![0; positions.len()];
    for vertices in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
        for vertex in vertices {
            place_of_vertex[*vertex as usize] = vertices[0];
        }
    }
    place_of_vertex
}

/// A place has the number of one of its vertices.
fn length(mesh: &TriMesh, (start, end, _): (u32, u32, u32)) -> f32 {
    mesh.positions()[start as usize].distance(mesh.positions()[end as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    /// Two triangles of a square that name their corners apart, the second turned over if asked for.
    fn square(is_turned: bool) -> TriMesh {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 0.0], [1.0, 2.0], [0.0, 2.0]];
        let corners = corners.map(|[x, y]| vec3(x, y, 0.0)).to_vec();
        let second = if is_turned { [3, 5, 4] } else { [3, 4, 5] };
        TriMesh::from_faces(corners, vec![[0, 1, 2], second]).unwrap()
    }

    #[test]
    fn faces_with_corners_of_their_own_share_the_edge_between_equal_places() {
        let length_m = 5f32.sqrt();
        assert_eq!(borders(&square(false)), [Border { faces: [0, 1], length_m, is_flipped: false }]);
        assert_eq!(borders(&square(true)), [Border { faces: [0, 1], length_m, is_flipped: true }]);
    }

    #[test]
    fn an_edge_of_many_faces_is_a_chain() {
        let corners: Vec<Vec3> = (0..8).map(|i| vec3(i as f32, (i * i) as f32, 1.0)).collect();
        let fan = |n: u32| (2..2 + n).map(|i| [0, 1, i]).collect();
        let of = |n| borders(&TriMesh::from_faces(corners.clone(), fan(n)).unwrap()).len();
        assert_eq!((of(3), of(4), of(6)), (3, 6, 5));
    }
}
