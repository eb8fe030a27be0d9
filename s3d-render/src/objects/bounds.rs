//! Which pixels a box can cover.

use crate::pixel_box::PixelBox;
use glam::{DVec2, DVec3, dvec2, dvec3};
use s3d_geom::{Aabb, Camera, Pose};
use std::f64::consts::{PI, TAU};

/// Points nearer than this to the plane of a pinhole camera, metres, are not projected: they would lie far
/// outside of the image.
const NEAREST_M: f64 = 1e-3;

/// Boxes in a panorama are widened by this many pixels. Rounding errors are far smaller.
const SLACK_PX: f64 = 1e-6;

/// Returns the corners of a box.
fn corners(bounds: &Aabb) -> [DVec3; 8] {
    let ends = [bounds.min.as_dvec3(), bounds.max.as_dvec3()];
    std::array::from_fn(|k| dvec3(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2].z))
}

/// Returns the least and the largest projection of points onto the image of a pinhole camera; `None` if one
/// of them is not clearly in front of it.
pub(super) fn projected(camera: &Camera, points: impl IntoIterator<Item = DVec3>) -> Option<[DVec2; 2]> {
    let mut low = DVec2::INFINITY;
    let mut high = DVec2::NEG_INFINITY;
    for point in points {
        let (pixel, depth) = camera.project(point)?;
        if depth < NEAREST_M {
            return None;
        }
        low = low.min(pixel);
        high = high.max(pixel);
    }
    low.is_finite().then_some([low, high])
}

/// Returns the parts of an image that a box may cover: at most two, since it may lie across the border of a
/// panorama.
pub(super) fn parts(camera: &Camera, bounds: &Aabb) -> Vec<PixelBox> {
    let whole = PixelBox { x: 0, y: 0, width: camera.width, height: camera.height };
    if camera.is_panorama() {
        return panorama_parts(camera, bounds);
    }
    match projected(camera, corners(bounds)) {
        Some([low, high]) => whole.between(low, high).into_iter().collect(),
        // A part of it is beside or behind the camera.
        None => vec![whole],
    }
}

/// Returns the parts of a panorama that a box may cover.
fn panorama_parts(camera: &Camera, bounds: &Aabb) -> Vec<PixelBox> {
    let size = dvec2(f64::from(camera.width), f64::from(camera.height));
    let eye = camera.pose.location;
    let [bottom, top] = rows(bounds, eye).map(|latitude_rad| (0.5 - latitude_rad / PI) * size.y);
    let whole = PixelBox { x: 0, y: 0, width: camera.width, height: camera.height };
    let between = |from: f64, to: f64| {
        whole.between(dvec2(from - SLACK_PX, top - SLACK_PX), dvec2(to + SLACK_PX, bottom + SLACK_PX))
    };

    let Some([from, to]) = columns(&camera.pose, bounds).map(|turns| turns.map(|turn| turn * size.x)) else {
        return between(0.0, size.x).into_iter().collect();
    };
    // Columns up to the right border, and those that go on beyond it.
    match [between(from, to), between(from - size.x, to - size.x)] {
        [Some(last), Some(first)] if first.columns().end > last.x => {
            vec![PixelBox { x: 0, width: camera.width, ..last }]
        }
        parts => parts.into_iter().flatten().collect(),
    }
}

/// Returns the latitudes between which a box lies as seen from `eye`, the lower first.
fn rows(bounds: &Aabb, eye: DVec3) -> [f64; 2] {
    let low = bounds.min.as_dvec3() - eye;
    let high = bounds.max.as_dvec3() - eye;
    let nearest = dvec2(beside(low.x, high.x), beside(low.y, high.y)).length();
    let farthest = dvec2(low.x.abs().max(high.x.abs()), low.y.abs().max(high.y.abs())).length();
    // Above the eye, what is nearest appears highest, and what is farthest lowest; below it, the other way
    // round.
    let across_low = if low.z < 0.0 { nearest } else { farthest };
    let across_high = if high.z > 0.0 { nearest } else { farthest };
    [libm::atan2(low.z, across_low), libm::atan2(high.z, across_high)]
}

/// Returns the distance of 0 from an interval.
fn beside(low: f64, high: f64) -> f64 {
    low.max(-high).max(0.0)
}

/// Returns the columns between which a box lies, in widths of the image: the first one in [0, 1), the last
/// one at most one width further. Returns `None` for a box above or below the eye, which has all columns.
fn columns(pose: &Pose, bounds: &Aabb) -> Option<[f64; 2]> {
    let low = bounds.min.as_dvec3() - pose.location;
    let high = bounds.max.as_dvec3() - pose.location;
    if low.x <= 0.0 && high.x >= 0.0 && low.y <= 0.0 && high.y >= 0.0 {
        return None;
    }

    // Angles from the middle of the box stay below half a turn.
    let middle = (low + high) / 2.0;
    let middle_rad = libm::atan2(middle.y, middle.x);
    let off = [(low.x, low.y), (low.x, high.y), (high.x, low.y), (high.x, high.y)].map(|(x, y)| {
        let off = libm::atan2(y, x) - middle_rad;
        off - TAU * (off / TAU).round()
    });
    let left = off.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let right = off.into_iter().fold(f64::INFINITY, f64::min);

    let turn = |azimuth_rad: f64| (pose.azimuth_rad() - azimuth_rad) / TAU + 0.5;
    let first = turn(middle_rad + left).rem_euclid(1.0);
    Some([first, first + (left - right) / TAU])
}
