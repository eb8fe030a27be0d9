//! What the page is told, as JSON.

use crate::labelling::{FaceRuns, Room};
use serde::{Deserialize, Serialize};

/// What does not change while the server runs.
#[derive(Serialize)]
pub(super) struct SceneOf<'a> {
    pub(super) name: &'a str,
    pub(super) folder: String,
    pub(super) version: &'static str,
    pub(super) faces: usize,
    pub(super) vertices: usize,
    pub(super) origin: [f64; 3],
    #[serde(rename = "box")]
    pub(super) bounds: [[f32; 3]; 2],
    pub(super) classes: Vec<&'a str>,
    pub(super) room_types: Vec<&'a str>,
    pub(super) has_colors: bool,
    pub(super) materials: Vec<MaterialOf>,
    pub(super) textures: usize,
    pub(super) nodes: u32,
    pub(super) segments: u32,
    pub(super) photographs: Vec<PhotographOf>,
    pub(super) warnings: &'a [String],
}

#[derive(Serialize)]
pub(super) struct MaterialOf {
    pub(super) color: [u8; 3],
    pub(super) texture: Option<u32>,
}

#[derive(Serialize)]
pub(super) struct PhotographOf {
    pub(super) name: String,
    pub(super) at: [f64; 3],
    pub(super) kind: &'static str,
}

/// The labels of a moment.
#[derive(Serialize)]
pub(super) struct StateOf {
    pub(super) revision: u64,
    pub(super) instances: Vec<InstanceOf>,
    pub(super) rooms: Vec<RoomOf>,
    pub(super) labelled_m2: f64,
    pub(super) total_m2: f64,
    /// Both are 0 until the pixels are counted.
    pub(super) labelled_pixels: u64,
    pub(super) total_pixels: u64,
    pub(super) can_undo: bool,
    pub(super) can_redo: bool,
    pub(super) is_structure_found: bool,
}

#[derive(Serialize)]
pub(super) struct InstanceOf {
    pub(super) number: u32,
    /// `None` without faces.
    pub(super) name: Option<String>,
    pub(super) class: String,
    pub(super) faces: u32,
    pub(super) area_m2: f64,
}

#[derive(Serialize)]
pub(super) struct RoomOf {
    pub(super) number: u32,
    /// `None` without a type.
    pub(super) name: Option<String>,
    pub(super) is: Room,
}

/// What is proposed. The number of a surface for [`Gesture::Accept`](crate::workbench::Gesture::Accept) is its
/// place here.
#[derive(Serialize)]
pub(super) struct ProposalsOf {
    pub(super) surfaces: Vec<SurfaceOf>,
    pub(super) rooms: Vec<Room>,
}

#[derive(Serialize)]
pub(super) struct SurfaceOf {
    pub(super) class: String,
    pub(super) faces: FaceRuns,
    pub(super) room: Option<u32>,
    pub(super) area_m2: f64,
    pub(super) source: String,
}

/// What has become of a gesture.
#[derive(Serialize)]
pub(super) struct DoneOf {
    pub(super) state: StateOf,
    /// The faces with another instance, by this instance.
    pub(super) changed: Vec<(u32, FaceRuns)>,
}

/// A wish of the page: a gesture, made from this revision.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wish {
    pub(super) revision: u64,
    pub(super) gesture: crate::workbench::Gesture,
}

/// A wish of the page: the faces that a cut would take.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CutWish {
    pub(super) at: crate::workbench::Patch,
    pub(super) by: crate::workbench::Knife,
}

/// A wish of the page: the labels for another program.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WriteWish {
    pub(super) format: crate::outputs::OutputFormat,
}

/// Why a request is refused.
#[derive(Serialize)]
pub(super) struct RefusalOf {
    pub(super) error: String,
    /// The revision of the labels, for a wish that was made from another one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) revision: Option<u64>,
}
