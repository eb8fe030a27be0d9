//! Which face each pixel sees: faces drawn from the rays' common origin, the nearest first, with the answer
//! of exact single rays.

pub(crate) mod batch;
pub(crate) mod canvas;
pub(crate) mod chunk;
pub(crate) mod panorama;
pub(crate) mod panorama_batch;
pub(crate) mod panorama_grid;
pub(crate) mod pinhole;
pub(crate) mod visibility;
pub(crate) mod window;

/// The smaller of two, and of anything but numbers the second: one instruction, which `f64::min` is not.
#[inline(always)]
fn min<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The greater of two, likewise.
#[inline(always)]
fn max<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// The smallest of three.
#[inline(always)]
fn low<T: PartialOrd>([a, b, c]: [T; 3]) -> T {
    min(min(a, b), c)
}

/// The greatest of three.
#[inline(always)]
fn high<T: PartialOrd>([a, b, c]: [T; 3]) -> T {
    max(max(a, b), c)
}
