//! Estimates of a data set's size, before its first byte is written.

use super::{Condition, Finding};
use crate::error::{InputError, Result};
use crate::options::ExportOptions;
use s3d_geom::TriMesh;
use s3d_io::dataset::{Domain, XyzType};
use std::fmt;
use std::path::Path;

/// The number of points above which a cloud is probably a mistake. The largest area of the published data set
/// has 470 million.
const MANY_POINTS: f64 = 3e9;

/// The number of points above which a cloud is always refused.
const MOST_POINTS: f64 = 1e11;

/// The size of a point in `pointcloud.ply`, bytes. The file has little else.
pub(crate) const PLY_POINT_BYTES: f64 = 23.0;

/// The size of a point in all files of points together, bytes: PLY, the S3DIS tree, `pointcloud.mat`.
const POINT_BYTES: f64 = 100.0;

/// Returns the bytes per pixel with the default compression: the mean of a synthetic office, the built-in
/// building and a real scan.
fn pixel_bytes(domain: Domain, xyz: XyzType) -> f64 {
    match domain {
        Domain::Rgb => 0.65,
        Domain::Depth => 0.14,
        Domain::Normal => 0.11,
        Domain::Semantic => 0.02,
        Domain::SemanticPretty => 0.025,
        Domain::SemanticClass => 0.01,
        Domain::GlobalXyz if xyz == XyzType::Float => 1.2,
        Domain::GlobalXyz => 0.5,
        Domain::Pose => 0.001,
        Domain::Objects => 0.03,
        Domain::DepthEuclidean => 0.3,
        Domain::Reshading => 0.15,
        Domain::PrincipalCurvature => 0.1,
        Domain::EdgeTexture => 0.4,
        Domain::Keypoints2d => 0.15,
        Domain::SegmentUnsup2d | Domain::SegmentUnsup25d | Domain::Keypoints3d => 0.03,
        Domain::EdgeOcclusion | Domain::EdgeInstance | Domain::MaskValid => 0.005,
        Domain::BoundaryDistance => 0.6,
        Domain::SemanticRefined => 0.03,
        Domain::SemanticMoved => 0.01,
    }
}

/// The time of one core for a pixel of all images of a view, scored, cast, shaded and compressed,
/// nanoseconds. Measured on the machine of the book's page on speed.
const PIXEL_NS: f64 = 50.0;

/// The same for a sampled point, drawn and written in three formats.
const POINT_NS: f64 = 400.0;

/// The share of candidate views that are kept.
const KEPT: f64 = 0.725;

/// A rough size of an export.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// The number of sampled points.
    pub points: f64,
    /// The number of images: kept views and panoramas, in every modality.
    pub images: f64,
    /// The number of files.
    pub files: f64,
    /// The size of all files, bytes.
    pub bytes: f64,
    /// The time on one core, seconds.
    pub core_seconds: f64,
}

impl Estimate {
    /// Estimates an export of `locations` scan locations in meshes of `area_m2`.
    pub(crate) fn new(area_m2: f64, locations: f64, options: &ExportOptions) -> Self {
        let share = if options.keep_all { 1.0 } else { KEPT };
        let written = match options.only.len() {
            0 => locations,
            only => locations.min(only as f64),
        };

        let views = written * f64::from(options.views) * share;
        let panoramas = written;
        let view_pixels = f64::from(options.size).powi(2);
        let panorama_pixels = f64::from(options.pano_width).powi(2) / 2.0;
        let pixels = views * view_pixels + panoramas * panorama_pixels;

        let points = area_m2 * options.points_per_m2;
        let bytes_per_pixel: f64 = options.modalities.iter().map(|d| pixel_bytes(*d, options.xyz)).sum();
        let images = (views + panoramas) * options.modalities.len() as f64;

        Self {
            points,
            images,
            files: images + 60.0,
            bytes: pixels * bytes_per_pixel + points * POINT_BYTES,
            core_seconds: 1e-9 * (pixels * PIXEL_NS + points * POINT_NS),
        }
    }

    /// Adds views with these numbers of pixels.
    pub(crate) fn with_views(self, views: impl Iterator<Item = f64>, options: &ExportOptions) -> Self {
        let (count, pixels) = views.fold((0.0, 0.0), |(count, sum), pixels| (count + 1.0, sum + pixels));
        let bytes_per_pixel: f64 = options.modalities.iter().map(|d| pixel_bytes(*d, options.xyz)).sum();
        let images = count * options.modalities.len() as f64;
        self.add(Self {
            points: 0.0,
            images,
            files: images,
            bytes: pixels * bytes_per_pixel,
            core_seconds: 1e-9 * pixels * PIXEL_NS,
        })
    }

    pub(crate) fn add(self, other: Self) -> Self {
        Self {
            points: self.points + other.points,
            images: self.images + other.images,
            files: self.files + other.files,
            bytes: self.bytes + other.bytes,
            core_seconds: self.core_seconds + other.core_seconds,
        }
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let minutes = self.core_seconds / 60.0;
        let time = if minutes < 1.0 {
            "less than a minute".to_owned()
        } else {
            format!("{minutes:.0} minutes")
        };

        write!(f, "about {:.0} files, {}, {time} of one core", self.files, Bytes(self.bytes))
    }
}

/// A number of bytes in words, with powers of 1000.
struct Bytes(f64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = self.0;
        match bytes {
            0.0..1e9 => write!(f, "{:.0} MB", bytes / 1e6),
            1e9..1e12 => write!(f, "{:.1} GB", bytes / 1e9),
            _ => write!(f, "{:.0} TB", bytes / 1e12),
        }
    }
}

/// Refuses a number of points that cannot be intended.
pub(crate) fn check_points(points: f64) -> Result<()> {
    if points <= MOST_POINTS {
        return Ok(());
    }
    Err(InputError::TooManyPoints { points, points_per_m2: None, most: MOST_POINTS }.into())
}

/// Returns what looks wrong about the number of points sampled on a mesh.
///
/// # Errors
/// The same as for [`check_points`].
pub(crate) fn size_findings(mesh: &TriMesh, points_per_m2: f64) -> Result<Vec<Finding>> {
    let area_m2 = mesh.total_area();
    let points = area_m2 * points_per_m2;
    if points > MOST_POINTS {
        return Err(InputError::TooManyPoints {
            points,
            points_per_m2: Some(points_per_m2),
            most: MOST_POINTS,
        }
        .into());
    }

    let text = format!(
        "{points_per_m2} points a m² on {area_m2:.1} m² are {points:.1e} points: is the mesh in metres? or \
         ask for fewer points"
    );
    Ok((points > MANY_POINTS)
        .then(|| Finding::new(Condition::Size, true, text))
        .into_iter()
        .collect())
}

/// Refuses to write exactly `bytes` if the disk of `folder` has less space.
pub(crate) fn check_space(bytes: f64, folder: &Path) -> Result<()> {
    match lack_of_space(bytes, folder) {
        Some((_, why)) => Err(InputError::NoSpace { why }.into()),
        None => Ok(()),
    }
}

/// Returns what looks wrong about writing about `bytes` on the disk of `folder`. Image sizes depend on what
/// images show, so only a disk with less than half of the space stops an export.
pub(crate) fn space_findings(bytes: f64, folder: &Path) -> Vec<Finding> {
    let lack = lack_of_space(bytes, folder);
    lack.map(|(free, text)| Finding::new(Condition::Size, bytes > 2.0 * free, text))
        .into_iter()
        .collect()
}

/// Returns the free bytes on the disk of `folder`, and a sentence, if they are fewer than `bytes`. The folder
/// need not exist yet. Returns `None` if the system does not tell.
fn lack_of_space(bytes: f64, folder: &Path) -> Option<(f64, String)> {
    let free = folder
        .ancestors()
        .find_map(|folder| fs4::available_space(or_current(folder)).ok())? as f64;
    let text = format!(
        "about {} are to be written, and {} are free at {}: make room, choose another folder, or write less",
        Bytes(bytes),
        Bytes(free),
        folder.display()
    );
    (bytes > free).then_some((free, text))
}

/// Returns the current folder for an empty path.
fn or_current(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_is_near_what_was_written() {
        // A synthetic office, a generated building and a real scan: the files of their exports, the bytes of
        // images and points, and the seconds of one core.
        let demo = ExportOptions {
            size: 540,
            pano_width: 2048,
            views: 24,
            points_per_m2: 2500.0,
            ..ExportOptions::default()
        };
        for (area_m2, locations, options, files, bytes, seconds) in [
            (257.1, 1.0, ExportOptions::default(), 443.0, 4.38e8, 5.4),
            (778.0, 6.0, demo, 1013.0, 2.78e8, 3.4),
            (48.0, 3.0, ExportOptions::default(), 1191.0, 2.1e8, 8.3),
        ] {
            let estimate = Estimate::new(area_m2, locations, &options);
            for (guess, real) in
                [(estimate.files, files), (estimate.bytes, bytes), (estimate.core_seconds, seconds)]
            {
                assert!((0.6..1.8).contains(&(guess / real)), "{area_m2} m²: {guess}, {real}: {estimate}");
            }
        }
    }

    #[test]
    fn what_cannot_fit_stops() {
        let dir = tempfile::tempdir().unwrap();
        assert!(space_findings(1e3, &dir.path().join("not/there/yet")).is_empty());
        assert!(space_findings(1e18, &dir.path().join("not/there/yet"))[0].stops);
        assert!(check_space(1e3, dir.path()).is_ok() && check_space(1e18, dir.path()).is_err());
        let free = fs4::available_space(dir.path()).unwrap() as f64;
        assert!(!space_findings(1.5 * free, dir.path())[0].stops);
    }
}
