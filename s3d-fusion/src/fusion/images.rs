//! An image is added to the grid.

use super::pyramid::Pyramid;
use super::view::View;
use super::walk::{self, blocks_along};
use super::{Scale, Tile, chance};
use crate::FusionError;
use crate::grid::block::{Block, NO_COLOR};
use crate::grid::{CHUNK, FARTHEST, Grid, NONE, Place, SIDE, block_in, chunk_of, key, place_of};
use crate::range_image::{RangeImage, Surfel};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec3};
use s3d_simd::{dispatch, level};

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
        self.block(view.location)?;
        let (touched, low, high) = self.touched(&view, &surfels);
        if touched.is_empty() && low.x > high.x {
            return Ok(());
        }
        let bounds = self.bounds(&view, low, high)?;
        for block in touched {
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
            .for_each(|((block, place), _)| {
                dispatch!(level(), _simd => self.update(&view, &surfels, *place, block));
            });
        Ok(())
    }

    /// Returns the first and the last block of a box around the sensor and all hits.
    fn bounds(&self, view: &View<'_>, low: Vec3, high: Vec3) -> Result<[Place; 2], FusionError> {
        let reach = self.scale.front + self.scale.block();
        let (low, high) = (low.as_dvec3().min(DVec3::ZERO), high.as_dvec3().max(DVec3::ZERO));
        Ok([self.block(view.location + low - reach)?, self.block(view.location + high + reach)?])
    }

    fn block(&self, point: DVec3) -> Result<Place, FusionError> {
        let too_far = FusionError::TooFar { point, cell_m: self.scale.cell };
        self.scale.block_of(point).ok_or(too_far)
    }

    /// Returns the keys of the blocks near hits, in order, and the box of all hits from the sensor.
    fn touched(&self, view: &View<'_>, surfels: &[Surfel]) -> (Vec<u64>, Vec3, Vec3) {
        let width = view.size[0] as usize;
        // In blocks from the block of the sensor, so that single precision is enough.
        let per_block = self.scale.block().recip();
        let sensor = walk::floor(view.location * per_block);
        let start = (view.location * per_block - DVec3::from_array(sensor.map(f64::from))).as_vec3();
        let turn = view.turn.transpose().as_mat3();
        let reach = (FARTHEST - 8) as f32;

        let bands = surfels.par_chunks(width * 8).enumerate().map(|(band, surfels)| {
            let mut found: Vec<u64> = Vec::new();
            let mut last = None;
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for (i, s) in surfels.iter().enumerate().filter(|(_, s)| s.weight > 0.0) {
                let ray = self.image.ray_of(band * width * 8 + i) * s.range;
                let hit = turn * ray;
                (low, high) = (low.min(hit), high.max(hit));
                let length = ray.dot(ray).sqrt();
                let [front, behind] = self.scale.along_ray(-s.normal.dot(ray) / length, s.sigma_m);
                let at = |off: f64| start + hit * ((1.0 + off as f32 / length) * per_block as f32);
                let ends = [at(-front), at(behind)];
                if ends.iter().any(|end| end.abs().max_element() >= reach) {
                    continue;
                }
                // The ray before went the same way.
                let way = walk::Way::new(ends);
                if way.is_short() && last == Some(way) {
                    continue;
                }
                last = Some(way);
                blocks_along(ends.map(Vec3::as_dvec3), |from_sensor| {
                    let block = [0, 1, 2].map(|k| sensor[k] + from_sensor[k]);
                    if self.tile.is_none_or(|t| t.holds(block)) {
                        found.push(key(block));
                    }
                });
            }
            found.sort_unstable();
            found.dedup();
            (found, low, high)
        });

        let bands: Vec<(Vec<u64>, Vec3, Vec3)> = bands.collect();
        let low = bands.iter().fold(Vec3::INFINITY, |low, band| low.min(band.1));
        let high = bands.iter().fold(Vec3::NEG_INFINITY, |high, band| high.max(band.2));
        let mut found: Vec<u64> = bands.into_iter().flat_map(|band| band.0).collect();
        found.sort_unstable();
        found.dedup();
        (found, low, high)
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
        let behind = self.scale.most_behind(self.image.noise().sigma_m(farthest));
        if extent.near > farthest + behind {
            Seen::No
        } else if extent.is_within && extent.far + (self.scale.front as f32) < nearest {
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
    #[inline(always)]
    pub(super) fn update(&self, view: &View<'_>, surfels: &[Surfel], place: Place, block: &mut Block) {
        let cell = self.scale.cell;
        let corner = DVec3::from_array(place.map(f64::from)) * self.scale.block();
        let first = (view.turn * (corner - view.location)).as_vec3();
        let [right, up, out] =
            [view.turn.x_axis, view.turn.y_axis, view.turn.z_axis].map(|a| (a * cell).as_vec3());

        for k in 0..SIDE * SIDE {
            let start = first + up * (k % SIDE) as f32 + out * (k / SIDE) as f32;
            let mut points = [[0.0; 8]; 3];
            for (axis, numbers) in points.iter_mut().enumerate() {
                let numbers = numbers.iter_mut().enumerate();
                numbers.for_each(|(i, k)| *k = start[axis] + right[axis] * i as f32);
            }
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
        if s.weight == 0.0 {
            return;
        }

        let distance = s.normal.dot(point) + s.offset;
        if before > front {
            block.pass(voxel, distance > front, s.nearest - range > front);
        }
        if distance > front || before > scale.most_before() as f32 {
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
