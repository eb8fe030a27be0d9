//! Which pixels a smaller image takes of a larger one, as each library does it: they differ by up to half a
//! pixel of the smaller image, which shows in a score's third digit.

/// The places that Pillow's `resize(…, NEAREST)` takes along an axis of `from` pixels for one of `to`: the
/// pixel that the middle of the new one lies in. scikit-image's `rescale(…, order=0)` takes the same since 0.19. Steps
/// are summed as the library does, which decides where a middle lies between two pixels. Source: Pillow,
/// `libImaging/Geometry.c`, `ImagingScaleAffine`.
pub fn pillow_nearest(from: u32, to: u32) -> Vec<u32> {
    let step = f64::from(from) / f64::from(to);
    let middles = std::iter::successors(Some(0.5 * step), |middle| Some(middle + step));
    middles
        .take(to as usize)
        .map(|middle| (middle as u32).min(from.saturating_sub(1)))
        .collect()
}

/// The places that OpenCV's `resize(…, INTER_NEAREST)` takes along an axis of `from` pixels for one of `to`:
/// the pixel that the start of the new one lies in. Source: OpenCV, `imgproc/src/resize.cpp`, `resizeNN`.
pub fn opencv_nearest(from: u32, to: u32) -> Vec<u32> {
    let step = 1.0 / (f64::from(to) / f64::from(from));
    (0..to)
        .map(|at| ((f64::from(at) * step) as u32).min(from.saturating_sub(1)))
        .collect()
}
