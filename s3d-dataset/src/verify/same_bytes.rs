//! A writer that compares what is written with a file that is there, and changes nothing.

use super::report::{Report, Topic};
use s3d_io::Error as FileError;
use s3d_io::fs::open_file;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The most places that are kept.
const MOST_RANGES: usize = 1000;

/// Compares written bytes with those of a file at the same places.
pub(crate) struct SameBytes {
    path: PathBuf,
    file: BufReader<File>,
    length: u64,
    /// The place of the next byte.
    at: u64,
    /// The end of all that was written.
    end: u64,
    /// The places that were written last with other bytes, up to [`MOST_RANGES`]. Writers fill in some places
    /// later.
    different: Vec<Range<u64>>,
    /// The bytes of the file at the place of the last write.
    there: Vec<u8>,
    /// The first error of reading.
    error: Option<io::Error>,
}

impl SameBytes {
    /// Opens a file. One that cannot be opened is reported.
    pub(crate) fn open(path: &Path, topic: Topic, report: &Report) -> Option<Self> {
        let opened = report.read(topic, path, |path| {
            let file = open_file(path)?;
            let length = file.metadata().map_err(|e| FileError::io(path, "read", e))?.len();
            Ok((file, length))
        });
        let (file, length) = opened?;
        Some(Self {
            path: path.to_owned(),
            file: BufReader::with_capacity(1 << 18, file),
            length,
            at: 0,
            end: 0,
            different: Vec::new(),
            there: Vec::new(),
            error: None,
        })
    }

    /// Reports if the file has other bytes than were written.
    pub(crate) fn finish(self, fault: (Topic, &'static str), report: &Report) {
        if let Some(error) = self.error {
            report.unreadable(fault.0, &FileError::io(&self.path, "read", error));
            return;
        }
        let first = self.different.iter().map(|range| range.start).min();
        report.check(first.is_none() && self.length == self.end, fault, &self.path, || match first {
            Some(byte) => format!(
                "is not what the mesh and its labels give: {} ranges of bytes differ, the first from byte \
                 {byte}",
                self.different.len()
            ),
            None => format!("has {} bytes, and the mesh and its labels give {}", self.length, self.end),
        });
    }

    /// Reads the file's bytes at the present place, as far as there are any, up to `count`.
    fn read_there(&mut self, count: usize) -> io::Result<()> {
        // A relative move keeps what the buffer holds.
        let now = self.file.stream_position()?;
        self.file.seek_relative(self.at as i64 - now as i64)?;
        self.there.clear();
        (&mut self.file).take(count as u64).read_to_end(&mut self.there)?;
        Ok(())
    }
}

impl Write for SameBytes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Err(error) = self.read_there(bytes.len()) {
            self.error.get_or_insert(error);
        }

        let written = self.at..self.at + bytes.len() as u64;
        self.different
            .retain(|range| range.start < written.start || range.end > written.end);
        let differs = |at: &usize| self.there.get(*at) != bytes.get(*at);
        if self.there != bytes
            && let Some(first) = (0..bytes.len()).find(differs)
            && let Some(last) = (0..bytes.len()).rfind(differs)
            && self.different.len() < MOST_RANGES
        {
            self.different
                .push(written.start + first as u64..written.start + last as u64 + 1);
        }
        self.at = written.end;
        self.end = self.end.max(self.at);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SameBytes {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => self.end.checked_add_signed(by),
        };
        self.at = place.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_io::dataset::Layout;

    const FAULT: (Topic, &str) = (Topic::Points, "files of points");

    /// Returns the report on a file of these bytes after `write`.
    fn told(bytes: &[u8], write: impl FnOnce(&mut SameBytes)) -> String {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        std::fs::write(&path, bytes).unwrap();
        let report = Report::new(&Layout::new(dir.path()));
        let mut file = SameBytes::open(&path, Topic::Points, &report).unwrap();
        write(&mut file);
        file.finish(FAULT, &report);
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        report.finish().to_string()
    }

    #[test]
    fn equal_bytes_are_equal_even_if_some_come_later() {
        let report = told(b"0123456789", |file| {
            file.write_all(b"01..").unwrap();
            file.write_all(b"456789").unwrap();
            file.seek(SeekFrom::Start(2)).unwrap();
            file.write_all(b"23").unwrap();
        });
        assert!(!report.contains("differ"), "{report}");
    }

    #[test]
    fn other_bytes_are_placed_and_other_lengths_told() {
        let report = told(b"0123456789", |file| {
            file.write_all(b"0123").unwrap();
            file.write_all(b"4_6789").unwrap();
        });
        assert!(report.contains("1 ranges of bytes differ, the first from byte 5"), "{report}");
        let report = told(b"0123456789", |file| file.write_all(b"01234").unwrap());
        assert!(report.contains("has 10 bytes, and the mesh and its labels give 5"), "{report}");
        let report = told(b"01234", |file| file.write_all(b"0123456789").unwrap());
        assert!(report.contains("the first from byte 5"), "{report}");
    }
}
