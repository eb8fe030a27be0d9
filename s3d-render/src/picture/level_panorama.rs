//! Turns panoramas upright.

use glam::{DMat3, DVec2, dvec2};
use s3d_geom::{Camera, Pose, Raster};
use std::f64::consts::{PI, TAU};

/// The most samples along a side of a pixel.
const MOST_SAMPLES: f64 = 16.0;

/// A pixel that covers at most this much more than one pixel of the photograph still takes one sample.
const LITTLE_MORE: f64 = 0.2;

/// Returns the panorama that `camera` would have taken in place of `photo`, an equirectangular photograph
/// that was taken at `photo_pose`.
///
/// The photograph may be tilted: its centre looks along the forward axis of its pose, and its upper edge is
/// the direction up of its pose. The result is upright in the world. A pixel is the mean of the area of the
/// photograph that it covers, in values as they are stored, and is at least 1, 1, 1. If the photograph is
/// level and has the size of the camera, its pixels are copied.
///
/// ```
/// use s3d_geom::{Camera, Pose, Raster, glam::DVec3};
/// use s3d_render::level_panorama;
///
/// let pose = Pose::level(DVec3::ZERO, 0.7);
/// let mut photo = Raster::filled(64, 32, [9, 8, 0]);
/// photo.pixels_mut()[6 * 64 + 5] = [200, 0, 0];
/// let image = level_panorama(&photo, &pose, &Camera::equirectangular(pose, 64));
/// assert_eq!((image.at(5, 6), image.at(6, 6)), ([200, 1, 1], [9, 8, 1]));
/// ```
///
/// # Panics
/// If the photograph has no pixels, or the camera is no panorama.
pub fn level_panorama(photo: &Raster<[u8; 3]>, photo_pose: &Pose, camera: &Camera) -> Raster<[u8; 3]> {
    assert!(!photo.is_empty(), "a photograph has pixels");
    assert!(camera.is_panorama(), "a panorama stays a panorama");

    let from = Panorama { photo, photo_from_world: photo_pose.opencv_from_world() };
    let columns = samples_along(photo.width(), camera.width);
    let rows = samples_along(photo.height(), camera.height);
    let mut image = Raster::filled(camera.width, camera.height, [0; 3]);

    for (y, row) in (0..camera.height).zip(image.pixels_mut().chunks_mut(camera.width as usize)) {
        for (x, pixel) in (0..camera.width).zip(row) {
            let mut sum = [0.0; 3];
            for j in 0..rows {
                for i in 0..columns {
                    let within = dvec2(sample_place(i, columns), sample_place(j, rows));
                    let sample = from.color(camera, dvec2(f64::from(x), f64::from(y)) + within);
                    sum = std::array::from_fn(|k| sum[k] + sample[k]);
                }
            }
            let samples = f64::from(rows * columns);
            *pixel = sum.map(|v| ((v / samples).round() as u8).max(1));
        }
    }
    image
}

/// Returns the number of samples along a side of a pixel, if `from` pixels become `to`.
fn samples_along(from: u32, to: u32) -> u32 {
    (f64::from(from) / f64::from(to) - LITTLE_MORE)
        .ceil()
        .clamp(1.0, MOST_SAMPLES) as u32
}

/// Returns the position of sample `k` of `count` along a side, 0 to 1.
fn sample_place(k: u32, count: u32) -> f64 {
    (f64::from(k) + 0.5) / f64::from(count)
}

/// An equirectangular photograph and how it is turned.
struct Panorama<'a> {
    photo: &'a Raster<[u8; 3]>,
    /// To OpenCV's axes: x right, y down, z forward.
    photo_from_world: DMat3,
}

impl Panorama<'_> {
    /// Returns the photograph's colour in the direction of a place in the camera's image.
    fn color(&self, camera: &Camera, at: DVec2) -> [f64; 3] {
        let v = self.photo_from_world * camera.direction(at.x, at.y);
        let turn = libm::atan2(v.x, v.z) / TAU + 0.5;
        let down = libm::atan2(v.y, libm::hypot(v.x, v.z)) / PI + 0.5;
        let size = dvec2(f64::from(self.photo.width()), f64::from(self.photo.height()));
        self.bilinear(dvec2(turn, down) * size)
    }

    /// Returns the colour at a place, bilinearly. The left edge follows the right one.
    fn bilinear(&self, place: DVec2) -> [f64; 3] {
        let width = self.photo.width();
        let last = self.photo.height() - 1;
        let x = place.x - 0.5;
        let y = (place.y - 0.5).clamp(0.0, f64::from(last));
        let s = x - x.floor();
        let t = y - y.floor();

        // A place may lie half a pixel beyond either end.
        let left = x.floor().rem_euclid(f64::from(width)) as u32 % width;
        let right = (left + 1) % width;
        let upper = y as u32;
        let lower = (upper + 1).min(last);
        let [a, b, c, d] = [(left, upper), (right, upper), (left, lower), (right, lower)]
            .map(|(x, y)| self.photo.at(x, y).map(f64::from));
        std::array::from_fn(|k| {
            let above = a[k] + (b[k] - a[k]) * s;
            let below = c[k] + (d[k] - c[k]) * s;
            above + (below - above) * t
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec3};

    /// Returns a photograph whose colours follow from the directions in the world that it shows, slowly.
    fn photo(width: u32, pose: &Pose) -> Raster<[u8; 3]> {
        let height = width / 2;
        let world_from_photo = pose.opencv_from_world().transpose();
        let pixels = (0..width * height).map(|i| {
            let theta = TAU * ((f64::from(i % width) + 0.5) / f64::from(width) - 0.5);
            let phi = PI * (0.5 - (f64::from(i / width) + 0.5) / f64::from(height));
            let v = dvec3(phi.cos() * theta.sin(), -phi.sin(), phi.cos() * theta.cos());
            color_of(world_from_photo * v)
        });
        Raster::from_vec(width, height, pixels.collect())
    }

    fn color_of(direction: DVec3) -> [u8; 3] {
        direction.to_array().map(|v| (128.0 + 100.0 * v).round() as u8)
    }

    #[test]
    fn a_level_panorama_stays_as_it_is() {
        let pose = Pose::level(dvec3(1.0, 2.0, 1.5), 2.3);
        let pixels = (0..128 * 64u32).map(|i| {
            let noise = i.wrapping_mul(0x9E37_79B1);
            [noise >> 24, noise >> 16, noise >> 8].map(|v| v as u8)
        });
        let noise = Raster::from_vec(128, 64, pixels.collect());
        let image = level_panorama(&noise, &pose, &Camera::equirectangular(pose, 128));
        let differ = image
            .pixels()
            .iter()
            .zip(noise.pixels())
            .filter(|(a, b)| **a != b.map(|v| v.max(1)));
        assert_eq!(differ.count(), 0);
    }

    /// Whichever way the camera was held, a pixel shows what lies in its direction.
    #[test]
    fn a_tilted_panorama_is_turned_upright() {
        let level = Pose::level(dvec3(1.0, 2.0, 1.5), 0.4);
        let on_its_side =
            Pose { world_from_camera: level.world_from_camera * DMat3::from_rotation_z(1.5), ..level };
        for tilted in [level, level.turned(0.3, 0.1), level.turned(-1.0, -0.7), on_its_side] {
            let camera = Camera::equirectangular(tilted.leveled(), 200);
            for width in [400, 1200] {
                let image = level_panorama(&photo(width, &tilted), &tilted, &camera);
                for (x, y) in (0..200).flat_map(|x| (0..100).map(move |y| (x, y))) {
                    let expected = color_of(camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5));
                    let off = (0..3).map(|k| image.at(x, y)[k].abs_diff(expected[k])).max();
                    assert!(off <= Some(1), "({x}, {y}): {:?} {expected:?}", image.at(x, y));
                }
            }
        }
    }
}
