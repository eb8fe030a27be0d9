//! Where separate pieces of a mesh touch.

use super::borders::Border;
use rayon::prelude::*;
use s3d_geom::glam::Vec3;
use s3d_geom::{DisjointSets, TriMesh};

/// The edge of the cells in which pieces meet, in metres.
const CELL_M: f32 = 0.04;

/// A surface reaches so far beyond itself along each axis, in metres.
const NEAR_M: f32 = 0.01;

/// The largest distance between neighbouring samples of a face, in metres.
const STEP_M: f32 = 0.02;

/// Two segments of different pieces, the smaller number first, and the length along which they touch.
pub(super) struct Touch {
    pub(super) segments: [u32; 2],
    pub(super) length_m: f64,
}

/// Returns which segments touch though no edge joins their pieces of the mesh, ascending. Furniture that was
/// modelled stands on the floor without an edge, and a scan is in pieces.
pub(super) fn touches(mesh: &TriMesh, borders: &[Border], segment_of_face: &[u32]) -> Vec<Touch> {
    let (piece_of_face, pieces) = pieces(mesh, borders);
    if pieces < 2 {
        return Vec::new();
    }

    let mut piece_of_segment = vec![0; segment_of_face.iter().max().map_or(0, |last| *last as usize + 1)];
    for (segment, piece) in segment_of_face.iter().zip(&piece_of_face) {
        piece_of_segment[*segment as usize] = *piece;
    }

    // The cells of each segment.
    let corner = mesh.aabb().min;
    let mut cells: Vec<(u64, u32)> = (0..segment_of_face.len() as u32)
        .into_par_iter()
        .fold(Vec::new, |mut cells, face| {
            // Neighbouring samples share cells.
            let mut of_face = Vec::new();
            samples(mesh, face, |point| add_cells_around(point - corner, &mut of_face));
            of_face.sort_unstable();
            of_face.dedup();
            cells.extend(of_face.iter().map(|cell| (*cell, segment_of_face[face as usize])));
            cells
        })
        .reduce(Vec::new, |mut all, mut more| {
            all.append(&mut more);
            all
        });
    cells.par_sort_unstable();
    cells.dedup();

    // The segments of different pieces in a cell, two by two.
    let mut met: Vec<[u32; 2]> = Vec::new();
    for in_cell in cells.chunk_by(|a, b| a.0 == b.0) {
        for (i, (_, one)) in in_cell.iter().enumerate() {
            let others = in_cell[i + 1..].iter().map(|(_, other)| *other);
            let piece = piece_of_segment[*one as usize];
            met.extend(
                others
                    .filter(|other| piece_of_segment[*other as usize] != piece)
                    .map(|other| [*one, other]),
            );
        }
    }
    met.par_sort_unstable();
    met.chunk_by(|a, b| a == b)
        .map(|cells| Touch { segments: cells[0], length_m: f64::from(CELL_M) * cells.len() as f64 })
        .collect()
}

/// Returns the piece of each face, and the number of pieces. The faces of a piece are joined by edges.
fn pieces(mesh: &TriMesh, borders: &[Border]) -> (Vec<u32>, usize) {
    let mut sets = DisjointSets::new(mesh.faces().len());
    for border in borders {
        let [a, b] = border.faces.map(|face| sets.root(face));
        sets.join(a, b);
    }
    sets.numbered()
}

/// Visits points of a face, at most [`STEP_M`] from each other along its edges.
fn samples(mesh: &TriMesh, face: u32, mut visit: impl FnMut(Vec3)) {
    let [a, b, c] = mesh.triangle(face);
    let longest_m = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let steps = (longest_m / STEP_M).ceil().max(1.0);
    let [to_b, to_c] = [(b - a) / steps, (c - a) / steps];
    for i in 0..=steps as u32 {
        for j in 0..=steps as u32 - i {
            visit(a + to_b * i as f32 + to_c * j as f32);
        }
    }
}

/// Adds the cells within [`NEAR_M`] of a point: one, or up to eight at the corner of a cell. A cell is a
/// number of 63 bits; the point is relative to the least corner of the mesh.
fn add_cells_around(point: Vec3, cells: &mut Vec<u64>) {
    const PER_M: f32 = 1.0 / CELL_M;
    let range = |x: f32| {
        let from = ((x - NEAR_M) * PER_M) as u32;
        let to = ((x + NEAR_M) * PER_M) as u32;
        u64::from(from)..=u64::from(to)
    };
    for x in range(point.x) {
        for y in range(point.y) {
            cells.extend(range(point.z).map(|z| x << 42 | y << 21 | z));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::borders::borders;
    use super::*;
    use s3d_geom::MeshParts;
    use s3d_geom::glam::vec3;
    use s3d_geom::primitives::{cuboid, grid};

    /// A floor, a box so far above it, and a box in the air. Each is a segment.
    fn scene(gap_m: f32) -> (TriMesh, Vec<u32>) {
        let mut parts = MeshParts::default();
        let mut segment_of_face = Vec::new();
        for (segment, body) in (0u32..).zip([
            grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, [1, 1]),
            cuboid(vec3(1.0, 1.0, gap_m), vec3(1.4, 1.4, 0.5)),
            cuboid(vec3(3.0, 3.0, 1.0), vec3(3.4, 3.4, 1.5)),
        ]) {
            segment_of_face.extend(vec![segment; body.faces.len()]);
            parts.append(body);
        }
        (TriMesh::new(parts).unwrap(), segment_of_face)
    }

    #[test]
    fn a_box_on_the_floor_touches_it_and_a_box_in_the_air_touches_nothing() {
        let (mesh, segment_of_face) = scene(0.005);
        let found = touches(&mesh, &borders(&mesh), &segment_of_face);
        assert_eq!(found.iter().map(|touch| touch.segments).collect::<Vec<_>>(), [[0, 1]]);
        // The bottom of the box covers about a hundred cells of 4 cm.
        assert!((3.0..8.0).contains(&found[0].length_m), "{}", found[0].length_m);

        let (mesh, segment_of_face) = scene(0.15);
        assert!(touches(&mesh, &borders(&mesh), &segment_of_face).is_empty());
    }
}
