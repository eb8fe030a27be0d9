//! What a program that watches a command is told: one JSON object a line, with `--log json`. Described for its readers in
//! docs/log.md; keys are added, never renamed.

use crate::console;
use crate::pipeline::summary::{Summary, UnitTally};
use serde::Serialize;
use std::fmt;
use tracing::debug;

/// One thing that happened.
#[derive(Debug, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub(crate) enum Event<'a> {
    /// The first: the command has begun.
    Started {
        version: &'a str,
        /// The command line.
        command: &'a [String],
    },
    /// What else is a log line.
    Log {
        /// `error`, `warning`, `info` or `debug`.
        level: &'a str,
        message: &'a str,
    },
    /// How far a piece of long work is.
    Progress {
        /// What is done: "rendering".
        what: &'a str,
        /// To what: "images".
        unit: &'a str,
        done: u64,
        total: u64,
        /// Units a second since it began.
        rate: f64,
        /// At that rate; null before the first is done.
        seconds_left: Option<f64>,
    },
    /// A unit of work is done and on the disk.
    UnitFinished {
        unit: UnitKind,
        area: u32,
        /// The camera's uuid, if the unit is a scan location.
        #[serde(skip_serializing_if = "Option::is_none")]
        location: Option<&'a str>,
        #[serde(flatten)]
        tally: &'a UnitTally,
        seconds: f64,
    },
    /// Units that an earlier run finished were found to be whole.
    UnitsTaken {
        units: u64,
        #[serde(flatten)]
        tally: &'a UnitTally,
        seconds: f64,
    },
    /// A stage of a command is done. A stage that several areas go through comes once for each.
    StageFinished { stage: Stage, area: Option<u32>, seconds: f64 },
    /// What an export has made.
    Summary(&'a Summary),
    /// The last: the command ends with this exit code.
    Finished { exit_code: u8 },
}

/// A kind of a unit of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum UnitKind {
    /// The labels of an area: instances, rooms, votes.
    Labels,
    /// All images of a scan location.
    Location,
    /// The meshes and points of an area.
    Rest,
}

/// A stage of an export. Meshes and points are written beside the images, by one of the threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Stage {
    Load,
    Label,
    Score,
    Render,
    Meshes,
    Points,
    /// Of shards: their files come into one folder.
    Merge,
    Tables,
}

impl Stage {
    /// Its name in the log.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Load => "load",
            Self::Label => "label",
            Self::Score => "score",
            Self::Render => "render",
            Self::Meshes => "meshes",
            Self::Points => "points",
            Self::Merge => "merge",
            Self::Tables => "tables",
        }
    }
}

impl fmt::Display for UnitKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Labels => "labels",
            Self::Location => "location",
            Self::Rest => "rest",
        })
    }
}

/// Tells of an event: as a line of JSON with `--log json`; else what a person wants to know of it is a log line.
pub(crate) fn emit(event: &Event<'_>) {
    if console::is_json() {
        console::write_json(event);
        return;
    }
    match event {
        Event::UnitFinished { unit, area, location, tally, seconds } => {
            let location = location.map_or_else(String::new, |l| format!(" {l}"));
            let UnitTally { files, bytes, .. } = tally;
            debug!("area {area}: {unit}{location} done: {files} files, {bytes} bytes ({seconds:.1} s)");
        }
        Event::UnitsTaken { units, tally, seconds } => {
            debug!("{units} units of an earlier run are whole: {} files ({seconds:.1} s)", tally.files);
        }
        Event::StageFinished { stage, area, seconds } => match area {
            Some(area) => debug!("area {area}: {} done ({seconds:.1} s)", stage.name()),
            None => debug!("{} done ({seconds:.1} s)", stage.name()),
        },
        Event::Summary(summary) => summary.log(),
        Event::Started { .. } | Event::Log { .. } | Event::Progress { .. } | Event::Finished { .. } => {}
    }
}
