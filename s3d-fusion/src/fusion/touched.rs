//! Which blocks an image is gathered in: those near its hits.

use super::images::Adding;
use super::view::View;
use super::walk::{self, Ways, blocks_along, cubes_of};
use crate::grid::{FARTHEST, Place, key};
use crate::lanes::{LANES, Lanes};
use crate::range_image::{Rays, Surfel};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Mat3, Vec3};
use s3d_simd::{dispatch, level};

/// The blocks near hits.
#[derive(Debug)]
pub(super) struct Touched {
    /// The keys of the blocks, in order.
    pub(super) blocks: Vec<u64>,
    /// A box around the sensor and all hits, from the sensor, metres.
    pub(super) low: Vec3,
    pub(super) high: Vec3,
}

/// Rows of an image that are worked on at a time.
const ROWS: usize = 32;
/// The numbers of ways and of blocks that are remembered.
const RECENT: usize = 1024;

impl Adding<'_> {
    pub(super) fn touched(&self, view: &View<'_>, surfels: &[Surfel]) -> Touched {
        let width = view.size[0] as usize;
        let near = Near::new(self, view);
        let rays = self.image.rays();
        let bands: Vec<Touched> = surfels
            .par_chunks(width * ROWS)
            .enumerate()
            .map(|(band, surfels)| dispatch!(level(), _simd => near.band(&rays, band * ROWS, surfels)))
            .collect();

        let low = bands.iter().fold(Vec3::ZERO, |low, band| low.min(band.low));
        let high = bands.iter().fold(Vec3::ZERO, |high, band| high.max(band.high));
        let mut blocks: Vec<u64> = bands.into_iter().flat_map(|band| band.blocks).collect();
        blocks.par_sort_unstable();
        blocks.dedup();
        Touched { blocks, low, high }
    }
}

/// From pixels to blocks. Blocks are counted from the sensor's, so that single precision is enough.
struct Near<'a> {
    adding: &'a Adding<'a>,
    width: usize,
    /// From OpenCV's axes of the sensor to the world.
    turn: Mat3,
    /// The block of the sensor, and where the sensor is in it, in blocks.
    sensor: [i32; 3],
    start: Vec3,
    per_block: f32,
}

impl<'a> Near<'a> {
    fn new(adding: &'a Adding<'a>, view: &View<'_>) -> Self {
        let per_block = adding.scale.block().recip();
        let sensor = walk::floor(view.location * per_block);
        let start = view.location * per_block - DVec3::from_array(sensor.map(f64::from));
        Self {
            adding,
            width: view.size[0] as usize,
            turn: view.turn.transpose().as_mat3(),
            sensor,
            start: start.as_vec3(),
            per_block: per_block as f32,
        }
    }

    /// Returns the blocks of some rows.
    #[inline(always)]
    fn band(&self, rays: &Rays<'_>, first: usize, surfels: &[Surfel]) -> Touched {
        let mut blocks = Vec::new();
        let (mut low, mut high) = ([[0.0_f32; LANES]; 3], [[0.0_f32; LANES]; 3]);
        let mut recent = Recent::default();
        let mut row_rays = [const { Vec::new() }; 3];
        for (row, surfels) in surfels.chunks(self.width).enumerate() {
            rays.row(first + row, &mut row_rays);
            for x in (0..self.width).step_by(LANES) {
                let surfels = &surfels[x..self.width.min(x + LANES)];
                let hits = self.hits(&row_rays, x, surfels);
                for axis in 0..3 {
                    for lane in 0..LANES {
                        let at = if hits.is_seen[lane] { hits.at[axis][lane] } else { 0.0 };
                        low[axis][lane] = low[axis][lane].min(at);
                        high[axis][lane] = high[axis][lane].max(at);
                    }
                }
                self.walk(&hits, &mut recent, &mut blocks);
            }
        }
        blocks.sort_unstable();
        blocks.dedup();
        let low = low.map(|low| low.into_iter().fold(0.0, f32::min));
        let high = high.map(|high| high.into_iter().fold(0.0, f32::max));
        Touched { blocks, low: low.into(), high: high.into() }
    }

    /// Returns what the pixels from `x` on see, and where their distances are gathered.
    #[inline(always)]
    fn hits(&self, rays: &[Vec<f32>; 3], x: usize, surfels: &[Surfel]) -> Hits {
        let mut ray = [[0.0; LANES]; 3];
        for (ray, row) in ray.iter_mut().zip(rays) {
            ray[..surfels.len()].copy_from_slice(&row[x..x + surfels.len()]);
        }
        let [mut nx, mut ny, mut nz, mut range, mut sigma] = [[0.0; LANES]; 5];
        let mut is_seen = [false; LANES];
        for (lane, s) in surfels.iter().enumerate() {
            (nx[lane], ny[lane], nz[lane]) = (s.normal.x, s.normal.y, s.normal.z);
            (range[lane], sigma[lane], is_seen[lane]) = (s.range, s.sigma_m, s.weight > 0.0);
        }

        let mut hits = Hits { is_seen, at: [[0.0; LANES]; 3], ends: [[[0.0; LANES]; 3]; 2] };
        let rows = [0, 1, 2].map(|axis| self.turn.row(axis));
        for lane in 0..LANES {
            let [x, y, z] = [ray[0][lane], ray[1][lane], ray[2][lane]].map(|k| k * range[lane]);
            let length = (x * x + y * y + z * z).sqrt();
            let cosine = -(nx[lane] * x + ny[lane] * y + nz[lane] * z) / length;
            let [front, behind] = self.adding.scale.along_ray(cosine, sigma[lane]);
            let ends = [-front, behind].map(|off| (1.0 + off / length) * self.per_block);
            for (axis, row) in rows.iter().enumerate() {
                let at = row.x * x + row.y * y + row.z * z;
                hits.at[axis][lane] = at;
                (0..2).for_each(|k| hits.ends[k][axis][lane] = self.start[axis] + at * ends[k]);
            }
        }
        hits
    }

    /// Adds the blocks of rays, but not of rays that go a way of late.
    #[inline(always)]
    fn walk(&self, hits: &Hits, recent: &mut Recent, blocks: &mut Vec<u64>) {
        let ways = Ways::of(&hits.ends);
        // The first pixel of a run of equal ways that is seen.
        let changes = ways.changes();
        let mut is_done = false;
        for lane in 0..LANES {
            is_done &= changes >> lane & 1 == 0;
            if is_done | !hits.is_seen[lane] {
                continue;
            }
            is_done = true;

            let way = ways.lane(lane);
            let known = recent.way(way);
            if *known == way {
                continue;
            }

            let ends = [0, 1].map(|end: usize| {
                let [x, y, z] = &hits.ends[end];
                Vec3::new(x[lane], y[lane], z[lane])
            });
            let is_near = |end: &Vec3| end.abs().max_element() < (FARTHEST - 8) as f32;
            if !ends.iter().all(is_near) {
                continue;
            }
            let is_short = Ways::is_short(way);
            if is_short {
                *known = way;
            }

            let visit = |from_sensor: Place| {
                let block = [0, 1, 2].map(|k| self.sensor[k] + from_sensor[k]);
                if self.adding.tile.is_none_or(|tile| tile.holds(block)) && recent.is_new(key(block)) {
                    blocks.push(key(block));
                }
            };
            if is_short {
                cubes_of(way, visit);
            } else {
                blocks_along(ends.map(|end| end.as_dvec3()), visit);
            }
        }
    }
}

/// The ways and the blocks of late.
struct Recent {
    ways: [[i32; 4]; RECENT],
    blocks: [u64; RECENT],
}

impl Default for Recent {
    fn default() -> Self {
        Self { ways: [[i32::MIN; 4]; RECENT], blocks: [u64::MAX; RECENT] }
    }
}

impl Recent {
    /// Where a way is kept, or another one that came there.
    #[inline(always)]
    fn way(&mut self, way: [i32; 4]) -> &mut [i32; 4] {
        let mix = |mixed: u32, k: &i32| (mixed ^ *k as u32).wrapping_mul(0x9e37_79b9);
        &mut self.ways[way.iter().fold(0, mix) as usize >> (u32::BITS - RECENT.ilog2())]
    }

    /// Keeps the key of a block, and returns false if it is there.
    #[inline(always)]
    fn is_new(&mut self, block: u64) -> bool {
        let place = block.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (u64::BITS - RECENT.ilog2());
        std::mem::replace(&mut self.blocks[place as usize], block) != block
    }
}

/// What pixels side by side see.
struct Hits {
    is_seen: [bool; LANES],
    /// From the sensor, along the axes of the world, metres.
    at: [Lanes; 3],
    /// Where distances are gathered from and to, in blocks.
    ends: [[Lanes; 3]; 2],
}
