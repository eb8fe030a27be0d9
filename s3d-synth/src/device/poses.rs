//! Where depth cameras stand: on a turntable, or in a hand.

use super::target::ScanTarget;
use crate::building::ScanLocation;
use s3d_geom::Pose;
use s3d_geom::glam::{DVec3, dvec3};
use std::f64::consts::{PI, TAU};

/// A picture of a turntable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurntableStop {
    /// The camera: 0 looks up, 1 level, 2 down.
    pub camera: u32,
    /// The stop of the turn, 0 to 5.
    pub yaw: u32,
    /// Where the picture is taken.
    pub pose: Pose,
}

/// The tilts of the three cameras. With a field of view of 51° in height, neighbours overlap by a third.
const TILTS_DEG: [f64; 3] = [33.0, 0.0, -33.0];
/// How far the cameras are from the axis of the turntable, and above its middle.
const AXIS_M: f64 = 0.04;
const HEIGHTS_M: [f64; 3] = [0.05, 0.0, -0.05];

/// Returns the 18 pictures of a scan location: three cameras above each other, at six stops of a turn. The
/// level camera's first stop looks along the heading of the location; later ones are turned by 60° to the
/// right. Source: the documentation of Matterport3D (three sensors that look up, level and down, stops at
/// 60°).
pub fn turntable_poses(location: &ScanLocation) -> [TurntableStop; 18] {
    std::array::from_fn(|k| {
        let (camera, yaw) = (k / 6, k % 6);
        let turned = Pose::level(location.position, location.yaw_rad - TAU * yaw as f64 / 6.0);
        let shift = turned.forward() * AXIS_M + DVec3::Z * HEIGHTS_M[camera];
        let pose = turned.turned(0.0, TILTS_DEG[camera].to_radians());
        let pose = Pose { location: location.position + shift, ..pose };
        TurntableStop { camera: camera as u32, yaw: yaw as u32, pose }
    })
}

/// The widest circle that a person walks, and how far the camera stays from things.
const CIRCLE_M: f64 = 0.7;
const CLEARANCE_M: f64 = 0.5;

/// The number of directions in which the room for the circle is measured.
const DIRECTIONS: u32 = 36;

impl ScanTarget<'_> {
    /// Returns the path of a hand-held camera about a scan location: `count` poses on two rounds of a circle.
    /// Its radius is 0.7 m, or less where things at its height would be nearer than 0.5 m. In the first round
    /// the camera looks outwards, in the second across the circle and farther down. It sways, as in a hand.
    pub fn hand_held_poses(&self, location: &ScanLocation, count: u32) -> Vec<Pose> {
        let middle = location.position;
        // Headings are 0 along +Y and grow to the left.
        let toward = |angle: f64| dvec3(-libm::sin(angle), libm::cos(angle), 0.0);
        let free = (0..DIRECTIONS).filter_map(|k| {
            let direction = toward(TAU * f64::from(k) / f64::from(DIRECTIONS));
            self.range(middle.as_vec3(), direction.as_vec3())
        });
        let free = f64::from(free.fold(f32::INFINITY, f32::min));
        let radius = (free - CLEARANCE_M).clamp(0.0, CIRCLE_M);

        let pose = |k: u32| {
            let rounds = 2.0 * f64::from(k) / f64::from(count);
            let angle = TAU * rounds;
            let rise = 0.12 * libm::sin(3.0 * angle);
            let place = middle + toward(angle) * radius + DVec3::Z * rise;

            let is_outwards = rounds < 1.0;
            let heading = if is_outwards { angle } else { angle + PI };
            let pitch = if is_outwards { -0.1 } else { -0.35 } + 0.3 * libm::sin(5.0 * angle);
            let sway = 0.1 * libm::sin(7.0 * angle);
            Pose::level(place, heading + sway).turned(0.0, pitch)
        };
        (0..count).map(pose).collect()
    }
}
