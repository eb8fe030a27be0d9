//! The pose and the lens of an image. Source: ASTM E2807, 8.4.13.4 to 8.4.13.6 and 8.4.14.4 to 8.4.14.6.

use crate::camera::narrow::too_narrow;
use e57::{PinholeImageProperties, Projection, SphericalImageProperties};
use s3d_geom::glam::{DMat3, DQuat, DVec2, DVec3, dvec2};
use s3d_geom::{CaptureLens, Lens, Pose, SphericalLens};
use std::f64::consts::{PI, TAU};

/// The angle below which a picture twice as wide as high is not taken at its word, radians. Some programs
/// write the width of a sensor's pixel in metres for a picture of all directions.
const NO_WIDTH_RAD: f64 = 0.1;

/// The frame of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axes {
    /// x right, y up, looking along −z: the axes of a [`Pose`].
    Pinhole,
    /// The middle of the picture is along +x, its left is +y, and its top +z.
    Spherical,
}

/// Returns the pose of a camera from the transform of its image, from the image's frame to the file's.
pub(super) fn pose_of(location: DVec3, rotation: DQuat, axes: Axes) -> Pose {
    let turn = DMat3::from_quat(rotation);
    let image_from_camera = match axes {
        Axes::Pinhole => DMat3::IDENTITY,
        // Right is −y, up is z, and backwards is −x.
        Axes::Spherical => DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X),
    };
    Pose { location, world_from_camera: turn * image_from_camera }
}

/// Returns the lens of an image. The error says which number is wrong.
pub(super) fn lens_of(projection: &Projection) -> Result<CaptureLens, String> {
    match projection {
        Projection::Pinhole(image) => pinhole(&image.properties),
        Projection::Spherical(image) => spherical(&image.properties),
        Projection::Cylindrical(_) => Err("is cylindrical".to_owned()),
    }
}

fn pinhole(numbers: &PinholeImageProperties) -> Result<CaptureLens, String> {
    let size = [numbers.width, numbers.height];
    let focal_px =
        dvec2(numbers.focal_length / numbers.pixel_width, numbers.focal_length / numbers.pixel_height);
    let center_px = dvec2(numbers.principal_x, numbers.principal_y);
    if let Some(why) = too_narrow(size, focal_px) {
        return Err(why);
    }
    let lens = Lens::new(size, focal_px, center_px, [0.0; 5]);
    lens.map(CaptureLens::from).ok_or_else(|| {
        format!(
            "no pinhole has {} × {} pixels, focalLength {}, pixelWidth {}, pixelHeight {}, \
             principalPointX {} and principalPointY {}",
            numbers.width,
            numbers.height,
            numbers.focal_length,
            numbers.pixel_width,
            numbers.pixel_height,
            numbers.principal_x,
            numbers.principal_y
        )
    })
}

fn spherical(numbers: &SphericalImageProperties) -> Result<CaptureLens, String> {
    let size = [numbers.width, numbers.height];
    let mut pixel_rad = dvec2(numbers.pixel_width, numbers.pixel_height);
    if is_whole_at_a_glance(size, pixel_rad) {
        pixel_rad = dvec2(TAU / f64::from(size[0]), PI / f64::from(size[1]));
    }

    let lens = SphericalLens::new(size, pixel_rad);
    lens.map(CaptureLens::from).ok_or_else(|| {
        format!(
            "no sphere has {} × {} pixels of pixelWidth {} and pixelHeight {} radians",
            numbers.width, numbers.height, numbers.pixel_width, numbers.pixel_height
        )
    })
}

/// Tells whether a picture shows all directions though it says that its pixels are next to nothing wide.
fn is_whole_at_a_glance(size: [u32; 2], pixel_rad: DVec2) -> bool {
    let [width, height] = size.map(f64::from);
    let is_narrow = pixel_rad.is_finite()
        && pixel_rad.cmpge(DVec2::ZERO).all()
        && pixel_rad.x * width < NO_WIDTH_RAD
        && pixel_rad.y * height < NO_WIDTH_RAD;
    is_narrow && size[0] > 0 && size[0] == size[1].saturating_mul(2)
}
