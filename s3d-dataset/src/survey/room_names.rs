//! What the annotated instances of an area are called.

use s3d_label::{Label, Room};
use serde::{Deserialize, Serialize};

/// The annotated instances of a room, without their points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RoomNames {
    pub(crate) room: Room,
    pub(crate) instances: Vec<InstanceName>,
}

/// What an instance is called.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct InstanceName {
    /// In the data set.
    pub(crate) label: Label,
    /// In its room, among those of its class.
    pub(crate) number_in_room: u32,
}
