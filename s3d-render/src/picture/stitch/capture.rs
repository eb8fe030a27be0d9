//! Captures, prepared so that rays of the cube can look them up.

use super::lanes::{DepthLimits, LaneCapture};
use crate::picture::cube_map::{face_cameras, face_of, place_on};
use crate::picture::cube_sources::SourceMipMap;
use crate::picture::equirectangular::AT_POLES;
use crate::picture::fill::fill_unseen;
use crate::raster::visibility::cast;
use crate::scene::Scene;
use crate::shade::mip_maps::TextureFilter;
use glam::{DMat3, DVec2, DVec3, dvec2};
use rayon::prelude::*;
use s3d_geom::{Camera, CaptureLens, Lens, Pose, Raster, SphericalLens, Wrap};
use std::f64::consts::TAU;

/// How far behind the nearest surface a visible point may be: a part of its depth, and metres.
const BEHIND: (f32, f32) = (0.01, 0.02);

/// The width in pixels of the depth images that tell which points are hidden.
const DEPTH_WIDTH: u32 = 640;

/// A picture and the camera that took it.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The picture; it has the lens's size.
    pub image: Raster<[u8; 3]>,
    /// The camera's lens.
    pub lens: CaptureLens,
    /// The place and direction of the camera in the project's axes.
    pub pose: Pose,
    /// The pixels that show the scene: 0 where the picture is to be left out, else 255. It has the picture's
    /// size. `None`: all of them.
    pub mask: Option<Raster<u8>>,
    /// The pixels on each side that repeat the border, as [`with_border`](Self::with_border) adds them. They
    /// tell nothing about exposure.
    pub border_px: u32,
}

impl Capture {
    /// Returns the capture with a pixel more on each side, which repeats the border. Without it, a picture
    /// counts only from the middle of its first pixel to the middle of its last one: pictures that end where
    /// the next begins, such as the faces of a cube, would leave a gap. A spherical picture stays as it is.
    ///
    /// # Panics
    /// If the picture or the mask does not have the lens's size.
    #[must_use]
    pub fn with_border(self) -> Self {
        let CaptureLens::Straight(lens) = self.lens else { return self };
        let size = [lens.width(), lens.height()];
        assert_eq!([self.image.width(), self.image.height()], size, "a picture has its lens's size");

        let wider = size.map(|side| side.saturating_add(2));
        let Some(lens) = Lens::new(wider, lens.focal_px(), lens.center_px() + 1.0, lens.distortion()) else {
            return self;
        };
        let mask = self.mask.map(|mask| bordered(&mask));
        Self {
            image: bordered(&self.image),
            lens: lens.into(),
            pose: self.pose,
            mask,
            border_px: self.border_px + 1,
        }
    }
}

/// Returns an image with a pixel more on each side, which repeats the border.
fn bordered<T: Copy>(image: &Raster<T>) -> Raster<T> {
    let last_x = image.width() - 1;
    let last_y = image.height() - 1;
    let mut pixels = Vec::with_capacity((image.width() as usize + 2) * (image.height() as usize + 2));
    for y in 0..image.height() + 2 {
        let row = image.row(y.saturating_sub(1).min(last_y));
        pixels.push(row[0]);
        pixels.extend_from_slice(row);
        pixels.push(row[last_x as usize]);
    }
    Raster::from_vec(image.width() + 2, image.height() + 2, pixels)
}

/// The depths of the scene behind each pixel of the cube, infinite where there is none.
pub(super) struct SceneDepths(Option<Vec<Raster<f32>>>);

impl SceneDepths {
    pub(super) fn new(pose: &Pose, size: u32, scene: Option<&Scene<'_>>) -> Self {
        let cameras = face_cameras(pose, size);
        Self(scene.map(|scene| cameras.par_iter().map(|c| cast(scene, c).depth).collect()))
    }

    /// Returns the depths behind a face, if there is a scene.
    pub(super) fn of_face(&self, face: usize) -> Option<&Raster<f32>> {
        self.0.as_ref().map(|faces| &faces[face])
    }

    pub(super) fn depth(&self, face: usize, x: u32, y: u32) -> Option<f64> {
        let depth = self.0.as_ref()?[face].at(x, y);
        depth.is_finite().then(|| f64::from(depth))
    }
}

/// The ray of a pixel of the cube.
pub(super) struct CubeRay {
    /// The direction in the world, with a depth of 1 on its face.
    pub(super) direction: DVec3,
    /// The depth of the surface in that direction, if it is known.
    pub(super) depth: Option<f64>,
    /// The size of the cube's faces.
    pub(super) size: u32,
    /// Whether a capture counts only if its picture contains all of the pixel.
    pub(super) whole: bool,
}

impl CubeRay {
    /// Returns the angle that the pixel covers, radians. A pixel of the cube is 2/size wide at the depth 1.
    fn angle(&self) -> f64 {
        self.direction.length() * 2.0 / f64::from(self.size) / self.direction.length_squared()
    }
}

/// A prepared capture.
pub(super) struct PreparedCapture {
    picture: SourceMipMap,
    lens: CaptureLens,
    /// The pixels that count, as in [`Capture`].
    mask: Option<Raster<u8>>,
    /// The pixels on each side that only repeat the border.
    border_px: f64,
    /// World → the camera's OpenCV axes.
    camera_from_world: DMat3,
    /// From the camera to the cube's centre, in the world.
    center: DVec3,
    forward: DVec3,
    /// The tangent of the largest angle from the axis at which the camera sees anything. A spherical picture
    /// sees everything.
    reach: f64,
    /// How deep the camera sees into the scene.
    limits: Option<SightLimits>,
}

/// How deep a camera sees into the scene.
enum SightLimits {
    /// A straight camera, with one depth image that covers its picture.
    Straight(DepthLimits),
    /// A spherical picture: the six faces of a cube with the camera's axes.
    Around([Raster<f32>; 6]),
}

/// A place in the picture of a capture.
struct PlaceInPicture {
    pixel: DVec2,
    /// The width and the height of the footprint in pixels.
    footprint: DVec2,
    /// 1 in the middle of the picture and 0 at a border of it.
    inner: f64,
}

impl PreparedCapture {
    pub(super) fn new(capture: Capture, pose: &Pose, scene: Option<&Scene<'_>>) -> Self {
        let Capture { mut image, lens, pose: own, mask, border_px } = capture;
        let [width, height] = lens.size();
        assert_eq!([image.width(), image.height()], [width, height], "a picture has its lens's size");

        let mask = mask.filter(|mask| mask.pixels().contains(&0));
        if let Some(mask) = &mask {
            assert_eq!([mask.width(), mask.height()], [width, height], "a mask has its picture's size");
            // A pixel beside the mask is filtered, and must not take the colour of what the mask hides.
            fill_unseen(&mut image, mask);
        }

        let (reach, wrap) = match &lens {
            CaptureLens::Straight(lens) => (lens.reach(), [Wrap::Clamp; 2]),
            CaptureLens::Spherical(lens) if lens.is_around() => (f64::INFINITY, [Wrap::Repeat, Wrap::Clamp]),
            CaptureLens::Spherical(_) => (f64::INFINITY, [Wrap::Clamp; 2]),
        };
        Self {
            picture: SourceMipMap::new(image, wrap),
            lens,
            mask,
            border_px: f64::from(border_px),
            camera_from_world: own.opencv_from_world(),
            center: pose.location - own.location,
            forward: own.forward(),
            reach,
            limits: scene.map(|scene| SightLimits::new(scene, &lens, &own)),
        }
    }

    /// Returns the capture as the lanes need it. Returns `None` if they do not suit it.
    pub(super) fn in_lanes(&self, world_from_frame: DMat3, gain: [f32; 3]) -> Option<LaneCapture<'_>> {
        let CaptureLens::Straight(lens) = &self.lens else { return None };
        if self.mask.is_some() {
            return None;
        }
        let limits = match &self.limits {
            Some(SightLimits::Straight(limits)) => Some(limits),
            Some(SightLimits::Around(_)) | None => None,
        };
        let capture = LaneCapture {
            levels: self.picture.levels(),
            lens,
            turn: self.camera_from_world * world_from_frame,
            center: self.camera_from_world * self.center,
            reach: self.reach,
            limits,
            gain,
        };
        capture.is_usable().then_some(capture)
    }

    /// Returns the colour that the capture shows along a ray, and its weight. Returns `None` if it does not
    /// show it.
    pub(super) fn sees(&self, ray: &CubeRay) -> Option<([f32; 3], f32)> {
        let direction = match (&self.limits, ray.depth) {
            (Some(_), Some(depth)) => self.center + ray.direction * depth,
            _ => ray.direction,
        };
        let v = self.camera_from_world * direction;
        let place = match &self.lens {
            CaptureLens::Straight(lens) => self.place_straight(lens, ray, direction, v)?,
            CaptureLens::Spherical(lens) => place_around(lens, ray, v)?,
        };
        if self.is_masked(place.pixel) || ray.depth.is_some() && self.is_hidden(v) {
            return None;
        }

        let weight = place.inner;
        let footprint = place.footprint;
        let filter = match self.lens {
            CaptureLens::Straight(_) => TextureFilter::default(),
            CaptureLens::Spherical(_) => AT_POLES,
        };
        let color = self
            .picture
            .sample(place.pixel, DVec2::X * footprint.x, DVec2::Y * footprint.y, &filter);
        Some((color, (weight * weight) as f32))
    }

    /// Returns the place of a direction in the picture of a straight lens. `v` is the direction in the
    /// camera's axes.
    fn place_straight(
        &self,
        lens: &Lens,
        ray: &CubeRay,
        direction: DVec3,
        v: DVec3,
    ) -> Option<PlaceInPicture> {
        let depth = self.forward.dot(direction);
        let length_2 = direction.length_squared();
        if depth <= 0.0 || length_2 > (1.0 + self.reach * self.reach) * depth * depth {
            return None;
        }
        let pixel = lens.project(v)?;

        // Distortion hardly changes the part of the picture that a pixel of the cube covers.
        let along = lens.focal_px() * (ray.angle() * length_2.sqrt() / v.z);
        let size = dvec2(f64::from(lens.width()), f64::from(lens.height()));
        let border = if ray.whole {
            0.5 * along.max(DVec2::ONE) + self.border_px
        } else {
            DVec2::splat(0.5)
        };
        if !(pixel.cmpgt(border) & pixel.cmplt(size - border)).all() {
            return None;
        }

        // 1 in the middle of the picture and 0 at its border, along either axis.
        let inner = 1.0 - (2.0 * pixel / size - 1.0) * (2.0 * pixel / size - 1.0);
        Some(PlaceInPicture { pixel, footprint: along, inner: inner.x * inner.y })
    }

    /// Tells whether the mask leaves out a place in the picture.
    fn is_masked(&self, pixel: DVec2) -> bool {
        let Some(mask) = &self.mask else { return false };
        // A cast brings what is below 0 to 0.
        let x = (pixel.x as u32).min(mask.width() - 1);
        let y = (pixel.y as u32).min(mask.height() - 1);
        mask.at(x, y) == 0
    }

    /// Tells whether something is in front of the point `v`, in the camera's axes.
    fn is_hidden(&self, v: DVec3) -> bool {
        match &self.limits {
            None => false,
            Some(SightLimits::Straight(DepthLimits { limits, focal })) => {
                let middle = 0.5 * f64::from(limits.width());
                let at = dvec2(v.x, v.y) * (f64::from(*focal) / v.z) + middle;
                v.z > limit_at(limits, at)
            }
            Some(SightLimits::Around(faces)) => {
                let face = face_of(v);
                let limits = &faces[face];
                // The depth images have borders: they are wider than the face by as much on each side.
                let middle = 0.5 * f64::from(limits.width());
                let at = place_on(face, v) * (0.5 * f64::from(DEPTH_WIDTH)) + middle;
                v.abs().max_element() > limit_at(limits, at)
            }
        }
    }
}

impl SightLimits {
    fn new(scene: &Scene<'_>, lens: &CaptureLens, own: &Pose) -> Self {
        match lens {
            CaptureLens::Straight(lens) => {
                let fov_rad = 2.0 * libm::atan(1.01 * lens.reach());
                let camera = Camera::perspective(*own, fov_rad, DEPTH_WIDTH, DEPTH_WIDTH);
                let limits = depth_limits(&cast(scene, &camera).depth);
                Self::Straight(DepthLimits { limits, focal: camera.focal_px().x as f32 })
            }
            CaptureLens::Spherical(_) => {
                let faces = face_cameras(own, DEPTH_WIDTH);
                Self::Around(faces.map(|camera| depth_limits(&cast(scene, &camera).depth)))
            }
        }
    }
}

/// Returns the place of a direction in a spherical picture. `v` is the direction in the camera's axes.
fn place_around(lens: &SphericalLens, ray: &CubeRay, v: DVec3) -> Option<PlaceInPicture> {
    let mut pixel = lens.project(v);
    let size = dvec2(f64::from(lens.width()), f64::from(lens.height()));

    // A circle of latitude shortens towards the pole, so that a pixel of the cube sees many columns there.
    let angle = ray.angle();
    let shortened = libm::hypot(v.x, v.z) / v.length();
    let footprint = dvec2((angle / shortened).min(TAU), angle) / lens.pixel_rad();

    // A picture counts up to half a pixel beyond its border, so that it meets its neighbours.
    let border = if ray.whole { 0.5 * footprint } else { DVec2::splat(-0.5) };
    let is_within = pixel.cmpgt(border) & pixel.cmplt(size - border);
    let is_seen = (lens.is_around() || is_within.x) && (lens.is_pole_to_pole() || is_within.y);
    if !is_seen || !pixel.is_finite() {
        return None;
    }

    // 1 in the middle and 0 just beyond a border, along an axis that has borders.
    let across = 2.0 * (pixel + 0.5) / (size + 1.0) - 1.0;
    let mut inner = 1.0;
    if !lens.is_around() {
        inner *= 1.0 - across.x * across.x;
    }
    if !lens.is_pole_to_pole() {
        inner *= 1.0 - across.y * across.y;
    }

    if lens.is_around() {
        pixel.x = pixel.x.rem_euclid(size.x);
    }
    Some(PlaceInPicture { pixel, footprint, inner })
}

/// Returns the limit at a place of its image, in pixels.
fn limit_at(limits: &Raster<f32>, at: DVec2) -> f64 {
    let last_x = f64::from(limits.width() - 1);
    let last_y = f64::from(limits.height() - 1);
    let x = at.x.clamp(0.0, last_x) as u32;
    let y = at.y.clamp(0.0, last_y) as u32;
    f64::from(limits.at(x, y))
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
