//! Makes cube maps from captures: overlapping pictures of real cameras, from about one place.
//!
//! A pixel of the cube is the mean of the captures that see it. Each capture has a weight that falls smoothly
//! to 0 towards the border of its picture, so that no seam shows. Before that, the exposures of the captures
//! are matched: one factor a channel, by least squares over the parts that captures share.
//!
//! **Parallax.** The cameras of a scanner turn about its axis, and stand some centimetres from it and from
//! each other. With the mesh of the scene, a pixel of the cube looks up the point that it sees, and takes its
//! colour from the captures in which no other surface hides the point. Without the mesh, or beside it, all
//! cameras are taken to stand at the centre. The error is then their distance from the centre over the
//! distance of the point: 2 cm at 2 m are ten pixels of 1,000 a radian.

pub(crate) mod capture;

mod gains;
mod lanes;

use crate::picture::cube_map::CubeMap;
use crate::scene::Scene;
use crate::simd::dispatch_on;
use capture::{Capture, CubeRay, PreparedCapture, SceneDepths};
use gains::gains;
use glam::DMat3;
use lanes::{BlendKernel, LaneCapture};
use rayon::prelude::*;
use s3d_geom::{CaptureLens, Pose};
use s3d_simd::{ProvenLevel, level};

/// The width of a cube face in pixels when captures are compared.
const GAIN_SIZE: u32 = 64;

/// The distance from the centre at which a spherical picture has no parallax that can be seen.
const SAME_PLACE_M: f64 = 1e-3;

/// How captures become a cube map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StitchOptions {
    /// The width of a face in pixels. `None` keeps the resolution of the sharpest capture.
    pub size: Option<u32>,
    /// Whether exposures are matched.
    pub gains: bool,
}

impl Default for StitchOptions {
    fn default() -> Self {
        Self { size: None, gains: true }
    }
}

/// Makes the cube map around `pose` (E(original) of the location) from captures taken near it. With `scene`,
/// parallax is taken into account, as the module explains. Directions that no capture sees are holes. Runs on
/// all threads of the current rayon pool.
///
/// # Panics
/// If there is no capture, or a picture does not have its lens's size.
pub fn stitch(
    captures: Vec<Capture>,
    pose: &Pose,
    scene: Option<&Scene<'_>>,
    options: &StitchOptions,
) -> CubeMap {
    let captures = match sphere_of(captures, pose, scene.is_some(), options) {
        Ok(cube) => return cube,
        Err(captures) => captures,
    };
    let stitch = Stitch::new(captures, pose, scene, options);
    match stitch.lanes() {
        Some(lanes) => stitch.in_lanes(&lanes, level()),
        None => stitch.pixel_by_pixel(),
    }
}

/// Makes the cube map of a single picture that shows every direction, if there is no parallax to remove.
/// Returns the captures if they are others.
fn sphere_of(
    mut captures: Vec<Capture>,
    pose: &Pose,
    has_scene: bool,
    options: &StitchOptions,
) -> Result<CubeMap, Vec<Capture>> {
    let [capture] = captures.as_slice() else { return Err(captures) };
    let is_whole = matches!(&capture.lens, CaptureLens::Spherical(lens) if lens.is_whole());
    let is_at_center = capture.pose.location.distance(pose.location) <= SAME_PLACE_M;
    if !is_whole || capture.mask.is_some() || has_scene && !is_at_center {
        return Err(captures);
    }

    let own = capture.pose;
    // The rows are the picture's +X, +Y and +Z: forward, left and up.
    let photo_from_world = DMat3::from_cols(own.forward(), -own.right(), own.up()).transpose();
    match captures.pop() {
        Some(capture) => Ok(CubeMap::from_sphere(capture.image, photo_from_world, pose, options.size)),
        None => Err(captures),
    }
}

/// Returns the pixels of a capture in the middle of its picture, per radian. A spherical picture counts a
/// quarter more, because the corners of a face of the cube are sharper than its middle.
fn sharpness(lens: &CaptureLens) -> f64 {
    match lens {
        CaptureLens::Straight(lens) => lens.focal_px().max_element(),
        CaptureLens::Spherical(lens) => 1.25 / lens.pixel_rad().x,
    }
}

/// The most pixels of a cube for each pixel of the captures. A single picture that is 20° wide fills the
/// cube so thinly; a narrower one would take memory for pixels that it does not show.
const MOST_TEXELS: f64 = 256.0;

/// The data from which the pixels of the cube are made.
struct Stitch {
    pose: Pose,
    size: u32,
    world_from_frame: DMat3,
    views: Vec<PreparedCapture>,
    gains: Vec<[f32; 3]>,
    depths: SceneDepths,
}

impl Stitch {
    fn new(captures: Vec<Capture>, pose: &Pose, scene: Option<&Scene<'_>>, options: &StitchOptions) -> Self {
        assert!(!captures.is_empty(), "a cube map needs captures");
        let sharpest = captures.iter().map(|c| sharpness(&c.lens)).fold(0.0, f64::max);
        let pixels: f64 = captures.iter().map(|c| c.image.len() as f64).sum();
        let most = (MOST_TEXELS * pixels / 6.0).sqrt();
        let size = CubeMap::fitting_size(options.size.map_or((2.0 * sharpest).min(most), f64::from));

        let world_from_frame = pose.opencv_from_world().transpose();
        let views: Vec<PreparedCapture> = captures
            .into_par_iter()
            .map(|c| PreparedCapture::new(c, pose, scene))
            .collect();

        let gains = if options.gains && views.len() > 1 {
            let depths = SceneDepths::new(pose, GAIN_SIZE, scene);
            gains(&views, GAIN_SIZE, &depths, world_from_frame)
        } else {
            vec![[1.0; 3]; views.len()]
        };

        let depths = SceneDepths::new(pose, size, scene);
        Self { pose: *pose, size, world_from_frame, views, gains, depths }
    }

    /// Returns the captures as the lanes need them. Returns `None` if the lanes do not suit one of them.
    fn lanes(&self) -> Option<Vec<LaneCapture<'_>>> {
        let each = self.views.iter().zip(&self.gains);
        each.map(|(view, gain)| view.in_lanes(self.world_from_frame, *gain))
            .collect()
    }

    fn in_lanes(&self, captures: &[LaneCapture<'_>], level: ProvenLevel) -> CubeMap {
        CubeMap::build_bands(self.pose, self.size, |band| {
            let depths = self.depths.of_face(band.face);
            dispatch_on(level, BlendKernel { captures, size: self.size, depths, band });
        })
    }

    /// Makes the same cube map in `f64`, one pixel after another: for pictures that do not suit the lanes,
    /// and as the reference in tests.
    fn pixel_by_pixel(&self) -> CubeMap {
        CubeMap::build(self.pose, self.size, |face, x, y, d| {
            let depth = self.depths.depth(face, x, y);
            let ray = CubeRay { direction: self.world_from_frame * d, depth, size: self.size, whole: false };
            let mut sum = [0.0f32; 3];
            let mut total = 0.0f32;
            for (view, gain) in self.views.iter().zip(&self.gains) {
                if let Some((color, weight)) = view.sees(&ray) {
                    (0..3).for_each(|k| sum[k] += weight * gain[k] * color[k]);
                    total += weight;
                }
            }
            (total > 0.0).then(|| sum.map(|c| (c / total).min(255.0)))
        })
    }
}

#[cfg(test)]
mod spherical_tests;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::cube_map::tests::{close, color_of, pose};
    use crate::picture::picture_color::{Unseen, picture_image};
    use crate::raster::visibility::cast;
    use crate::shade::color::rgb_image;
    use crate::shade::mip_maps::{MipMaps, TextureFilter};
    use glam::{DQuat, DVec3, dvec2, dvec3};
    use s3d_geom::{Camera, Lens, Raster};

    /// Returns eighteen captures of `seen`, as a scanner takes them from one place.
    fn captures(seen: impl Fn(usize, DVec3) -> [f32; 3]) -> Vec<Capture> {
        let lens = Lens::new(
            [160, 128],
            dvec2(110.0, 109.0),
            dvec2(81.0, 62.5),
            [0.08, -0.05, 0.001, -0.0008, 0.01],
        );
        let lens = lens.unwrap();
        (0..18usize)
            .map(|k| {
                let yaw = -((k % 6) as f64) * std::f64::consts::FRAC_PI_3 + 0.2;
                let own = pose().turned(yaw, [0.95, 0.02, -0.95][k / 6]);
                let world = own.opencv_from_world().transpose();
                let pixels = (0..160 * 128).map(|i| {
                    let at = dvec2(f64::from(i % 160) + 0.5, f64::from(i / 160) + 0.5);
                    seen(k, world * lens.direction(at).unwrap()).map(|c| (c + 0.5).clamp(0.0, 255.0) as u8)
                });
                let image = Raster::from_vec(160, 128, pixels.collect());
                Capture { image, lens: lens.into(), pose: own, mask: None, border_px: 0 }
            })
            .collect()
    }

    /// Returns directions that are spread over the sphere.
    pub(super) fn directions() -> impl Iterator<Item = DVec3> {
        (0..3000).map(|k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 3000.0;
            let (sin, cos) = libm::sincos(2.399_963 * f64::from(k));
            dvec3(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
        })
    }

    pub(super) fn sample(cube: &CubeMap, d: DVec3) -> ([f32; 3], u8) {
        cube.sample(d, DVec3::splat(1e-9), DVec3::splat(1e-9), &TextureFilter::default())
    }

    /// A picture that shows little does not make a cube of thousands of pixels a side.
    #[test]
    fn a_narrow_picture_makes_a_small_cube() {
        let mut captures = captures(|_, _| [90.0; 3]);
        captures.truncate(1);
        captures[0].lens = Lens::new([160, 128], dvec2(9000.0, 9000.0), dvec2(80.0, 64.0), [0.0; 5])
            .unwrap()
            .into();
        let cube = stitch(captures, &pose(), None, &StitchOptions::default());
        let most = (MOST_TEXELS * 160.0 * 128.0 / 6.0).sqrt();
        assert_eq!(cube.size(), CubeMap::fitting_size(most));
        assert!(cube.size() < 1000, "{}", cube.size());
    }

    #[test]
    fn captures_are_undistorted_and_put_in_their_places() {
        let cube = stitch(captures(|_, d| color_of(d)), &pose(), None, &StitchOptions::default());
        assert_eq!(cube.size(), 224, "twice the focal length");
        for d in directions() {
            let (color, seen) = sample(&cube, d);
            // No camera looks straight up or down.
            if seen == 255 {
                assert!(close(color, color_of(d), 1.5), "{d}: {color:?} {:?}", color_of(d));
            } else {
                assert!(d.z.abs() > 0.95, "{d} is not seen");
            }
        }
        let turned: Vec<Capture> = captures(|_, d| color_of(d))
            .into_iter()
            .map(|c| Capture { pose: c.pose.turned(0.1, 0.0), ..c })
            .collect();
        let wrong = stitch(turned, &pose(), None, &StitchOptions::default());
        assert!(directions().any(|d| !close(sample(&wrong, d).0, color_of(d), 8.0)));
    }

    fn spread(gains: bool) -> f32 {
        let cube = stitch(captures(gray), &pose(), None, &StitchOptions { gains, size: Some(64) });
        let seen = directions()
            .map(|d| sample(&cube, d))
            .filter(|s| s.1 == 255)
            .map(|s| s.0[0]);
        let (low, high) = seen.fold((255.0f32, 0.0f32), |(l, h), c| (l.min(c), h.max(c)));
        high - low
    }

    fn gray(k: usize, _: DVec3) -> [f32; 3] {
        [120.0 * exposure(k), 100.0, 90.0 * exposure(k + 3)]
    }

    /// Returns the exposure of a capture: each has its own.
    fn exposure(k: usize) -> f32 {
        1.0 + 0.15 * (((k * 7) % 5) as f32 - 2.0) / 2.0
    }

    #[test]
    fn exposures_are_brought_together() {
        let before = spread(false);
        let after = spread(true);
        assert!(before > 30.0 && after < 4.0, "{before} {after}");
    }

    /// Returns captures of noise. Each is darker or brighter than the others, and taken beside the centre.
    fn noisy_captures() -> Vec<Capture> {
        let all = captures(|_, _| [0.0; 3]).into_iter().enumerate();
        all.map(|(n, mut capture)| {
            for (k, pixel) in capture.image.pixels_mut().iter_mut().enumerate() {
                let mut h = ((n * 7919 + k) as u32).wrapping_mul(0x9E37_79B1);
                h ^= h >> 15;
                let [r, g, b, _] = h.wrapping_mul(0x85EB_CA77).to_le_bytes();
                *pixel = [r, g / 2 + 10 * n as u8 % 50, b];
            }
            let beside = dvec3(0.04, 0.01 * (n % 5) as f64, -0.03);
            Capture { pose: Pose { location: pose().location + beside, ..capture.pose }, ..capture }
        })
        .collect()
    }

    /// Checks stitching with the scene and without it, and sharper than the captures, about as sharp, and
    /// coarser.
    fn in_many_ways(mut check: impl FnMut(&Stitch)) {
        let mesh = s3d_synth::scenes::furnished_room(5);
        let scene = Scene::new(&mesh);
        for (scene, size) in [(None, None), (Some(&scene), None), (Some(&scene), Some(320)), (None, Some(96))]
        {
            check(&Stitch::new(noisy_captures(), &pose(), scene, &StitchOptions { size, gains: true }));
        }
    }

    #[test]
    fn eight_pixels_at_a_time_give_what_single_ones_do() {
        in_many_ways(|stitch| {
            let cube = stitch.in_lanes(&stitch.lanes().unwrap(), level());
            let plain = stitch.pixel_by_pixel();
            let mut pixels = 0;
            let mut far = 0;
            let mut differ = 0;
            for ((color, seen), (plain, plain_seen)) in cube.texels().zip(plain.texels()) {
                let off = (0..3).map(|k| color[k].abs_diff(plain[k])).max().unwrap_or(0);
                pixels += 1;
                differ += usize::from(seen != plain_seen);
                far += usize::from(seen == plain_seen && seen == 255 && off > 1);
            }
            // Rounding decides where a capture ends, and where one surface hides another.
            assert!(differ * 20_000 <= pixels && far * 2_000 <= pixels, "{differ}, {far} of {pixels}");
        });
    }

    #[test]
    fn every_level_of_instructions_gives_the_same_bytes() {
        in_many_ways(|stitch| {
            let lanes = stitch.lanes().unwrap();
            let cubes = ProvenLevel::all()
                .into_iter()
                .map(|level| stitch.in_lanes(&lanes, level));
            let texels: Vec<Vec<_>> = cubes.map(|cube| cube.texels().collect()).collect();
            assert!(texels.iter().all(|t| *t == texels[0]));
        });
    }

    /// The cameras stand beside the centre, and a thing is in the room. With the mesh, each pixel is in its
    /// place.
    #[test]
    fn parallax_is_taken_out_with_the_mesh() {
        let mesh = s3d_synth::scenes::furnished_room(5);
        let scene = Scene::new(&mesh);
        let mip_maps = MipMaps::new(&mesh);
        let center = Pose::from_scanner(dvec3(2.2, 2.1, 1.4), DQuat::from_rotation_z(0.4));
        let lens = Lens::new([320, 256], dvec2(215.0, 215.0), dvec2(160.0, 128.0), [0.0; 5]).unwrap();

        let shots: Vec<Capture> = (0..18usize)
            .map(|k| {
                let turned =
                    center.turned(-((k % 6) as f64) * std::f64::consts::FRAC_PI_3, [0.95, 0.0, -0.95][k / 6]);
                let location =
                    center.location + 0.06 * turned.forward() + DVec3::Z * (0.05 - 0.05 * (k / 6) as f64);
                let own = Pose { location, ..turned };
                let camera = Camera::perspective(own, 2.0 * libm::atan(160.0 / 215.0), 320, 256);
                let image = rgb_image(&scene, &mip_maps, &cast(&scene, &camera), &camera);
                Capture { image, lens: lens.into(), pose: own, mask: None, border_px: 0 }
            })
            .collect();

        let view = Camera::perspective(center.turned(0.5, -0.3), 1.2, 240, 240);
        let hits = cast(&scene, &view);
        let direct = rgb_image(&scene, &mip_maps, &hits, &view);

        let error = |scene: Option<&Scene<'_>>| {
            let cube = stitch(shots.clone(), &center, scene, &StitchOptions::default());
            let filter = TextureFilter::default();
            let image = picture_image(&cube, Unseen::Nearby, &hits, &view, &filter);
            let squares = image.pixels().as_flattened().iter().zip(direct.pixels().as_flattened());
            squares.map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum::<f64>() / (3.0 * 240.0 * 240.0)
        };

        let without = error(None);
        let with = error(Some(&scene));
        assert!(with < 0.25 * without, "mean square {without} without the mesh, {with} with it");
    }
}
