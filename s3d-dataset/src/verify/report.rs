//! Collects what was checked and what is wrong: faults by topic and kind, with a few lines for each kind.

use crate::error::passes;
use s3d_io::Error as FileError;
use s3d_io::dataset::{FileRecord, Layout};
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// The most lines for one kind of fault. Further ones are only counted.
const MAX_LINES: usize = 20;

/// Files up to this many bytes are read even if their size is wrong.
const SMALL: u64 = 1 << 26;

/// The subject of a fault. The report is grouped by it, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Topic {
    Files,
    Manifest,
    Tables,
    Labels,
    Mesh,
    Instances,
    Points,
    Views,
    Poses,
    Images,
    Rays,
}

impl Topic {
    fn title(self) -> &'static str {
        match self {
            Self::Files => "files",
            Self::Manifest => "manifest",
            Self::Tables => "tables",
            Self::Labels => "labels",
            Self::Mesh => "meshes",
            Self::Instances => "instances",
            Self::Points => "points",
            Self::Views => "views",
            Self::Poses => "poses",
            Self::Images => "images",
            Self::Rays => "images against the mesh",
        }
    }
}

/// Faults of one kind: the first by path and message, and how many there are.
#[derive(Debug, Default)]
struct Kind {
    first: BTreeSet<(String, String)>,
    count: u64,
}

#[derive(Debug, Default)]
struct State {
    faults: BTreeMap<(Topic, &'static str), Kind>,
    notes: BTreeSet<String>,
    /// The first error that kept a file from being read and may not occur the next time.
    again: Option<String>,
}

/// Collects faults from any number of threads. Its text does not depend on their order.
#[derive(Debug)]
pub(crate) struct Report {
    root: PathBuf,
    state: Mutex<State>,
    checks: AtomicU64,
    files: AtomicU64,
    sizes: OnceLock<Sizes>,
}

/// The sizes that files may have.
#[derive(Debug)]
struct Sizes {
    listed: Option<BTreeMap<String, FileRecord>>,
    most: u64,
}

impl Report {
    /// An empty report on the data set of this layout.
    pub(crate) fn new(layout: &Layout) -> Self {
        Self {
            root: layout.root().to_owned(),
            state: Mutex::default(),
            checks: AtomicU64::new(0),
            files: AtomicU64::new(0),
            sizes: OnceLock::new(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The data set's folder.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// A file's path below the data set's folder, with `/`.
    pub(crate) fn relative(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.root).unwrap_or(path);
        let parts: Vec<_> = inside.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        parts.join("/")
    }

    /// Records a fault of the file `path`. Faults of one `kind` share a limit of lines.
    pub(crate) fn fault(&self, topic: Topic, kind: &'static str, path: &Path, message: impl Into<String>) {
        let line = (self.relative(path), message.into());
        let mut state = self.state();
        let kind = state.faults.entry((topic, kind)).or_default();
        kind.count += 1;
        kind.first.insert(line);
        if kind.first.len() > MAX_LINES {
            kind.first.pop_last();
        }
    }

    /// Counts a check, and records a fault if it does not hold.
    pub(crate) fn check(
        &self,
        holds: bool,
        (topic, kind): (Topic, &'static str),
        path: &Path,
        message: impl FnOnce() -> String,
    ) -> bool {
        self.checked(1);
        if !holds {
            self.fault(topic, kind, path, message());
        }
        holds
    }

    /// Checks of one file that share a kind of fault.
    pub(crate) fn of<'a>(&'a self, fault: (Topic, &'static str), path: &'a Path) -> OfFile<'a> {
        OfFile { report: self, fault, path, all_hold: Cell::new(true) }
    }

    /// Sets the sizes that files may have. A file much larger than its listed size is not read. Without a
    /// list, no file larger than `most` bytes is read, the size of all files together.
    pub(crate) fn expect(&self, listed: Option<Vec<FileRecord>>, most: u64) {
        let listed = listed.map(|all| all.into_iter().map(|record| (record.path.clone(), record)).collect());
        let _ = self.sizes.set(Sizes { listed, most });
    }

    /// Checks that a file's size allows reading it. Files that are not listed are reported elsewhere.
    pub(crate) fn check_size(&self, path: &Path) -> Result<(), FileError> {
        let Some(sizes) = self.sizes.get() else { return Ok(()) };
        if let Some(listed) = &sizes.listed
            && let Some(record) = listed.get(&self.relative(path))
        {
            // A small damaged file may still be diagnosed.
            let is_small = std::fs::metadata(path).is_ok_and(|m| m.is_file() && m.len() <= SMALL);
            return if is_small {
                Ok(())
            } else {
                record.check_size(&self.root)
            };
        }
        let size = std::fs::metadata(path)
            .map_err(|e| FileError::io(path, "read", e))?
            .len();
        if size > sizes.most {
            return Err(FileError::format(path, format!("{size} bytes, more than the data set has")));
        }
        Ok(())
    }

    /// Does the same for all listed files that are `chosen`.
    pub(crate) fn check_sizes(&self, chosen: impl Fn(&Path) -> bool) -> Result<(), FileError> {
        let listed = self.sizes.get().and_then(|sizes| sizes.listed.as_ref());
        let records = listed.into_iter().flat_map(BTreeMap::values);
        let paths = records.map(|record| record.path_in(&self.root));
        paths
            .filter(|path| chosen(path))
            .try_for_each(|path| self.check_size(&path))
    }

    /// Reads a file with `read`. A file that cannot be read is a fault.
    pub(crate) fn read<T>(
        &self,
        topic: Topic,
        path: &Path,
        read: impl FnOnce(&Path) -> Result<T, FileError>,
    ) -> Option<T> {
        self.ok(topic, self.check_size(path).and_then(|()| read(path)))
    }

    /// Returns the value if it could be read, and otherwise records a fault of its file.
    pub(crate) fn ok<T>(&self, topic: Topic, result: Result<T, FileError>) -> Option<T> {
        self.checked(1);
        result.map_err(|e| self.unreadable(topic, &e)).ok()
    }

    /// Records that a file cannot be read.
    pub(crate) fn unreadable(&self, topic: Topic, error: &FileError) {
        self.wrong((topic, "cannot be read"), error);
    }

    /// Records an error as a fault of its file, or as a passing error of the system.
    pub(crate) fn wrong(&self, (topic, kind): (Topic, &'static str), error: &FileError) {
        if passes(error) {
            self.state().again.get_or_insert_with(|| error.to_string());
            return;
        }
        let message = match error {
            FileError::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
                "missing".to_owned()
            }
            other => other.message(),
        };
        self.fault(topic, kind, error.path(), message);
    }

    /// Notes a check that was left out, and why.
    pub(crate) fn note(&self, note: impl Into<String>) {
        self.state().notes.insert(note.into());
    }

    /// Counts this many checks.
    pub(crate) fn checked(&self, checks: u64) {
        self.checks.fetch_add(checks, Ordering::Relaxed);
    }

    /// Counts this many files.
    pub(crate) fn looked_at(&self, files: u64) {
        self.files.fetch_add(files, Ordering::Relaxed);
    }

    /// Returns the finished report.
    pub(crate) fn finish(self) -> VerifyReport {
        let state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let groups = state.faults.into_iter().map(|((topic, kind), faults)| FaultGroup {
            topic: topic.title(),
            kind,
            first: faults.first.into_iter().collect(),
            count: faults.count,
        });
        VerifyReport {
            faults: groups.collect(),
            notes: state.notes.into_iter().collect(),
            files: self.files.into_inner(),
            checks: self.checks.into_inner(),
            unread: state.again,
        }
    }
}

/// The faults of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FaultGroup {
    /// The subject, such as "images against the mesh".
    pub topic: &'static str,
    /// The kind, such as a modality.
    pub kind: &'static str,
    /// The first twenty by path: the file, relative to the folder of the data set, and what is wrong with it.
    pub first: Vec<(String, String)>,
    /// The number of faults of this kind, listed or not.
    pub count: u64,
}

/// The faults that [`verify`](crate::verify()) found in a data set.
///
/// Displayed, it is the text that `s3d verify` prints.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct VerifyReport {
    /// The faults by topic and kind. The groups of one topic follow each other.
    pub faults: Vec<FaultGroup>,
    /// The checks that were left out, and why, a sentence each.
    pub notes: Vec<String>,
    /// The number of files that were examined.
    pub files: u64,
    /// The number of checks that were made.
    pub checks: u64,
    /// An error that kept a file from being read and may not occur the next time. With it the report is
    /// incomplete.
    pub unread: Option<String>,
}

impl VerifyReport {
    /// The number of faults.
    pub fn fault_count(&self) -> u64 {
        self.faults.iter().map(|group| group.count).sum()
    }
}

impl fmt::Display for VerifyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut topic = None;
        for group in &self.faults {
            if topic != Some(group.topic) {
                topic = Some(group.topic);
                writeln!(f, "{}", group.topic)?;
            }
            for (path, message) in &group.first {
                writeln!(f, "  {path}: {message}")?;
            }
            let more = group.count.saturating_sub(group.first.len() as u64);
            if more > 0 {
                writeln!(f, "  … and {more} more like this ({})", group.kind)?;
            }
        }

        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }

        let files = count(self.files, "file");
        let checks = count(self.checks, "check");
        writeln!(f, "{files}, {checks}, {}", count(self.fault_count(), "fault"))
    }
}

fn count(n: u64, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// The checks of one file.
pub(crate) struct OfFile<'a> {
    report: &'a Report,
    fault: (Topic, &'static str),
    path: &'a Path,
    all_hold: Cell<bool>,
}

impl OfFile<'_> {
    /// Counts a check, and records a fault if it does not hold.
    pub(crate) fn check(&self, holds: bool, message: impl FnOnce() -> String) -> bool {
        if !self.report.check(holds, self.fault, self.path, message) {
            self.all_hold.set(false);
        }
        holds
    }

    /// Whether all checks held so far.
    pub(crate) fn all_hold(&self) -> bool {
        self.all_hold.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_grouped_sorted_and_limited() {
        let report = Report::new(&Layout::new("out"));
        for i in (0..50).rev() {
            report.fault(Topic::Files, "bytes", &Path::new("out/a").join(format!("{i:02}")), "other bytes");
        }
        report.check(false, (Topic::Manifest, "counts"), Path::new("out/manifest.json"), || "wrong".into());
        report.check(true, (Topic::Manifest, "counts"), Path::new("out/manifest.json"), || "never".into());
        report.note("RGB was not checked");
        report.looked_at(2);
        let report = report.finish();
        assert_eq!((report.fault_count(), report.checks), (51, 2));
        let text = report.to_string();
        assert!(text.starts_with("files\n  a/00: other bytes\n  a/01: "), "{text}");
        assert!(text.contains(
            "a/19: other bytes\n  … and 30 more like this (bytes)\nmanifest\n  manifest.json: wrong\n"
        ));
        assert!(text.ends_with("note: RGB was not checked\n2 files, 2 checks, 51 faults\n"), "{text}");
    }
}
