//! Does a library of wide registers do for the kernel of the visibility pass what s3d-render's own do?
//!
//! ```text
//! cargo run --release --manifest-path bench/simd_library/Cargo.toml
//! ```
//!
//! The kernel (`s3d-render/src/raster/chunk.rs`, as it is there) draws 4,000 chunks of 16 columns and 4 to 16
//! rows on a window of 256 × 128, with our registers and with those of `fearless_simd`, taking turns.
//! Printed are milliseconds of processor time; the pixels must be the same. Needs a processor with AVX-512 as
//! of Ice Lake, which is what the library asks for.

#![allow(dead_code)]

#[path = "../../../../s3d-render/src/raster/chunk.rs"]
mod chunk;
#[path = "../../../../s3d-render/src/simd/raster_lanes.rs"]
mod raster_lanes;
#[path = "../../../../s3d-render/src/simd/raster_x86.rs"]
mod raster_x86;

mod simd {
    pub(crate) use crate::raster_lanes;
}

use chunk::{Chunk, ChunkGrid, EDGE_ERROR, Linear, MAX_ROWS, RowScratch, draw};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, i32x16, mask32x16, u32x16};
use s3d_simd::{Avx2, Avx512};
use raster_lanes::{LANES, Pair, Portable, RasterLanes};
use raster_x86::{Wide256, Wide512};

/// The library's registers.
#[derive(Clone, Copy)]
struct Library<S: Simd>(S);

impl<S: Simd> RasterLanes for Library<S> {
    const N: usize = LANES;
    type F = f32x16<S>;
    type M = mask32x16<S>;
    type Half = Portable;

    #[inline(always)]
    fn half(self) -> Self::Half {
        Portable
    }
    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        f32x16::splat(self.0, x)
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        f32x16::from_slice(self.0, &from[..LANES])
    }
    #[inline(always)]
    fn store(self, to: &mut [f32], x: Self::F) {
        x.store_slice(&mut to[..LANES]);
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        a + b
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        a * b
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        a.min(b)
    }
    #[inline(always)]
    fn greater(self, a: Self::F, b: Self::F) -> Self::M {
        a.simd_gt(b)
    }
    #[inline(always)]
    fn greater_by_ulps(self, a: Self::F, b: Self::F, ulps: i32) -> Self::M {
        let (a, b): (i32x16<S>, i32x16<S>) = (a.bitcast(), b.bitcast());
        a.simd_gt(b + i32x16::splat(self.0, ulps))
    }
    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        a & b
    }
    #[inline(always)]
    fn bits(self, m: Self::M) -> u16 {
        m.to_bitmask() as u16
    }
    #[inline(always)]
    fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
        let old = f32x16::from_slice(self.0, &to[..LANES]);
        m.select(x, old).store_slice(&mut to[..LANES]);
    }
    #[inline(always)]
    fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32) {
        let old = u32x16::from_slice(self.0, &to[..LANES]);
        m.select(u32x16::splat(self.0, x), old).store_slice(&mut to[..LANES]);
    }
}

const PITCH: usize = 256;
const ROWS: usize = 128;
const CHUNKS: u32 = 4000;
const ROUNDS: usize = 30;
/// Windows a turn: enough for the kernel's clock.
const WINDOWS: usize = 300;

/// A window and what is drawn on it.
struct Job {
    best: Vec<f32>,
    slots: Vec<u32>,
    chunks: Vec<(Chunk, usize)>,
    count: [f32; MAX_ROWS],
    scratch: RowScratch,
    doubtful: u64,
}

impl Job {
    fn new() -> Self {
        let mut state = 1u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let chunk = |slot| {
            let rows = [4, 8, 12, 16][(random() * 4.0) as usize];
            let (across, down) = (1e-4, 1e-4);
            let inverse_t = Linear { at: 0.2 + random(), across, bend: 0.0, down };
            let (column, row) = ((random() * 200.0) as usize, (random() * 100.0) as usize);
            let mut edge = || {
                let at = random() * 8.0 - 1.0;
                Linear { at, across: random() - 0.5, bend: 0.0, down: random() - 0.5 }
            };
            let edges = [edge(), edge(), edge()];
            let edge_error = EDGE_ERROR;
            (Chunk { column, row, edges, edge_error, inverse_t, slot, ..Chunk::default() }, rows)
        };
        Self {
            best: vec![0.0; PITCH * ROWS],
            slots: vec![0; PITCH * ROWS],
            chunks: (0..CHUNKS).map(chunk).collect(),
            count: std::array::from_fn(|k| k as f32),
            scratch: RowScratch::default(),
            doubtful: 0,
        }
    }

    #[inline(always)]
    fn run<L: RasterLanes>(&mut self, lanes: L) {
        self.best.fill(0.0);
        let Self { best, slots, chunks, count, scratch, doubtful } = self;
        let Some(u) = count.first_chunk() else { return };
        for (chunk, rows) in chunks.iter() {
            let grid = ChunkGrid { u, v: u, rows: count, count: *rows, scale: &[] };
            let at = chunk.row * PITCH + chunk.column;
            let window = (&mut best[at..], &mut slots[at..], PITCH);
            *doubtful += u64::from(draw::<L, false, false>(lanes, window, &grid, chunk, scratch));
        }
    }
}

#[target_feature(enable = "avx2,fma,f16c,bmi1,bmi2,lzcnt,popcnt")]
fn ours_avx2(job: &mut Job, lanes: Pair<Wide256>) {
    job.run(lanes);
}

#[target_feature(
    enable = "avx2,fma,f16c,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512bw,avx512dq,avx512vl,avx512vnni"
)]
fn ours_avx512(job: &mut Job, lanes: Wide512) {
    job.run(lanes);
}

/// Milliseconds of processor time of this thread.
fn processor_ms() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).expect("nanoseconds") / 1e6
}

fn main() {
    let (avx2, avx512) = (Avx2::detect().expect("AVX2"), Avx512::detect().expect("AVX-512"));
    let best = Level::new();
    assert!(best.as_avx512().is_some(), "the library finds {best:?}");
    let lower = Level::Avx2(best.as_avx2().expect("AVX2"));
    let names = ["ours, AVX-512", "library, AVX-512", "ours, AVX2", "library, AVX2"];
    let mut jobs = names.map(|_| Job::new());
    let mut times = names.map(|_| Vec::new());
    for round in 0..ROUNDS {
        for k in (0..names.len()).map(|k| (k + round) % names.len()) {
            let job = &mut jobs[k];
            let start = processor_ms();
            for _ in 0..WINDOWS {
                match k {
                    // SAFETY: the processor has AVX-512, which was asked.
                    0 => unsafe { ours_avx512(job, Wide512(avx512)) },
                    1 => dispatch!(best, simd => job.run(Library(simd))),
                    // SAFETY: likewise AVX2.
                    2 => unsafe { ours_avx2(job, Pair(Wide256(avx2))) },
                    _ => dispatch!(lower, simd => job.run(Library(simd))),
                }
            }
            times[k].push((processor_ms() - start) / WINDOWS as f64);
        }
    }
    for job in &jobs[1..] {
        assert!((&job.best, &job.slots, job.doubtful) == (&jobs[0].best, &jobs[0].slots, jobs[0].doubtful));
    }
    for (name, times) in names.iter().zip(&mut times) {
        times.sort_by(f64::total_cmp);
        let [least, fifth, median] = [0, ROUNDS / 5, ROUNDS / 2].map(|k| times[k]);
        println!("{name:16} ms a window: least {least:.4} fifth {fifth:.4} median {median:.4}");
    }
}
