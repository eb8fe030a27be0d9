//! What was checked and what is wrong: faults by topic and kind, few lines of each.

use crate::failure::passes;
use s3d_io::{Error, Layout, Place};
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Lines of one kind of fault; the rest is counted.
const MOST_LINES: usize = 20;

/// What a fault is about; the report is grouped by it, in this order.
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
    /// What kept a file from being read, and may not the next time.
    again: Option<String>,
}

/// Collects faults from any number of threads. What it says depends on what is found and not on when.
#[derive(Debug)]
pub(crate) struct Report {
    root: PathBuf,
    state: Mutex<State>,
    checks: AtomicU64,
    files: AtomicU64,
}

impl Report {
    /// Nothing found yet in the data set of this layout.
    pub(crate) fn new(layout: &Layout) -> Self {
        Self {
            root: layout.root().to_owned(),
            state: Mutex::default(),
            checks: AtomicU64::new(0),
            files: AtomicU64::new(0),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A file's path below the data set's folder, with `/`.
    pub(crate) fn relative(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.root).unwrap_or(path);
        let parts: Vec<_> = inside.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        parts.join("/")
    }

    /// Something is wrong with the file `path`. Faults of one `kind` share a limit of lines.
    pub(crate) fn fault(&self, topic: Topic, kind: &'static str, path: &Path, message: impl Into<String>) {
        let line = (self.relative(path), message.into());
        let mut state = self.state();
        let kind = state.faults.entry((topic, kind)).or_default();
        kind.count += 1;
        kind.first.insert(line);
        if kind.first.len() > MOST_LINES {
            kind.first.pop_last();
        }
    }

    /// One check, and the fault that it is if it does not hold.
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

    /// Checks of one file.
    pub(crate) fn of<'a>(&'a self, fault: (Topic, &'static str), path: &'a Path) -> OfFile<'a> {
        OfFile { report: self, fault, path, all_hold: Cell::new(true) }
    }

    /// What could be read; what could not is a fault of its file.
    pub(crate) fn read<T>(&self, topic: Topic, result: Result<T, Error>) -> Option<T> {
        self.checked(1);
        result.map_err(|e| self.unreadable(topic, &e)).ok()
    }

    /// A file that cannot be read: a fault of it, or of the system if it may do better the next time.
    pub(crate) fn unreadable(&self, topic: Topic, error: &Error) {
        if passes(error) {
            self.state().again.get_or_insert_with(|| error.to_string());
            return;
        }
        let message = match error {
            Error::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => "missing".to_owned(),
            Error::Io { source, action, .. } => format!("cannot {action}: {source}"),
            Error::Format { message, place: Place::Line(line), .. } => format!("line {line}: {message}"),
            Error::Format { message, .. } | Error::Unsupported { message, .. } => message.clone(),
            Error::Mesh { source, .. } => source.to_string(),
            other => other.to_string(),
        };
        self.fault(topic, "cannot be read", error.path(), message);
    }

    /// Something that was left out, and why.
    pub(crate) fn note(&self, note: impl Into<String>) {
        self.state().notes.insert(note.into());
    }

    /// So many checks were made.
    pub(crate) fn checked(&self, checks: u64) {
        self.checks.fetch_add(checks, Ordering::Relaxed);
    }

    /// So many files were looked at.
    pub(crate) fn looked_at(&self, files: u64) {
        self.files.fetch_add(files, Ordering::Relaxed);
    }

    /// What kept a file from being read, and may not the next time.
    pub(crate) fn again(&self) -> Option<String> {
        self.state().again.clone()
    }

    /// How many faults there are.
    pub(crate) fn faults(&self) -> u64 {
        self.state().faults.values().map(|kind| kind.count).sum()
    }

    /// The report, to read: groups of faults, notes, and the counts in the last line.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        let state = self.state();
        let mut topic = None;
        for ((of, name), kind) in &state.faults {
            if topic != Some(*of) {
                topic = Some(*of);
                let _ = writeln!(text, "{}", of.title());
            }
            for (path, message) in &kind.first {
                let _ = writeln!(text, "  {path}: {message}");
            }
            let more = kind.count.saturating_sub(kind.first.len() as u64);
            if more > 0 {
                let _ = writeln!(text, "  … and {more} more like this ({name})");
            }
        }
        for note in &state.notes {
            let _ = writeln!(text, "note: {note}");
        }
        drop(state);
        let count = |n: u64, noun: &str| format!("{n} {noun}{}", if n == 1 { "" } else { "s" });
        let (files, checks) = (self.files.load(Ordering::Relaxed), self.checks.load(Ordering::Relaxed));
        let _ = writeln!(
            text,
            "{}, {}, {}",
            count(files, "file"),
            count(checks, "check"),
            count(self.faults(), "fault")
        );
        text
    }
}

/// The checks of one file.
pub(crate) struct OfFile<'a> {
    report: &'a Report,
    fault: (Topic, &'static str),
    path: &'a Path,
    all_hold: Cell<bool>,
}

impl OfFile<'_> {
    /// One check, and the fault that it is if it does not hold.
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
        let text = report.text();
        assert!(text.starts_with("files\n  a/00: other bytes\n  a/01: "), "{text}");
        assert!(text.contains(
            "a/19: other bytes\n  … and 30 more like this (bytes)\nmanifest\n  manifest.json: wrong\n"
        ));
        assert!(text.ends_with("note: RGB was not checked\n2 files, 2 checks, 51 faults\n"), "{text}");
    }
}
