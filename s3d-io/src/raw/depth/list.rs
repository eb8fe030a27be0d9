//! Makes the list of a scan's depth pictures from what a form's reader found: sizes, lenses, checks.

use crate::camera::PosedCamera;
use crate::error::{Error, Result};
use crate::raw::depth::confidence::Confidence;
use crate::raw::depth::file::{DepthFile, DepthPlace};
use crate::raw::depth::{ColorPicture, DepthPicture, DepthPictures, units};
use crate::raw::form::RawForm;
use crate::raw::options::RawOptions;
use s3d_geom::PhotoLens;
use s3d_geom::glam::DVec3;
use std::path::PathBuf;

/// What a form's reader finds.
pub(super) struct Listed {
    pub(super) form: RawForm,
    pub(super) entries: Vec<Entry>,
    /// The number of depth pictures without a pose.
    pub(super) untracked: usize,
    /// The number of poses without a depth picture.
    pub(super) unpictured: usize,
    pub(super) warnings: Vec<String>,
    /// What is assumed of the lens, since no file tells it: a sentence.
    pub(super) assumed_lens: Option<String>,
    /// The files that were read.
    pub(super) files: Vec<PathBuf>,
    /// The file or folder that messages name.
    pub(super) named: PathBuf,
}

/// A depth picture as a form's reader finds it.
pub(super) struct Entry {
    /// The depth camera: its name, its pose in the frame of the files, and its optics, or the colour
    /// camera's, which are scaled to the picture.
    pub(super) camera: PosedCamera,
    pub(super) place: DepthPlace,
    /// Metres of the files' frame a step.
    pub(super) unit_m: f64,
    /// A number that stands for no depth, beside 0.
    pub(super) missing: Option<u16>,
    pub(super) confidence: Option<Confidence>,
    /// The colour camera, with its picture.
    pub(super) color: Option<PosedCamera>,
}

/// A mean direction of the cameras' up that is longer is the way the scanner was held.
const HELD_UPRIGHT: f64 = 0.7;
/// Its height if +Z is up.
const UPWARDS: f64 = 0.4;

impl Listed {
    /// Returns an empty list.
    pub(super) fn new(form: RawForm, named: PathBuf) -> Self {
        Self {
            form,
            entries: Vec::new(),
            untracked: 0,
            unpictured: 0,
            warnings: Vec::new(),
            assumed_lens: None,
            files: Vec::new(),
            named,
        }
    }

    /// Checks the list, and turns it into the world.
    pub(super) fn finish(self, options: &RawOptions) -> Result<DepthPictures> {
        if self.entries.is_empty() {
            let message = match self.untracked {
                0 => format!("is {}, but holds no depth picture", self.form),
                count => format!(
                    "is {}, and the poses of all its {count} depth pictures are unknown: poses are needed, \
                     which a program for SLAM or photogrammetry computes",
                    self.form
                ),
            };
            return Err(Error::format(&self.named, message));
        }

        let mut warnings = self.warnings;
        warnings.extend(self.assumed_lens.filter(|_| options.depth_optics.is_none()));
        if self.untracked > 0 {
            let count = self.untracked;
            let all = count + self.entries.len();
            warnings.push(format!(
                "{}: {count} of {all} depth pictures have no pose, left out",
                self.named.display()
            ));
        }
        if self.unpictured > 0 {
            let count = self.unpictured;
            warnings.push(format!("{}: {count} poses have no depth picture", self.named.display()));
        }

        let pictures = self
            .entries
            .into_iter()
            .map(|entry| entry.picture(options))
            .collect::<Result<Vec<_>>>()?;
        units::check(&pictures)?;
        warnings.extend(lying(&pictures).map(|up| {
            format!(
                "{}: the cameras' upper side points to {up} on average: is +Z up in its frame? If not, say \
                 which axis is",
                self.named.display()
            )
        }));
        Ok(DepthPictures {
            form: self.form,
            pictures,
            untracked: self.untracked,
            warnings,
            files: self.files,
        })
    }
}

impl Entry {
    fn picture(self, options: &RawOptions) -> Result<DepthPicture> {
        let Self { mut camera, place, unit_m, missing, confidence, color } = self;
        if let Some(optics) = options.depth_optics {
            camera.size = None;
            camera.optics = Some(optics);
        }
        let size = place.size()?;
        let lens = lens_of(&camera, size).map_err(|message| Error::format(place.path(), message))?;

        let unit_m = options.depth_unit_m.unwrap_or(unit_m) * options.scale();
        let color = color.and_then(|camera| {
            let picture = camera.picture.clone()?;
            picture.path.is_file().then(|| ColorPicture {
                picture,
                pose: camera.pose.moved(&options.world_from_file),
                camera,
            })
        });
        Ok(DepthPicture {
            name: camera.name,
            pose: camera.pose.moved(&options.world_from_file),
            lens,
            confidence: confidence.filter(|confidence| confidence.path().is_file()),
            color,
            depth: DepthFile { place, unit_m, missing },
        })
    }
}

/// Returns the lens of a depth camera for pictures of this size. The error is a sentence that says what to
/// do.
fn lens_of(camera: &PosedCamera, size: [u32; 2]) -> std::result::Result<PhotoLens, String> {
    use crate::camera::IntrinsicsError::{NoOptics, OtherSize};
    camera.photo_lens(size).map_err(|e| match e {
        NoOptics => format!(
            "the intrinsics of the depth camera are not known: give its focal lengths and principal point in \
             pixels, for pictures of {} × {}",
            size[0], size[1]
        ),
        OtherSize { found, told } => format!(
            "has {} × {} pixels, and the intrinsics are for {} × {}: is it of another camera, or was it \
             cut? Give the intrinsics of the depth camera itself",
            found[0], found[1], told[0], told[1]
        ),
        e => format!("the intrinsics of its camera do not fit: {e}"),
    })
}

/// Returns where the upper side of the cameras points, if they agree and it is not up.
fn lying(pictures: &[DepthPicture]) -> Option<String> {
    let sum: DVec3 = pictures.iter().map(|picture| picture.pose.up()).sum();
    let mean = sum / pictures.len() as f64;
    let is_lying = mean.length() > HELD_UPRIGHT && mean.z < UPWARDS * mean.length();
    is_lying.then(|| {
        let axes = [("x", mean.x), ("y", mean.y), ("z", mean.z)];
        let largest = axes.into_iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let (axis, value) = largest.unwrap_or(("z", mean.z));
        format!("{}{axis}", if value < 0.0 { '−' } else { '+' })
    })
}
