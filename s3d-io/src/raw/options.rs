//! What a caller knows beside the files of a raw scan.

use crate::camera::Optics;
use crate::cloud::OnFault;
use s3d_geom::glam::{DAffine3, DVec3};
use std::path::PathBuf;

/// How a raw scan is read. The defaults fit files that tell everything.
#[derive(Clone, Debug, PartialEq)]
pub struct RawOptions {
    /// From the frame of the files to the world (metres, +Z up): a rotation, a shift, and one scale for all
    /// axes. The scale applies to depths too.
    pub world_from_file: DAffine3,
    /// How many metres a step of the numbers in depth pictures is, such as 0.001. `None`: as the program that
    /// wrote them has it.
    pub depth_unit_m: Option<f64>,
    /// How the depth camera maps directions to the pixels of its pictures. It replaces what the files say.
    /// `None`: the files say it.
    pub depth_optics: Option<Optics>,
    /// The names of the columns, in order, for tables of points that do not name them. Empty: `x y z`, then
    /// the intensity, or red, green and blue, or both.
    pub columns: Vec<String>,
    /// Where the scanner stood, in the frame of the files, for points whose file does not tell it.
    pub origin_m: Option<DVec3>,
    /// The file with the path of a mobile scanner, for points with times: lines `t x y z qx qy qz qw`, or a
    /// table whose first line names `t`, `x`, `y` and `z`. It is in the frame of the points, and its times
    /// are theirs.
    pub trajectory: Option<PathBuf>,
    /// What is done about a faulty record or line of a table of points.
    pub on_fault: OnFault,
}

impl Default for RawOptions {
    fn default() -> Self {
        Self {
            world_from_file: DAffine3::IDENTITY,
            depth_unit_m: None,
            depth_optics: None,
            columns: Vec::new(),
            origin_m: None,
            trajectory: None,
            on_fault: OnFault::default(),
        }
    }
}

impl RawOptions {
    /// Returns the factor by which lengths of the files grow in the world.
    pub(super) fn scale(&self) -> f64 {
        self.world_from_file.matrix3.x_axis.length()
    }
}
