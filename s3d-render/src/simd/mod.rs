//! Wide registers: one choice of vector instructions for all kernels.
//!
//! A kernel is written once, over [`Simd`], and compiled for every level of instructions. [`dispatch`] runs
//! it at the level that s3d-simd has chosen. A [`ProvenLevel`] carries the proof that the processor has its
//! instructions; the public [`SimdLevel`](s3d_simd::SimdLevel) is its name. A level has registers for sixteen
//! pixels of the visibility pass ([`RasterLanes`]) and for eight pixels to be shaded ([`ShadeLanes`]). All
//! levels give the same bits: every operation is on integers or rounds once, as IEEE 754 demands, and
//! products and sums are never fused.
//!
//! In hot code, no closure that contains vector instructions is passed to `map` of an array or to `from_fn`,
//! or called from several places: the compiler may compile it for any processor and call it. It does not do
//! so with loops, nor with functions that are `#[inline(always)]`.
//!
//! This is our own code, since a library costs time in the hottest kernel. `fearless_simd` 1.2 (no
//! dependencies, safe, stable Rust) has no masked stores. With it, the chunks of a window take 0 to 10 %
//! longer with AVX-512 on Zen 4. With AVX2 they take 18 to 20 % longer on Zen 3, but 6 % less on Zen 4. It
//! also requires Ice Lake for AVX-512. Measured by `bench/simd_library`.

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
use s3d_simd::{ProvenLevel, Scalar, level};
use shade_lanes::{Plain, ShadeLanes};

/// A level of instructions, as the proof that the processor has them.
pub(crate) trait Simd: Copy {
    type Raster: RasterLanes;
    type Shade: ShadeLanes;

    /// Returns the registers of the visibility pass.
    fn raster(self) -> Self::Raster;
    /// Returns the registers that make images from hits.
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

/// Work that is compiled for every level. `run` and the functions that it calls in loops are
/// `#[inline(always)]`.
pub(crate) trait Kernel {
    type Output;
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs a kernel at the level in use.
#[inline]
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    dispatch_on(level(), kernel)
}

/// Runs a kernel at a given level.
pub(crate) fn dispatch_on<K: Kernel>(level: ProvenLevel, kernel: K) -> K::Output {
    s3d_simd::dispatch!(level, simd => kernel.run(simd))
}
