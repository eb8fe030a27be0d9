//! Which faces hang together.

use super::cells::{Cell, Cells, rows_after};
use s3d_geom::{DisjointSets, TriMesh};

/// Faces that hang together, and their area.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) faces: Vec<u32>,
    pub(super) area_m2: f64,
}

/// Returns the pieces of some faces, the largest first. Faces less than 5 cm apart hang together; those more
/// than 10 cm apart do not, unless others lead from one to the other.
pub(super) fn pieces(mesh: &TriMesh, cells: &Cells, faces: &[u32]) -> Vec<Piece> {
    let mut occupied: Vec<Cell> = faces.iter().flat_map(|face| cells.of(*face)).copied().collect();
    occupied.sort_unstable();
    occupied.dedup();

    let mut sets = DisjointSets::new(occupied.len());
    for (place, cell) in (0u32..).zip(&occupied) {
        let after = &occupied[place as usize..];
        for [first, last] in rows_after(*cell) {
            let begin = after.partition_point(|other| *other < first);
            let touching = after[begin..].iter().take_while(|other| **other <= last);
            for (other, _) in (place + begin as u32..).zip(touching) {
                sets.unite(place, other);
            }
        }
    }

    let mut found: Vec<Piece> = Vec::new();
    let mut piece_of_set: Vec<Option<usize>> = vec![None; occupied.len()];
    for &face in faces {
        // The cells of a face touch each other: any of them will do.
        let place = cells
            .of(face)
            .first()
            .map_or(0, |cell| occupied.partition_point(|other| other < cell));
        let set = sets.root(place as u32) as usize;
        let piece = *piece_of_set[set].get_or_insert_with(|| {
            found.push(Piece { faces: Vec::new(), area_m2: 0.0 });
            found.len() - 1
        });
        found[piece].faces.push(face);
        found[piece].area_m2 += mesh.area(face);
    }
    found.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::MeshParts;
    use s3d_geom::glam::{Vec3, vec3};
    use s3d_geom::primitives::{cuboid, grid};

    #[test]
    fn boxes_hang_together_within_5_cm() {
        // The last box is 11 cm from the others.
        let mut parts = MeshParts::default();
        for x in [0.0, 0.54, 1.15] {
            parts.append(cuboid(vec3(x, 0.0, 0.0), vec3(x + 0.5, 0.5, 0.3)));
        }
        let mesh = TriMesh::new(parts).unwrap();
        let found = pieces(&mesh, &Cells::new(&mesh), &(0..36).collect::<Vec<_>>());
        let faces: Vec<&[u32]> = found.iter().map(|piece| &piece.faces[..]).collect();
        assert_eq!(faces, [&(0..24).collect::<Vec<_>>()[..], &(24..36).collect::<Vec<_>>()[..]]);
        assert!((found[1].area_m2 - 1.1).abs() < 1e-6, "{}", found[1].area_m2);
    }

    #[test]
    fn a_surface_of_two_large_faces_is_one_piece() {
        let mesh = TriMesh::new(grid(Vec3::ZERO, vec3(7.0, 2.0, 1.0), vec3(0.0, 5.0, 3.0), [1, 1])).unwrap();
        assert_eq!(pieces(&mesh, &Cells::new(&mesh), &[0, 1]).len(), 1);
    }
}
