//! What is read and written soon, fetched from memory while there is something to calculate.

use crate::simd::shade_lanes::ShadeLanes;
use half::f16;

/// By pixel of a band, what is next in turn after its colours: the images that are painted afterwards, and
/// hits and images of the next band. By default nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Prefetch<'a> {
    pub(crate) faces: &'a [u32],
    pub(crate) distances: &'a [f32],
    pub(crate) depth: &'a [u16],
    pub(crate) xyz: &'a [[f16; 3]],
    pub(crate) rgb: &'a [[u8; 3]],
    pub(crate) flat: [&'a [[u8; 3]]; 3],
}

impl Prefetch<'_> {
    /// How many pixels are fetched at once.
    pub(crate) const PIXELS: usize = 64;

    /// Fetches what belongs to the pixels from `at` on.
    #[inline(always)]
    pub(crate) fn fetch(&self, lanes: impl ShadeLanes, at: usize) {
        prefetch(lanes, self.faces, at);
        prefetch(lanes, self.distances, at);
        prefetch(lanes, self.depth, at);
        prefetch(lanes, self.xyz, at);
        prefetch(lanes, self.rgb, at);
        for image in self.flat {
            prefetch(lanes, image, at);
        }
    }
}

#[inline(always)]
fn prefetch<T>(lanes: impl ShadeLanes, of: &[T], at: usize) {
    if let Some(some) = of.get(at..at + Prefetch::PIXELS) {
        for thing in some.iter().step_by(64 / size_of::<T>()) {
            lanes.prefetch(thing);
        }
    }
}
