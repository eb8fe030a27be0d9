//! The journal of an export: which units of work are done, and the files they wrote. A later run continues
//! from it.
//!
//! Every process appends to a file of its own in `.s3d/journal`, one line for each finished unit: JSON with a
//! checksum of the line. Nothing is synced. If a power loss removes a line or one of its files, or fills it
//! with zeros, the checksum no longer fits and the unit is done again.

use crate::context::Context;
use crate::error::Result;
use crate::record::listing::faults;
use crate::record::manifest::AreaEntry;
use crate::summary::UnitTally;
use s3d_io::Error as FileError;
use s3d_io::dataset::{FileRecord, Layout, PhotographRecord};
use s3d_io::fs::{Checksum, create_dir, read_file};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A unit of work.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Unit {
    /// The labels of an area: instances, rooms, votes.
    Labels(u32),
    /// The entropies of the candidate views of a scan location. Fields: area, uuid.
    Scores(u32, String),
    /// All images of a scan location. Fields: area, uuid.
    Location(u32, String),
    /// The view of a photograph. Fields: area, uuid of its camera.
    Photograph(u32, String),
    /// The meshes and points of an area.
    Assets(u32),
}

impl Unit {
    /// Returns the area that the unit belongs to.
    pub(crate) fn area(&self) -> u32 {
        match self {
            Self::Labels(area)
            | Self::Scores(area, _)
            | Self::Location(area, _)
            | Self::Photograph(area, _)
            | Self::Assets(area) => *area,
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Labels(area) => write!(f, "labels of area {area}"),
            Self::Scores(area, uuid) => write!(f, "scores of location {uuid} of area {area}"),
            Self::Location(area, uuid) => write!(f, "images of location {uuid} of area {area}"),
            Self::Photograph(area, uuid) => write!(f, "view of photograph {uuid} of area {area}"),
            Self::Assets(area) => write!(f, "meshes and points of area {area}"),
        }
    }
}

/// A finished unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "unit", rename_all = "snake_case")]
pub(crate) enum Done {
    Labels(LabelsDone),
    Scores(ScoresDone),
    Location(LocationDone),
    Photograph(PhotographDone),
    Assets(AssetsDone),
}

/// A labelled area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LabelsDone {
    /// The area's entry in the manifest, still without points, images and inputs.
    pub(crate) entry: Box<AreaEntry>,
    /// The uuids of the area's scan locations, in their order.
    pub(crate) locations: Vec<String>,
    /// The uuids of the cameras of the area's photographs, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) photographs: Vec<String>,
    pub(crate) files: Vec<FileRecord>,
}

/// A scan location with scored candidate views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ScoresDone {
    pub(crate) area: u32,
    pub(crate) location: String,
    /// The entropies by number of the candidate, nats.
    pub(crate) entropies: Vec<f64>,
}

/// A scan location with all its images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LocationDone {
    pub(crate) area: u32,
    pub(crate) location: String,
    pub(crate) tally: UnitTally,
    pub(crate) files: Vec<FileRecord>,
}

/// A photograph with its view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PhotographDone {
    pub(crate) area: u32,
    /// The photograph's entry in `frames.json`.
    pub(crate) record: PhotographRecord,
    pub(crate) tally: UnitTally,
    pub(crate) files: Vec<FileRecord>,
}

/// An area with its meshes and points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AssetsDone {
    pub(crate) area: u32,
    /// The number of sampled points.
    pub(crate) points: u64,
    pub(crate) files: Vec<FileRecord>,
}

impl Done {
    /// Returns which unit is done.
    pub(crate) fn unit(&self) -> Unit {
        match self {
            Self::Labels(done) => Unit::Labels(done.entry.area),
            Self::Scores(done) => Unit::Scores(done.area, done.location.clone()),
            Self::Location(done) => Unit::Location(done.area, done.location.clone()),
            Self::Photograph(done) => Unit::Photograph(done.area, done.record.camera_uuid.clone()),
            Self::Assets(done) => Unit::Assets(done.area),
        }
    }

    /// Returns the files that the unit wrote.
    pub(crate) fn files(&self) -> &[FileRecord] {
        match self {
            Self::Labels(done) => &done.files,
            Self::Scores(_) => &[],
            Self::Location(done) => &done.files,
            Self::Photograph(done) => &done.files,
            Self::Assets(done) => &done.files,
        }
    }

    /// Returns what the unit adds to the account.
    pub(crate) fn tally(&self) -> UnitTally {
        match self {
            Self::Location(done) => done.tally,
            Self::Photograph(done) => done.tally,
            _ => tally_of(self.files()),
        }
    }

    /// Returns the unit's line, with the line feed.
    fn to_line(&self) -> serde_json::Result<String> {
        let done = serde_json::to_string(self)?;
        Ok(format!("{BEFORE}{}{BETWEEN}{done}{AFTER}\n", Checksum::of(done.as_bytes())))
    }

    /// Reads a unit from its line, without the line feed. Returns `None` if the line is torn or altered, or
    /// its unit cannot be used.
    fn from_line(line: &[u8]) -> Option<Self> {
        let line = line.strip_prefix(BEFORE.as_bytes())?.strip_suffix(AFTER.as_bytes())?;
        let (sum, rest) = line.split_at_checked(32)?;
        let done = rest.strip_prefix(BETWEEN.as_bytes())?;
        let sum: Checksum = std::str::from_utf8(sum).ok()?.parse().ok()?;
        if Checksum::of(done) != sum {
            return None;
        }
        serde_json::from_slice(done).ok().filter(Self::is_sound)
    }

    /// Returns whether later steps can use the unit: entropies are finite and not negative, and no camera is
    /// there twice.
    fn is_sound(&self) -> bool {
        match self {
            Self::Scores(done) => done.entropies.iter().all(|e| e.is_finite() && *e >= 0.0),
            Self::Labels(done) => {
                let mut seen = BTreeSet::new();
                let mut cameras = done.locations.iter().chain(&done.photographs);
                cameras.all(|uuid| seen.insert(uuid))
            }
            Self::Location(_) | Self::Photograph(_) | Self::Assets(_) => true,
        }
    }
}

const BEFORE: &str = "{\"xxh3_128\":\"";
const BETWEEN: &str = "\",\"done\":";
const AFTER: &str = "}";

/// Counts files and their bytes, but no images.
pub(crate) fn tally_of(files: &[FileRecord]) -> UnitTally {
    let bytes = files.iter().map(|f| f.bytes).sum();
    UnitTally { files: files.len() as u64, bytes, ..UnitTally::default() }
}

/// The finished units of an export.
#[derive(Clone, Debug, Default)]
pub(crate) struct Finished {
    units: BTreeMap<Unit, Done>,
}

impl Finished {
    /// Adds a unit. A unit that was done twice wrote the same files both times.
    pub(crate) fn insert(&mut self, done: Done) {
        self.units.insert(done.unit(), done);
    }

    /// Returns whether a unit is done.
    pub(crate) fn has(&self, unit: &Unit) -> bool {
        self.units.contains_key(unit)
    }

    /// Returns the number of finished units.
    pub(crate) fn len(&self) -> usize {
        self.units.len()
    }

    /// Returns a unit, if it is done.
    pub(crate) fn get(&self, unit: &Unit) -> Option<&Done> {
        self.units.get(unit)
    }

    /// Iterates over all finished units, in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Done> {
        self.units.values()
    }

    /// Returns the labels of an area.
    pub(crate) fn labels(&self, area: u32) -> Option<&LabelsDone> {
        match self.units.get(&Unit::Labels(area)) {
            Some(Done::Labels(done)) => Some(done),
            _ => None,
        }
    }

    /// Returns the entropies of a location's candidates.
    pub(crate) fn scores(&self, area: u32, location: &str) -> Option<&[f64]> {
        match self.units.get(&Unit::Scores(area, location.to_owned())) {
            Some(Done::Scores(done)) => Some(&done.entropies),
            _ => None,
        }
    }

    /// Returns the meshes and points of an area.
    pub(crate) fn assets(&self, area: u32) -> Option<&AssetsDone> {
        match self.units.get(&Unit::Assets(area)) {
            Some(Done::Assets(done)) => Some(done),
            _ => None,
        }
    }

    /// Iterates over the finished locations of an area.
    pub(crate) fn locations(&self, area: u32) -> impl Iterator<Item = &LocationDone> {
        self.units.values().filter_map(move |done| match done {
            Done::Location(done) if done.area == area => Some(done),
            _ => None,
        })
    }

    /// Iterates over an area's photographs that have their views, in the order of the photographs.
    pub(crate) fn photographs(&self, area: u32) -> impl Iterator<Item = &PhotographDone> {
        let uuids = self.labels(area).map_or(&[][..], |labels| &labels.photographs);
        uuids
            .iter()
            .filter_map(move |uuid| match self.units.get(&Unit::Photograph(area, uuid.clone())) {
                Some(Done::Photograph(done)) => Some(done),
                _ => None,
            })
    }

    /// Returns the number of scan locations in the labelled ones of these areas.
    pub(crate) fn count_locations(&self, areas: &[u32]) -> usize {
        areas
            .iter()
            .filter_map(|area| self.labels(*area))
            .map(|labels| labels.locations.len())
            .sum()
    }

    /// Reads all journals of an export, without torn lines. The files are not checked yet.
    pub(crate) fn read(ctx: &Context, layout: &Layout) -> Result<Self> {
        let mut finished = Self::default();
        let mut torn = 0;
        for path in crate::record::listing::walk(&layout.journal_dir())? {
            let content = read_file(&path)?;
            for line in content.split(|b| *b == b'\n').filter(|line| !line.is_empty()) {
                match Done::from_line(line) {
                    Some(done) => finished.insert(done),
                    None => torn += 1,
                }
            }
        }
        if torn > 0 {
            ctx.debug(format_args!("{torn} lines of the journal are torn and left out"));
        }
        Ok(finished)
    }

    /// Reads the files of all units. Drops every unit with a missing or altered file, to be done again.
    pub(crate) fn checked(self, ctx: &Context, layout: &Layout) -> Result<Self> {
        self.checked_where(ctx, layout, |_| true)
    }

    /// Does the same for the units that fulfil `which`, and keeps all others.
    pub(crate) fn checked_where(
        mut self,
        ctx: &Context,
        layout: &Layout,
        which: impl Fn(&Unit) -> bool,
    ) -> Result<Self> {
        let mut units = Vec::new();
        let mut files = Vec::new();
        for (unit, done) in self.units.iter().filter(|(unit, _)| which(unit)) {
            for file in done.files() {
                units.push(unit.clone());
                files.push(file);
            }
        }

        let faults = faults(ctx, layout, &files)?;
        let mut again: BTreeSet<Unit> = BTreeSet::new();
        for (index, fault) in faults {
            let Some(unit) = units.get(index) else { continue };
            if again.insert(unit.clone()) {
                ctx.warn(format_args!(
                    "{}/{fault}; what it belongs to is made again",
                    layout.root().display()
                ));
            }
        }

        self.units.retain(|unit, _| !again.contains(unit));
        Ok(self)
    }
}

/// The journal of this process, with everything that it and earlier processes have finished.
#[derive(Debug)]
pub(crate) struct Journal {
    path: PathBuf,
    file: Mutex<File>,
    finished: Mutex<Finished>,
}

impl Journal {
    /// Begins a journal beside the existing ones, which hold the units in `finished`.
    pub(crate) fn begin(layout: &Layout, finished: Finished) -> Result<Self> {
        let dir = layout.journal_dir();
        create_dir(&dir)?;
        let failed = |e| FileError::io(&dir, "write in", e);
        // With `tempfile_in`, the error would lack the system's number.
        let named = tempfile::Builder::new()
            .prefix("")
            .suffix(".jsonl")
            .rand_bytes(12)
            .make_in(&dir, |path| File::options().write(true).create_new(true).open(path));
        let (file, path) = named.map_err(failed)?.keep().map_err(|e| failed(e.error))?;
        Ok(Self { path, file: Mutex::new(file), finished: Mutex::new(finished) })
    }

    /// Records that a unit is done. Its files must be in place under their names.
    pub(crate) fn write(&self, done: Done) -> Result<()> {
        let line = done
            .to_line()
            .map_err(|e| FileError::format(&self.path, e.to_string()))?;
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(line.as_bytes())
            .map_err(|e| FileError::io(&self.path, "write", e))?;
        drop(file);
        self.finished().insert(done);
        Ok(())
    }

    /// Counts a unit as done for the rest of this process only: another process wrote its files.
    pub(crate) fn know(&self, done: Done) {
        self.finished().insert(done);
    }

    /// Reads the files of the finished units that fulfil `which`. Units with a missing or altered file no
    /// longer count as done.
    pub(crate) fn check(&self, ctx: &Context, layout: &Layout, which: impl Fn(&Unit) -> bool) -> Result<()> {
        let finished = self.finished().clone();
        let checked = finished.checked_where(ctx, layout, which)?;
        *self.finished() = checked;
        Ok(())
    }

    /// Returns everything that is finished so far.
    pub(crate) fn finished(&self) -> MutexGuard<'_, Finished> {
        self.finished.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_io::fs::write_bytes;
    use std::fs;

    fn scores(location: &str) -> Done {
        let entropies = vec![0.1, 1.7e-300, 2.564_949_357_461_536_7];
        Done::Scores(ScoresDone { area: 1, location: location.into(), entropies })
    }

    fn location(layout: &Layout, uuid: &str, content: &[u8]) -> Done {
        let path = layout.root().join(format!("{uuid}.png"));
        write_bytes(&path, content).unwrap();
        let files = vec![FileRecord::of_bytes(layout.root(), &path, content).unwrap()];
        let tally = tally_of(&files);
        Done::Location(LocationDone { area: 1, location: uuid.into(), tally, files })
    }

    #[test]
    fn what_was_written_is_read_and_torn_or_altered_lines_are_not() {
        let dir = tempfile::tempdir().unwrap();
        let layout = Layout::new(dir.path());
        let first = Journal::begin(&layout, Finished::default()).unwrap();
        first.write(scores("a")).unwrap();
        first.write(scores("b")).unwrap();
        let second = Journal::begin(&layout, Finished::read(&Context::default(), &layout).unwrap()).unwrap();
        second.write(location(&layout, "c", b"image")).unwrap();

        let read = Finished::read(&Context::default(), &layout).unwrap();
        assert_eq!(read.units, second.finished().units);
        assert_eq!(read.scores(1, "a"), Some(&[0.1, 1.7e-300, 2.564_949_357_461_536_7][..]));
        assert_eq!(read.locations(1).count(), 1);

        let whole = fs::read(&first.path).unwrap();
        let lines = |content: &[u8]| {
            fs::write(&first.path, content).unwrap();
            Finished::read(&Context::default(), &layout).unwrap().units.len()
        };
        for cut in 0..whole.len() {
            let expected = 1 + whole[..cut]
                .split(|b| *b == b'\n')
                .filter(|l| Done::from_line(l).is_some())
                .count();

            assert_eq!(lines(&whole[..cut]), expected);

            let mut flipped = whole.clone();
            flipped[cut] ^= 4;
            // A line with a flipped bit is dropped; a flipped line feed drops both lines.
            assert!(lines(&flipped) < 3, "byte {cut}");

            let mut zeroed = whole.clone();
            zeroed[cut..].fill(0);
            assert!(lines(&zeroed) < 3, "byte {cut}");
        }
        assert_eq!(lines(&whole), 3);
    }

    #[test]
    fn a_unit_whose_file_is_not_the_one_that_was_written_is_left_out() {
        let dir = tempfile::tempdir().unwrap();
        let layout = Layout::new(dir.path());
        let mut finished = Finished::default();
        for uuid in ["a", "b", "c", "d"] {
            finished.insert(location(&layout, uuid, uuid.as_bytes()));
        }
        finished.insert(scores("b"));

        fs::write(layout.root().join("b.png"), b"\0").unwrap();
        fs::write(layout.root().join("c.png"), b"").unwrap();
        fs::remove_file(layout.root().join("d.png")).unwrap();

        let checked = finished.checked(&Context::default(), &layout).unwrap();
        let left: Vec<Unit> = checked.units.into_keys().collect();
        assert_eq!(left, [Unit::Scores(1, "b".into()), Unit::Location(1, "a".into())]);
    }
}
