//! Prefetches data that is read or written soon, while the processor calculates.

use crate::simd::shade_lanes::ShadeLanes;
use half::f16;

/// The data that is needed after the colours of a pixel: the images that are painted afterwards, and the hits
/// and images of the next band. All slices are by pixel of the band. By default they are empty.
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
    /// The number of pixels that are prefetched at once.
    pub(crate) const PIXELS: usize = 64;

    /// Prefetches the data of the pixels from `at` on.
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
fn prefetch<T>(lanes: impl ShadeLanes, values: &[T], at: usize) {
    if let Some(values) = values.get(at..at + Prefetch::PIXELS) {
        for value in values.iter().step_by(64 / size_of::<T>()) {
            lanes.prefetch(value);
        }
    }
}
