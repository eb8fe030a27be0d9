//! The names of an area's annotated instances.

use s3d_label::{Label, Room};
use serde::{Deserialize, Serialize};

/// The annotated instances of a room, without their points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RoomNames {
    pub(crate) room: Room,
    pub(crate) instances: Vec<InstanceName>,
}

/// The names of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct InstanceName {
    /// Its label in the data set.
    pub(crate) label: Label,
    /// Its number in its room, among the instances of its class.
    pub(crate) number_in_room: u32,
}
