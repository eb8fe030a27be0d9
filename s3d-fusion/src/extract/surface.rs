//! The zero level of a grid, before surfaces of tiles are joined.

use super::mesh::FusedMesh;
use super::samples::{Part, Samples, Vertex, z_bits};
use crate::FusionError;
use crate::grid::{Grid, Place, SIDE};
use rayon::prelude::*;
use std::ops::Range;

/// The surface of a grid or tile. [`Surface::join`] makes one of many, and [`Surface::into_mesh`] its mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    pub(super) cell_m: f64,
    /// Sorted by their keys, each once.
    pub(super) vertices: Vec<Vertex>,
    /// The cell and the vertices of each face, sorted by cells.
    pub(super) faces: Vec<(u64, [u32; 3])>,
}

impl Surface {
    /// Makes the surface of the cells whose lower corner is in the blocks of a tile, or of all cells.
    pub(crate) fn of_grid(grid: &Grid, cell_m: f64, front_m: f64, tile: Option<[Place; 2]>) -> Self {
        let holds = |place: &Place| {
            tile.is_none_or(|[from, to]| (0..3).all(|k| (from[k]..to[k]).contains(&place[k])))
        };
        let mut places: Vec<Place> = grid.places.iter().copied().filter(holds).collect();
        places.par_sort_unstable_by_key(|[_, _, z]| *z);

        // Layer by layer, so that little is held twice beside the grid. One is made while another is joined.
        let layers: Vec<&[Place]> = places.chunk_by(|a, b| a[2] == b[2]).collect();
        let parts_of = |layer: &[Place]| -> Vec<Part> {
            let parts = layer
                .par_iter()
                .map(|place| Samples::of(grid, *place, (cell_m / front_m) as f32).part(cell_m));
            parts.filter(|part| !part.faces.is_empty()).collect()
        };
        let mut whole = Self { cell_m, vertices: Vec::new(), faces: Vec::new() };
        let mut last_layer = 0..0;
        let mut parts = layers.first().map_or_else(Vec::new, |layer| parts_of(layer));
        for (number, layer) in layers.iter().enumerate() {
            let start = whole.faces.len();
            let join = || whole.append(Self::of_parts(cell_m, parts), last_layer, layer[0][2]);
            let next = || layers.get(number + 1).map_or_else(Vec::new, |layer| parts_of(layer));
            (_, parts) = rayon::join(join, next);
            last_layer = start..whole.faces.len();
        }
        whole
    }

    /// Appends the next layer of blocks, whose place on z is given. `last_layer`: the faces of the layer
    /// before, which alone can share vertices with it.
    fn append(&mut self, next: Self, last_layer: Range<usize>, layer: i32) {
        // What both can have is in the lowest plane of the new layer.
        let of_plane = |vertices: &[Vertex], above: i32| {
            let least = z_bits(layer * SIDE + above);
            vertices.partition_point(|v| v.key < least)
        };
        let tail_start = of_plane(&self.vertices, 0);
        let (head, rest) = next.vertices.split_at(of_plane(&next.vertices, 1));
        let tail = self.vertices.split_off(tail_start);

        let mut plane = [&tail, head].concat();
        plane.par_sort_unstable_by_key(|v| v.key);
        plane.dedup_by_key(|v| v.key);
        let numbers = |vertices: &[Vertex]| -> Vec<u32> {
            let number = |v: &Vertex| (tail_start + plane.partition_point(|p| p.key < v.key)) as u32;
            vertices.par_iter().map(number).collect()
        };
        let (of_tail, of_head) = (numbers(&tail), numbers(head));
        self.vertices.extend(plane);
        for v in self.faces[last_layer].iter_mut().flat_map(|(_, face)| face) {
            if *v as usize >= tail_start {
                *v = of_tail[*v as usize - tail_start];
            }
        }

        let shift = self.vertices.len() - head.len();
        self.vertices.extend_from_slice(rest);
        let new_of = |v: u32| of_head.get(v as usize).map_or_else(|| v + shift as u32, |v| *v);
        self.faces
            .extend(next.faces.into_iter().map(|(cell, face)| (cell, face.map(new_of))));
    }

    /// Joins the surfaces of the tiles of a grid. The order of tiles does not matter, and the result is the
    /// surface of a grid without tiles.
    ///
    /// # Errors
    /// [`FusionError::OtherCells`]; [`FusionError::NoSurface`] without tiles.
    pub fn join(tiles: Vec<Self>) -> Result<Self, FusionError> {
        let cell_m = tiles.first().ok_or(FusionError::NoSurface)?.cell_m;
        if let Some(other) = tiles.iter().find(|t| t.cell_m != cell_m) {
            return Err(FusionError::OtherCells { a_m: cell_m, b_m: other.cell_m });
        }
        let parts = tiles.into_iter().map(|t| Part { vertices: t.vertices, faces: t.faces });
        Ok(Self::of_parts(cell_m, parts.collect()))
    }

    fn of_parts(cell_m: f64, parts: Vec<Part>) -> Self {
        let starts: Vec<usize> = parts
            .iter()
            .scan(0, |sum, part| Some(std::mem::replace(sum, *sum + part.vertices.len())))
            .collect();
        let count = parts.iter().map(|part| part.vertices.len()).sum();
        let mut all = Vec::with_capacity(count);
        parts.iter().for_each(|part| all.extend_from_slice(&part.vertices));
        let mut order: Vec<(u64, u32)> = (0..).zip(&all).map(|(i, v)| (v.key, i)).collect();
        order.par_sort_unstable();

        // Vertices of the same key are equal: their voxels are.
        let mut new_of = vec![0; all.len()];
        let mut vertices: Vec<Vertex> = Vec::new();
        for (key, i) in order {
            if vertices.last().is_none_or(|last| last.key != key) {
                vertices.push(all[i as usize]);
            }
            new_of[i as usize] = vertices.len() as u32 - 1;
        }

        let mut faces = Vec::with_capacity(parts.iter().map(|part| part.faces.len()).sum());
        for (part, start) in parts.iter().zip(starts) {
            let new_of = &new_of[start..];
            faces.extend(
                part.faces
                    .iter()
                    .map(|(cell, face)| (*cell, face.map(|v| new_of[v as usize]))),
            );
        }
        // The order of a cell's faces stays.
        faces.par_sort_by_key(|(cell, _)| *cell);
        Self { cell_m, vertices, faces }
    }

    /// Returns the mesh without pieces of less surface than `least_piece_m2`. A piece is what hangs together
    /// by edges and vertices.
    ///
    /// # Errors
    /// [`FusionError::NoSurface`] if nothing is left.
    pub fn into_mesh(self, least_piece_m2: f64) -> Result<FusedMesh, FusionError> {
        let faces: Vec<_> = self.faces.into_par_iter().map(|(_, face)| face).collect();
        FusedMesh::of_pieces(&self.vertices, &faces, least_piece_m2)
    }
}
