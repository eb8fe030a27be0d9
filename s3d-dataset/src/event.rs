//! What an observer is told while a call runs.

use crate::stage::Stage;
use crate::summary::{Summary, UnitTally};
use serde::Serialize;
use std::fmt;

/// One thing that happened.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Event<'a> {
    /// A sentence for a person.
    #[serde(skip)]
    Message {
        /// How much it matters.
        level: Level,
        /// The sentence, in English.
        text: &'a str,
    },
    /// Long work whose end can be foreseen begins.
    #[serde(skip)]
    TaskStarted {
        /// What it is.
        task: Task,
    },
    /// More of it is done.
    #[serde(skip)]
    TaskAdvanced {
        /// What it is.
        task: Task,
        /// Units done so far. Threads may tell out of order.
        done: u64,
    },
    /// It has ended, done or not.
    #[serde(skip)]
    TaskEnded {
        /// What it is.
        task: Task,
    },
    /// A unit of work is done and on the disk: what is done again if everything stops now is the rest.
    UnitFinished {
        /// Its kind.
        unit: UnitKind,
        /// The number of its area.
        area: u32,
        /// The camera's uuid, if the unit is a scan location.
        #[serde(skip_serializing_if = "Option::is_none")]
        location: Option<&'a str>,
        /// What it wrote.
        #[serde(flatten)]
        tally: &'a UnitTally,
        /// How long it took.
        seconds: f64,
    },
    /// Units that an earlier run finished were found to be whole.
    UnitsTaken {
        /// How many.
        units: u64,
        /// What they had written.
        #[serde(flatten)]
        tally: &'a UnitTally,
        /// How long the check took.
        seconds: f64,
    },
    /// A stage of a call begins.
    #[serde(skip)]
    StageStarted {
        /// Which.
        stage: Stage,
        /// The area that goes through it; `None` if all do together.
        area: Option<u32>,
    },
    /// A stage of a call is done. A stage that several areas go through comes once for each.
    StageFinished {
        /// Which.
        stage: Stage,
        /// The area that went through it; `None` if all did together.
        area: Option<u32>,
        /// How long it took.
        seconds: f64,
    },
    /// What an export has made.
    Summary(&'a Summary),
}

/// A piece of long work whose end can be foreseen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Task {
    /// Tells apart what is under way at the same time; never the same twice in a process.
    pub id: u64,
    /// What is done: "rendering".
    pub what: &'static str,
    /// To what: "images".
    pub unit: &'static str,
    /// How many units there are.
    pub total: u64,
}

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Something may be wrong with the input or the result.
    Warning,
    /// What a person wants to know.
    Info,
    /// Details.
    Debug,
}

/// A kind of a unit of work.
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
