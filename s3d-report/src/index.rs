//! The index of a report: all but the images. `docs/report.md` describes it, and `web/src/data.ts` reads it.

use crate::faults::Fault;
use crate::pixels::Shares;
use crate::selection::Place;
use serde::Serialize;
use serde_json::Value;

/// The form of the files of a report. It grows by one when an older page could not read them.
pub(crate) const FORM: u32 = 1;

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
    /// How many pictures a file `data/views_N.js` has, and a file `data/thumbs_N.js`.
    pub(crate) views_per_file: usize,
    pub(crate) thumbs_per_file: usize,
    /// `statistics.json`.
    pub(crate) statistics: Option<Value>,
    /// `votes.json` of each area that has one.
    pub(crate) votes: Vec<AreaVotes>,
    /// Pixels of all panoramas and views together by class, and those without a label; full-size images.
    pub(crate) pixels_by_class: Vec<u64>,
    pub(crate) pixels_unlabelled: u64,
    pub(crate) faults: Vec<Fault>,
}

#[derive(Serialize)]
pub(crate) struct DataSetEntry {
    /// That of its folder.
    pub(crate) name: String,
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
    pub(crate) seen: Option<Shares>,
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
