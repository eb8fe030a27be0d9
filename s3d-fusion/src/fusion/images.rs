//! An image is added to the grid.

use super::pyramid::Pyramid;
use super::view::View;
use super::walk::blocks_along;
use super::{Scale, Tile, chance};
use crate::FusionError;
use crate::grid::block::{Block, NO_COLOR};
use crate::grid::{CHUNK, Grid, NONE, Place, SIDE, block_in, chunk_of, key, place_of};
use crate::range_image::{RangeImage, Surfel};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec3};
use std::collections::BTreeSet;

/// An image that is being added.
pub(super) struct Adding<'a> {
    pub(super) image: &'a RangeImage,
    pub(super) scale: Scale,
    /// Blocks outside of it are left alone.
    pub(super) tile: Option<Tile>,
    /// The number of the image: how parts of a level of colours are rounded depends on it.
    pub(super) number: u32,
}

/// What an image does to a chunk.
enum Effect {
    /// All blocks are free.
    Free,
    /// Blocks that are free, and blocks whose voxels must be looked at one by one, as bits.
    Blocks { free: u64, mixed: u64 },
}

/// What an image does to a box.
#[derive(Clone, Copy, PartialEq)]
enum Seen {
    No,
    Free,
    Mixed,
}

impl Adding<'_> {
    pub(super) fn add_to(&self, grid: &mut Grid) -> Result<(), FusionError> {
        let view = View::new(self.image);
        let surfels = self.image.surfels(self.scale.cell as f32);
        let Some(bounds) = self.bounds(&view, &surfels)? else { return Ok(()) };

        for block in self.touched(&view, &surfels) {
            grid.block_at(place_of(block));
        }

        // Chunks between the sensor and what it saw.
        let pyramid = Pyramid::new(&surfels, view.size);
        let [from, to] = bounds.map(chunk_of);
        let count = [0, 1, 2].map(|k| (to[k] - from[k] + 1) as usize);
        let effects: Vec<(Place, Effect)> = (0..count[0] * count[1] * count[2])
            .into_par_iter()
            .filter_map(|i| {
                let within = [i % count[0], i / count[0] % count[1], i / count[0] / count[1]];
                let place = [0, 1, 2].map(|k| from[k] + within[k] as i32);
                self.effect(&view, &pyramid, place).map(|effect| (place, effect))
            })
            .collect();

        let mut work = vec![false; grid.blocks.len()];
        for (place, effect) in effects {
            self.apply(grid, place, &effect, &mut work);
        }

        let Grid { blocks, places, .. } = grid;
        blocks
            .par_iter_mut()
            .zip(places.par_iter())
            .zip(work.par_iter())
            .filter(|(_, has_work)| **has_work)
            .for_each(|((block, place), _)| self.update(&view, &surfels, *place, block));
        Ok(())
    }

    /// Returns the first and the last block of a box around the sensor and all hits.
    fn bounds(&self, view: &View<'_>, surfels: &[Surfel]) -> Result<Option<[Place; 2]>, FusionError> {
        let identity = || ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let turn = view.turn.transpose().as_mat3();
        let (low, high) = surfels
            .par_chunks(1 << 14)
            .enumerate()
            .map(|(chunk, surfels)| {
                let taken = surfels.iter().enumerate().filter(|(_, s)| s.weight > 0.0);
                taken.fold(identity(), |(low, high), (i, s)| {
                    let p = turn * self.image.ray(chunk << 14 | i, s);
                    ([0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k])))
                })
            })
            .reduce(identity, |a, b| {
                ([0, 1, 2].map(|k| a.0[k].min(b.0[k])), [0, 1, 2].map(|k| a.1[k].max(b.1[k])))
            });
        if low[0] > high[0] {
            return Ok(None);
        }

        let reach = self.scale.front + self.scale.cell * f64::from(SIDE);
        let corner = |off: [f32; 3], reach: f64| {
            let off = DVec3::from_array(off.map(f64::from));
            let point = view.location
                + if reach < 0.0 {
                    off.min(DVec3::ZERO)
                } else {
                    off.max(DVec3::ZERO)
                };
            self.scale
                .block_of(point + reach)
                .ok_or(FusionError::TooFar { point, cell_m: self.scale.cell })
        };
        Ok(Some([corner(low, -reach)?, corner(high, reach)?]))
    }

    /// Returns the keys of the blocks near hits, in order.
    fn touched(&self, view: &View<'_>, surfels: &[Surfel]) -> BTreeSet<u64> {
        let width = view.size[0] as usize;
        let turn = view.turn.transpose();
        let rows = surfels.par_chunks(width * 8).enumerate().map(|(band, surfels)| {
            let mut found: Vec<u64> = Vec::new();
            let mut last = None;
            for (i, s) in surfels.iter().enumerate().filter(|(_, s)| s.weight > 0.0) {
                let ray = self.image.ray(band * width * 8 + i, s);
                let length = ray.length();
                let cosine = -s.normal.dot(ray) / length;
                let along = turn * ray.as_dvec3() / f64::from(length);
                let hit = view.location + along * f64::from(length);
                let [front, behind] = self.scale.along_ray(cosine, s.sigma_m);
                let ends = [hit - along * front, hit + along * behind];
                let [a, b] = ends.map(|end| self.scale.block_of(end));
                let [Some(a), Some(b)] = [a, b] else { continue };
                // The neighbour's ray was in the same single block.
                if last == Some((a, b)) && a == b {
                    continue;
                }
                last = Some((a, b));
                blocks_along(ends.map(|end| end / self.scale.block()), |block| {
                    if self.tile.is_none_or(|t| t.holds(block)) {
                        found.push(key(block));
                    }
                });
                if found.len() > 1 << 14 {
                    found.sort_unstable();
                    found.dedup();
                }
            }
            found.sort_unstable();
            found.dedup();
            found
        });
        rows.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Returns what the image does to a chunk, or `None` if it does nothing.
    fn effect(&self, view: &View<'_>, pyramid: &Pyramid, place: Place) -> Option<Effect> {
        match self.seen(view, pyramid, place.map(|k| k * CHUNK), CHUNK) {
            Seen::No => return None,
            Seen::Free => return Some(Effect::Free),
            Seen::Mixed => {}
        }
        let (mut free, mut mixed) = (0, 0);
        for slot in 0..64 {
            match self.seen(view, pyramid, block_in(place, slot), 1) {
                Seen::No => {}
                Seen::Free => free |= 1 << slot,
                Seen::Mixed => mixed |= 1 << slot,
            }
        }
        (free | mixed != 0).then_some(Effect::Blocks { free, mixed })
    }

    /// Returns what the image does to a cube of blocks.
    fn seen(&self, view: &View<'_>, pyramid: &Pyramid, first: Place, blocks: i32) -> Seen {
        let half = 0.5 * f64::from(blocks) * self.scale.block();
        let middle = DVec3::from_array(first.map(f64::from)) * self.scale.block() + half;
        let Some(extent) = view.extent(middle, half * 3.0_f64.sqrt()) else { return Seen::No };
        let [nearest, farthest] = pyramid.ranges(&extent);
        if extent.near > farthest + self.scale.most_before() as f32 {
            Seen::No
        } else if extent.is_within && extent.far + (self.scale.most_before() as f32) < nearest {
            Seen::Free
        } else {
            Seen::Mixed
        }
    }

    /// Counts free blocks, and marks blocks to work on.
    fn apply(&self, grid: &mut Grid, place: Place, effect: &Effect, work: &mut [bool]) {
        let (free, mixed) = match effect {
            Effect::Free => (u64::MAX, 0),
            Effect::Blocks { free, mixed } => (*free, *mixed),
        };
        let held = |bits: u64| {
            let is_held = |slot: &usize| self.tile.is_none_or(|t| t.holds(block_in(place, *slot)));
            (0..64).filter(move |slot| bits >> slot & 1 == 1).filter(is_held)
        };
        if held(free).next().is_some() {
            let chunk = grid.chunk_at(place);
            for slot in held(free) {
                let count = &mut grid.chunks[chunk].free[slot];
                *count = count.saturating_add(1);
            }
        }
        let Some(chunk) = grid.chunk(place) else { return };
        for slot in held(mixed).filter(|slot| chunk.blocks[*slot] != NONE) {
            work[chunk.blocks[slot] as usize] = true;
        }
    }

    /// Adds the image to each voxel of a block.
    pub(super) fn update(&self, view: &View<'_>, surfels: &[Surfel], place: Place, block: &mut Block) {
        let cell = self.scale.cell;
        let corner = DVec3::from_array(place.map(f64::from)) * self.scale.block();
        let first = (view.turn * (corner - view.location)).as_vec3();
        let [right, up, out] =
            [view.turn.x_axis, view.turn.y_axis, view.turn.z_axis].map(|a| (a * cell).as_vec3());

        for k in 0..SIDE * SIDE {
            let start = first + up * (k % SIDE) as f32 + out * (k / SIDE) as f32;
            let points: [[f32; 8]; 3] =
                std::array::from_fn(|axis| std::array::from_fn(|i| start[axis] + right[axis] * i as f32));
            let (pixels, ranges) = view.pixels(&points);
            for i in 0..8 {
                let Some(surfel) = surfels.get(pixels[i] as usize) else { continue };
                let point = Vec3::new(points[0][i], points[1][i], points[2][i]);
                let voxel = (k * SIDE) as usize + i;
                self.update_voxel(block, voxel, surfel, point, ranges[i], pixels[i]);
            }
        }
    }

    /// Adds what a pixel says of a voxel. `point` is the voxel in the axes of the sensor.
    #[inline(always)]
    fn update_voxel(&self, block: &mut Block, voxel: usize, s: &Surfel, point: Vec3, range: f32, pixel: u32) {
        let scale = &self.scale;
        let before = s.range - range;
        let front = scale.front as f32;
        let most = scale.most_before() as f32;
        if s.weight == 0.0 {
            return;
        }

        let distance = s.normal.dot(point) + s.offset;
        if distance > front && before > front {
            block.pass(voxel, s.nearest - range > front);
        }
        if distance > front || before > most {
            return;
        }
        let Some(weight) = scale.weight(distance, before, s.sigma_m) else { return };
        let is_at = distance < 0.5 * scale.cell as f32;
        let share = block.observe(voxel, distance / front, weight * s.weight, is_at);
        if let Some(color) = self.image.colors().get(pixel as usize)
            && *color != NO_COLOR
            && distance.abs() < 2.0 * scale.cell as f32
        {
            block.mix_color(voxel, *color, share, chance(voxel as u32, self.number));
        }
    }
}
