//! The pixels of a large image that make a small one, by the rules of two libraries. The rules differ by up
//! to half a pixel of the small image, which changes the third digit of a score.

/// Returns the pixels that Pillow's `resize(…, NEAREST)` takes along an axis of `from` pixels for an axis
/// of `to`: each is the pixel that holds the middle of the new pixel. scikit-image's `rescale(…, order=0)`
/// takes the same since 0.19. Steps are summed like in the library, which decides when a middle lies between
/// two pixels. Source: Pillow, `libImaging/Geometry.c`, `ImagingScaleAffine`.
pub fn pillow_nearest(from: u32, to: u32) -> Vec<u32> {
    let step = f64::from(from) / f64::from(to);
    let middles = std::iter::successors(Some(0.5 * step), |middle| Some(middle + step));
    middles
        .take(to as usize)
        .map(|middle| (middle as u32).min(from.saturating_sub(1)))
        .collect()
}

/// Returns the pixels that OpenCV's `resize(…, INTER_NEAREST)` takes along an axis of `from` pixels for an
/// axis of `to`: each is the pixel that holds the start of the new pixel. Source: OpenCV,
/// `imgproc/src/resize.cpp`, `resizeNN`.
pub fn opencv_nearest(from: u32, to: u32) -> Vec<u32> {
    let step = 1.0 / (f64::from(to) / f64::from(from));
    (0..to)
        .map(|at| ((f64::from(at) * step) as u32).min(from.saturating_sub(1)))
        .collect()
}
