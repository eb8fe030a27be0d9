//! The zero level of a grid, before surfaces of tiles are joined.

use super::mesh::FusedMesh;
use super::table::{EDGES, TRIANGLES};
use crate::FusionError;
use crate::grid::block::Voxel;
use crate::grid::{Grid, Place, SIDE};
use rayon::prelude::*;
use s3d_geom::glam::Vec3;
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

/// Where the surface crosses an edge between two voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vertex {
    /// The lower voxel and the axis.
    pub(super) key: u64,
    pub(super) position: Vec3,
    /// Black: unknown.
    pub(super) color: [u8; 3],
}

/// What a block adds to a surface. Faces have indices into its own vertices.
#[derive(Default)]
struct Part {
    vertices: Vec<Vertex>,
    faces: Vec<(u64, [u32; 3])>,
}

/// Voxels along the side of a block with the next voxels behind it.
const MORE: usize = SIDE as usize + 1;
/// Voxels of such a block.
const SAMPLES: usize = MORE * MORE * MORE;
/// No vertex.
const NONE: u32 = u32::MAX;

impl Surface {
    /// Makes the surface of the cells whose lower corner is in the blocks of a tile, or of all cells.
    pub(crate) fn of_grid(grid: &Grid, cell_m: f64, front_m: f64, tile: Option<[Place; 2]>) -> Self {
        let holds = |place: &Place| {
            tile.is_none_or(|[from, to]| (0..3).all(|k| (from[k]..to[k]).contains(&place[k])))
        };
        let mut places: Vec<Place> = grid.places.iter().copied().filter(holds).collect();
        places.par_sort_unstable_by_key(|[_, _, z]| *z);

        // Layer by layer, so that little is held twice beside the grid.
        let mut whole = Self { cell_m, vertices: Vec::new(), faces: Vec::new() };
        let mut last_layer = 0..0;
        for layer in places.chunk_by(|a, b| a[2] == b[2]) {
            let parts = layer
                .par_iter()
                .map(|place| Samples::of(grid, *place, (cell_m / front_m) as f32).part(cell_m))
                .filter(|part| !part.faces.is_empty())
                .collect();
            let start = whole.faces.len();
            whole.append(Self::of_parts(cell_m, parts), last_layer, layer[0][2]);
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
        let mut order: Vec<(u64, u32)> = parts
            .iter()
            .flat_map(|part| &part.vertices)
            .enumerate()
            .map(|(i, v)| (v.key, i as u32))
            .collect();
        order.par_sort_unstable();

        // Vertices of the same key are equal: their voxels are.
        let all: Vec<Vertex> = parts.iter().flat_map(|part| &part.vertices).copied().collect();
        let mut new_of = vec![NONE; all.len()];
        let mut vertices: Vec<Vertex> = Vec::new();
        for (key, i) in order {
            if vertices.last().is_none_or(|last| last.key != key) {
                vertices.push(all[i as usize]);
            }
            new_of[i as usize] = vertices.len() as u32 - 1;
        }

        let mut faces: Vec<(u64, [u32; 3])> = parts
            .iter()
            .zip(&starts)
            .flat_map(|(part, start)| part.faces.iter().map(move |(cell, face)| (*cell, *face, *start)))
            .map(|(cell, face, start)| (cell, face.map(|v| new_of[start + v as usize])))
            .collect();
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
        let faces = self.faces.into_iter().map(|(_, face)| face).collect();
        FusedMesh::of_pieces(&self.vertices, faces, least_piece_m2)
    }
}

/// The voxels of a block and the next ones behind it.
struct Samples<'a> {
    grid: &'a Grid,
    place: Place,
    values: Vec<f32>,
    /// 0: unknown, 1: passed by rays alone, 2: has a distance.
    states: Vec<u8>,
}

impl<'a> Samples<'a> {
    /// `cell` is a cell as a share of the truncation.
    fn of(grid: &'a Grid, place: Place, cell: f32) -> Self {
        let mut samples = Self { grid, place, values: vec![0.0; SAMPLES], states: vec![0; SAMPLES] };
        for corner in 0..8 {
            let step = [corner & 1, corner >> 1 & 1, corner >> 2];
            let place = [0, 1, 2].map(|k| place[k] + step[k]);
            let block = grid.block(place);
            let free = block.map_or_else(|| grid.free(place), |(_, free)| free);
            let range = |k: usize| if step[k] == 0 { 0..SIDE } else { 0..1 };

            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        let voxel = match block {
                            Some((block, _)) => block.voxel(((z * SIDE + y) * SIDE + x) as usize, free),
                            None if free > 0 => Voxel::Passed,
                            None => Voxel::Unknown,
                        };
                        let at = [0, 1, 2].map(|k| ([x, y, z][k] + step[k] * SIDE) as usize);
                        let i = sample([at[0], at[1], at[2]]);
                        (samples.values[i], samples.states[i]) = match voxel {
                            Voxel::Unknown => (0.0, 0),
                            Voxel::Passed => (cell, 1),
                            Voxel::Distance(distance) => (distance, 2),
                        };
                    }
                }
            }
        }
        samples
    }

    fn part(&self, cell_m: f64) -> Part {
        let mut part = Part::default();
        let mut vertex_of = vec![NONE; 3 * SAMPLES];
        let side = SIDE as usize;
        for i in 0..side * side * side {
            let cell = [i % side, i / side % side, i / (side * side)];
            let corners: [usize; 8] = std::array::from_fn(|c| {
                sample([cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)])
            });
            let Some(behind) = self.behind(corners) else { continue };

            for triangle in &TRIANGLES[behind as usize] {
                let face = triangle.map(|edge| {
                    let [a, b] = EDGES[edge as usize];
                    let axis = (edge / 4) as usize;
                    let low = [0, 1, 2].map(|k| cell[k] + (a as usize >> k & 1));
                    let slot = &mut vertex_of[3 * corners[a as usize] + axis];
                    if *slot == NONE {
                        *slot = part.vertices.len() as u32;
                        let ends = [corners[a as usize], corners[b as usize]];
                        part.vertices.push(self.vertex(low, axis, ends, cell_m));
                    }
                    *slot
                });
                part.faces.push((self.key(cell, 0), face));
            }
        }
        part
    }

    /// Returns the corners behind the surface, as bits, if the surface crosses the cell and all is known:
    /// each corner was seen, and one at least was seen just before a surface. Where rays only passed beside a
    /// surface, its end is not known.
    fn behind(&self, corners: [usize; 8]) -> Option<u8> {
        let mut behind = 0;
        let mut is_before = false;
        for (c, i) in corners.into_iter().enumerate() {
            match self.states[i] {
                0 => return None,
                2 if self.values[i] < 0.0 => behind |= 1 << c,
                state => is_before |= state == 2,
            }
        }
        (behind != 0 && is_before).then_some(behind)
    }

    /// A voxel of the block and an axis as one number, by z, y and x.
    fn key(&self, voxel: [usize; 3], axis: usize) -> u64 {
        let [x, y, z] = [0, 1, 2].map(|k| self.place[k] * SIDE + voxel[k] as i32);
        z_bits(z) | (bits(y) << 20 | bits(x)) << 2 | axis as u64
    }

    fn vertex(&self, low: [usize; 3], axis: usize, ends: [usize; 2], cell_m: f64) -> Vertex {
        let [a, b] = ends.map(|i| self.values[i]);
        // Not in a voxel itself: vertices of several edges would be in the same place.
        let share = (a / (a - b)).clamp(1e-3, 1.0 - 1e-3);
        let mut position = [0, 1, 2].map(|k| f64::from(self.place[k] * SIDE) + low[k] as f64);
        position[axis] += f64::from(share);

        let mut high = low;
        high[axis] += 1;
        let color = match [low, high].map(|voxel| self.color(voxel)) {
            [Some(a), Some(b)] => [0, 1, 2].map(|k| {
                let (a, b) = (f32::from(a[k]), f32::from(b[k]));
                (a + (b - a) * share + 0.5) as u8
            }),
            [a, b] => a.or(b).unwrap_or_default(),
        };
        let position = Vec3::from_array(position.map(|k| (k * cell_m) as f32));
        Vertex { key: self.key(low, axis), position, color }
    }

    fn color(&self, voxel: [usize; 3]) -> Option<[u8; 3]> {
        let side = SIDE as usize;
        let place = [0, 1, 2].map(|k| self.place[k] + (voxel[k] / side) as i32);
        let [x, y, z] = voxel.map(|k| k % side);
        self.grid.block(place)?.0.color((z * side + y) * side + x)
    }
}

/// The coordinate of a voxel in a key: 20 bits.
fn bits(coordinate: i32) -> u64 {
    (i64::from(coordinate) + (1 << 19)) as u64
}

/// The least key of the voxels of a plane.
fn z_bits(z: i32) -> u64 {
    bits(z) << 42
}

fn sample([x, y, z]: [usize; 3]) -> usize {
    (z * MORE + y) * MORE + x
}
