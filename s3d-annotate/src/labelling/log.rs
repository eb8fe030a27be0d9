//! The log of a labelling as a file: a header, and an event a line. It only grows.

use super::error::{Error, Result};
use super::event::{EVENT_VERSION, Event};
use rayon::prelude::*;
use s3d_io::Error as FileError;
use s3d_io::fs::{Checksum, read_file, sync_file};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The first line of a log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    /// The version of the events.
    #[serde(rename = "v")]
    pub(super) version: u32,
    /// The checksum of the mesh.
    pub(super) mesh: Checksum,
    /// The number of its faces.
    pub(super) faces: u32,
}

/// A log, open for more events.
#[derive(Debug)]
pub(super) struct Log {
    path: PathBuf,
    file: File,
    /// The bytes that are whole lines.
    bytes: u64,
    is_broken: bool,
}

/// A log as it was found.
pub(super) struct Opened {
    pub(super) log: Log,
    pub(super) header: Header,
    pub(super) events: Vec<Event>,
    /// The bytes of a last line that a kill had cut; they are removed.
    pub(super) torn: u64,
}

impl Log {
    /// Opens a log, or begins it with `header`.
    ///
    /// # Errors
    /// [`Error::File`]: for a line that is damaged, it names the line.
    pub(super) fn open(path: &Path, header: &Header) -> Result<Opened> {
        let content = if path.exists() { read_file(path)? } else { Vec::new() };
        let whole = content
            .iter()
            .rposition(|byte| *byte == b'\n')
            .map_or(0, |place| place + 1);
        let (lines, torn) = content.split_at(whole);

        let options = || File::options().create(true).append(true).open(path);
        let file = options().map_err(|e| FileError::io(path, "write", e))?;
        let mut log = Self { path: path.to_owned(), file, bytes: whole as u64, is_broken: false };
        let mut lines = lines.split_inclusive(|byte| *byte == b'\n');
        let Some(first) = lines.next() else {
            log.begin(header, torn)?;
            return Ok(Opened { log, header: header.clone(), events: Vec::new(), torn: 0 });
        };

        let header: Header = parsed(path, 1, first)?;
        if header.version == 0 || header.version > EVENT_VERSION {
            let message = format!(
                "its version is {}, and this program reads up to {EVENT_VERSION}: a newer program wrote it",
                header.version
            );
            return Err(FileError::line(path, 1, message).into());
        }
        let lines: Vec<&[u8]> = lines.collect();
        let events = lines.par_iter().enumerate();
        let events: Result<Vec<Event>> = events.map(|(i, line)| parsed(path, i as u64 + 2, line)).collect();
        let events = events?;

        if !torn.is_empty() {
            log.cut_off()?;
        }
        Ok(Opened { log, header, events, torn: torn.len() as u64 })
    }

    /// Writes the header of a new log. A kill may have left the beginning of one.
    fn begin(&mut self, header: &Header, torn: &[u8]) -> Result<()> {
        let line = line_of(&self.path, header)?;
        if !line.starts_with(torn) {
            return Err(FileError::line(&self.path, 1, "this is no log of labels").into());
        }
        self.cut_off()?;
        self.put(&line)?;
        // The name of the file is brought to the disk, too.
        Ok(sync_file(&self.path)?)
    }

    /// Writes an event, and waits until it is on the disk.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be written; then it is not in the log. [`Error::Broken`] if that cannot
    /// be said of an earlier one.
    pub(super) fn add(&mut self, event: &Event) -> Result<()> {
        let line = line_of(&self.path, event)?;
        self.put(&line)
    }

    fn put(&mut self, line: &[u8]) -> Result<()> {
        if self.is_broken {
            return Err(Error::Broken { path: self.path.clone() });
        }
        let written = self.file.write_all(line).and_then(|()| self.file.sync_data());
        if let Err(e) = written {
            self.is_broken = self.cut_off().is_err();
            return Err(FileError::io(&self.path, "write", e).into());
        }
        self.bytes += line.len() as u64;
        Ok(())
    }

    /// Removes what comes after the whole lines.
    fn cut_off(&mut self) -> Result<()> {
        let cut = self.file.set_len(self.bytes).and_then(|()| self.file.sync_data());
        cut.map_err(|e| FileError::io(&self.path, "shorten", e).into())
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

fn line_of(path: &Path, value: &impl Serialize) -> Result<Vec<u8>> {
    let mut line = serde_json::to_vec(value).map_err(|e| FileError::format(path, e.to_string()))?;
    line.push(b'\n');
    Ok(line)
}

fn parsed<'l, T: Deserialize<'l>>(path: &Path, number: u64, line: &'l [u8]) -> Result<T> {
    serde_json::from_slice(line).map_err(|e| FileError::line(path, number, format!("is damaged: {e}")).into())
}
