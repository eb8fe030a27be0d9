//! A candidate view of a scan location.

use s3d_geom::Camera;
use s3d_io::camera::ScanLocation;
use serde::Serialize;

/// A candidate view of a scan location.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Candidate {
    /// Number of its area.
    #[serde(skip)]
    pub(crate) area: u32,
    /// Index of its location in the area's camera table.
    #[serde(skip)]
    pub(crate) location: usize,
    pub(crate) camera_uuid: String,
    /// From 0: what its draw is keyed by.
    pub(crate) candidate: u32,
    pub(crate) yaw_rad: f64,
    pub(crate) pitch_rad: f64,
    pub(crate) fov_rad: f64,
    /// Shannon entropy of what its pixels show (`Kinds`), nats.
    pub(crate) entropy: f64,
    /// The number in its files' names, if it is kept: kept views of a location count from 0.
    pub(crate) frame_num: Option<u32>,
}

impl Candidate {
    /// The camera that takes it, `size` × `size` pixels.
    pub(crate) fn camera(&self, location: &ScanLocation, size: u32) -> Camera {
        let pose = location.pose.turned(self.yaw_rad, self.pitch_rad);
        Camera::perspective(pose, self.fov_rad, size, size)
    }
}
