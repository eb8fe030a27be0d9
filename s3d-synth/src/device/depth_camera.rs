//! A structured-light depth camera.

use super::chance::Chance;
use super::disturbance::Disturbances;
use super::target::ScanTarget;
use crate::RangeError;
use rayon::prelude::*;
use s3d_geom::glam::{DVec2, DVec3, Vec3, dvec2};
use s3d_geom::{Lens, NO_INDEX, Pose, Raster};

/// A camera that sees a pattern of dots, which a projector beside it throws, and takes the depth of a pixel
/// from the disparity of the dots.
///
/// The `Default` has the figures of the first Kinect: a baseline of 7.5 cm, disparities in eighths of a
/// pixel that are off by a sixteenth (Khoshelham and Oude Elberink 2012, "Accuracy and resolution of Kinect
/// depth data for indoor mapping applications": 1.4 mm at 1 m and 3.6 cm at 5 m, steps of 2.8 mm and 7 cm).
/// Its lens is the one that the TUM RGB-D benchmark recommends, and its depths are in fifths of a millimetre
/// as there.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCamera {
    /// The lens of both pictures.
    pub lens: Lens,
    /// The smallest and the largest depth that is measured, metres: 0.05 to 20.
    pub range_m: [f32; 2],
    /// How far right of the camera the projector is, metres: 0.01 to 1.
    pub baseline_m: f32,
    /// The focal length of the camera that sees the dots, in its own pixels: 50 to 5,000.
    pub dots_focal_px: f32,
    /// The step of disparities, pixels: 0.001 to 2.
    pub disparity_step_px: f32,
    /// The deviation of disparities, pixels: 0 to 2.
    pub disparity_noise_px: f32,
    /// Neighbours within so many pixels of the picture share the noise, because disparities come from blocks
    /// of dots: 1 to 100. A block of the first Kinect has 9 × 9 pixels (Konolige and Mihelich 2011,
    /// "Technical description of Kinect calibration"), and half of that is its reach.
    pub correlation_px: f32,
    /// The number of measurements whose mean is taken: 1 to 100.
    pub frames: u32,
    /// The deviation of where a pixel looks, in pixels of the picture: 0 to 5. It makes edges ragged. Nguyen,
    /// Izadi and Lovell 2012 ("Modeling Kinect sensor noise for improved 3D reconstruction and tracking")
    /// measured 0.8.
    pub aside_px: f32,
    /// The unit of depths, metres: 1e-6 to 0.1. Depths are whole multiples of it.
    pub unit_m: f64,
    /// Rays that meet a surface at a smaller cosine than this have no depth: 0 to 1.
    pub least_cosine: f32,
    /// The share of the light that must come back, 0 to 1. A white surface at a right angle returns 1.
    pub least_signal: f32,
    /// What spoils the picture.
    pub disturbances: Disturbances,
    /// The seed of all randomness.
    pub seed: u64,
}

/// The lens of the first Kinect as the TUM RGB-D benchmark recommends it. There the middle of a pixel is at a
/// whole number; here it is at a half.
const KINECT: ([u32; 2], f64, DVec2) = ([640, 480], 525.0, dvec2(320.0, 240.0));

/// A lens like the published ones of Matterport's cameras, its middle off the middle of the picture.
const TURNTABLE: ([u32; 2], f64, DVec2) = ([1280, 1024], 1075.0, dvec2(633.0, 517.0));

fn pinhole((size, focal_px, center_px): ([u32; 2], f64, DVec2)) -> Lens {
    let lens = Lens::new(size, DVec2::splat(focal_px), center_px, [0.0; 5]);
    #[expect(clippy::expect_used, reason = "the arguments are constants")]
    lens.expect("a pinhole")
}

impl Default for DepthCamera {
    fn default() -> Self {
        Self {
            lens: pinhole(KINECT),
            range_m: [0.5, 4.0],
            baseline_m: 0.075,
            dots_focal_px: 575.0,
            disparity_step_px: 0.125,
            disparity_noise_px: 0.0625,
            correlation_px: 4.0,
            frames: 1,
            aside_px: 0.8,
            unit_m: 0.0002,
            least_cosine: 0.17,
            least_signal: 0.01,
            disturbances: Disturbances::default(),
            seed: 1,
        }
    }
}

/// A depth picture, and the colour picture that the same camera took at the same time.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthPicture {
    /// The place and rotation of the camera.
    pub pose: Pose,
    /// The lens.
    pub lens: Lens,
    /// Depths along the optical axis, metres. NaN where there is none.
    pub depth: Raster<f32>,
    /// Colours. Black where nothing is seen.
    pub colors: Raster<[u8; 3]>,
}

/// What random numbers are for.
const ASIDE: u32 = 0;
const DOWN: u32 = 1;
const SIGNAL: u32 = 2;
const FRAMES: u32 = 3;

/// A ray to the projector begins this far from its point, as a share of the way, so that the point's own
/// surface does not block it.
const SLACK: f32 = 0.003;

impl DepthCamera {
    /// The cameras of a turntable: three sensors like the default, in pictures of Matterport's size and
    /// unit. They stand still, so a depth is the mean of 16 measurements. Depths end at 4.5 m, which the
    /// maker states for its Pro cameras.
    pub fn turntable() -> Self {
        Self {
            lens: pinhole(TURNTABLE),
            range_m: [0.4, 4.5],
            correlation_px: 8.0,
            frames: 16,
            aside_px: 1.6,
            unit_m: 0.00025,
            ..Self::default()
        }
    }

    /// Returns the camera with pictures of another size: `factor` times as wide and as high, and at least one
    /// pixel.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        let size = [self.lens.width(), self.lens.height()]
            .map(|side| (f64::from(side) * factor).round().max(1.0) as u32);
        let by = dvec2(f64::from(size[0]), f64::from(size[1]))
            / dvec2(f64::from(self.lens.width()), f64::from(self.lens.height()));
        let focal_px = self.lens.focal_px() * by;
        let lens = Lens::new(size, focal_px, self.lens.center_px() * by, self.lens.distortion());
        Self {
            lens: lens.unwrap_or(self.lens),
            correlation_px: (self.correlation_px * factor as f32).max(1.0),
            aside_px: self.aside_px * factor as f32,
            ..self
        }
    }

    pub(crate) fn check(&self) -> Result<(), RangeError> {
        let check = |value: f64, range, what: &str| RangeError::check(value, range, || what.to_owned());
        check(self.range_m[0].into(), [0.05, 20.0], "the smallest depth")?;
        check(self.range_m[1].into(), [self.range_m[0].into(), 20.0], "the largest depth")?;
        check(self.baseline_m.into(), [0.01, 1.0], "the baseline")?;
        check(self.dots_focal_px.into(), [50.0, 5000.0], "the focal length for the dots")?;
        check(self.disparity_step_px.into(), [0.001, 2.0], "the step of disparities")?;
        check(self.disparity_noise_px.into(), [0.0, 2.0], "the noise of disparities")?;
        check(self.correlation_px.into(), [1.0, 100.0], "the reach of the noise")?;
        check(self.frames.into(), [1.0, 100.0], "the number of measurements")?;
        check(self.aside_px.into(), [0.0, 5.0], "the noise of pixels")?;
        check(self.unit_m, [1e-6, 0.1], "the unit of depths")?;
        check(self.least_cosine.into(), [0.0, 1.0], "the least cosine")?;
        check(self.least_signal.into(), [0.0, 1.0], "the light that must come back")?;
        self.disturbances.check()
    }

    /// Returns the depth as the sensor measures it, the mean of its frames in whole units.
    fn measured(&self, depth: f32, [x, y]: [u32; 2], chance: Chance) -> f32 {
        let reach = self.baseline_m * self.dots_focal_px;
        let step = self.disparity_step_px;
        let frames = (0..self.frames).map(|frame| {
            let noise = chance.smooth(x, y, self.correlation_px, FRAMES + frame) * self.disparity_noise_px;
            ((reach / depth + noise) / step).round() * step
        });
        let disparity = frames.sum::<f32>() / self.frames as f32;
        let units = (f64::from(reach / disparity) / self.unit_m).round();
        (units * self.unit_m) as f32
    }
}

/// A picture that is being taken.
struct Shot<'a> {
    camera: &'a DepthCamera,
    pose: &'a Pose,
    with: Disturbances,
    chance: Chance,
    origin: Vec3,
    projector: Vec3,
}

impl ScanTarget<'_> {
    /// Takes a depth picture and a colour picture. `number` tells pictures apart that have the same seed.
    ///
    /// There is no depth outside of the range, on glass, on glancing and dark surfaces, and where something
    /// hides the surface from the projector, as beside an edge.
    ///
    /// ```
    /// use s3d_geom::Pose;
    /// use s3d_synth::Building;
    /// use s3d_synth::device::{DepthCamera, ScanTarget};
    ///
    /// let scene = Building { texture_scale: 0.05, ..Building::demo() }.build()?;
    /// let target = ScanTarget::new(&scene);
    /// let camera = DepthCamera::default().scaled(0.1);
    /// let picture = target.depth_picture(&Pose::level(scene.locations[0].position, 0.5), &camera, 0)?;
    /// assert_eq!((picture.depth.width(), picture.depth.height()), (64, 48));
    /// assert!(picture.depth.pixels().iter().all(|d| d.is_nan() || (0.4..4.3).contains(d)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`RangeError`] for a number that is out of its range.
    pub fn depth_picture(
        &self,
        pose: &Pose,
        camera: &DepthCamera,
        number: u64,
    ) -> Result<DepthPicture, RangeError> {
        camera.check()?;
        let shot = Shot {
            camera,
            pose,
            with: camera.disturbances.during(number),
            chance: Chance::new(camera.seed, number),
            origin: pose.location.as_vec3(),
            projector: (pose.location + pose.right() * f64::from(camera.baseline_m)).as_vec3(),
        };

        let mut depth = Raster::filled(camera.lens.width(), camera.lens.height(), f32::NAN);
        let rows = depth.pixels_mut().par_chunks_mut(camera.lens.width() as usize);
        rows.enumerate().for_each(|(y, row)| {
            let mut hider = NO_INDEX;
            for (x, depth) in (0..).zip(row) {
                *depth = self.depth_at(&shot, [x, y as u32], &mut hider).unwrap_or(f32::NAN);
            }
        });

        let colors = self.picture(pose, &camera.lens, &shot.with);
        Ok(DepthPicture { pose: *pose, lens: camera.lens, depth, colors })
    }

    fn depth_at(&self, shot: &Shot<'_>, [x, y]: [u32; 2], hider: &mut u32) -> Option<f32> {
        let Shot { camera, chance, ref with, .. } = *shot;
        let aside = dvec2(chance.normal(x, y, ASIDE).into(), chance.normal(x, y, DOWN).into());
        let pixel = dvec2(f64::from(x) + 0.5, f64::from(y) + 0.5) + aside * f64::from(camera.aside_px);
        let ray: DVec3 = camera.lens.direction(pixel)?;
        let ray = (shot.pose.opencv_from_world().transpose() * ray).as_vec3();
        let met = self.meet(shot.origin, ray, with, 0.0)?;

        let [nearest, farthest] = camera.range_m;
        let least = camera.least_signal * (1.0 + 0.25 * chance.normal(x, y, SIGNAL));
        let is_bright = met.signal() >= least && met.cosine >= camera.least_cosine && !met.is_glass;
        if !is_bright || !(nearest..=farthest).contains(&met.distance) {
            return None;
        }

        // The dots must reach the surface. What a mirror shows has no place that they could reach.
        let place = shot.origin + ray * met.distance;
        let way = place - shot.projector;
        let is_lit = self.tree().is_free(shot.projector, way, 1.0 - SLACK, hider);
        let is_mirrored = with.mirror(shot.origin, ray, met.distance).is_some();
        (is_lit || is_mirrored).then(|| camera.measured(met.distance, [x, y], chance))
    }
}
