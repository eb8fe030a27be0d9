//! A mesh in cells of about 5 cm: where there is surface, and whose.

use rayon::prelude::*;
use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;

/// The edge of a cell, metres. Cells are larger if a mesh would have too many.
const CELL_M: f32 = 0.05;

/// The largest surface of a mesh in cells of 5 cm, m², and the largest sum of its faces' longest edges, m.
const MOST_M2: f64 = 10_000.0;
const MOST_EDGES_M: f64 = 500_000.0;

/// Samples of a face are no farther apart than this share of a cell, so that they leave no hole.
const STEP: f32 = 0.7;

/// The largest number of a cell along an axis.
const LAST: u64 = (1 << 21) - 1;

/// A cell: its numbers along x, y and z, 21 bits each.
pub(super) type Cell = u64;

/// The cells of each face, and of the mesh.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    corner: Vec3,
    /// The edge of a cell, metres.
    pub(super) edge_m: f32,
    /// Where the cells of each face begin in `of_faces`, and where those of the last one end.
    starts: Vec<u32>,
    of_faces: Vec<Cell>,
    /// All cells with surface, ascending.
    occupied: Vec<Cell>,
}

impl Cells {
    pub(super) fn new(mesh: &TriMesh) -> Self {
        let faces = 0..mesh.faces().len() as u32;
        let edges_m: f64 = faces.clone().map(|face| f64::from(longest_edge(mesh.triangle(face)).0)).sum();
        let too_many = (mesh.total_area() / MOST_M2).sqrt().max(edges_m / MOST_EDGES_M);
        let mut cells = Self {
            corner: mesh.aabb().min - CELL_M,
            edge_m: CELL_M * (too_many as f32).max(1.0),
            starts: vec![0],
            of_faces: Vec::new(),
            occupied: Vec::new(),
        };

        let lists: Vec<Vec<Cell>> = faces
            .into_par_iter()
            .map(|face| {
                let mut list = Vec::new();
                cells.add_cells_of(mesh.triangle(face), &mut list);
                list.sort_unstable();
                list.dedup();
                list
            })
            .collect();
        for list in lists {
            cells.of_faces.extend(list);
            cells.starts.push(cells.of_faces.len() as u32);
        }
        cells.occupied = cells.of_faces.clone();
        cells.occupied.par_sort_unstable();
        cells.occupied.dedup();
        cells.occupied.shrink_to_fit();
        cells
    }

    /// The cells of a face, ascending.
    pub(super) fn of(&self, face: u32) -> &[Cell] {
        let [start, end] = [0, 1].map(|i| self.starts[face as usize + i] as usize);
        &self.of_faces[start..end]
    }

    /// The cell that a point is in. Points beyond the cells are in the outermost ones.
    pub(super) fn at(&self, point: Vec3) -> Cell {
        // The conversion saturates.
        let [x, y, z] = ((point - self.corner) / self.edge_m).to_array().map(|x| (x as u64).min(LAST));
        x << 42 | y << 21 | z
    }

    pub(super) fn is_occupied(&self, point: Vec3) -> bool {
        self.occupied.binary_search(&self.at(point)).is_ok()
    }

    /// Adds the cells of a triangle: those of its corners, and of its halves as long as it is large.
    fn add_cells_of(&self, triangle: [Vec3; 3], list: &mut Vec<Cell>) {
        let (length_m, from) = longest_edge(triangle);
        if length_m <= STEP * self.edge_m {
            for cell in triangle.map(|corner| self.at(corner)) {
                // Neighbours share cells.
                if !list.iter().rev().take(4).any(|before| *before == cell) {
                    list.push(cell);
                }
            }
            return;
        }
        let [a, b, c] = [0, 1, 2].map(|i| triangle[(from + i) % 3]);
        let middle = (a + b) / 2.0;
        self.add_cells_of([a, middle, c], list);
        self.add_cells_of([middle, b, c], list);
    }
}

/// The column of a cell, and its height in cells.
pub(super) fn column(cell: Cell) -> (u64, u64) {
    (cell >> 21, cell & LAST)
}

/// The cells around a cell that come after it, as ranges: each cell of a range touches it.
pub(super) fn rows_after(cell: Cell) -> [[Cell; 2]; 5] {
    let (z, y, x) = (cell & LAST, cell >> 21 & LAST, cell >> 42);
    let row = |x: u64, y: u64| {
        let row = x << 42 | y << 21;
        [row | z.saturating_sub(1), row | (z + 1).min(LAST)]
    };
    let (before, after, next) = (y.saturating_sub(1), (y + 1).min(LAST), (x + 1).min(LAST));
    [[cell, row(x, y)[1]], row(x, after), row(next, before), row(next, y), row(next, after)]
}

/// The longest edge of a triangle: its length in metres, and the corner where it begins.
fn longest_edge([a, b, c]: [Vec3; 3]) -> (f32, usize) {
    let [ab, bc, ca] = [a.distance(b), b.distance(c), c.distance(a)];
    if ab >= bc && ab >= ca {
        (ab, 0)
    } else if bc >= ca {
        (bc, 1)
    } else {
        (ca, 2)
    }
}
