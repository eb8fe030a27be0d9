//! Why an action does not fit a state.

use thiserror::Error;

/// Why an action does not fit a state. Nothing was changed.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// There is no such instance, or it was joined to another one.
    #[error("there is no instance {number}")]
    UnknownInstance {
        /// Its number.
        number: u32,
    },
    /// There is no such room, or it was removed or joined to another one.
    #[error("there is no room {number}")]
    UnknownRoom {
        /// Its number.
        number: u32,
    },
    /// A new instance has a number that was given before, or that is too large.
    #[error("a new instance cannot have the number {number}: the next one is {next}")]
    InstanceNumber {
        /// The number.
        number: u32,
        /// The next one that is free.
        next: u32,
    },
    /// A new room has a number that was given before, or that is too large.
    #[error("a new room cannot have the number {number}: the next one is {next}")]
    RoomNumber {
        /// The number.
        number: u32,
        /// The next one that is free.
        next: u32,
    },
    /// The mesh has no such face.
    #[error("there is no face {face}: the mesh has {count}, counted from 0")]
    NoSuchFace {
        /// The face.
        face: u32,
        /// The number of faces of the mesh.
        count: u32,
    },
    /// One of several actions makes nothing new.
    #[error("several actions at once make new instances and new rooms only")]
    NotNew,
    /// There is no such patch: the face is not in the segments of the node.
    #[error("there is no patch at face {face} in node {node} of the tree")]
    NoSuchPatch {
        /// The face.
        face: u32,
        /// The node of the tree of segments.
        node: u32,
    },
    /// A cut has no shape: its points are the same, lie on a line, or are not finite.
    #[error("the points of a cut make no plane: they are the same, on one line, or not finite")]
    CutShape,
    /// There is no such proposal.
    #[error("there is no proposal {number}: there are {count}, counted from 0")]
    NoSuchProposal {
        /// Its number.
        number: u32,
        /// How many there are.
        count: u32,
    },
    /// The action changes nothing. The words say why.
    #[error("nothing to do: {why}")]
    Nothing {
        /// A part of a sentence.
        why: &'static str,
    },
    /// A room has a part that is no polygon with heights.
    #[error(
        "a part of a room needs an outline of three corners or more, with an area, and heights from the \
         lower to the higher, all of them finite"
    )]
    RoomShape,
    /// A line to split a room has no direction.
    #[error("a line to split a room needs two different points, both finite")]
    Line,
    /// An undo or redo is about another event than the one whose turn it is.
    #[error("event {of} cannot be {what}: {turn}", turn = turn_of(*turn))]
    NotItsTurn {
        /// The event that was named.
        of: u64,
        /// `taken back` or `brought back`.
        what: &'static str,
        /// The event whose turn it is, if there is one.
        turn: Option<u64>,
    },
    /// An event has another number than the one after the last event.
    #[error("event {number} does not follow event {revision}")]
    Number {
        /// The number of the event.
        number: u64,
        /// The number of the last event.
        revision: u64,
    },
    /// An event has a version that this program does not know.
    #[error("its version is {version}, and this program reads up to {known}: a newer program wrote it",
        known = super::EVENT_VERSION)]
    Version {
        /// The version.
        version: u32,
    },
}

fn turn_of(turn: Option<u64>) -> String {
    turn.map_or_else(|| "no event can".to_owned(), |turn| format!("it is the turn of event {turn}"))
}
