//! The index of a report: everything but the images. [`crate::files`] describes it, and `web/src/data.ts`
//! reads it.

use crate::faults::Fault;
use crate::pixels::Shares;
use crate::selection::PoolPlace;
use s3d_dataset::verify::{FaultGroup, VerifyReport};
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// The version of the files of a report. It grows by one when an older page could not read them.
pub(crate) const FORM: u32 = 2;

/// Returns the name of a folder, whatever path leads to it.
pub(crate) fn folder_name(folder: &Path) -> String {
    let canonical = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    canonical.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The place where a report shows an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Shown {
    /// The panorama of the location with this index.
    #[serde(rename = "pano")]
    Panorama(usize),
    /// The picture with this number.
    Picture(usize),
}

impl Shown {
    /// Returns the index of the location, or the number of the picture.
    pub(crate) fn number(self) -> usize {
        match self {
            Self::Panorama(number) | Self::Picture(number) => number,
        }
    }
}

/// `data/index.js`.
#[derive(Serialize)]
pub(crate) struct Index {
    pub(crate) form: u32,
    pub(crate) data_set: DataSetEntry,
    pub(crate) areas: Vec<Value>,
    pub(crate) classes: Vec<ClassEntry>,
    /// The labels by index, the null label first.
    pub(crate) labels: Vec<LabelEntry>,
    pub(crate) rooms: Vec<RoomEntry>,
    pub(crate) locations: Vec<LocationEntry>,
    pub(crate) views: Vec<ViewEntry>,
    pub(crate) meshes: Vec<MeshEntry>,
    /// The grounds of plans, each with a file `data/ground_N.js`, where N is its index.
    pub(crate) grounds: Vec<GroundEntry>,
    /// The areas with pairs of images: those with a file `data/graph_A.js`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) pairs: Vec<u32>,
    /// The number of files `data/scores_N.js`.
    pub(crate) scores: usize,
    /// The name of the folder of the other data set, if there is `compare.js`.
    pub(crate) against: Option<String>,
    /// The number of pictures in a file `data/views_N.js`.
    pub(crate) views_per_file: usize,
    /// The number of pictures in a file `data/thumbs_N.js`.
    pub(crate) thumbs_per_file: usize,
    /// `statistics.json`.
    pub(crate) statistics: Option<Value>,
    /// `votes.json` of each area that has one.
    pub(crate) votes: Vec<AreaVotes>,
    /// The pixels of all panoramas and views together by class, at full size.
    pub(crate) pixels_by_class: Vec<u64>,
    /// The surface of all meshes by class.
    pub(crate) surface_by_class: Vec<Surface>,
    /// The pixels of all panoramas and views without a label.
    pub(crate) pixels_unlabelled: u64,
    pub(crate) faults: Vec<Fault>,
    /// The result of `verify`, if it was asked for.
    pub(crate) verified: Option<Verified>,
}

/// The result of `verify`.
#[derive(Serialize)]
pub(crate) struct Verified {
    files: u64,
    checks: u64,
    /// Sentences on checks that were left out, and why.
    notes: Vec<String>,
    faults: Vec<VerifyFaults>,
}

/// Faults of one kind.
#[derive(Serialize)]
struct VerifyFaults {
    topic: &'static str,
    kind: &'static str,
    count: u64,
    /// The faults that are named: a file below the folder of the data set, and what is wrong with it.
    first: Vec<(String, String)>,
}

impl From<VerifyReport> for Verified {
    fn from(found: VerifyReport) -> Self {
        let VerifyReport { faults, mut notes, files, checks, unread, .. } = found;
        notes.extend(unread);
        Self {
            files,
            checks,
            notes,
            faults: faults
                .into_iter()
                .map(|FaultGroup { topic, kind, first, count, .. }| VerifyFaults {
                    topic,
                    kind,
                    count,
                    first,
                })
                .collect(),
        }
    }
}

#[derive(Serialize)]
pub(crate) struct DataSetEntry {
    /// The name of its folder.
    pub(crate) name: String,
    /// Sentences on missing parts, if the export did not finish.
    pub(crate) missing_yet: Option<Vec<String>>,
    pub(crate) version: String,
    pub(crate) seed: u64,
    pub(crate) files: u64,
    pub(crate) bytes: u64,
    /// `None` without labels.
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
    /// An index of `classes`; `None` for the null label.
    pub(crate) class: Option<usize>,
    /// The colour in `semantic_pretty`.
    pub(crate) color: [u8; 3],
}

#[derive(Clone, Serialize)]
pub(crate) struct RoomEntry {
    pub(crate) area: u32,
    pub(crate) name: String,
    pub(crate) floor_m2: f64,
    /// The height of its floor in the world, in metres: the middle of the box of the floor with the most
    /// points.
    pub(crate) floor: Option<f64>,
    /// The lowest and the highest z of its instances in the world, in metres.
    pub(crate) heights: Option<[f64; 2]>,
    /// Rings of x and y in the world, in metres, rounded to millimetres: outer rings and holes, to fill by
    /// the even-odd rule.
    pub(crate) outline: Vec<Vec<[f64; 2]>>,
}

#[derive(Default, Serialize)]
pub(crate) struct LocationEntry {
    pub(crate) area: u32,
    pub(crate) uuid: String,
    pub(crate) room: String,
    /// Its place in the world, in metres; `None` without poses.
    pub(crate) position: Option<[f64; 3]>,
    /// The direction of the centre column of the panorama: radians from +X towards +Y.
    pub(crate) azimuth_rad: Option<f64>,
    /// Whether there is a file `data/pano_N.js`, where N is the index of the location.
    pub(crate) pano: bool,
    /// The direction in which the panorama is looked at first, in degrees to the right of its centre column.
    pub(crate) look_deg: Option<f64>,
    pub(crate) seen: Option<Shares>,
}

#[derive(Default, Serialize)]
pub(crate) struct ViewEntry {
    pub(crate) area: u32,
    /// An index of `locations`; `None` for photographs.
    pub(crate) location: Option<usize>,
    pub(crate) room: String,
    /// The name of its photograph.
    pub(crate) photograph: Option<String>,
    /// Its number in names of files; `None` if it was dropped.
    pub(crate) frame: Option<u32>,
    /// Its number among the candidates of its location.
    pub(crate) candidate: Option<u32>,
    /// The number N of its picture, which is in `data/views_{N / views_per_file}.js`, and likewise in thumbs.
    pub(crate) picture: Option<usize>,
    /// The angle to the left of the camera of the location.
    pub(crate) yaw_deg: Option<f64>,
    /// The angle above its horizon.
    pub(crate) pitch_deg: Option<f64>,
    /// The horizontal angle of view.
    pub(crate) fov_deg: Option<f64>,
    /// The entropy that decided about its selection, in nats.
    pub(crate) entropy: Option<f64>,
    pub(crate) place: Option<PoolPlace>,
    /// The place of its camera; only for photographs, since other views stand at their location.
    pub(crate) position: Option<[f64; 3]>,
    /// Its directions in the world; only for photographs.
    pub(crate) forward: Option<[f64; 3]>,
    pub(crate) up: Option<[f64; 3]>,
    pub(crate) seen: Option<Shares>,
    /// The number of its objects, which are in `data/objects_{N / views_per_file}.js` like its picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) objects: Option<usize>,
}

/// The mesh of an area, and its files.
#[derive(Clone, Serialize)]
pub(crate) struct MeshEntry {
    pub(crate) area: u32,
    /// The number of faces in the data set.
    pub(crate) faces: usize,
    /// The number of faces in the report.
    pub(crate) shown: usize,
    /// The width of the cells whose vertices were merged, in metres; `None` if all faces are shown.
    pub(crate) cell_m: Option<f64>,
    /// The least and the largest corner of its box in the world, in metres.
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
    /// The number of files `data/mesh_AREA_K.js`.
    pub(crate) files: usize,
    /// The number of files `data/textures_AREA_K.js`.
    pub(crate) texture_files: usize,
    /// Whether there is a file `data/faces_AREA.js`.
    pub(crate) has_votes: bool,
    /// Whether there is a file `data/boxes_AREA.js`.
    pub(crate) has_boxes: bool,
    /// `None` without votes.
    pub(crate) spread: Option<VoteSpread>,
    pub(crate) materials: Vec<MaterialEntry>,
}

#[derive(Clone, Serialize)]
pub(crate) struct MaterialEntry {
    /// The colour of faces without a texture and without colours of vertices.
    pub(crate) color: [u8; 3],
    pub(crate) texture: Option<u32>,
}

/// The ground of a plan: a storey from above.
#[derive(Clone, Serialize)]
pub(crate) struct GroundEntry {
    pub(crate) area: u32,
    /// The heights of the lowest and the highest floor of the storey in the world, in metres.
    pub(crate) floors: [f64; 2],
    /// The height above which all is cut away, in metres; `None` if nothing is.
    pub(crate) cut: Option<f64>,
    /// The least x and the greatest y in the world, in metres.
    pub(crate) west: f64,
    pub(crate) north: f64,
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
    /// The side of a pixel in metres.
    pub(crate) pixel_m: f64,
}

/// The distribution of the votes of the faces of an area, from `votes.npz`.
#[derive(Clone, Default, Serialize)]
pub(crate) struct VoteSpread {
    /// The faces by number of votes: 0, 1, 2, 3 to 4, 5 to 8 and so on, up to the most votes of a face.
    pub(crate) votes: Vec<Surface>,
    /// The faces with votes by margin, in ten parts.
    pub(crate) margin: [Surface; 10],
}

/// A number of faces, and their area.
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

/// Rounds a number to this number of decimal places.
pub(crate) fn rounded(value: f64, places: i32) -> f64 {
    let scale = 10f64.powi(places);
    // Adding 0 turns −0 into 0.
    (value * scale).round() / scale + 0.0
}

/// Converts an angle to degrees, rounded to a hundredth.
pub(crate) fn degrees(radians: f64) -> f64 {
    rounded(radians.to_degrees(), 2)
}
