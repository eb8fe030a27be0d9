//! The index of a report: all but the images. `docs/report.md` describes it, and `web/src/data.ts` reads it.

use crate::faults::Fault;
use crate::pixels::Shares;
use crate::selection::Place;
use s3d_dataset::{FaultGroup, VerifyReport};
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// The form of the files of a report. It grows by one when an older page could not read them.
pub(crate) const FORM: u32 = 2;

/// The name of a folder, whatever it is called by.
pub(crate) fn folder_name(folder: &Path) -> String {
    let canonical = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    canonical.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// `data/index.js`.
#[derive(Serialize)]
pub(crate) struct Index {
    pub(crate) form: u32,
    pub(crate) data_set: DataSetEntry,
    pub(crate) areas: Vec<Value>,
    pub(crate) classes: Vec<ClassEntry>,
    /// By index, the null label first.
    pub(crate) labels: Vec<LabelEntry>,
    pub(crate) rooms: Vec<RoomEntry>,
    pub(crate) locations: Vec<LocationEntry>,
    pub(crate) views: Vec<ViewEntry>,
    pub(crate) meshes: Vec<MeshEntry>,
    /// The name of the other data set's folder, if there is `compare.js`.
    pub(crate) against: Option<String>,
    /// How many pictures a file `data/views_N.js` has, and a file `data/thumbs_N.js`.
    pub(crate) views_per_file: usize,
    pub(crate) thumbs_per_file: usize,
    /// `statistics.json`.
    pub(crate) statistics: Option<Value>,
    /// `votes.json` of each area that has one.
    pub(crate) votes: Vec<AreaVotes>,
    /// Pixels of all panoramas and views together by class, and those without a label; full-size images.
    pub(crate) pixels_by_class: Vec<u64>,
    /// Of all meshes, by class.
    pub(crate) surface_by_class: Vec<Surface>,
    pub(crate) pixels_unlabelled: u64,
    pub(crate) faults: Vec<Fault>,
    /// What `verify` found, if it was asked.
    pub(crate) verified: Option<Verified>,
}

/// What `verify` found.
#[derive(Serialize)]
pub(crate) struct Verified {
    files: u64,
    checks: u64,
    /// What was left out, and why, a sentence each.
    notes: Vec<String>,
    faults: Vec<VerifyFaults>,
}

/// Faults of one kind.
#[derive(Serialize)]
struct VerifyFaults {
    topic: &'static str,
    kind: &'static str,
    count: u64,
    /// Those that are named: a file, from the data set's folder, and what is wrong with it.
    first: Vec<(String, String)>,
}

impl From<VerifyReport> for Verified {
    fn from(found: VerifyReport) -> Self {
        let VerifyReport { faults, mut notes, files, checks, unread, .. } = found;
        notes.extend(unread);
        let group = |FaultGroup { topic, kind, first, count, .. }| VerifyFaults { topic, kind, count, first };
        Self { files, checks, notes, faults: faults.into_iter().map(group).collect() }
    }
}

#[derive(Serialize)]
pub(crate) struct DataSetEntry {
    /// That of its folder.
    pub(crate) name: String,
    /// What is not there yet, a sentence each, if the export did not finish.
    pub(crate) missing_yet: Option<Vec<String>>,
    pub(crate) version: String,
    pub(crate) seed: u64,
    pub(crate) files: u64,
    pub(crate) bytes: u64,
    /// Nothing if there are no labels.
    pub(crate) taxonomy: Option<String>,
    pub(crate) depth_units_per_m: f64,
    pub(crate) options: Value,
}

#[derive(Serialize)]
pub(crate) struct ClassEntry {
    pub(crate) name: &'static str,
    pub(crate) color: [u8; 3],
}

#[derive(Serialize)]
pub(crate) struct LabelEntry {
    pub(crate) name: String,
    /// A place in `classes`; nothing for the null label.
    pub(crate) class: Option<usize>,
    /// That of `semantic_pretty`.
    pub(crate) color: [u8; 3],
}

#[derive(Serialize)]
pub(crate) struct RoomEntry {
    pub(crate) area: u32,
    pub(crate) name: String,
    pub(crate) floor_m2: f64,
    /// World z from the lowest to the highest of its instances, metres.
    pub(crate) heights: Option<[f64; 2]>,
    /// Rings of world x and y, metres, rounded to millimetres: outer ones and holes, to be filled by the
    /// even-odd rule.
    pub(crate) outline: Vec<Vec<[f64; 2]>>,
}

#[derive(Default, Serialize)]
pub(crate) struct LocationEntry {
    pub(crate) area: u32,
    pub(crate) uuid: String,
    pub(crate) room: String,
    /// World, metres; nothing without poses.
    pub(crate) position: Option<[f64; 3]>,
    /// Where the panorama's centre column looks: radians from +X towards +Y.
    pub(crate) azimuth_rad: Option<f64>,
    /// Whether there is a file `data/pano_N.js`, N being the location's place in the list.
    pub(crate) pano: bool,
    pub(crate) seen: Option<Shares>,
}

#[derive(Default, Serialize)]
pub(crate) struct ViewEntry {
    pub(crate) area: u32,
    /// A place in `locations`; nothing for photographs.
    pub(crate) location: Option<usize>,
    pub(crate) room: String,
    /// The name of the photograph that it is the view of.
    pub(crate) photograph: Option<String>,
    /// Its number in names of files; nothing if it was dropped.
    pub(crate) frame: Option<u32>,
    /// Its number among the candidates of its location.
    pub(crate) candidate: Option<u32>,
    /// Its place among the pictures: picture N is in `data/views_{N / views_per_file}.js`; likewise thumbs.
    pub(crate) picture: Option<usize>,
    /// To the left of the location's camera, above its horizon, and the horizontal angle of view.
    pub(crate) yaw_deg: Option<f64>,
    pub(crate) pitch_deg: Option<f64>,
    pub(crate) fov_deg: Option<f64>,
    /// What it was selected by, nats.
    pub(crate) entropy: Option<f64>,
    pub(crate) place: Option<Place>,
    /// Where its camera stands; only for photographs, since others stand at their location.
    pub(crate) position: Option<[f64; 3]>,
    /// Of photographs, directions in the world.
    pub(crate) forward: Option<[f64; 3]>,
    pub(crate) up: Option<[f64; 3]>,
    pub(crate) seen: Option<Shares>,
}

/// The mesh of an area, and the files it is in.
#[derive(Clone, Serialize)]
pub(crate) struct MeshEntry {
    pub(crate) area: u32,
    /// Of the data set's mesh.
    pub(crate) faces: usize,
    /// In the report.
    pub(crate) shown: usize,
    /// Edge of the cells whose vertices were merged, metres; nothing if all faces are shown.
    pub(crate) cell_m: Option<f64>,
    /// World box, metres.
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
    /// How many files `data/mesh_AREA_K.js`, and `data/textures_AREA_K.js`.
    pub(crate) files: usize,
    pub(crate) texture_files: usize,
    /// Whether there is a file `data/faces_AREA.js`, and `data/boxes_AREA.js`.
    pub(crate) has_votes: bool,
    pub(crate) has_boxes: bool,
    /// Nothing without votes.
    pub(crate) spread: Option<VoteSpread>,
    pub(crate) materials: Vec<MaterialEntry>,
}

#[derive(Clone, Serialize)]
pub(crate) struct MaterialEntry {
    /// Where there is neither a texture nor colours of vertices.
    pub(crate) color: [u8; 3],
    pub(crate) texture: Option<u32>,
}

/// How the votes of an area's faces are spread, by `votes.npz`.
#[derive(Clone, Default, Serialize)]
pub(crate) struct VoteSpread {
    /// Faces by all of their votes: 0, 1, 2, 3 to 4, 5 to 8 and so on, up to the most of a face.
    pub(crate) votes: Vec<Surface>,
    /// Faces with votes, by margin in ten parts.
    pub(crate) margin: [Surface; 10],
}

/// So many faces, and their area.
#[derive(Clone, Copy, Default, Serialize)]
pub(crate) struct Surface {
    pub(crate) faces: u64,
    pub(crate) m2: f64,
}

impl Surface {
    /// Counts a face of this area.
    pub(crate) fn add(&mut self, m2: f64) {
        self.faces += 1;
        self.m2 += m2;
    }
}

#[derive(Serialize)]
pub(crate) struct AreaVotes {
    pub(crate) area: u32,
    pub(crate) votes: Value,
}

/// A number with so many places behind the point.
pub(crate) fn rounded(value: f64, places: i32) -> f64 {
    let scale = 10f64.powi(places);
    // Adding 0 turns −0 into 0.
    (value * scale).round() / scale + 0.0
}

/// An angle in degrees, to a hundredth.
pub(crate) fn degrees(radians: f64) -> f64 {
    rounded(radians.to_degrees(), 2)
}
