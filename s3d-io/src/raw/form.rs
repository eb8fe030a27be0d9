//! The forms of raw scans, and how their names are written.

use std::fmt;

/// What a raw scan is on the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RawForm {
    /// Captures of a Matterport: `{uuid}_d0_0.png` with poses and intrinsics.
    Matterport,
    /// Matterport3D's undistorted pictures: a list of commands, `.conf`.
    MatterportUndistorted,
    /// A recording of ScanNet or BundleFusion, `.sens`.
    Recording,
    /// A folder with ScanNet's `depth/0.png` and `pose/0.txt`.
    ScanNet,
    /// A video of ARKitScenes: `lowres_depth` and `lowres_wide.traj`.
    ArkitScenes,
    /// A sequence of 3RScan or BundleFusion: `frame-000000.depth.pgm`, `.pose.txt`, `_info.txt`.
    Sequence,
    /// A sequence of 7-Scenes: `frame-000000.depth.png` and `.pose.txt`.
    SevenScenes,
    /// A sequence of TUM's RGB-D benchmark: `depth.txt` and `groundtruth.txt`.
    Tum,
    /// The keyframes of a Polycam capture.
    Polycam,
    /// A `transforms.json` whose frames have a `depth_file_path`.
    Nerfstudio,
    /// Scans of an E57 file.
    E57,
    /// Scans of a PTX file.
    Ptx,
    /// Points of a laser scanner without a grid: LAS, PLY, PCD, NPY or text.
    Points,
    /// A list of files with points, each with the scanner's place.
    OriginList,
    /// A folder with files of laser scans.
    ScanFolder,
}

impl RawForm {
    /// Returns whether it is depth pictures. All other forms are laser scans.
    pub fn is_pictures(self) -> bool {
        !matches!(self, Self::E57 | Self::Ptx | Self::Points | Self::OriginList | Self::ScanFolder)
    }
}

impl fmt::Display for RawForm {
    /// Writes what it is: "a recording of ScanNet (.sens)".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Matterport => "captures of a Matterport with depth",
            Self::MatterportUndistorted => "undistorted pictures of Matterport3D with depth",
            Self::Recording => "a recording of ScanNet (.sens)",
            Self::ScanNet => "a folder of ScanNet with depth and poses",
            Self::ArkitScenes => "a video of ARKitScenes with depth",
            Self::Sequence => "a sequence in the form of 3RScan or BundleFusion",
            Self::SevenScenes => "a sequence of 7-Scenes",
            Self::Tum => "a sequence of TUM's RGB-D benchmark",
            Self::Polycam => "the keyframes of a Polycam capture",
            Self::Nerfstudio => "a transforms.json with depth",
            Self::E57 => "laser scans (E57)",
            Self::Ptx => "laser scans (PTX)",
            Self::Points => "points of a laser scanner",
            Self::OriginList => "a list of laser scans with the scanner's places",
            Self::ScanFolder => "a folder of laser scans",
        })
    }
}
