//! Laser scans: where the scanner stood, and the points that it measured from there.
//!
//! [`LaserScans`] lists the scans of files; [`LaserScans::read`] hands on the points of one, block by block.
//! The readers of tables are those of annotated points, in `cloud`.

mod check;
#[cfg(feature = "e57")]
mod e57;
mod find;
mod grid;
mod origins;
#[cfg(feature = "text")]
mod ptx;
mod read;
mod source;
mod trajectory;

#[cfg(test)]
mod tests;

pub use crate::cloud::table::measured::ScanBlock;
use crate::error::{Error, Result};
use crate::raw::form::RawForm;
pub(super) use find::{find, is_mesh};
pub use grid::ScanGrid;
pub use read::ReadScan;
use s3d_geom::Pose;
use s3d_geom::glam::{DAffine3, DVec3};
use source::ScanSource;
use std::path::{Path, PathBuf};
pub use trajectory::Trajectory;

/// The laser scans of a file, or of several.
#[derive(Debug)]
pub struct LaserScans {
    /// What they are.
    pub form: RawForm,
    /// What is doubtful or was left out: a sentence each, for the user.
    pub warnings: Vec<String>,
    /// The files beside those of the points that were read: a list of places, a trajectory.
    pub files: Vec<PathBuf>,
    scans: Vec<ScanInfo>,
    sources: Vec<ScanSource>,
    trajectory: Option<Trajectory>,
    world_from_file: DAffine3,
    /// What the readers of tables are told.
    columns: Vec<String>,
    on_fault: crate::cloud::OnFault,
}

/// What is known of a scan before its points are read.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanInfo {
    /// The name of the scan in its file, or the file's.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// The uuid of the scan location of an E57 scan, as
    /// [`read_scan_locations`](crate::camera::read_scan_locations) and the pictures of the file have it.
    pub uuid: Option<String>,
    /// Where the scanner stood, in the world (metres, +Z up). `None`: the file does not tell it, or the
    /// scanner moved and each point has a place of its own.
    pub origin_m: Option<DVec3>,
    /// How the scanner was turned, if the file tells it.
    pub pose: Option<Pose>,
    /// The rows and columns of the scanner's grid, if the points have places in one.
    pub grid: Option<[u32; 2]>,
    /// The number of points in the file, valid or not; `None` if only reading them tells it.
    pub points: Option<u64>,
    /// Whether points have colours.
    pub has_colors: bool,
    /// Whether points have intensities.
    pub has_intensity: bool,
    /// Whether points have times.
    pub has_times: bool,
}

impl LaserScans {
    /// Returns the scans; at least one.
    pub fn scans(&self) -> &[ScanInfo] {
        &self.scans
    }

    /// Returns the path of the mobile scanner, in the world, if one was given.
    pub fn trajectory(&self) -> Option<&Trajectory> {
        self.trajectory.as_ref()
    }

    /// Checks that the scanner's place is known for all points: of each scan, or of each point through a
    /// trajectory.
    ///
    /// # Errors
    /// [`Error::Format`] with the scans that do not tell it, and what to give.
    pub fn require_origins(&self) -> Result<()> {
        if self.trajectory.is_some() {
            return Ok(());
        }
        let unknown: Vec<&ScanInfo> = self.scans.iter().filter(|scan| scan.origin_m.is_none()).collect();
        let Some(first) = unknown.first() else { return Ok(()) };
        let message = match unknown.len() {
            1 => format!("does not tell where the scanner stood: {HOW}"),
            count => format!("is one of {count} scans that do not tell where the scanner stood: {HOW}"),
        };
        Err(Error::format(&first.path, message))
    }

    /// Says where the scanner stood during a scan, in the world, metres: for files that do not tell it.
    pub fn place(&mut self, scan: usize, origin_m: DVec3) {
        if let Some(scan) = self.scans.get_mut(scan) {
            scan.origin_m = Some(origin_m);
        }
    }

    fn scan(&self, number: usize) -> Result<(&ScanInfo, &ScanSource)> {
        let found = self.scans.get(number).zip(self.sources.get(number));
        let path = self.scans.first().map_or(Path::new(""), |scan| scan.path.as_path());
        found.ok_or_else(|| {
            Error::format(path, format!("there is no scan {number}: there are {}", self.scans.len()))
        })
    }
}

/// How the scanner's place is given.
const HOW: &str = "give its place as an origin (x, y, z); for several files a list with lines `file,x,y,z`; \
                   for a scanner that moved its trajectory";
