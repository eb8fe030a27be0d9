//! An image is added to the grid.

use super::pyramid::Pyramid;
use super::touched::Touched;
use super::view::View;
use super::{Scale, Tile, chance};
use crate::FusionError;
use crate::grid::block::{Block, NO_COLOR, Row};
use crate::grid::{CHUNK, Grid, NONE, Place, SIDE, block_in, chunk_of, place_of};
use crate::lanes::{LANES, Lanes};
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

/// What an image says, whatever other images say.
#[derive(Debug)]
pub(super) struct Prepared {
    surfels: Vec<Surfel>,
    touched: Touched,
    pyramid: Pyramid,
}

impl Adding<'_> {
    pub(super) fn prepare(&self) -> Prepared {
        let view = View::new(self.image);
        let surfels = self.image.surfels(self.scale.cell as f32);
        let touched = self.touched(&view, &surfels);
        let pyramid = Pyramid::new(&surfels, view.size);
        Prepared { surfels, touched, pyramid }
    }

    pub(super) fn add_to(&self, grid: &mut Grid, prepared: &Prepared) -> Result<(), FusionError> {
        let Prepared { surfels, touched: Touched { blocks: touched, low, high }, pyramid } = prepared;
        let view = View::new(self.image);
        self.block(view.location)?;
        if low == high {
            return Ok(());
        }
        let bounds = self.bounds(&view, *low, *high)?;
        grid.make_blocks(touched.iter().copied().map(place_of));

        // Chunks between the sensor and what it saw.
        let [from, to] = bounds.map(chunk_of);
        let count = [0, 1, 2].map(|k| (to[k] - from[k] + 1) as usize);
        let effects: Vec<(Place, Effect)> = (0..count[0] * count[1] * count[2])
            .into_par_iter()
            .filter_map(|i| {
                let within = [i % count[0], i / count[0] % count[1], i / count[0] / count[1]];
                let place = [0, 1, 2].map(|k| from[k] + within[k] as i32);
                self.effect(&view, pyramid, place).map(|effect| (place, effect))
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
                dispatch!(level(), _simd => self.update(&view, surfels, *place, block));
            });
        Ok(())
    }

    /// Returns the first and the last block of a box around the sensor and all hits.
    fn bounds(&self, view: &View<'_>, low: Vec3, high: Vec3) -> Result<[Place; 2], FusionError> {
        let reach = self.scale.front + self.scale.block();
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        Ok([self.block(view.location + low - reach)?, self.block(view.location + high + reach)?])
    }

    fn block(&self, point: DVec3) -> Result<Place, FusionError> {
        let too_far = FusionError::TooFar { point, cell_m: self.scale.cell };
        self.scale.block_of(point).ok_or(too_far)
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

        // Some rows of voxels at a time.
        let side = SIDE as usize;
        let mut steps = [[0.0; LANES]; 3];
        for (axis, steps) in steps.iter_mut().enumerate() {
            for (i, step) in steps.iter_mut().enumerate() {
                *step = right[axis] * (i % side) as f32 + up[axis] * (i / side) as f32;
            }
        }
        for k in (0..side * side).step_by(LANES / side) {
            let start = first + up * (k % side) as f32 + out * (k / side) as f32;
            let mut points = steps;
            for (axis, numbers) in points.iter_mut().enumerate() {
                numbers.iter_mut().for_each(|k| *k += start[axis]);
            }
            let (pixels, ranges) = view.pixels(&points);
            if pixels != [u32::MAX; LANES] {
                self.update_row(block, k * side, surfels, &pixels, &ranges, &points);
            }
        }
    }

    /// Adds what pixels say of voxels from `first` on. `points` are the voxels in the axes of the sensor.
    #[inline(always)]
    fn update_row(
        &self,
        block: &mut Block,
        first: usize,
        surfels: &[Surfel],
        pixels: &[u32; LANES],
        ranges: &Lanes,
        points: &[Lanes; 3],
    ) {
        // What the pixels see, as columns.
        let mut columns = [[0.0; LANES]; 8];
        for lane in 0..LANES {
            let s = surfels.get(pixels[lane] as usize).unwrap_or(&Surfel::NONE).numbers();
            (0..8).for_each(|k| columns[k][lane] = s[k]);
        }
        let [x, y, z, offset, hit, trust, sigma, nearest] = columns;

        let scale = &self.scale;
        let (front, cell) = (scale.front as f32, scale.cell as f32);
        let mut row = Row::default();
        let (mut is_touched, mut is_colored) = ([false; LANES], [false; LANES]);
        for lane in 0..LANES {
            let [px, py, pz] = [0, 1, 2].map(|axis: usize| points[axis][lane]);
            let distance = (x[lane] * px + y[lane] * py + z[lane] * pz) + offset[lane];
            let before = hit[lane] - ranges[lane];
            let is_seen = trust[lane] > 0.0;
            let is_before = is_seen & (before > front);
            row.is_far[lane] = f32::from(is_before & (distance > front));
            row.is_through[lane] = f32::from(is_before & (nearest[lane] - ranges[lane] > front));

            let counts = is_seen & (distance <= front) & (before <= scale.most_before());
            let weight = f32::from(counts) * scale.weight(distance, before, sigma[lane]) * trust[lane];
            row.distance[lane] = distance * front.recip();
            row.weight[lane] = weight;
            is_touched[lane] = row.weight[lane] + row.is_far[lane] + row.is_through[lane] > 0.0;
            is_colored[lane] = (weight > 0.0) & (distance.abs() < 2.0 * cell);
        }

        if is_touched == [false; LANES] {
            return;
        }
        let shares = block.observe_row(first, &row, scale.near());
        if is_colored == [false; LANES] {
            return;
        }
        for lane in 0..LANES {
            if is_colored[lane]
                && let Some(color) = self.image.colors().get(pixels[lane] as usize)
                && *color != NO_COLOR
            {
                let voxel = first + lane;
                block.mix_color(voxel, *color, shares[lane], chance(voxel as u32, self.number));
            }
        }
    }
}
