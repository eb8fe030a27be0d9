//! The lens of a photograph, of either model.

use super::{Camera, CameraError, FisheyeLens, Lens, Pose};
use glam::{DVec2, DVec3};

/// The lens of a photograph, of either of OpenCV's models. A pinhole is a [`Lens`] without distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PhotoLens {
    /// The model with k₁ k₂ p₁ p₂ k₃.
    Straight(Lens),
    /// The fisheye model, with k₁ k₂ k₃ k₄.
    Fisheye(FisheyeLens),
}

impl PhotoLens {
    /// Returns the width and height of the photograph in pixels.
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Straight(lens) => [lens.width(), lens.height()],
            Self::Fisheye(lens) => [lens.width(), lens.height()],
        }
    }

    /// Returns the focal lengths in pixels, to the right and downwards.
    pub fn focal_px(&self) -> DVec2 {
        match self {
            Self::Straight(lens) => lens.focal_px(),
            Self::Fisheye(lens) => lens.focal_px(),
        }
    }

    /// Returns the principal point in pixels from the top left corner of the photograph.
    pub fn center_px(&self) -> DVec2 {
        match self {
            Self::Straight(lens) => lens.center_px(),
            Self::Fisheye(lens) => lens.center_px(),
        }
    }

    /// Makes a pinhole camera with the same focal lengths and principal point. Its image is `width` pixels
    /// wide and has the proportions of the photograph.
    ///
    /// # Errors
    /// The errors of [`Camera::pinhole`].
    pub fn pinhole(&self, pose: Pose, width: u32) -> Result<Camera, CameraError> {
        let [w, h] = self.size().map(f64::from);
        let height = (h * f64::from(width) / w).round().max(1.0) as u32;
        let scale = DVec2::new(f64::from(width) / w, f64::from(height) / h);
        Camera::pinhole(pose, self.focal_px() * scale, self.center_px() * scale, width, height)
    }

    /// Projects a direction of any length, in OpenCV's axes (x right, y down, z forward), to the plane of the
    /// photograph, in pixels. Returns `None` if the lens does not see the direction.
    #[inline]
    pub fn project(&self, direction: DVec3) -> Option<DVec2> {
        match self {
            Self::Straight(lens) => lens.project(direction),
            Self::Fisheye(lens) => lens.project(direction),
        }
    }

    /// Projects like [`project`](Self::project). Also returns `None` if the place is outside the photograph.
    #[inline]
    pub fn pixel(&self, direction: DVec3) -> Option<DVec2> {
        let [width, height] = self.size();
        let is_within =
            |p: &DVec2| (0.0..=f64::from(width)).contains(&p.x) && (0.0..=f64::from(height)).contains(&p.y);
        self.project(direction).filter(is_within)
    }

    /// Returns the direction, of any length, that is projected to `pixel`. Returns `None` if there is none.
    pub fn direction(&self, pixel: DVec2) -> Option<DVec3> {
        match self {
            Self::Straight(lens) => lens.direction(pixel),
            Self::Fisheye(lens) => lens.direction(pixel),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{dvec2, dvec3};

    #[test]
    fn places_beside_the_photograph_are_none_of_its_pixels() {
        let size = [640, 480];
        let f = dvec2(300.0, 310.0);
        let c = dvec2(321.0, 239.0);
        let straight = PhotoLens::Straight(Lens::new(size, f, c, [0.1, 0.0, 0.001, 0.0, 0.0]).unwrap());
        let fisheye = PhotoLens::Fisheye(FisheyeLens::new(size, f, c, [0.01, 0.0, 0.0, 0.0]).unwrap());
        for lens in [straight, fisheye] {
            assert_eq!(lens.size(), size);
            for pixel in [dvec2(0.5, 0.5), dvec2(639.0, 470.0), c] {
                let direction = lens.direction(pixel).unwrap();
                assert!(lens.pixel(direction * 3.0).unwrap().abs_diff_eq(pixel, 1e-9));
            }
            let beside = lens.direction(dvec2(641.0, 100.0)).unwrap();
            assert!(lens.project(beside).is_some() && lens.pixel(beside).is_none());
            let camera = lens.pinhole(Pose::level(DVec3::ZERO, 0.0), 321).unwrap();
            assert_eq!((camera.width, camera.height), (321, 241));
            assert_eq!(camera.center_px(), c * dvec2(321.0 / 640.0, 241.0 / 480.0));
            assert_eq!(camera.focal_px(), f * dvec2(321.0 / 640.0, 241.0 / 480.0));
            assert_eq!(lens.pixel(dvec3(0.1, 0.0, -1.0)), None);
        }
    }
}
