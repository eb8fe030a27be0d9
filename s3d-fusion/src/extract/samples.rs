//! The cells of a block that the surface crosses.

use super::table::{EDGES, TRIANGLES};
use crate::grid::block::{Block, RowStates, Voxel};
use crate::grid::{Grid, Place, SIDE};
use s3d_geom::glam::Vec3;

/// Voxels along the side of a block.
const FEW: usize = SIDE as usize;
/// Voxels along the side of a block with the next voxels behind it.
const MORE: usize = FEW + 1;
/// Voxels of such a block.
const SAMPLES: usize = MORE * MORE * MORE;

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
pub(super) struct Part {
    pub(super) vertices: Vec<Vertex>,
    pub(super) faces: Vec<(u64, [u32; 3])>,
}

/// No vertex.
const NONE: u32 = u32::MAX;

/// The voxels of a block and the next ones behind it.
pub(super) struct Samples<'a> {
    place: Place,
    /// The block and the next ones, if they exist.
    blocks: [Option<&'a Block>; 8],
    /// Signed distances as shares of the truncation; any number where nothing is known.
    values: [f32; SAMPLES],
    /// What is known of each row along x.
    rows: [RowStates; MORE * MORE],
}

impl<'a> Samples<'a> {
    /// `cell` is a cell as a share of the truncation: the distance of voxels that rays passed alone.
    pub(super) fn of(grid: &'a Grid, place: Place, cell: f32) -> Self {
        let rows = [RowStates::default(); MORE * MORE];
        let mut samples = Self { place, blocks: [None; 8], values: [0.0; SAMPLES], rows };
        for corner in 0..8 {
            let step = [corner & 1, corner >> 1 & 1, corner >> 2];
            let place = [0, 1, 2].map(|k| place[k] + step[k]);
            let block = grid.block(place);
            let free = block.map_or_else(|| grid.free(place), |(_, free)| free);
            let block = block.map(|(block, _)| block);
            samples.blocks[corner as usize] = block;
            let [x, y, z] = step.map(|step| step as usize * FEW);
            let range = |step: i32| if step == 0 { 0..FEW } else { 0..1 };

            for (k, j) in range(step[2]).flat_map(|k| range(step[1]).map(move |j| (k, j))) {
                let (first, row) = ((k * FEW + j) * FEW, (z + k) * MORE + y + j);
                let values = &mut samples.values[row * MORE..][..MORE];
                let of_row = match (block, step[0]) {
                    (Some(block), 0) => block.row(first, free, cell, values),
                    (block, _) => {
                        let voxel = block.map(|block| block.voxel(first, free));
                        let passed = if free > 0 { Voxel::Passed } else { Voxel::Unknown };
                        let all = if step[0] == 0 { 0xff } else { 1 };
                        RowStates::same(voxel.unwrap_or(passed), all, cell, &mut values[x..])
                    }
                };
                samples.rows[row].add(of_row, x);
            }
        }
        samples
    }

    /// Returns the vertices and faces of the cells whose lower corner is in the block.
    pub(super) fn part(&self, cell_m: f64) -> Part {
        let mut part = Part::default();
        let mut vertex_of = [NONE; 3 * SAMPLES];
        for (z, y) in (0..FEW).flat_map(|z| (0..FEW).map(move |y| (z, y))) {
            let rows = [0, 1, MORE, MORE + 1].map(|next| self.rows[z * MORE + y + next]);
            let mut crossed = Self::crossed(&rows);
            while crossed != 0 {
                let x = crossed.trailing_zeros() as usize;
                crossed &= crossed - 1;
                let of_row = |row: usize| (rows[row].behind >> x & 3) << (2 * row);
                let behind = of_row(0) | of_row(1) | of_row(2) | of_row(3);
                self.faces([x, y, z], behind, cell_m, &mut vertex_of, &mut part);
            }
        }
        part
    }

    /// Returns the cells between four rows that the surface crosses and of which all is known, as bits.
    ///
    /// Each corner was seen, one at least just before a surface, and one at a surface. Where rays only passed
    /// beside a surface, its end is not known. Where some say that they are far before a surface and others
    /// that they are far behind one, nobody saw a surface.
    fn crossed(rows: &[RowStates; 4]) -> u16 {
        let both = |a: u16| a & a >> 1;
        let either = |a: u16| a | a >> 1;
        let known = rows.iter().fold(0xffff, |all, row| all & row.known);
        let behind = rows.iter().fold(0, |any, row| any | row.behind);
        let before = rows.iter().fold(0, |any, row| any | row.before);
        let at = rows.iter().fold(0, |any, row| any | row.at);
        both(known) & either(behind) & either(before) & either(at) & 0xff
    }

    /// Adds the faces of a cell. `behind`: its corners behind the surface, as bits.
    fn faces(
        &self,
        cell: [usize; 3],
        behind: u16,
        cell_m: f64,
        vertex_of: &mut [u32; 3 * SAMPLES],
        part: &mut Part,
    ) {
        let corner = |c: u8| [0, 1, 2].map(|k| cell[k] + (c as usize >> k & 1));
        for triangle in &TRIANGLES[behind as usize] {
            let face = triangle.map(|edge| {
                let [low, high] = EDGES[edge as usize].map(corner);
                let axis = (edge / 4) as usize;
                let slot = &mut vertex_of[3 * sample(low) + axis];
                if *slot == NONE {
                    *slot = part.vertices.len() as u32;
                    part.vertices.push(self.vertex(low, high, axis, cell_m));
                }
                *slot
            });
            part.faces.push((self.key(cell, 0), face));
        }
    }

    /// A voxel of the block and an axis as one number, by z, y and x.
    fn key(&self, voxel: [usize; 3], axis: usize) -> u64 {
        let [x, y, z] = [0, 1, 2].map(|k| self.place[k] * SIDE + voxel[k] as i32);
        z_bits(z) | (bits(y) << 20 | bits(x)) << 2 | axis as u64
    }

    /// Returns where the surface crosses the edge between two voxels along an axis.
    fn vertex(&self, low: [usize; 3], high: [usize; 3], axis: usize, cell_m: f64) -> Vertex {
        let [a, b] = [low, high].map(|voxel| self.values[sample(voxel)]);
        // Not in a voxel itself: vertices of several edges would be in the same place.
        let share = (a / (a - b)).clamp(1e-3, 1.0 - 1e-3);
        let mut position = [0, 1, 2].map(|k| f64::from(self.place[k] * SIDE) + low[k] as f64);
        position[axis] += f64::from(share);

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
        let [i, j, k] = voxel.map(|k| k / FEW);
        let [x, y, z] = voxel.map(|k| k % FEW);
        self.blocks[k << 2 | j << 1 | i]?.color((z * FEW + y) * FEW + x)
    }
}

/// Where a voxel is in the columns of [`Samples`].
fn sample([x, y, z]: [usize; 3]) -> usize {
    (z * MORE + y) * MORE + x
}

/// The coordinate of a voxel in a key: 20 bits.
fn bits(coordinate: i32) -> u64 {
    (i64::from(coordinate) + (1 << 19)) as u64
}

/// The least key of the voxels of a plane.
pub(super) fn z_bits(z: i32) -> u64 {
    bits(z) << 42
}
