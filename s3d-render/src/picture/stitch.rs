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

use crate::picture::cube_map::{CubeMap, face_cameras};
use crate::picture::cube_sources::SourceMipMap;
use crate::picture::stitch_lanes::{BlendKernel, DepthLimits, LaneCapture};
use crate::raster::visibility::cast;
use crate::scene::Scene;
use crate::simd::dispatch_on;
use glam::{DMat3, DVec2, DVec3, dvec2};
use rayon::prelude::*;
use s3d_geom::{Camera, Lens, Pose, Raster, Wrap};
use s3d_simd::{Level, level};

/// How far behind the nearest surface a visible point may be: a part of its depth, and metres.
const BEHIND: (f32, f32) = (0.01, 0.02);

/// The width in pixels of the depth images that tell which points are hidden.
const DEPTH_WIDTH: u32 = 640;

/// The width of a cube face in pixels when captures are compared.
const GAIN_SIZE: u32 = 64;

/// The standard deviation of a factor from 1, and the standard deviation of one point's colour between two
/// captures, 0 to 255.
const GAIN_DEVIATION: f64 = 1.0;
const COLOR_DEVIATION: f64 = 10.0;

/// The colours that tell anything about exposure: not too dark and not too bright.
const TELLING: std::ops::RangeInclusive<f32> = 8.0..=247.0;

/// A picture and the camera that took it.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The picture; it has the lens's size.
    pub image: Raster<[u8; 3]>,
    /// The camera's lens.
    pub lens: Lens,
    /// The place and direction of the camera in the project's axes.
    pub pose: Pose,
}

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
    let stitch = Stitch::new(captures, pose, scene, options);
    let lanes = stitch.lanes();
    if lanes.iter().all(LaneCapture::is_usable) {
        stitch.in_lanes(&lanes, level())
    } else {
        stitch.pixel_by_pixel()
    }
}

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
        let sharpest = captures
            .iter()
            .map(|c| c.lens.focal_px().max_element())
            .fold(0.0, f64::max);
        let size = CubeMap::fitting_size(options.size.map_or(2.0 * sharpest, f64::from));

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

    fn lanes(&self) -> Vec<LaneCapture<'_>> {
        let each = self.views.iter().zip(&self.gains);
        each.map(|(view, gain)| view.in_lanes(self.world_from_frame, *gain))
            .collect()
    }

    fn in_lanes(&self, captures: &[LaneCapture<'_>], level: Level) -> CubeMap {
        CubeMap::build_bands(self.pose, self.size, |band| {
            let depths = self.depths.0.as_ref().map(|faces| &faces[band.face]);
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

/// The depths of the scene behind each pixel of the cube, infinite where there is none.
struct SceneDepths(Option<Vec<Raster<f32>>>);

impl SceneDepths {
    fn new(pose: &Pose, size: u32, scene: Option<&Scene<'_>>) -> Self {
        let depths = |scene| {
            face_cameras(pose, size)
                .par_iter()
                .map(|c| cast(scene, c).depth)
                .collect()
        };
        Self(scene.map(depths))
    }

    fn depth(&self, face: usize, x: u32, y: u32) -> Option<f64> {
        let depth = self.0.as_ref()?[face].at(x, y);
        depth.is_finite().then(|| f64::from(depth))
    }
}

/// The ray of a pixel of the cube.
struct CubeRay {
    /// The direction in the world, with a depth of 1 on its face.
    direction: DVec3,
    /// The depth of the surface in that direction, if it is known.
    depth: Option<f64>,
    /// The size of the cube's faces.
    size: u32,
    /// Whether a capture counts only if its picture contains all of the pixel.
    whole: bool,
}

/// A prepared capture.
struct PreparedCapture {
    picture: SourceMipMap,
    lens: Lens,
    /// World → the camera's OpenCV axes.
    camera_from_world: DMat3,
    /// From the camera to the cube's centre, in the world.
    center: DVec3,
    forward: DVec3,
    /// The tangent of the largest angle from the axis at which the camera sees anything.
    reach: f64,
    /// How deep the camera sees into the scene.
    limits: Option<DepthLimits>,
}

impl PreparedCapture {
    fn new(capture: Capture, pose: &Pose, scene: Option<&Scene<'_>>) -> Self {
        let Capture { image, lens, pose: own } = capture;
        assert_eq!(
            (image.width(), image.height()),
            (lens.width(), lens.height()),
            "a picture has its lens's size"
        );

        let reach = lens.reach();
        let limits = scene.map(|scene| {
            let camera = Camera::perspective(own, 2.0 * libm::atan(1.01 * reach), DEPTH_WIDTH, DEPTH_WIDTH);
            let limits = depth_limits(&cast(scene, &camera).depth);
            DepthLimits { limits, focal: camera.focal_px().x as f32 }
        });

        Self {
            picture: SourceMipMap::new(image, [Wrap::Clamp; 2]),
            lens,
            camera_from_world: own.opencv_from_world(),
            center: pose.location - own.location,
            forward: own.forward(),
            reach,
            limits,
        }
    }

    fn in_lanes(&self, world_from_frame: DMat3, gain: [f32; 3]) -> LaneCapture<'_> {
        LaneCapture {
            levels: self.picture.levels(),
            lens: &self.lens,
            turn: self.camera_from_world * world_from_frame,
            center: self.camera_from_world * self.center,
            reach: self.reach,
            limits: self.limits.as_ref(),
            gain,
        }
    }

    /// Returns the colour that the capture shows along a ray, and its weight. Returns `None` if it does not
    /// show it.
    fn sees(&self, ray: &CubeRay) -> Option<([f32; 3], f32)> {
        let direction = match (&self.limits, ray.depth) {
            (Some(_), Some(depth)) => self.center + ray.direction * depth,
            _ => ray.direction,
        };
        let depth = self.forward.dot(direction);
        let length_2 = direction.length_squared();
        if depth <= 0.0 || length_2 > (1.0 + self.reach * self.reach) * depth * depth {
            return None;
        }

        let v = self.camera_from_world * direction;
        let pixel = self.lens.project(v)?;

        // A pixel of the cube is 2/size wide at the depth 1. Distortion hardly changes the part of the
        // picture that it covers.
        let step = ray.direction.length() * 2.0 / f64::from(ray.size) / ray.direction.length_squared();
        let along = self.lens.focal_px() * (step * length_2.sqrt() / v.z);
        let size = dvec2(f64::from(self.lens.width()), f64::from(self.lens.height()));
        let border = if ray.whole {
            0.5 * along.max(DVec2::ONE)
        } else {
            DVec2::splat(0.5)
        };
        if !(pixel.cmpgt(border) & pixel.cmplt(size - border)).all() {
            return None;
        }

        if ray.depth.is_some() && self.is_hidden(v) {
            return None;
        }

        // 1 in the middle of the picture and 0 at its border, along either axis.
        let inner = 1.0 - (2.0 * pixel / size - 1.0) * (2.0 * pixel / size - 1.0);
        let weight = inner.x * inner.y;
        let color = self
            .picture
            .sample(pixel, DVec2::X * along.x, DVec2::Y * along.y, &Default::default());
        Some((color, (weight * weight) as f32))
    }

    /// Tells whether something is in front of the point `v`, in the camera's axes.
    fn is_hidden(&self, v: DVec3) -> bool {
        let Some(DepthLimits { limits, focal }) = &self.limits else { return false };
        let middle = 0.5 * f64::from(limits.width());
        let at = dvec2(v.x, v.y) * (f64::from(*focal) / v.z) + middle;
        let last = f64::from(limits.width() - 1);
        let x = at.x.clamp(0.0, last) as u32;
        let y = at.y.clamp(0.0, last) as u32;
        v.z > f64::from(limits.at(x, y))
    }
}

/// Returns, for every four neighbouring pixels of a depth image, how deep a visible point between them may
/// be. A point is hidden if it is behind the farthest of the four, so that both sides of an edge count as
/// visible. Indexed by the upper left pixel.
fn depth_limits(depths: &Raster<f32>) -> Raster<f32> {
    let columns = depths.width() - 1;
    let rows = depths.height() - 1;
    let mut limits = Vec::with_capacity(columns as usize * rows as usize);
    for y in 0..rows {
        for (upper, lower) in depths.row(y).windows(2).zip(depths.row(y + 1).windows(2)) {
            let far = upper[0].max(upper[1]).max(lower[0].max(lower[1]));
            limits.push(far * (1.0 + BEHIND.0) + BEHIND.1);
        }
    }
    Raster::from_vec(columns, rows, limits)
}

/// Returns a factor for each capture and channel that matches their exposures. The factors minimise the sum,
/// over the pairs of captures that overlap, of (gᵢ·meanᵢ − gⱼ·meanⱼ)² and of (1 − g)². Each
/// term is weighted by its deviation and the number of pixels.
fn gains(views: &[PreparedCapture], size: u32, rays: &SceneDepths, world_from_frame: DMat3) -> Vec<[f32; 3]> {
    let n = views.len();
    let sums = shared_colors(views, size, rays, world_from_frame);

    let mut gains = vec![[1.0f32; 3]; n];
    for k in 0..3 {
        let mut matrix = vec![0.0; n * n];
        let mut right = vec![0.0; n];
        // One equation a capture.
        for i in 0..n {
            // A capture that overlaps no other keeps its exposure.
            matrix[i * n + i] += 1e-6;
            right[i] += 1e-6;
            for j in (0..n).filter(|&j| j != i) {
                let (count, sum) = sums[i * n + j];
                if count == 0.0 {
                    continue;
                }
                let own = sum[k] / count;
                let other = sums[j * n + i].1[k] / count;
                let weight = count / (COLOR_DEVIATION * COLOR_DEVIATION);
                let prior = count / (GAIN_DEVIATION * GAIN_DEVIATION);
                matrix[i * n + i] += 2.0 * weight * own * own + prior;
                matrix[i * n + j] -= 2.0 * weight * own * other;
                right[i] += prior;
            }
        }

        for (gain, solved) in gains.iter_mut().zip(solve(matrix, right)) {
            gain[k] = solved.clamp(0.25, 4.0) as f32;
        }
    }
    gains
}

/// The number of pixels that a pair of captures shares, and the sum of the first capture's colours there.
type SharedColors = (f64, [f64; 3]);

/// Returns the shared colours of each pair of captures, row by row.
fn shared_colors(
    views: &[PreparedCapture],
    size: u32,
    rays: &SceneDepths,
    world_from_frame: DMat3,
) -> Vec<SharedColors> {
    let n = views.len();
    let mut sums = vec![(0.0f64, [0.0f64; 3]); n * n];
    let colors = CubeMap::directions(size).map(|(face, x, y, d)| {
        let ray =
            CubeRay { direction: world_from_frame * d, depth: rays.depth(face, x, y), size, whole: true };
        views.iter().map(|v| v.sees(&ray).map(|(c, _)| c)).collect::<Vec<_>>()
    });

    for seen in colors {
        let seen: Vec<(usize, [f32; 3])> = seen
            .into_iter()
            .enumerate()
            .filter_map(|(i, c)| Some((i, c.filter(is_telling)?)))
            .collect();
        for &(i, color) in &seen {
            for &(j, _) in seen.iter().filter(|(j, _)| *j != i) {
                let (count, sum) = &mut sums[i * n + j];
                *count += 1.0;
                (0..3).for_each(|k| sum[k] += f64::from(color[k]));
            }
        }
    }
    sums
}

/// Tells whether a colour tells anything about exposure.
fn is_telling(color: &[f32; 3]) -> bool {
    color.iter().all(|v| TELLING.contains(v))
}

/// Solves a system with a symmetric, positive definite matrix, given row by row.
fn solve(mut matrix: Vec<f64>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();

    for i in 0..n {
        for row in i + 1..n {
            let factor = matrix[row * n + i] / matrix[i * n + i];
            for column in i..n {
                matrix[row * n + column] -= factor * matrix[i * n + column];
            }
            right[row] -= factor * right[i];
        }
    }

    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| matrix[i * n + j] * right[j]).sum();
        right[i] = (right[i] - known) / matrix[i * n + i];
    }

    right
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::cube_map::tests::{close, color_of, pose};
    use crate::picture::picture_color::{Unseen, picture_image};
    use crate::shade::color::rgb_image;
    use crate::shade::mip_maps::{MipMaps, TextureFilter};
    use glam::{DQuat, dvec3};
    use proptest::prelude::*;

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
                let pixel = |i: u32| {
                    let at = dvec2(f64::from(i % 160) + 0.5, f64::from(i / 160) + 0.5);
                    seen(k, world * lens.direction(at).unwrap()).map(|c| (c + 0.5).clamp(0.0, 255.0) as u8)
                };
                Capture {
                    image: Raster::from_vec(160, 128, (0..160 * 128).map(pixel).collect()),
                    lens,
                    pose: own,
                }
            })
            .collect()
    }

    /// Returns directions that are spread over the sphere.
    fn directions() -> impl Iterator<Item = DVec3> {
        (0..3000).map(|k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 3000.0;
            let (sin, cos) = libm::sincos(2.399_963 * f64::from(k));
            dvec3(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
        })
    }

    fn sample(cube: &CubeMap, d: DVec3) -> ([f32; 3], u8) {
        cube.sample(d, DVec3::splat(1e-9), DVec3::splat(1e-9), &TextureFilter::default())
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

    #[test]
    fn exposures_are_brought_together() {
        // Every capture has an exposure of its own.
        let exposure = |k: usize| 1.0 + 0.15 * (((k * 7) % 5) as f32 - 2.0) / 2.0;
        let gray = |k: usize, _: DVec3| [120.0 * exposure(k), 100.0, 90.0 * exposure(k + 3)];
        let spread = |gains: bool| {
            let cube = stitch(captures(gray), &pose(), None, &StitchOptions { gains, size: Some(64) });
            let seen = directions()
                .map(|d| sample(&cube, d))
                .filter(|s| s.1 == 255)
                .map(|s| s.0[0]);
            let (low, high) = seen.fold((255.0f32, 0.0f32), |(l, h), c| (l.min(c), h.max(c)));
            high - low
        };
        let before = spread(false);
        let after = spread(true);
        assert!(before > 30.0 && after < 4.0, "{before} {after}");
    }

    proptest! {
        #[test]
        fn systems_are_solved(values in prop::collection::vec(-1.0..1.0f64, 20)) {
            // AᵀA + 1 is positive definite.
            let (a, x) = values.split_at(16);
            let matrix: Vec<f64> = (0..16)
                .map(|k| (k / 4, k % 4))
                .map(|(i, j)| {
                    let product: f64 = (0..4).map(|r| a[4 * r + i] * a[4 * r + j]).sum();
                    product + f64::from(u8::from(i == j))
                })
                .collect();
            let right = (0..4).map(|i| (0..4).map(|j| matrix[4 * i + j] * x[j]).sum()).collect();
            for (solved, x) in solve(matrix, right).iter().zip(x) {
                prop_assert!((solved - x).abs() < 1e-9);
            }
        }
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
            let cube = stitch.in_lanes(&stitch.lanes(), level());
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
            let lanes = stitch.lanes();
            let cubes = Level::all().into_iter().map(|level| stitch.in_lanes(&lanes, level));
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
                Capture { image, lens, pose: own }
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
