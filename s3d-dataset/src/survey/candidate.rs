//! A candidate view of a scan location.

use s3d_geom::Camera;
use s3d_io::camera::ScanLocation;
use serde::Serialize;

/// A candidate view of a scan location.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Candidate {
    /// The number of its area.
    #[serde(skip)]
    pub(crate) area: u32,
    /// The index of its location in the area's camera table.
    #[serde(skip)]
    pub(crate) location: usize,
    pub(crate) camera_uuid: String,
    /// Its number within the location, from 0. The key of its random draw.
    pub(crate) candidate: u32,
    pub(crate) yaw_rad: f64,
    pub(crate) pitch_rad: f64,
    pub(crate) fov_rad: f64,
    /// The Shannon entropy of what its pixels show (`Kinds`), nats.
    pub(crate) entropy: f64,
    /// The number in its file names, if it is kept. Kept views of a location are numbered from 0.
    pub(crate) frame_num: Option<u32>,
}

impl Candidate {
    /// Returns the camera of the view, with `size` × `size` pixels.
    pub(crate) fn camera(&self, location: &ScanLocation, size: u32) -> Camera {
        let pose = location.pose.turned(self.yaw_rad, self.pitch_rad);
        Camera::perspective(pose, self.fov_rad, size, size)
    }
}
