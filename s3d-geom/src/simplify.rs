//! Meshes of fewer faces, for viewing: the vertices in a cell of a grid are merged.
//!
//! The method is P. Lindstrom's, "Out-of-core simplification of large polygonal models", 2000. The vertex of
//! a cell minimises the squared distances to the planes of the faces with a corner in the cell, weighted by
//! area. The mesh may have any topology. Every face that stays is a face of the mesh, so its attributes still
//! hold.

use crate::TriMesh;
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashSet;

/// The largest number of cells along an axis, so that the number of a cell fits in 63 bits.
const MOST_CELLS: f64 = (1u32 << 21) as f64;

/// The factor by which cells grow from one attempt to the next.
const GROWTH: f64 = 1.3;

/// The weight that draws the vertex of a cell towards the mean of its vertices. On a flat surface, the planes
/// alone leave the place within the surface open.
const HOLD: f64 = 1e-3;

/// A mesh with fewer faces, made by [`simplify`].
#[derive(Clone, Debug, PartialEq)]
pub struct SimplifiedMesh {
    /// The edge of the cells, in metres. Every vertex moved by less than the diagonal of a cell.
    pub cell_m: f64,
    /// The vertices, in world metres.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` per face.
    pub faces: Vec<[u32; 3]>,
    /// For each of `faces`, the face of the mesh that it was; ascending.
    pub face_of: Vec<u32>,
    /// For each vertex of the mesh, the index in `positions` of the vertex that it became.
    /// [`NO_INDEX`](crate::NO_INDEX) if no face uses it, or no face that stays has a corner in its cell.
    pub vertex_of: Vec<u32>,
}

/// Merges the vertices in the cells of a grid, so that at most `most` faces are left. Returns `None` if the
/// mesh has no more faces already.
///
/// The cells grow from attempt to attempt until the number fits. A face goes if two of its corners are
/// merged, or if it has the corners of an earlier face.
///
/// ```
/// use s3d_geom::{TriMesh, primitives::grid, simplify, glam::Vec3};
///
/// // A floor of 20,000 triangles becomes a floor of at most a thousand.
/// let floor = TriMesh::new(grid(Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0, [100, 100]))?;
/// let small = simplify(&floor, 1000).expect("it has more");
/// assert!((300..=1000).contains(&small.faces.len()));
/// assert_eq!(TriMesh::from_faces(small.positions, small.faces)?.normal(0), Vec3::Z);
/// assert!(simplify(&floor, 20_000).is_none());
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub fn simplify(mesh: &TriMesh, most: usize) -> Option<SimplifiedMesh> {
    if mesh.faces().len() <= most {
        return None;
    }

    // The first cells are rather small: four of them have the area of one of `most` equal faces.
    let size = f64::from(mesh.aabb().size().max_element());
    let smallest = (mesh.total_area() / most.max(1) as f64).sqrt() / 2.0;
    let mut cell_m = smallest.max(2.0 * size / MOST_CELLS);

    loop {
        // `cell_m` is reported in tenths of a millimetre.
        let rounded_m = (cell_m.max(1e-4) * 1e4).round() / 1e4;
        let cells = Cells::new(mesh, rounded_m);
        if cells.count(mesh) <= most || rounded_m > size {
            return Some(cells.simplified(mesh));
        }
        cell_m = (rounded_m * GROWTH).max(rounded_m + 1e-4);
    }
}

/// A grid over a mesh, with the cell of each vertex.
struct Cells {
    cell_m: f64,
    origin: DVec3,
    /// The numbers of the cells that have a vertex, ascending.
    numbers: Vec<u64>,
    /// For each vertex of the mesh, a place in `numbers`, or `NO_INDEX` if no face uses the vertex.
    of_vertex: Vec<u32>,
}

impl Cells {
    fn new(mesh: &TriMesh, cell_m: f64) -> Self {
        let origin = mesh.aabb().min.as_dvec3();
        let number = |p: &Vec3| {
            let cell = ((p.as_dvec3() - origin) / cell_m).floor();
            let [x, y, z] = cell.to_array().map(|c| c.clamp(0.0, MOST_CELLS - 1.0) as u64);
            (x << 42) | (y << 21) | z
        };

        let mut used = vec![false; mesh.positions().len()];
        mesh.faces().iter().flatten().for_each(|v| used[*v as usize] = true);
        let of_vertex: Vec<Option<u64>> = mesh
            .positions()
            .par_iter()
            .zip(&used)
            .map(|(p, used)| used.then(|| number(p)))
            .collect();

        let mut numbers: Vec<u64> = of_vertex.iter().flatten().copied().collect();
        numbers.par_sort_unstable();
        numbers.dedup();

        let of_vertex = of_vertex
            .par_iter()
            .map(|number| {
                let found = number.and_then(|number| numbers.binary_search(&number).ok());
                found.map_or(crate::NO_INDEX, |place| place as u32)
            })
            .collect();
        Self { cell_m, origin, numbers, of_vertex }
    }

    fn of_face(&self, corners: [u32; 3]) -> [u32; 3] {
        corners.map(|v| self.of_vertex[v as usize])
    }

    /// Returns the number of faces whose corners are in three different cells.
    fn count(&self, mesh: &TriMesh) -> usize {
        mesh.faces()
            .par_iter()
            .filter(|corners| {
                let [a, b, c] = self.of_face(**corners);
                a != b && b != c && c != a
            })
            .count()
    }

    /// Returns the faces whose corners are in three different cells. If several have the same cells and the
    /// same winding, only the first is returned.
    fn kept(&self, mesh: &TriMesh) -> Vec<u32> {
        let mut seen = HashSet::new();
        let mut kept = Vec::new();
        for (face, corners) in (0..).zip(mesh.faces()) {
            let [a, b, c] = self.of_face(*corners);
            if a == b || b == c || c == a {
                continue;
            }

            // Start with the smallest cell and keep the winding: the two sides of a sheet are two faces.
            let first = a.min(b).min(c);
            let turned = if first == a {
                [a, b, c]
            } else if first == b {
                [b, c, a]
            } else {
                [c, a, b]
            };
            if seen.insert(turned) {
                kept.push(face);
            }
        }
        kept
    }

    /// Returns the quadric of each cell.
    fn quadrics(&self, mesh: &TriMesh) -> Vec<Quadric> {
        let mut sums = vec![Quadric::ZERO; self.numbers.len()];
        for (v, cell) in self.of_vertex.iter().enumerate() {
            if *cell != crate::NO_INDEX {
                sums[*cell as usize].add_vertex(mesh.positions()[v].as_dvec3() - self.origin);
            }
        }
        for face in 0..mesh.faces().len() as u32 {
            let [a, b, c] = mesh.triangle(face).map(|p| p.as_dvec3() - self.origin);
            let normal = (b - a).cross(c - a);
            for cell in self.of_face(mesh.faces()[face as usize]) {
                sums[cell as usize].add_plane(normal, a);
            }
        }
        sums
    }

    /// Returns the vertex that minimises the quadric of the cell `number`, within the cell.
    fn vertex(&self, number: u64, quadric: &Quadric) -> Vec3 {
        let cell = [number >> 42, (number >> 21) & 0x1f_ffff, number & 0x1f_ffff];
        let low = DVec3::from_array(cell.map(|c| c as f64)) * self.cell_m;
        (self.origin + quadric.minimizer().clamp(low, low + self.cell_m)).as_vec3()
    }

    fn simplified(self, mesh: &TriMesh) -> SimplifiedMesh {
        let kept = self.kept(mesh);
        let quadrics = self.quadrics(mesh);

        // Only cells with a face that stays get a vertex.
        let mut place = vec![crate::NO_INDEX; self.numbers.len()];
        let mut positions = Vec::new();
        let mut faces = Vec::with_capacity(kept.len());
        for face in &kept {
            faces.push(self.of_face(mesh.faces()[*face as usize]).map(|cell| {
                let cell = cell as usize;
                if place[cell] == crate::NO_INDEX {
                    place[cell] = positions.len() as u32;
                    positions.push(self.vertex(self.numbers[cell], &quadrics[cell]));
                }
                place[cell]
            }));
        }

        let vertex_of = self
            .of_vertex
            .iter()
            .map(|cell| place.get(*cell as usize).copied().unwrap_or(crate::NO_INDEX))
            .collect();
        SimplifiedMesh { cell_m: self.cell_m, positions, faces, face_of: kept, vertex_of }
    }
}

/// The sum of the squared distances to planes, as a function of the place x: xᵀAx − 2bx + c. The constant
/// c is left out.
#[derive(Clone, Copy)]
struct Quadric {
    a: DMat3,
    b: DVec3,
    vertices: DVec3,
    count: f64,
}

impl Quadric {
    const ZERO: Self = Self { a: DMat3::ZERO, b: DVec3::ZERO, vertices: DVec3::ZERO, count: 0.0 };

    fn add_vertex(&mut self, at: DVec3) {
        self.vertices += at;
        self.count += 1.0;
    }

    /// Adds the plane of a face through the point `at`. The length of `normal` is twice the area of the face.
    fn add_plane(&mut self, normal: DVec3, at: DVec3) {
        let weight = 1.0 / normal.length();
        if weight.is_finite() {
            let outer = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
            self.a += outer * weight;
            self.b += normal * (normal.dot(at) * weight);
        }
    }

    /// Returns the place of the minimum. Directions that the planes leave open follow the mean of the
    /// vertices.
    fn minimizer(&self) -> DVec3 {
        let mean = self.vertices / self.count.max(1.0);
        let hold = HOLD * (self.a.x_axis.x + self.a.y_axis.y + self.a.z_axis.z);
        let held = self.a + DMat3::from_diagonal(DVec3::splat(hold));
        let place = held.inverse() * (self.b + mean * hold);
        if hold > 0.0 && place.is_finite() { place } else { mean }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MeshParts;
    use crate::primitives::{cuboid, grid};
    use glam::vec3;

    /// Returns a room of 4 × 3 × 2.5 m whose walls are grids of 5 cm.
    fn room() -> TriMesh {
        let [x, y, z] = [Vec3::X * 4.0, Vec3::Y * 3.0, Vec3::Z * 2.5];
        let walls = [
            grid(Vec3::ZERO, x, y, [80, 60]),
            grid(z, y, x, [60, 80]),
            grid(Vec3::ZERO, z, x, [50, 80]),
            grid(y, x, z, [80, 50]),
            grid(Vec3::ZERO, y, z, [60, 50]),
            grid(x, z, y, [50, 60]),
        ];
        TriMesh::new(MeshParts::merge(walls)).unwrap()
    }

    #[test]
    fn corners_stay_sharp_and_faces_are_faces_of_the_mesh() {
        let mesh = room();
        let small = simplify(&mesh, 4000).unwrap();
        assert!((1500..=4000).contains(&small.faces.len()), "{}", small.faces.len());
        let kept = TriMesh::from_faces(small.positions.clone(), small.faces.clone()).unwrap();
        // Quadrics put vertices into the corner. Means would round it off.
        assert!((kept.total_area() / mesh.total_area() - 1.0).abs() < 0.01, "{}", kept.total_area());
        for corner in [Vec3::ZERO, vec3(4.0, 3.0, 2.5), vec3(4.0, 0.0, 2.5)] {
            let least = small
                .positions
                .iter()
                .map(|p| p.distance(corner))
                .fold(f32::MAX, f32::min);
            assert!(least < 0.005, "{corner}: {least} m");
        }

        assert!(small.face_of.is_sorted());
        for (face, was) in small.faces.iter().zip(&small.face_of) {
            assert_eq!(*face, mesh.faces()[*was as usize].map(|v| small.vertex_of[v as usize]));
        }

        let diagonal = 3f64.sqrt() * small.cell_m;
        for (old, new) in mesh.positions().iter().zip(&small.vertex_of) {
            if let Some(new) = small.positions.get(*new as usize) {
                assert!(f64::from(old.distance(*new)) <= diagonal + 1e-5);
            }
        }
    }

    #[test]
    fn both_sides_of_a_sheet_stay_and_what_is_less_than_a_cell_goes() {
        let mut back = grid(Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0, [50, 50]);
        back.flip();
        let sheet = MeshParts::merge([grid(Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0, [50, 50]), back]);
        let speck = cuboid(vec3(2.0, 2.0, 1.0), vec3(2.001, 2.001, 1.001));
        let mesh = TriMesh::new(MeshParts::merge([sheet, speck])).unwrap();
        let small = simplify(&mesh, 1000).unwrap();
        let kept = TriMesh::from_faces(small.positions, small.faces).unwrap();
        let up = (0..kept.faces().len() as u32)
            .filter(|f| kept.normal(*f).z > 0.99)
            .count();
        let down = (0..kept.faces().len() as u32)
            .filter(|f| kept.normal(*f).z < -0.99)
            .count();
        assert_eq!((up, up + down), (down, kept.faces().len()));
        assert_eq!(small.vertex_of.last(), Some(&crate::NO_INDEX));
    }

    #[test]
    fn any_number_of_faces_may_be_asked_for() {
        let mesh = room();
        for most in [0, 1, 2, 10, 100] {
            assert!(simplify(&mesh, most).unwrap().faces.len() <= most);
        }
        let far = vec3(400_000.0, 5_000_000.0, 0.0);
        let moved = mesh.positions().iter().map(|p| *p + far).collect();
        let parts = MeshParts { positions: moved, ..mesh.into_parts() };
        assert!(simplify(&TriMesh::new(parts).unwrap(), 500).unwrap().faces.len() <= 500);
    }
}
