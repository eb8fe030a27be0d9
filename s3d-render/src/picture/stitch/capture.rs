//! Captures, prepared so that rays of the cube can look them up.

use super::lanes::{DepthLimits, LaneCapture};
use crate::picture::cube_map::face_cameras;
use crate::picture::cube_sources::SourceMipMap;
use crate::raster::visibility::cast;
use crate::scene::Scene;
use glam::{DMat3, DVec2, DVec3, dvec2};
use rayon::prelude::*;
use s3d_geom::{Camera, Lens, Pose, Raster, Wrap};

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
    pub lens: Lens,
    /// The place and direction of the camera in the project's axes.
    pub pose: Pose,
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

/// A prepared capture.
pub(super) struct PreparedCapture {
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
    pub(super) fn new(capture: Capture, pose: &Pose, scene: Option<&Scene<'_>>) -> Self {
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

    pub(super) fn in_lanes(&self, world_from_frame: DMat3, gain: [f32; 3]) -> LaneCapture<'_> {
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
    pub(super) fn sees(&self, ray: &CubeRay) -> Option<([f32; 3], f32)> {
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
