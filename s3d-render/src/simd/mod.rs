//! Wide registers: one choice of instructions for all kernels.
//!
//! A kernel is written once, over [`Simd`], and compiled for every level of instructions; [`dispatch`] runs
//! it with the level that s3d-simd has chosen. A level gives it registers for sixteen pixels of the
//! visibility pass ([`RasterLanes`]) or for eight pixels to be shaded ([`ShadeLanes`]). All give the same
//! bits: every operation is on integers or rounds once, as IEEE 754 says it must; products and sums are never
//! fused.
//!
//! Where time counts, no closure with instructions goes to `map` of an array or to `from_fn`, or is called
//! from several places: it may be compiled for any processor, and called. Loops and functions with
//! `#[inline(always)]` are not.
//!
//! Own code, since a library costs time in the kernel that counts: by `fearless_simd` 1.2 (no dependencies,
//! safe, stable Rust), which has no stores of some lanes alone, the chunks of a window take 0 to 10 % longer
//! with AVX-512 on Zen 4, and with AVX2 18 to 20 % longer on Zen 3, but 6 % less on Zen 4; and it asks for
//! Ice Lake where AVX-512 is to be used. Measured by `docs/performance/simd_library`.

pub(crate) mod raster_lanes;
#[cfg(target_arch = "x86_64")]
pub(crate) mod raster_x86;
#[cfg(target_arch = "x86_64")]
pub(crate) mod shade_avx2;
pub(crate) mod shade_lanes;
#[cfg(target_arch = "x86_64")]
pub(crate) mod shade_width;

use raster_lanes::{Pair, Portable, RasterLanes};
#[cfg(target_arch = "x86_64")]
use s3d_simd::{Avx2, Avx512};
use s3d_simd::{Level, Scalar, level};
use shade_lanes::{Plain, ShadeLanes};

/// A level of instructions, as the proof that the processor has them.
pub(crate) trait Simd: Copy {
    type Raster: RasterLanes;
    type Shade: ShadeLanes;

    /// Registers of the visibility pass.
    fn raster(self) -> Self::Raster;
    /// Registers of what makes images from hits.
    fn shade(self) -> Self::Shade;
}

impl Simd for Scalar {
    type Raster = Pair<Portable>;
    type Shade = Plain;

    #[inline(always)]
    fn raster(self) -> Self::Raster {
        Pair(Portable)
    }
    #[inline(always)]
    fn shade(self) -> Self::Shade {
        Plain
    }
}

#[cfg(target_arch = "x86_64")]
impl Simd for Avx2 {
    type Raster = Pair<raster_x86::Wide256>;
    type Shade = shade_avx2::Eight<Self>;

    #[inline(always)]
    fn raster(self) -> Self::Raster {
        Pair(raster_x86::Wide256(self))
    }
    #[inline(always)]
    fn shade(self) -> Self::Shade {
        shade_avx2::Eight(self)
    }
}

#[cfg(target_arch = "x86_64")]
impl Simd for Avx512 {
    type Raster = raster_x86::Wide512;
    type Shade = shade_avx2::Eight<Self>;

    #[inline(always)]
    fn raster(self) -> Self::Raster {
        raster_x86::Wide512(self)
    }
    #[inline(always)]
    fn shade(self) -> Self::Shade {
        shade_avx2::Eight(self)
    }
}

/// Work that is compiled for every level. `run` and what it calls in its loops are `#[inline(always)]`.
pub(crate) trait Kernel {
    type Output;
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs a kernel with the instructions in use.
#[inline]
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    dispatch_on(level(), kernel)
}

/// Runs a kernel with the instructions of a level.
pub(crate) fn dispatch_on<K: Kernel>(level: Level, kernel: K) -> K::Output {
    s3d_simd::dispatch!(level, simd => kernel.run(simd))
}
