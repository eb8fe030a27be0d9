//! Raw scans, before there is a mesh: depth pictures with poses, and laser scans.
//!
//! [`RawScan::open`] tells by its contents what a folder or file is, and lists what is in it. Nothing but
//! lists, headers and a few samples are read then. Pictures and points are read one by one, and block by
//! block, when they are asked for.
//!
//! | raw scan | found by |
//! |---|---|
//! | a Matterport's captures | `{uuid}_d0_0.png`, `{uuid}_pose_0_0.txt`, `{uuid}_intrinsics_0.txt` |
//! | Matterport3D's undistorted pictures | a `.conf` |
//! | ScanNet, BundleFusion | a `.sens`; or `depth/0.png`, `pose/0.txt`, `intrinsic/intrinsic_depth.txt` |
//! | ARKitScenes | `lowres_depth`, `lowres_wide.traj`, `lowres_wide_intrinsics` |
//! | 3RScan, BundleFusion | `frame-000000.depth.pgm` or `.png`, `.pose.txt`, `_info.txt` or `info.txt` |
//! | 7-Scenes | `frame-000000.depth.png`, `.pose.txt`; or folders `seq-01`… of them |
//! | TUM's RGB-D benchmark | `depth.txt`, `groundtruth.txt` |
//! | Polycam | `keyframes/depth`, `keyframes/corrected_cameras` |
//! | nerfstudio | a `transforms.json` with `depth_file_path` |
//! | laser scans that tell the scanner's place | `.e57`, `.ptx` |
//! | points of a laser scanner | `.las`, `.laz`, `.ply`, `.pcd`, `.npy`, text, with [`RawOptions::origin_m`]
//! |
//! | several of them | a list with lines `file,x,y,z`, or a folder |
//! | points of a mobile scanner | with times, and [`RawOptions::trajectory`] |
//!
//! Everything is in the world: metres, +Z up, after [`RawOptions::world_from_file`]. Source:
//! [`crate::formats`], "Raw scans".
//!
//! ```
//! use s3d_io::raw::{RawOptions, RawScan};
//!
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("hall.xyz");
//! std::fs::write(&path, "2 0 1 90\n0 3 1 80\n0 3 2 85\n").unwrap();
//! let options = RawOptions { origin_m: Some([0.0, 0.0, 1.5].into()), ..RawOptions::default() };
//! let RawScan::Scans(scans) = RawScan::open(&path, &options)? else { panic!() };
//! scans.require_origins()?;
//!
//! let mut farthest_m = 0.0f64;
//! let origin_m = scans.scans()[0].origin_m.unwrap();
//! let read = scans.read(0, |block| {
//!     let ranges = block.positions_m.iter().map(|point| point.distance(origin_m));
//!     farthest_m = ranges.fold(farthest_m, f64::max);
//!     Ok::<(), s3d_io::Error>(())
//! })?;
//! assert_eq!((read.points, (farthest_m * 100.0).round()), (3, 304.0));
//! # Ok::<(), s3d_io::Error>(())
//! ```

mod depth;
mod form;
mod laser;
mod options;

pub use depth::{ColorPicture, Confidence, DepthPicture, DepthPictures};
pub use form::RawForm;
pub use laser::{LaserScans, ReadScan, ScanBlock, ScanGrid, ScanInfo, Trajectory};
pub use options::RawOptions;

use crate::error::{Error, Result};
use std::path::Path;

/// What is read, for messages.
const FORMS: &str = "raw scans are depth pictures with poses (captures of a Matterport, ScanNet, \
                     ARKitScenes, 3RScan, 7-Scenes, TUM's RGB-D benchmark, Polycam's keyframes, a \
                     transforms.json with depth_file_path) and laser scans (E57, PTX; LAS, PLY, PCD, NPY or \
                     text with the scanner's place; a list of files with places)";

/// A raw scan.
#[derive(Debug)]
pub enum RawScan {
    /// Depth pictures with poses.
    Pictures(DepthPictures),
    /// Laser scans.
    Scans(LaserScans),
}

impl RawScan {
    /// Returns what a folder or file is, if it is a raw scan. Only names and first bytes of files are looked
    /// at. A PLY file with faces is a mesh, and no raw scan.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read.
    pub fn form_of(path: &Path) -> Result<Option<RawForm>> {
        std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
        if let Some(found) = depth::find(path)? {
            return Ok(Some(found.form));
        }
        Ok(laser::find(path)?.map(|found| found.form))
    }

    /// Opens a raw scan: a folder or a file.
    ///
    /// Lists and headers are read, the depths of a few pictures, and the first points of each scan, so that
    /// wrong units and damaged files are told early.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] with the file, the place and what to do, among others for
    /// - depth pictures whose intrinsics or poses are not known, or that have another size;
    /// - poses that are no rotation with a shift, or are transposed;
    /// - depths or ranges that cannot be metres, with the scale that would fit;
    /// - files that are damaged or cut short.
    ///
    /// [`Error::Unsupported`] if it is no raw scan.
    pub fn open(path: &Path, options: &RawOptions) -> Result<Self> {
        std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
        if let Some(found) = depth::find(path)? {
            return found.open(options).map(Self::Pictures);
        }
        if let Some(found) = laser::find(path)? {
            return found.open(options).map(Self::Scans);
        }
        if laser::is_mesh(path) {
            return Err(Error::unsupported(path, format!("is a mesh, not a raw scan: {FORMS}")));
        }
        Err(Error::unsupported(path, format!("is no raw scan: {FORMS}")))
    }

    /// Returns what it is.
    pub fn form(&self) -> RawForm {
        match self {
            Self::Pictures(pictures) => pictures.form,
            Self::Scans(scans) => scans.form,
        }
    }

    /// Returns what is doubtful or was left out: a sentence each, for the user.
    pub fn warnings(&self) -> &[String] {
        match self {
            Self::Pictures(pictures) => &pictures.warnings,
            Self::Scans(scans) => &scans.warnings,
        }
    }
}
