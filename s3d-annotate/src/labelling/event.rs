//! What the log of a labelling has in its lines.

use super::face_runs::FaceRuns;
use serde::{Deserialize, Serialize};

/// The version of the events that this crate writes, and the last one that it reads.
pub const EVENT_VERSION: u32 = 1;

/// A line of the log. Its fields are one JSON object: `v`, `n`, `at_ms` if it is there, and `do`.
///
/// ```
/// use s3d_annotate::labelling::{Action, Event, FaceRuns};
///
/// let faces = FaceRuns::of_range(0..100_000);
/// let wall = Action::Paint { faces, instance: 1, class: Some("wall".into()) };
/// let event = Event { version: 1, number: 1, at_ms: None, action: wall };
/// let line = r#"{"v":1,"n":1,"do":{"paint":{"faces":[0,100000],"instance":1,"class":"wall"}}}"#;
/// assert_eq!(serde_json::to_string(&event)?, line);
/// assert_eq!(serde_json::from_str::<Event>(line)?, event);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    /// The version of its form: see [`EVENT_VERSION`].
    #[serde(rename = "v")]
    pub version: u32,
    /// Its number in the log, from 1, without gaps. The number of the last event is the revision of the
    /// state.
    #[serde(rename = "n")]
    pub number: u64,
    /// When it happened, in milliseconds since 1970-01-01 UTC, if the caller told. Nothing depends on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_ms: Option<u64>,
    /// What happened.
    #[serde(rename = "do")]
    pub action: Action,
}

/// A change of the labels.
///
/// Instances and rooms have numbers from 1, which are permanent: a number is never given twice, also after
/// an undo, and a redo brings back the same one. A new number is above all earlier ones
/// ([`State::next_instance`](super::State::next_instance),
/// [`State::next_room`](super::State::next_room)). Classes and types of rooms are words, so a log can be read
/// whatever the taxonomy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Action {
    /// Gives faces to an instance, whatever they belonged to.
    Paint {
        /// The faces, at least one.
        faces: FaceRuns,
        /// The number of the instance.
        instance: u32,
        /// The class if the instance is new; `None` if it exists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        class: Option<String>,
    },
    /// Takes faces from their instances. Faces without one stay as they are.
    Erase {
        /// The faces, at least one.
        faces: FaceRuns,
    },
    /// Gives the faces of some instances to another one. The others are no more.
    Join {
        /// The instance that stays, with its class.
        into: u32,
        /// The others, at least one.
        instances: Vec<u32>,
    },
    /// Gives faces of an instance to a new one of the same class. Faces of other instances stay as they are.
    Cut {
        /// The instance, which keeps the rest. Some of its faces must be among `faces`, and not all.
        instance: u32,
        /// The faces.
        faces: FaceRuns,
        /// The number of the new instance.
        new: u32,
    },
    /// Changes the class of an instance.
    Class {
        /// The instance.
        instance: u32,
        /// The class.
        class: String,
    },
    /// Makes a room, or changes all of one. Faces that were painted for it stay with it.
    Room {
        /// The number of the room.
        room: u32,
        /// The room.
        is: Room,
    },
    /// Cuts a room along a line of the plan. What lies left of the line, seen from its first point to its
    /// second, stays; the right side is a new room of the same type. Painted faces stay with the first.
    SplitRoom {
        /// The room.
        room: u32,
        /// The number of the new room.
        new: u32,
        /// Two points of the line, which goes on beyond them: x and y, metres.
        line: [[f64; 2]; 2],
    },
    /// Gives the parts and the painted faces of some rooms to another one. The others are no more.
    JoinRooms {
        /// The room that stays, with its type and name.
        into: u32,
        /// The others, at least one.
        rooms: Vec<u32>,
    },
    /// Removes a room. The faces that were painted for it are so no longer.
    RemoveRoom {
        /// The room.
        room: u32,
    },
    /// Says that faces belong to a room, whatever the outlines say.
    PaintRoom {
        /// The faces, at least one.
        faces: FaceRuns,
        /// The room. `None`: the outlines count again.
        room: Option<u32>,
    },
    /// Does several actions as one, so that one undo takes them back: new instances ([`Action::Paint`] with a
    /// class), and new rooms ([`Action::Room`]). Others are refused.
    All {
        /// The actions, in their order, at least one.
        actions: Vec<Action>,
    },
    /// Takes back the last action that is in effect.
    Undo {
        /// The number of the event of this action.
        of: u64,
    },
    /// Brings back what the last undo took back. Any other action ends this possibility, but not the events
    /// in the log.
    Redo {
        /// The number of the event of the action.
        of: u64,
    },
}

/// A room: its type, its name, and where it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Room {
    /// The type, such as `office`. `None` if nobody has said it yet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// A name for people, such as `kitchen of the caretaker`. Only `rooms.json` has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Where it is: all of these together. None for a room of painted faces alone.
    #[serde(default)]
    pub parts: Vec<RoomPart>,
}

/// A part of a room: what is above a polygon, within a range of heights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoomPart {
    /// The corners of the polygon: x and y in world metres, in either direction, at least three.
    pub outline: Vec<[f64; 2]>,
    /// The lowest and the highest z, world metres.
    pub heights: [f64; 2],
}
