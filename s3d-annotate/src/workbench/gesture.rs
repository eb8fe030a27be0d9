//! What a hand does on the page: gestures, in the words of the patches that it points at.

use crate::labelling::{FaceRuns, Room};
use s3d_geom::glam::Vec3;
use serde::{Deserialize, Serialize};

/// What a person does in one go.
///
/// A gesture names patches. The [`Workbench`](super::Workbench) makes an [`Action`](crate::labelling::Action)
/// of it, which names faces.
///
/// ```
/// use s3d_annotate::workbench::{Gesture, Patch, Selection};
///
/// let what = Selection { patches: vec![Patch { face: 7, node: 2 }], ..Selection::default() };
/// let gesture = Gesture::Label { what, class: "chair".into() };
/// let text = r#"{"label":{"what":{"patches":[{"face":7,"node":2}],"faces":[]},"class":"chair"}}"#;
/// assert_eq!(serde_json::to_string(&gesture)?, text);
/// assert_eq!(serde_json::from_str::<Gesture>(text)?, gesture);
/// assert_eq!(serde_json::from_str::<Gesture>(r#""undo""#)?, Gesture::Undo);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Gesture {
    /// Makes a new instance.
    Label {
        /// What it is made of.
        what: Selection,
        /// Its class.
        class: String,
    },
    /// Makes a new instance of each patch.
    LabelEach {
        /// The patches. Of two that overlap, the first has the faces.
        patches: Vec<Patch>,
        /// The class of them all.
        class: String,
    },
    /// Adds to an instance.
    Add {
        /// What is added.
        what: Selection,
        /// The instance.
        instance: u32,
    },
    /// Takes labels away.
    Erase {
        /// From what.
        what: Selection,
    },
    /// Makes a new instance of a part of a patch.
    Cut {
        /// The patch.
        at: Patch,
        /// Which part.
        by: Knife,
        /// The class of the new instance. `None`: the class of the patch, which needs to have one.
        class: Option<String>,
    },
    /// Joins instances.
    Join {
        /// The one that stays.
        into: u32,
        /// The others.
        instances: Vec<u32>,
    },
    /// Changes the class of an instance.
    Class {
        /// The instance.
        instance: u32,
        /// The new class.
        class: String,
    },
    /// Accepts proposals, as one step. Of the surfaces, only faces without a label are taken.
    Accept {
        /// Which surfaces, by their places in [`Proposals::surfaces`](super::Proposals::surfaces).
        #[serde(default)]
        surfaces: Vec<u32>,
        /// Which rooms, by their places in [`Proposals::rooms`](super::Proposals::rooms).
        #[serde(default)]
        rooms: Vec<u32>,
    },
    /// Makes a room, or changes all of one.
    Room {
        /// Which one; `None` for a new one.
        room: Option<u32>,
        /// What it is then.
        is: Room,
    },
    /// Cuts a room along a line of the plan.
    SplitRoom {
        /// The room.
        room: u32,
        /// Two points of the line: x and y, metres.
        line: [[f64; 2]; 2],
    },
    /// Joins rooms.
    JoinRooms {
        /// The one that stays.
        into: u32,
        /// The others.
        rooms: Vec<u32>,
    },
    /// Removes a room.
    RemoveRoom {
        /// The room.
        room: u32,
    },
    /// Takes back the last action in effect.
    Undo,
    /// Brings back what the last undo took back.
    Redo,
}

/// A patch of the surface: the faces of a node of the tree of segments that have the same instance as one
/// face of them, or, like it, none. What was labelled or cut is a patch of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Patch {
    /// The face that the pointer is on. Its segment is in the node.
    pub face: u32,
    /// The node of the tree.
    pub node: u32,
}

/// What a stroke has touched: patches and single faces together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// Patches.
    #[serde(default)]
    pub patches: Vec<Patch>,
    /// Faces, such as those that a brush has seen.
    #[serde(default)]
    pub faces: FaceRuns,
}

/// How a part is cut out of a patch. Points are in world metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Knife {
    /// A line that is drawn on the screen. The plane through it and the eye cuts. What lies on the right of
    /// the line, seen from the eye along it, is cut off.
    Line {
        /// The eye.
        eye: Vec3,
        /// Where the line begins.
        from: Vec3,
        /// Where it ends.
        to: Vec3,
    },
    /// A quadrilateral on the surface, which need not be quite plane. Faces whose middles are above or below
    /// it, within 15 cm, are cut out.
    Box {
        /// Its corners, in either direction.
        corners: [Vec3; 4],
    },
    /// The colour of the face that the pointer is on. Faces of the patch that hang together with it and have
    /// about its colour are cut out.
    Color {
        /// The largest distance in Oklab; black and white are 1 apart.
        tolerance: f32,
    },
    /// A brush: these faces of the patch are cut out.
    Faces(FaceRuns),
}
