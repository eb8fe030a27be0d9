//! `manifest.json`: what made a data set, from which input, with which options, and what was lost on the way.

use crate::error::{Difference, Result};
use crate::options::profile::Profile;
use crate::options::{ExportOptions, by_name};
use crate::record::if_there;
use crate::record::pending_change::pending;
use crate::record::request::{InputRecord, Request, RequestedArea};
use crate::summary::Unlabelled;
use crate::survey::surface_seen::SurfaceSeen;
use s3d_geom::Aabb;
use s3d_io::Error as FileError;
use s3d_io::dataset::{Conventions, DepthUnits, Domain, Layout, XyzType, read_taxonomy_json};
use s3d_io::fs::{Checksum, read_json, write_bytes};
use s3d_label::{LabelTable, Taxonomy};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::Path;

const GENERATOR: &str = "s3d";
const RUNNING: &str = "running";
const COMPLETE: &str = "complete";

/// The name of the list of files.
const LIST: &str = "files.csv";

/// What RGB images are made from: the mesh, or pictures of a kind.
const RGB_SOURCES: [&str; 5] = ["texture", "skybox", "captures", "panorama", "e57"];

/// The largest size of a manifest, bytes. Most of it is a line for each input file.
const LARGEST: u64 = 1 << 28;

/// The manifest. It holds no thread counts, times or folders of the machine, so the same input and options
/// give the same bytes. Readers of a data set call [`Manifest::read`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Manifest {
    generator: String,
    pub(crate) version: String,
    /// `"running"` from the first file on, `"complete"` after the last.
    status: String,
    pub(crate) seed: u64,
    pub(crate) options: ExportOptions,
    /// The areas that are in the folder, or will be.
    pub(crate) area_numbers: Vec<u32>,
    pub(crate) areas: Vec<AreaEntry>,
    /// The number of entries of the label table, with the null label and without padding. 0 if there are no
    /// labels.
    pub(crate) labels: usize,
    /// The number of entries of `semantic_labels.json`, which null labels fill up.
    labels_padded_to: usize,
    /// The name of the taxonomy in `assets/taxonomy.json`. Absent if the classes are S3DIS's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) taxonomy: Option<String>,
    /// The list of all other files. Absent while the export runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) files: Option<FileList>,
    /// How `s3d xyz` made the world coordinates from depth and pose. Absent if it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    xyz_from_depth: Option<XyzFromDepth>,
    /// The checksum of everything else in the manifest. Absent in data sets of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    xxh3_128: Option<Checksum>,
}

/// The list of a data set's files, without itself and the manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FileList {
    /// Its name.
    pub(crate) list: String,
    /// The number of files.
    pub(crate) count: u64,
    /// The size of all files, bytes.
    pub(crate) bytes: u64,
    /// The checksum of the list.
    pub(crate) xxh3_128: Checksum,
}

/// How world coordinates were made from depth, and what that loses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct XyzFromDepth {
    #[serde(rename = "type", with = "by_name")]
    kind: XyzType,
    /// The distance between neighbouring depths, metres. A point is off by at most half of it, along its ray
    /// in a panorama and along the optical axis in a view.
    depth_step_m: f64,
    /// Points beyond this depth are missing, metres.
    largest_depth_m: f64,
}

impl XyzFromDepth {
    fn of(kind: XyzType, units: DepthUnits) -> Self {
        Self { kind, depth_step_m: 1.0 / units.per_m(), largest_depth_m: 65_534.0 / units.per_m() }
    }
}

/// What the manifest says about an area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AreaEntry {
    pub(crate) area: u32,
    pub(crate) faces: usize,
    /// Faces of the input that are not in the data set: they have no area, or the corners of an earlier face.
    pub(crate) faces_left_out: usize,
    pub(crate) points: u64,
    pub(crate) annotated_points: u64,
    /// What has no votes and no label. Absent without labels, and in data sets of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) unlabelled: Option<Unlabelled>,
    pub(crate) rooms: usize,
    pub(crate) locations: usize,
    pub(crate) panoramas: u64,
    pub(crate) views: u64,
    /// The number of views that show photographs. Absent if there is none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(crate) frames: u64,
    pub(crate) xyz: XyzLoss,
    /// What the RGB images are made from.
    pub(crate) rgb: String,
    /// The distance at which scan locations were placed, metres. Null if the scene has its own, or `see` is
    /// set.
    pub(crate) place_cameras: Option<f64>,
    /// The share of the surface that placed locations were to see. Absent if they were not placed that way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) see: Option<f64>,
    /// How much of the surface placed locations see. Absent if they were not placed by what they see.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) surface_seen: Option<SurfaceSeen>,
    /// What was subtracted from the scan's coordinates, metres. Absent if nothing was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) offset_m: Option<[f64; 3]>,
    /// The warnings of the export, a sentence each. Absent if there was none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) warnings: Vec<String>,
    /// The files it was made from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) inputs: Vec<InputRecord>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "what serde calls")]
fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// What storing world coordinates loses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct XyzLoss {
    #[serde(rename = "type", with = "by_name")]
    kind: XyzType,
    /// The largest absolute coordinate of the mesh, metres.
    largest_coordinate_m: f32,
    /// The distance between neighbouring numbers of the type at that coordinate, metres. The error is at most
    /// half of it. `None` if there are no coordinates.
    largest_step_m: Option<f64>,
}

impl XyzLoss {
    /// Returns the loss for a mesh with this box.
    pub(crate) fn of(bbox: Aabb, kind: XyzType) -> Self {
        let largest = bbox.to_array().iter().fold(0.0f32, |m, c| m.max(c.abs()));
        let mut loss = Self { kind, largest_coordinate_m: largest, largest_step_m: None };
        loss.store_as(kind);
        loss
    }

    fn store_as(&mut self, kind: XyzType) {
        self.kind = kind;
        self.largest_step_m = match kind {
            XyzType::Half => Some(half_step(self.largest_coordinate_m)),
            XyzType::Float => Some(float_step(self.largest_coordinate_m)),
            XyzType::None => None,
        };
    }
}

/// Returns the distance between neighbouring 32-bit floats at `value`.
fn float_step(value: f32) -> f64 {
    f64::from(value.abs().next_up()) - f64::from(value.abs())
}

/// Returns the distance between neighbouring half floats at `value`. They have 11 significant bits, down to
/// 2⁻²⁴.
pub(crate) fn half_step(value: f32) -> f64 {
    let mut step = 2f64.powi(-24);
    while step * 2048.0 <= f64::from(value) {
        step *= 2.0;
    }
    step
}

impl Manifest {
    /// Returns the manifest of an export that has begun with this label table. A table with only the null
    /// label stands for no labels.
    pub(crate) fn begin(request: &Request, table: &LabelTable) -> Self {
        let labels = if table.len() > 1 { table.len() } else { 0 };
        let taxonomy = Some(table.taxonomy()).filter(|t| labels > 0 && !t.is_s3dis());
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
            taxonomy: taxonomy.map(|t| t.name().to_owned()),
            files: None,
            xyz_from_depth: None,
            xxh3_128: None,
        }
    }

    /// Returns whether the data set has a label table and the files made with it.
    pub(crate) fn is_labelled(&self) -> bool {
        self.labels > 0
    }

    /// Returns the taxonomy of the labels: S3DIS's, or the one in `assets/taxonomy.json`. `check` may refuse
    /// that file before it is read.
    ///
    /// # Errors
    /// Fails if the file is damaged, or holds a taxonomy of another name.
    pub(crate) fn read_taxonomy(
        &self,
        layout: &Layout,
        check: impl Fn(&Path) -> Result<(), FileError>,
    ) -> Result<Taxonomy, FileError> {
        let Some(name) = &self.taxonomy else { return Ok(Taxonomy::s3dis()) };
        let path = layout.taxonomy_json();
        check(&path)?;
        let taxonomy = read_taxonomy_json(&path)?;
        if taxonomy.name() != name {
            let message = format!("is {}, and the manifest tells of {name}", taxonomy.name());
            return Err(FileError::format(&path, message));
        }
        Ok(taxonomy)
    }

    /// Returns the number of entries of the label file.
    pub(crate) fn labels_padded_to(&self) -> usize {
        self.labels_padded_to
    }

    /// Returns the request that made this data set.
    pub(crate) fn request(&self) -> Request {
        let areas = self.areas.iter().map(|entry| RequestedArea {
            area: entry.area,
            place_cameras: entry.place_cameras,
            see: entry.see,
            offset_m: entry.offset_m,
            inputs: entry.inputs.clone(),
        });

        Request {
            version: self.version.clone(),
            seed: self.seed,
            options: self.options.clone(),
            areas: areas.collect(),
        }
    }

    /// Returns how this data set differs from one that would be made `now`, a sentence each.
    pub(crate) fn differences(&self, now: &Request) -> Vec<Difference> {
        let mut differences = self.request().differences(now);
        if self.xyz_from_depth.is_some() {
            differences
                .push(Difference::Other("its world coordinates were made again by `s3d xyz`".to_owned()));
        }
        differences
    }

    /// Refuses a folder without a complete data set of ours. The data set may be damaged.
    pub(crate) fn require(layout: &Layout) -> Result<(), FileError> {
        let path = layout.manifest();
        let head: Head = read_manifest(&path)?;
        if head.generator != GENERATOR {
            let message = format!("written by {:?}, not by s3d", head.generator);
            return Err(FileError::format(&path, message));
        }
        if !head.is_complete() {
            let message = format!(
                "status {:?}: the export into this folder did not finish, call it again, with the same \
                 arguments, and it goes on",
                head.status
            );
            return Err(FileError::format(&path, message));
        }
        Ok(())
    }

    /// Reads the manifest of a complete data set.
    ///
    /// # Errors
    /// All errors are of the file: it is missing or not ours, the export did not finish, a field is missing
    /// or wrong, or the data set is half changed.
    pub(crate) fn read(layout: &Layout) -> Result<Self, FileError> {
        Self::require(layout)?;
        let path = layout.manifest();
        if let Some(what) = pending(layout)? {
            let message =
                format!("the data set is half changed: make the call {what:?} again, and it goes on");
            return Err(FileError::format(&path, message));
        }

        let manifest: Self = read_manifest(&path)?;
        match manifest.contradiction() {
            Some(message) => Err(FileError::format(&path, message)),
            None => Ok(manifest),
        }
    }

    /// Reads the manifest of an export that did not finish. Returns `None` if the folder holds something
    /// else.
    ///
    /// # Errors
    /// The same as for [`Manifest::read`].
    pub(crate) fn read_running(layout: &Layout) -> Result<Option<Self>, FileError> {
        let path = layout.manifest();
        let head: Head = read_manifest(&path)?;
        if head.generator == GENERATOR && head.status == RUNNING {
            read_manifest(&path).map(Some)
        } else {
            Ok(None)
        }
    }

    /// Returns a sentence on the first thing that contradicts the rest of the manifest, if there is one.
    fn contradiction(&self) -> Option<String> {
        let numbers: BTreeSet<u32> = self.area_numbers.iter().copied().collect();
        if numbers.is_empty() || numbers.contains(&0) || numbers.len() != self.area_numbers.len() {
            return Some(format!("area_numbers {:?} are no numbers of areas", self.area_numbers));
        }

        if !self
            .areas
            .iter()
            .map(|area| area.area)
            .eq(self.area_numbers.iter().copied())
        {
            let told: Vec<u32> = self.areas.iter().map(|area| area.area).collect();
            return Some(format!("area_numbers {:?}, and areas tells of {told:?}", self.area_numbers));
        }

        let padded = self.labels.max(self.options.pad_labels.0);
        if self.labels_padded_to != padded {
            let told = self.labels_padded_to;
            return Some(format!("{} labels, padded to {told}: its options make it {padded}", self.labels));
        }

        if !self.is_labelled() && self.options.need_labels() {
            return Some("no labels, and its options ask for what is made of them".to_owned());
        }
        if let Some(files) = self.files.as_ref().filter(|files| files.list != LIST) {
            return Some(format!("tells of a list {:?}; it is called {LIST}", files.list));
        }

        let units = self.options.depth_units;
        if let Some(made) = &self.xyz_from_depth
            && (made.kind == XyzType::None || *made != XyzFromDepth::of(made.kind, units))
        {
            return Some(format!("xyz_from_depth does not fit depth units {units}"));
        }

        if let Some(area) = self.areas.iter().find(|area| !RGB_SOURCES.contains(&area.rgb.as_str())) {
            return Some(format!("area {}: colours come from {:?}, which is not known", area.area, area.rgb));
        }

        self.options.canonical().err().map(|e| format!("in its options: {e}"))
    }

    /// Returns whether this version of the program wrote it, so that its standard files are known to the
    /// byte.
    pub(crate) fn is_of_this_version(&self) -> bool {
        self.version == env!("CARGO_PKG_VERSION")
    }

    /// Returns how numbers are written. `conventions.json` says the same to other programs.
    pub(crate) fn conventions(&self) -> Conventions {
        let made = self.xyz_from_depth.as_ref().map(|made| made.kind);
        let told = self.options.conventions();
        Conventions { xyz: made.unwrap_or(told.xyz), ..told }
    }

    /// Returns a sentence if `conventions.json` contradicts the manifest.
    pub(crate) fn contradiction_of(&self, found: Conventions) -> Option<String> {
        let told = self.conventions();
        (found != told).then(|| format!("{found}; the manifest tells of {told}"))
    }

    /// Returns the domains that every image has, in their order.
    pub(crate) fn domains(&self) -> Vec<Domain> {
        let mut domains = Domain::ALL.to_vec();
        domains.retain(|domain| {
            let is_made_later = *domain == Domain::GlobalXyz && self.is_xyz_from_depth();
            self.options.modalities.contains(domain) || is_made_later
        });
        domains
    }

    /// Returns whether `s3d xyz` made the world coordinates.
    pub(crate) fn is_xyz_from_depth(&self) -> bool {
        self.xyz_from_depth.is_some()
    }

    /// Returns the entry of an area.
    pub(crate) fn area(&self, number: u32) -> Option<&AreaEntry> {
        self.areas.iter().find(|a| a.area == number)
    }

    /// Returns whether a location's images were asked for.
    pub(crate) fn is_chosen(&self, uuid: &str) -> bool {
        self.options.only.is_empty() || self.options.only.iter().any(|o| o == uuid)
    }

    /// Records that the world coordinates were made from depth.
    pub(crate) fn xyz_from_depth(&mut self, kind: XyzType, units: DepthUnits) {
        self.areas.iter_mut().for_each(|area| area.xyz.store_as(kind));
        self.xyz_from_depth = Some(XyzFromDepth::of(kind, units));
    }

    /// Records profiles beside the earlier ones.
    pub(crate) fn add_profiles(&mut self, wanted: &[Profile]) {
        let profiles = &mut self.options.profiles;
        profiles.extend(wanted);
        profiles.sort();
        profiles.dedup();
    }

    /// Records modalities that images have beside the earlier ones.
    pub(crate) fn add_modalities(&mut self, added: &[Domain]) {
        let before = std::mem::replace(&mut self.options.modalities, Domain::ALL.to_vec());
        let is_there = |domain: &Domain| before.contains(domain) || added.contains(domain);
        self.options.modalities.retain(is_there);
    }

    /// Writes the manifest as it stands, with its checksum.
    pub(crate) fn write(&self, layout: &Layout) -> Result<()> {
        let path = layout.manifest();
        let wrong = |e: serde_json::Error| FileError::format(&path, e.to_string());
        // The checksum is of the numbers as a reader finds them in the text.
        let text = serde_json::to_string(self).map_err(wrong)?;
        let sum = checksum_of(&serde_json::from_str(&text).map_err(wrong)?);
        let text = serde_json::to_string_pretty(&Self { xxh3_128: Some(sum), ..self.clone() });
        write_bytes(&path, (text.map_err(wrong)? + "\n").as_bytes())?;
        Ok(())
    }

    /// Returns a sentence if the manifest at `path` was changed after it was written. Its layout may have.
    pub(crate) fn change_of(path: &Path) -> Result<Option<String>, FileError> {
        let value: Value = read_manifest(path)?;
        let Some(told) = value.get("xxh3_128") else { return Ok(None) };
        let found = checksum_of(&value).to_string();
        let message =
            format!("was changed after it was written: its checksum is {found}, and it tells of {told}");
        Ok((told.as_str() != Some(&found)).then_some(message))
    }

    /// Writes that the export is complete, and what it holds.
    pub(crate) fn complete(mut self, layout: &Layout, areas: Vec<AreaEntry>, files: FileList) -> Result<()> {
        self.areas = areas;
        self.files = Some(files);
        self.status = COMPLETE.to_owned();
        self.write(layout)
    }
}

/// Returns the checksum of a manifest without its own, whatever the order of keys and the blanks.
fn checksum_of(manifest: &Value) -> Checksum {
    let mut text = String::new();
    put(manifest, true, &mut text);
    Checksum::of(text.as_bytes())
}

/// Appends a value with sorted keys and without blanks. The checksum of the whole is left out.
fn put(value: &Value, is_whole: bool, text: &mut String) {
    match value {
        Value::Object(fields) => {
            let fields: BTreeMap<&String, &Value> = fields.iter().collect();
            for (key, field) in fields {
                if !is_whole || key != "xxh3_128" {
                    text.push_str(key);
                    text.push(':');
                    put(field, false, text);
                    text.push(',');
                }
            }
            text.push('}');
        }
        Value::Array(items) => {
            for item in items {
                put(item, false, text);
                text.push(',');
            }
            text.push(']');
        }
        other => text.push_str(&other.to_string()),
    }
}

/// Reads a manifest, or the fields of one that `T` has.
fn read_manifest<T: DeserializeOwned>(path: &Path) -> Result<T, FileError> {
    let size = match std::fs::metadata(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => {
            return Err(FileError::format(path, "not there: give the folder of a data set"));
        }
        found => found.map_err(|e| FileError::io(path, "read", e))?.len(),
    };
    if size > LARGEST {
        return Err(FileError::format(path, format!("{size} bytes: no manifest is as large")));
    }
    read_json(path)
}

/// The fields that manifests of all versions share: enough to continue the data set, to replace it or to
/// bring it back.
#[derive(Debug, Deserialize)]
pub(crate) struct Head {
    generator: String,
    status: String,
    pub(crate) area_numbers: Vec<u32>,
}

impl Head {
    /// Reads the manifest at `path`, of a complete data set or of one that was begun. Returns `None` if there
    /// is none, or it is not ours.
    ///
    /// # Errors
    /// Fails as [`if_there`] does if the file cannot be read now.
    pub(crate) fn read(path: &Path) -> Result<Option<Self>> {
        let head: Option<Self> = if_there(read_manifest(path))?;
        Ok(head.filter(|head| head.generator == GENERATOR))
    }

    /// Returns whether the export ended.
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
        // `s3d_io::formats`: 1.6 cm at 20 m, 6.3 cm at 100 m.
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
