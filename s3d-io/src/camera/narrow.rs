//! Pictures that are too narrow to be true: a focal length with a digit too many, or the size of a thumbnail.

use s3d_geom::glam::DVec2;

/// The least angle of view of a picture, along its wider side. A lens of 600 mm before a sensor of 36 mm has
/// 3.4°.
const NARROWEST_DEG: f64 = 3.0;

/// Returns what is wrong with the focal lengths of a picture if it would be narrower than any lens makes it.
/// Pictures that narrow would be stitched into cubes of thousands of pixels a side.
pub(crate) fn too_narrow(size: [u32; 2], focal_px: DVec2) -> Option<String> {
    let is_narrow = focal_px.min_element() > 0.0 && angle_deg(size, focal_px) < NARROWEST_DEG;
    is_narrow.then(|| sentence(size, focal_px))
}

/// Says how narrow a picture is.
pub(crate) fn sentence(size: [u32; 2], focal_px: DVec2) -> String {
    format!(
        "focal lengths of {} and {} px give {} × {} pixels an angle of view of {:.2}°, and at least \
         {NARROWEST_DEG}° are expected: has a focal length a digit too many, or is it for a larger picture?",
        focal_px.x,
        focal_px.y,
        size[0],
        size[1],
        angle_deg(size, focal_px)
    )
}

/// The angle of view along the wider side. NaN if a focal length is.
fn angle_deg(size: [u32; 2], focal_px: DVec2) -> f64 {
    let half = DVec2::new(f64::from(size[0]), f64::from(size[1])) * 0.5 / focal_px;
    2.0 * libm::atan(half.max_element()).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digit_too_many_is_told() {
        let told = too_narrow([48, 36], DVec2::splat(3000.0)).unwrap();
        assert!(told.contains("48 × 36 pixels an angle of view of 0.92°"), "{told}");
        assert_eq!(too_narrow([48, 36], DVec2::splat(300.0)), None);
        // The wider side counts; 3° are 916 px of focal length for 48.
        assert_eq!(too_narrow([36, 48], DVec2::splat(910.0)), None);
        assert!(too_narrow([36, 48], DVec2::splat(920.0)).is_some());
        assert_eq!(too_narrow([36, 48], DVec2::ZERO), None);
    }
}
