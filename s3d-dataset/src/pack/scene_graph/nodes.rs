//! What a graph holds: its nodes, and what is between them.

use serde::Serialize;

/// The graph of an area.
#[derive(Debug, Serialize)]
pub(super) struct SceneGraph {
    pub(super) building: BuildingNode,
    pub(super) rooms: Vec<RoomNode>,
    pub(super) objects: Vec<ObjectNode>,
    pub(super) cameras: Vec<CameraNode>,
    pub(super) relations: Relations,
}

#[derive(Debug, Serialize)]
pub(super) struct BuildingNode {
    /// The name of the area's folder.
    pub(super) id: String,
    pub(super) floor_area_m2: f64,
    /// The sum of the rooms' volumes; null if the volume of a room is not known.
    pub(super) volume_m3: Option<f64>,
    pub(super) rooms: usize,
    pub(super) objects: usize,
    pub(super) cameras: usize,
}

#[derive(Debug, Serialize)]
pub(super) struct RoomNode {
    /// The name, such as "office_3".
    pub(super) id: String,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) floor_area_m2: f64,
    /// The height of the largest floor, world metres; null in a room without a floor.
    pub(super) floor_z: Option<f64>,
    /// The height of the largest ceiling, world metres; null in a room without a ceiling.
    pub(super) ceiling_z: Option<f64>,
    /// The area of the floor times the height; null if a height is not known.
    pub(super) volume_m3: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct ObjectNode {
    /// the label, such as "chair_3_office_1_1".
    pub(super) id: String,
    /// The index in `semantic_labels.json`.
    pub(super) label_index: u32,
    pub(super) class: String,
    /// The room: its parent.
    pub(super) room: String,
    /// The number of faces, and their area.
    pub(super) faces: u64,
    pub(super) surface_m2: f64,
    /// The smallest upright box around the faces. Null for an object without faces.
    pub(super) center: Option<[f64; 3]>,
    pub(super) size_m: Option<[f64; 3]>,
    pub(super) yaw_deg: Option<f64>,
    /// The volume of the box.
    pub(super) box_volume_m3: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct CameraNode {
    /// The stem of the image's files.
    pub(super) id: String,
    /// `view`, `panorama` or `photograph`.
    pub(super) kind: &'static str,
    /// The room of the scan location, or of the photograph.
    pub(super) room: String,
    pub(super) location: [f64; 3],
    /// World to camera, OpenCV's axes: three rows of a rotation.
    pub(super) rotation: [[f64; 3]; 3],
    /// The intrinsic matrix in pixels; null for panoramas.
    pub(super) k: Option<[[f64; 3]; 3]>,
    /// The horizontal field of view, degrees.
    pub(super) fov_deg: f64,
    /// The folders of this image's files.
    pub(super) modalities: Vec<String>,
    /// The objects that it sees, by label index. Null if it has neither objects nor a semantic image.
    pub(super) sees: Option<Vec<Seen>>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Seen {
    pub(super) object: String,
    pub(super) pixels: u64,
}

#[derive(Debug, Serialize)]
pub(super) struct Relations {
    /// Two rooms that doors join, and the doors. Null in a taxonomy without a class `door`.
    pub(super) adjacent_rooms: Option<Vec<AdjacentRooms>>,
    /// The objects of each room from the largest box to the smallest. They have the same parent.
    pub(super) largest_first: Vec<RoomOrder>,
    /// The objects of a camera in order; null without the modality `objects`.
    pub(super) orders: Option<Vec<CameraOrder>>,
    /// Objects that hide parts of others; null without the modality `objects`.
    pub(super) occlusions: Option<Vec<Occlusion>>,
}

#[derive(Debug, PartialEq, Serialize)]
pub(super) struct AdjacentRooms {
    pub(super) rooms: [String; 2],
    pub(super) doors: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct RoomOrder {
    pub(super) room: String,
    pub(super) objects: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct CameraOrder {
    pub(super) camera: String,
    /// By the median distance of the visible surface.
    pub(super) near_to_far: Vec<String>,
    /// By the middle of the visible box; null for panoramas, which have no left end.
    pub(super) left_to_right: Option<Vec<String>>,
}

#[derive(Debug, Serialize)]
pub(super) struct Occlusion {
    pub(super) camera: String,
    pub(super) hidden: String,
    pub(super) by: String,
    /// The pixels of `hidden` that `by` covers.
    pub(super) pixels: u64,
}
