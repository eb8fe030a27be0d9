//! Rays with an origin each are added to the grid.

use super::normals::Normals;
use super::walk::{blocks_along, slices_along};
use super::{Scale, Tile, chance};
use crate::grid::block::Block;
use crate::grid::{Grid, Place, SIDE, key, place_of};
use crate::{FusionError, SensorNoise};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec3};

/// Rays that are being added.
pub(super) struct AddingRays<'a> {
    pub(super) origins: &'a [Vec3],
    pub(super) points: &'a [Vec3],
    pub(super) colors: &'a [[u8; 3]],
    pub(super) noise: SensorNoise,
    pub(super) scale: Scale,
    /// Blocks outside of it are left alone.
    pub(super) tile: Option<Tile>,
    /// The number of the call: how parts of a level of colours are rounded depends on it.
    pub(super) number: u32,
}

/// A ray with the plane of its hit.
struct Shot {
    origin: DVec3,
    hit: DVec3,
    /// The unit direction.
    along: DVec3,
    range: f64,
    normal: DVec3,
    /// How far before and behind the hit distances are gathered.
    reach: [f64; 2],
    sigma_m: f32,
    weight: f32,
    color: Option<[u8; 3]>,
}

/// Rays whose blocks are listed at a time.
const BATCH: usize = 1 << 16;

impl AddingRays<'_> {
    /// All blocks are made before the first ray carves, so the order of rays in a call changes little.
    pub(super) fn add_to(&self, grid: &mut Grid) -> Result<(), FusionError> {
        let is_ray = |i: &usize| {
            let (a, b) = (self.origins[*i], self.points[*i]);
            a.is_finite() && b.is_finite() && a != b
        };
        let rays: Vec<usize> = (0..self.points.len()).filter(is_ray).collect();
        for point in rays
            .iter()
            .flat_map(|i| [self.origins[*i], self.points[*i]])
            .map(|p| p.as_dvec3())
        {
            if self.scale.block_of(point).is_none() {
                return Err(FusionError::TooFar { point, cell_m: self.scale.cell });
            }
        }

        let normals = Normals::of(self.origins, self.points, &rays, self.scale.cell);
        for batch in rays.chunks(BATCH) {
            let found = batch.par_chunks(1 << 11).map(|rays| {
                let shots = rays.iter().map(|i| self.shot(*i, &normals));
                let mut found: Vec<u64> = shots.flat_map(|shot| self.near(&shot)).map(key).collect();
                found.sort_unstable();
                found.dedup();
                found
            });
            let mut found = found.collect::<Vec<_>>().concat();
            found.par_sort_unstable();
            found.dedup();
            grid.make_blocks(found.into_iter().map(place_of));
        }
        for batch in rays.chunks(BATCH) {
            let shots: Vec<Shot> = batch.par_iter().map(|i| self.shot(*i, &normals)).collect();
            self.update(grid, &shots);
        }
        Ok(())
    }

    fn shot(&self, i: usize, normals: &Normals) -> Shot {
        let (origin, hit) = (self.origins[i].as_dvec3(), self.points[i].as_dvec3());
        let range = origin.distance(hit);
        let along = (hit - origin) / range;
        let normal = normals.at(hit, along);
        let cosine = (-normal.dot(along)) as f32;
        let sigma_m = self.noise.sigma_m(range as f32);
        let reach = self.scale.along_ray(cosine, sigma_m).map(f64::from);
        let weight = Scale::weight_of(sigma_m, cosine);
        let color = self.colors.get(i).copied();
        Shot { origin, hit, along, range, normal, reach, sigma_m, weight, color }
    }

    /// Returns the blocks of the tile near the hit of a ray.
    fn near(&self, shot: &Shot) -> Vec<Place> {
        let ends = [shot.hit - shot.along * shot.reach[0], shot.hit + shot.along * shot.reach[1]];
        let mut found = Vec::new();
        blocks_along(ends.map(|end| end / self.scale.block()), |block| {
            if self.tile.is_none_or(|t| t.holds(block)) {
                found.push(block);
            }
        });
        found
    }

    /// Adds rays to the blocks that they cross. Each block takes them in their order.
    fn update(&self, grid: &mut Grid, shots: &[Shot]) {
        let crossed = shots.par_iter().enumerate().map(|(i, shot)| {
            let end = shot.hit + shot.along * shot.reach[1];
            let mut found = Vec::new();
            blocks_along([shot.origin, end].map(|end| end / self.scale.block()), |block| {
                found.extend(grid.index_of(block).map(|block| (block, i as u32)));
            });
            found
        });
        let mut work: Vec<(u32, u32)> = crossed.collect::<Vec<_>>().concat();
        work.par_sort_unstable();
        let mut rays_of_block = vec![0..0; grid.blocks.len()];
        let mut start = 0;
        for rays in work.chunk_by(|a, b| a.0 == b.0) {
            rays_of_block[rays[0].0 as usize] = start..start + rays.len();
            start += rays.len();
        }

        let Grid { blocks, places, .. } = grid;
        blocks
            .par_iter_mut()
            .zip(places.par_iter())
            .zip(rays_of_block.into_par_iter())
            .for_each(|((block, place), rays)| {
                work[rays]
                    .iter()
                    .for_each(|(_, i)| self.update_block(block, *place, &shots[*i as usize]));
            });
    }

    fn update_block(&self, block: &mut Block, place: Place, shot: &Shot) {
        let first = place.map(|k| k * SIDE);
        let inner = |voxel: Place| {
            let at = [0, 1, 2].map(|k| voxel[k] - first[k]);
            let is_inner = at.iter().all(|k| (0..SIDE).contains(k));
            is_inner.then(|| ((at[2] * SIDE + at[1]) * SIDE + at[0]) as usize)
        };
        let cell = self.scale.cell;
        let ends = |from: f64, to: f64| [from, to].map(|t| (shot.origin + shot.along * t) / cell);

        // Free space, up to where distances are gathered.
        let clear = shot.range - shot.reach[0];
        if clear > 0.0 {
            slices_along(ends(0.0, clear), first, 0, |voxel, _| {
                if let Some(i) = inner(voxel) {
                    block.pass(i, true, true);
                }
            });
        }

        // The surface, in the four voxels around the ray.
        let from = clear.max(0.0);
        slices_along(ends(from, shot.range + shot.reach[1]), first, 1, |voxel, share| {
            let Some(i) = inner(voxel) else { return };
            let off = DVec3::from_array(voxel.map(f64::from)) * cell - shot.hit;
            let distance = off.dot(shot.normal) as f32;
            let front = self.scale.front as f32;
            let before = -off.dot(shot.along) as f32;
            let weight = self.scale.weight(distance, before, shot.sigma_m);
            if distance >= front || weight * share <= 0.0 {
                return;
            }
            let share = block.observe(i, distance / front, weight * share * shot.weight, self.scale.near());
            if let Some(color) = shot.color.filter(|_| distance.abs() < 2.0 * cell as f32) {
                block.mix_color(i, color, share, chance(i as u32, self.number));
            }
        });
    }
}
