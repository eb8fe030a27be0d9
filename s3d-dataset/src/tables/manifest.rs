//! `manifest.json`: what made a data set, from what, with which options, and what was lost on the way.

use crate::error::{Result, passes_io};
use crate::options::ExportOptions;
use crate::profile::loader::Profile;
use crate::store::request::{InputRecord, Request, RequestedArea};
use s3d_geom::Aabb;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DepthUnits, Layout, XyzType};
use s3d_io::fs::{Checksum, read_json, write_json};
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::Path;

const GENERATOR: &str = "s3d";
const RUNNING: &str = "running";
const COMPLETE: &str = "complete";

/// The manifest. It names neither threads nor times nor folders of the machine: the same input and options
/// give the same bytes.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Manifest {
    generator: String,
    version: String,
    /// `"running"` from the first file on, `"complete"` after the last.
    status: String,
    seed: u64,
    options: ExportOptions,
    /// The areas that are in the folder, or will be.
    area_numbers: Vec<u32>,
    areas: Vec<AreaEntry>,
    /// Entries of the label table, the null label and no padding included.
    labels: usize,
    /// Entries of `semantic_labels.json`: null labels fill it up.
    labels_padded_to: usize,
    /// The list of all other files; not while the export runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) files: Option<FileList>,
    /// If the world coordinates were made from depth and pose, by `s3d xyz`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    xyz_from_depth: Option<XyzFromDepth>,
}

/// The list of a data set's files, all but itself and the manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FileList {
    /// Its name.
    pub(crate) list: String,
    /// How many files are in it.
    pub(crate) count: u64,
    /// Their bytes.
    pub(crate) bytes: u64,
    /// The checksum of the list.
    pub(crate) xxh3_128: Checksum,
}

/// What made world coordinates from depth, and what that loses.
#[derive(Debug, Serialize, Deserialize)]
struct XyzFromDepth {
    #[serde(rename = "type")]
    kind: String,
    /// The distance between neighbouring depths, metres: a point is off by at most half of it along its ray,
    /// or along the optical axis in a view.
    depth_step_m: f64,
    /// Points beyond this depth are missing, metres.
    largest_depth_m: f64,
}

/// What the manifest tells of an area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AreaEntry {
    pub(crate) area: u32,
    pub(crate) faces: usize,
    /// Faces of the input that are not in the data set: without area, or with the corners of an earlier one.
    pub(crate) faces_left_out: usize,
    pub(crate) points: u64,
    pub(crate) annotated_points: u64,
    pub(crate) rooms: usize,
    pub(crate) locations: usize,
    pub(crate) panoramas: u64,
    pub(crate) views: u64,
    pub(crate) xyz: XyzLoss,
    /// What its RGB images are made from.
    pub(crate) rgb: String,
    /// How far apart scan locations were placed, metres; null if the scene has its own.
    pub(crate) place_cameras: Option<f64>,
    /// What it was made from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) inputs: Vec<InputRecord>,
}

/// What storing world coordinates loses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct XyzLoss {
    #[serde(rename = "type")]
    kind: String,
    /// The farthest that a coordinate of the mesh is from 0, metres.
    largest_coordinate_m: f32,
    /// The distance between neighbouring numbers of the type there, metres; the error is at most half of it.
    /// Nothing if there are no coordinates.
    largest_step_m: Option<f64>,
}

impl XyzLoss {
    /// The loss in a mesh with this box.
    pub(crate) fn of(bbox: Aabb, kind: XyzType) -> Self {
        let largest = bbox.to_array().iter().fold(0.0f32, |m, c| m.max(c.abs()));
        let mut loss = Self { kind: String::new(), largest_coordinate_m: largest, largest_step_m: None };
        loss.store_as(kind);
        loss
    }

    fn store_as(&mut self, kind: XyzType) {
        self.kind = kind.name().to_owned();
        self.largest_step_m = match kind {
            XyzType::Half => Some(half_step(self.largest_coordinate_m)),
            XyzType::Float => Some(float_step(self.largest_coordinate_m)),
            XyzType::None => None,
        };
    }
}

/// The distance between neighbouring 32-bit floats at `value`.
fn float_step(value: f32) -> f64 {
    f64::from(value.abs().next_up()) - f64::from(value.abs())
}

/// The distance between neighbouring half floats at `value`: they have 11 significant bits, down to 2⁻²⁴.
pub(crate) fn half_step(value: f32) -> f64 {
    let mut step = 2f64.powi(-24);
    while step * 2048.0 <= f64::from(value) {
        step *= 2.0;
    }
    step
}

impl Manifest {
    /// The manifest of an export that has begun; `labels` is the length of the label table.
    pub(crate) fn begin(request: &Request, labels: usize) -> Self {
        let padded = request.options.pad_labels.0;
        Self {
            generator: GENERATOR.to_owned(),
            version: request.version.clone(),
            status: RUNNING.to_owned(),
            seed: request.seed,
            options: request.options.clone(),
            area_numbers: request.numbers(),
            areas: Vec::new(),
            labels,
            labels_padded_to: labels.max(padded),
            files: None,
            xyz_from_depth: None,
        }
    }

    /// How many entries the file of labels has.
    pub(crate) fn labels_padded_to(&self) -> usize {
        self.labels_padded_to
    }

    /// What was asked for when this data set was made.
    pub(crate) fn request(&self) -> Request {
        let areas = self.areas.iter().map(|entry| RequestedArea {
            area: entry.area,
            place_cameras: entry.place_cameras,
            inputs: entry.inputs.clone(),
        });
        Request {
            version: self.version.clone(),
            seed: self.seed,
            options: self.options.clone(),
            areas: areas.collect(),
        }
    }

    /// In what this data set differs from one that would be made `now`, a sentence each.
    pub(crate) fn differences(&self, now: &Request) -> Vec<String> {
        let mut differences = self.request().differences(now);
        if self.xyz_from_depth.is_some() {
            differences.push("its world coordinates were made again by `s3d xyz`".to_owned());
        }
        differences
    }

    /// The manifest of a complete data set, to be changed.
    pub(crate) fn read(layout: &Layout) -> Result<Self> {
        Head::require(layout)?;
        Ok(read_json(&layout.manifest())?)
    }

    /// Tells that the world coordinates were made from depth.
    pub(crate) fn xyz_from_depth(&mut self, kind: XyzType, units: DepthUnits) {
        self.areas.iter_mut().for_each(|area| area.xyz.store_as(kind));
        self.xyz_from_depth = Some(XyzFromDepth {
            kind: kind.name().to_owned(),
            depth_step_m: 1.0 / units.per_m(),
            largest_depth_m: 65_534.0 / units.per_m(),
        });
    }

    /// Tells that there are profiles besides those that there were.
    pub(crate) fn add_profiles(&mut self, wanted: &[Profile]) {
        let profiles = &mut self.options.profiles;
        profiles.extend(wanted);
        profiles.sort();
        profiles.dedup();
    }

    /// Writes it as it stands.
    pub(crate) fn write(&self, layout: &Layout) -> Result<()> {
        write_json(&layout.manifest(), self)?;
        Ok(())
    }

    /// Writes that the export is complete, with what it holds.
    pub(crate) fn complete(mut self, layout: &Layout, areas: Vec<AreaEntry>, files: FileList) -> Result<()> {
        self.areas = areas;
        self.files = Some(files);
        self.status = COMPLETE.to_owned();
        self.write(layout)
    }
}

/// What a file holds; nothing if it is not there, or is none of ours.
///
/// # Errors
/// Those of the disk or the network at this moment, and of permissions: what cannot be read now may be there
/// all the same, and must not be taken for gone.
pub(crate) fn if_there<T>(read: s3d_io::Result<T>) -> Result<Option<T>> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(FileError::Io { path, action, source })
            if passes_io(&source) || source.kind() == ErrorKind::PermissionDenied =>
        {
            Err(FileError::Io { path, action, source }.into())
        }
        Err(_) => Ok(None),
    }
}

/// What a manifest tells of the data set beside it.
#[derive(Debug, Deserialize)]
pub(crate) struct Head {
    generator: String,
    status: String,
    /// Its areas.
    pub(crate) area_numbers: Vec<u32>,
}

impl Head {
    /// The manifest at `path`, if there is one and it is ours, of a complete data set or of one that was
    /// begun.
    ///
    /// # Errors
    /// It cannot be read now: as [`if_there`].
    pub(crate) fn read(path: &Path) -> Result<Option<Self>> {
        let head: Option<Self> = if_there(read_json(path))?;
        Ok(head.filter(|head| head.generator == GENERATOR))
    }

    /// The manifest of a folder that must hold a complete data set of ours.
    pub(crate) fn require(layout: &Layout) -> Result<Self> {
        let path = layout.manifest();
        let head = Self::read(&path)?.ok_or_else(|| {
            FileError::format(&path, "not there, or not written by s3d: give the folder of a data set")
        })?;
        if head.is_complete() {
            return Ok(head);
        }
        Err(FileError::format(&path, "the export into this folder did not finish: call it again, with the same arguments, and it goes on")
            .into())
    }

    /// Whether the export ended.
    pub(crate) fn is_complete(&self) -> bool {
        self.status == COMPLETE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_read_now_is_not_taken_for_gone() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("manifest.json");
        assert!(Head::read(&path).unwrap().is_none());
        std::fs::write(&path, "{}").unwrap();
        assert!(Head::read(&path).unwrap().is_none());
        std::fs::write(&path, r#"{"generator":"s3d","status":"complete","area_numbers":[3]}"#).unwrap();
        assert!(Head::read(&path).unwrap().is_some_and(|head| head.is_complete()));
        let failed = |kind: ErrorKind| if_there::<()>(Err(FileError::io(&path, "read", kind.into())));
        assert!(failed(ErrorKind::NotFound).unwrap().is_none());
        assert!(failed(ErrorKind::StaleNetworkFileHandle).unwrap_err().is_temporary());
        assert!(!failed(ErrorKind::PermissionDenied).unwrap_err().is_temporary());
    }

    #[test]
    fn steps_of_half_floats() {
        // formats.md: 1.6 cm at 20 m, 6.3 cm at 100 m.
        assert_eq!(half_step(20.0), 1.0 / 64.0);
        assert_eq!(half_step(100.0), 1.0 / 16.0);
        assert_eq!(half_step(1.0), 1.0 / 1024.0);
        assert_eq!((float_step(20.0), float_step(1.0)), (2f64.powi(-19), 2f64.powi(-23)));
    }

    #[test]
    fn coordinates_that_are_not_stored_lose_nothing() {
        let bbox = Aabb { min: glam::vec3(-100.0, 0.0, 0.0), max: glam::Vec3::ONE };
        let loss = |kind| XyzLoss::of(bbox, kind).largest_step_m;
        assert_eq!((loss(XyzType::Half), loss(XyzType::None)), (Some(1.0 / 16.0), None));
        assert_eq!(loss(XyzType::Float), Some(2f64.powi(-17)));
    }
}
