//! Turns the world of a scan upright where its form does not say which way is up.

use super::images::Images;
use super::surface::Made;
use glam::{DMat3, DQuat, DVec3};
use s3d_io::raw::RawForm;

/// The mean of the cameras' upward axes must be at least this long: cameras that were turned anywhere tell
/// nothing.
const LEAST_MEAN: f64 = 0.4;

/// The axis is refined by surfaces that face it within these angles, degrees: floors, tables, ceilings.
const WITHIN_DEG: [f64; 4] = [25.0, 15.0, 8.0, 4.0];

/// Returns the turn that makes a mesh Z-up, from the world of its scan. Returns `None` if the form of the
/// scan is upright, or if the caller said which axis is.
///
/// The world of 7-Scenes is that of its first camera. People hold cameras upright, so the mean of their
/// upward axes is near the vertical, and the surfaces that face it tell it exactly.
pub(super) fn turn(images: &Images, made: &Made) -> Option<DMat3> {
    let is_tilted = images.inputs().iter().any(|(_, form)| *form == RawForm::SevenScenes);
    if !is_tilted || images.up().is_some() {
        return None;
    }
    let mut axis = images.mean_up().filter(|mean| mean.length() >= LEAST_MEAN)?.normalize();

    for within_deg in WITHIN_DEG {
        let least = libm::cos(within_deg.to_radians());
        let mut sum = DVec3::ZERO;
        for face in &made.faces {
            let [a, b, c] = face.map(|vertex| made.positions[vertex as usize].as_dvec3());
            // Twice the area long.
            let normal = (b - a).cross(c - a);
            let along = normal.dot(axis);
            if along.abs() >= least * normal.length() {
                sum += normal * along.signum();
            }
        }
        axis = sum.try_normalize()?;
    }
    Some(DMat3::from_quat(DQuat::from_rotation_arc(axis, DVec3::Z)))
}
