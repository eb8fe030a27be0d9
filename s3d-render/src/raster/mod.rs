//! Finds the face that each pixel sees. Faces are drawn from the common origin of the rays, the nearest
//! first; the result is the same as the result of exact single rays.

pub(crate) mod batch;
pub(crate) mod canvas;
pub(crate) mod chunk;
pub(crate) mod panorama;
pub(crate) mod panorama_batch;
pub(crate) mod panorama_grid;
pub(crate) mod pinhole;
pub(crate) mod visibility;
pub(crate) mod window;

/// Returns the smaller of two; `b` if one is NaN. It is one instruction, which `f64::min` is not.
#[inline(always)]
fn min<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// Returns the greater of two; `b` if one is NaN.
#[inline(always)]
fn max<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// Returns the smallest of three.
#[inline(always)]
fn low<T: PartialOrd>([a, b, c]: [T; 3]) -> T {
    min(min(a, b), c)
}

/// Returns the greatest of three.
#[inline(always)]
fn high<T: PartialOrd>([a, b, c]: [T; 3]) -> T {
    max(max(a, b), c)
}
