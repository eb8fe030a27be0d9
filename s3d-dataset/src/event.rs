//! The events that an observer receives while a call runs.

pub use crate::stage::Stage;

use crate::summary::{Summary, UnitTally};
use serde::Serialize;
use std::fmt;

/// An event during a call.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Event<'a> {
    /// A sentence for a person.
    #[serde(skip)]
    Message {
        /// The level of importance.
        level: MessageLevel,
        /// The sentence, in English.
        text: &'a str,
    },
    /// A task begins: long work of a known size.
    #[serde(skip)]
    TaskStarted {
        /// The task.
        task: Task,
    },
    /// More of a task is done.
    #[serde(skip)]
    TaskAdvanced {
        /// The task.
        task: Task,
        /// The units done so far. Threads may report out of order.
        done: u64,
    },
    /// A task has ended, done or not.
    #[serde(skip)]
    TaskEnded {
        /// The task.
        task: Task,
    },
    /// A unit of work is done and on the disk. A later run does not repeat it.
    UnitFinished {
        /// Its kind.
        unit: UnitKind,
        /// The number of its area.
        area: u32,
        /// The camera's uuid, if the unit is a scan location.
        #[serde(skip_serializing_if = "Option::is_none")]
        location: Option<&'a str>,
        /// What the unit wrote.
        #[serde(flatten)]
        tally: &'a UnitTally,
        /// The time it took, seconds.
        seconds: f64,
    },
    /// Units of an earlier run were checked and found whole.
    UnitsTaken {
        /// The number of units.
        units: u64,
        /// What they had written.
        #[serde(flatten)]
        tally: &'a UnitTally,
        /// The time of the check, seconds.
        seconds: f64,
    },
    /// A stage of a call begins.
    #[serde(skip)]
    StageStarted {
        /// The stage.
        stage: Stage,
        /// The area in this stage. `None` if all areas go through it together.
        area: Option<u32>,
    },
    /// A stage of a call is done. It comes once for each area if areas go through it one by one.
    StageFinished {
        /// The stage.
        stage: Stage,
        /// The area in this stage. `None` if all areas went through it together.
        area: Option<u32>,
        /// The time it took, seconds.
        seconds: f64,
    },
    /// An export is complete, with this summary.
    Summary(&'a Summary),
}

/// A piece of long work of a known size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Task {
    /// A number that tells tasks apart. It is unique within a process.
    pub id: u64,
    /// The action, such as "rendering".
    pub what: &'static str,
    /// What it is done to, such as "images".
    pub unit: &'static str,
    /// The number of units.
    pub total: u64,
}

/// How important a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageLevel {
    /// Something may be wrong with the input or the result.
    Warning,
    /// Something a person wants to know.
    Info,
    /// Details.
    Debug,
}

/// A kind of unit of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum UnitKind {
    /// The labels of an area: instances, rooms, votes.
    Labels,
    /// All images of a scan location.
    Location,
    /// The view of a photograph.
    Photograph,
    /// The meshes and points of an area.
    #[serde(rename = "rest")]
    Assets,
}

impl fmt::Display for UnitKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Labels => "labels",
            Self::Location => "location",
            Self::Photograph => "photograph",
            Self::Assets => "rest",
        })
    }
}
