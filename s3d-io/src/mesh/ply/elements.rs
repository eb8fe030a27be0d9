//! Reads the rows of a PLY file in batches, so memory does not grow with the file.
//!
//! ```text
//! let mut reader = PlyReader::new(file, size, path)?;
//! while let Some(element) = reader.next_element()? {         // in the order of the file
//!     if element.name == "vertex" {
//!         let x = element.find_scalar(&["x"]).ok_or(…)?;
//!         reader.want([x]);                                  // the others are passed over
//!         let mut batch = PlyBatch::default();
//!         while reader.read_batch(&mut batch)? {
//!             for &x in batch.scalars(x) { … }
//!         }
//!     }
//! }
//! ```
//!
//! Numbers come as `f64`, which holds every type of PLY exactly; [`crate::mesh::ply::batch::integer`] turns
//! them into whole numbers.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::{Error, Result};
use crate::fs::encoding::Utf8Reader;
use crate::mesh::ply::batch::PlyBatch;
use crate::mesh::ply::header::{MAX_HEADER, PlyElement, PlyEncoding, PlyHeader, PlyProperty};
use crate::mesh::ply::source::{Fault, Source};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The largest number of rows in a batch.
const BATCH_ROWS: u64 = 4096;

/// Reads the elements of a PLY file one after the other.
pub(crate) struct PlyReader<'r> {
    path: PathBuf,
    pub(super) header: PlyHeader,
    pub(super) source: Source<'r>,
    /// The size of the file in bytes; 0 if it is not known.
    bytes: u64,
    /// The current element, and how many of its rows are read. `None` before the first element.
    current: Option<(usize, u64)>,
    pub(super) wanted: Vec<bool>,
    /// The line of the next byte, in ASCII files.
    pub(super) line: u64,
    /// The line on which the previous row ended.
    pub(super) row_end: u64,
}

impl<'r> PlyReader<'r> {
    /// Reads the header of a file of `bytes` bytes (0: not known). Errors name the file by `path`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] with the line.
    pub(crate) fn new(file: impl Read + 'r, bytes: u64, path: &Path) -> Result<Self> {
        let mut source = Source::new(Utf8Reader::new(file));

        // A header nearly always lies in the first bytes; more are read only if it does not.
        let mut size = 4096usize;
        let header = loop {
            let complete = source.need(size).map_err(|e| Error::io(path, "read", e))?;
            match PlyHeader::parse(path, source.bytes()) {
                Err(_) if complete && size < MAX_HEADER => size = size.saturating_mul(4),
                other => break other?,
            }
        };

        source.pass(header.bytes);
        let line = header.lines.saturating_add(1);

        Ok(Self {
            path: path.to_owned(),
            header,
            source,
            bytes,
            current: None,
            wanted: Vec::new(),
            line,
            row_end: 0,
        })
    }

    /// Returns the header.
    pub(crate) fn header(&self) -> &PlyHeader {
        &self.header
    }

    /// Returns how many rows of `element` the file can hold by its size. This much memory may be reserved for
    /// them.
    pub(crate) fn plausible_rows(&self, element: &PlyElement) -> usize {
        let row = element.min_row_bytes(self.header.encoding).max(1) as u64;
        usize::try_from(self.bytes.checked_div(row).unwrap_or(0).min(element.count)).unwrap_or(0)
    }

    /// Goes to the next element, past the remaining rows of the current one. No property of it is wanted yet.
    ///
    /// # Errors
    /// Like [`PlyReader::read_batch`], for the rows that are skipped.
    pub(crate) fn next_element(&mut self) -> Result<Option<PlyElement>> {
        if self.current.is_some() {
            self.want([]);
            let mut rest = PlyBatch::default();
            while self.read_batch(&mut rest)? {}
        }

        let next = self.current.map_or(0, |(element, _)| element.saturating_add(1));
        let Some(element) = self.header.elements.get(next).cloned() else { return Ok(None) };
        self.current = Some((next, 0));
        self.wanted = vec![false; element.properties.len()];
        Ok(Some(element))
    }

    /// Chooses the properties that the next batches hold, by their indices. Other properties are skipped.
    ///
    /// # Panics
    /// If there is no element, or no such property.
    #[expect(
        clippy::indexing_slicing,
        reason = "places are found in the element; any other is a caller's mistake"
    )]
    pub(crate) fn want(&mut self, properties: impl IntoIterator<Item = usize>) {
        self.wanted.fill(false);
        for property in properties {
            self.wanted[property] = true;
        }
    }

    /// Reads the next rows of the current element into `batch`, whose memory is reused. Returns `false` after
    /// the last row, and before the first [`PlyReader::next_element`].
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] with the line or the row if the file ends too soon, a word is not a
    /// number or does not fit its property's type, a line holds more than a row, or a list has a negative
    /// length.
    pub(crate) fn read_batch(&mut self, batch: &mut PlyBatch) -> Result<bool> {
        let Some((element, done)) = self.current else { return Ok(false) };
        let Some(current) = self.header.elements.get_mut(element) else { return Ok(false) };
        let count = current.count;
        // The properties are taken out of the header while its reader changes.
        let properties = std::mem::take(&mut current.properties);
        batch.clear(done, properties.len());

        let read = if properties.is_empty() {
            Ok(())
        } else {
            let rows = count.saturating_sub(done).min(BATCH_ROWS);
            match self.header.encoding {
                PlyEncoding::Ascii => self.ascii_rows(&properties, rows, batch),
                _ if properties.iter().any(PlyProperty::is_list) => {
                    self.binary_rows(&properties, rows, batch)
                }
                _ => self.fixed_rows(&properties, rows, batch),
            }
        };
        if let Some(current) = self.header.elements.get_mut(element) {
            current.properties = properties;
        }

        let done = done.saturating_add(batch.rows as u64);
        self.current = Some((element, done));
        read.map_err(|fault| self.fault(fault, done))?;
        Ok(batch.rows > 0)
    }

    /// Returns whether the file goes on after the last element, other than with white space. To be called
    /// after that element.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn has_more(&mut self) -> Result<bool> {
        let ascii = self.header.encoding == PlyEncoding::Ascii;
        loop {
            let rest = self.source.bytes();
            if rest.iter().any(|b| !(ascii && b.is_ascii_whitespace())) {
                return Ok(true);
            }
            self.source.start = self.source.end;
            if !self.source.need(1).map_err(|e| Error::io(&self.path, "read", e))? {
                return Ok(false);
            }
        }
    }

    /// Makes an error about row `row` of the batch that was just read.
    pub(crate) fn fail(&self, batch: &PlyBatch, row: usize, message: impl std::fmt::Display) -> Error {
        let name = self.row_name();
        let number = batch.first_row().saturating_add(row as u64);
        let message = format!("{name} {number}: {message}");
        match batch.lines.get(row) {
            Some(&line) => Error::line(&self.path, line, message),
            None => Error::format(&self.path, format!("{message} (counted from 0)")),
        }
    }

    /// Returns the current element.
    fn element(&self) -> Option<&PlyElement> {
        self.header.elements.get(self.current?.0)
    }

    fn row_name(&self) -> &str {
        self.element().map_or("row", |element| &element.name)
    }

    /// Makes an error about the row `row` of the current element.
    fn fault(&self, fault: Fault, row: u64) -> Error {
        let name = self.row_name();
        let count = self.element().map_or(0, |element| element.count);
        match fault {
            Fault::Io(e) => Error::io(&self.path, "read", e),
            Fault::End => Error::format(
                &self.path,
                format!(
                    "is cut off: its header claims {count} rows of the element \"{name}\", and it ends after \
                     {row}"
                ),
            ),
            Fault::Line(line, message) => Error::line(&self.path, line, format!("{name} {row}: {message}")),
            Fault::Row(message) => {
                Error::format(&self.path, format!("{name} {row}: {message} (counted from 0)"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows of a file with all types, which is written once as words and once as bytes.
    const ROWS: [[f64; 8]; 3] = [
        [-128.0, 255.0, -32_768.0, 65_535.0, -2_147_483_648.0, 4_294_967_295.0, 0.5, 1e-300],
        [0.0; 8],
        [127.0, 1.0, 32_767.0, 2.0, 2_147_483_647.0, 3.0, -1.25, 12_345_678.875],
    ];

    fn header(format: &str) -> String {
        format!(
            "ply\nformat {format} 1.0\nelement a 3\nproperty char p0\nproperty uchar p1\nproperty short p2\n\
             property ushort p3\nproperty int p4\nproperty uint p5\nproperty float p6\nproperty double p7\n\
             element empty 9\nelement b 2\nproperty list uchar short s\nproperty uchar k\n\
             property list uint double d\n\
             end_header\n"
        )
    }

    fn bytes(big: bool) -> Vec<u8> {
        let format = if big {
            "binary_big_endian"
        } else {
            "binary_little_endian"
        };
        let mut out = header(format).into_bytes();
        let mut put = |le: &[u8]| {
            let mut le = le.to_vec();
            if big {
                le.reverse();
            }
            out.extend(le);
        };
        for r in ROWS {
            put(&(r[0] as i8).to_le_bytes());
            put(&(r[1] as u8).to_le_bytes());
            put(&(r[2] as i16).to_le_bytes());
            put(&(r[3] as u16).to_le_bytes());
            put(&(r[4] as i32).to_le_bytes());
            put(&(r[5] as u32).to_le_bytes());
            put(&(r[6] as f32).to_le_bytes());
            put(&r[7].to_le_bytes());
        }
        put(&[2]);
        put(&(-3i16).to_le_bytes());
        put(&4i16.to_le_bytes());
        put(&[7]);
        put(&0u32.to_le_bytes());
        put(&[0]);
        put(&[8]);
        put(&1u32.to_le_bytes());
        put(&0.1f64.to_le_bytes());
        out
    }

    fn ascii() -> String {
        let mut out = header("ascii");
        for r in ROWS {
            out += &r.map(|v| v.to_string()).join(" ");
            out += "\n";
        }
        // One row continues on the next line, and one line is empty.
        out + "2 -3\r\n  4\t7 0\n\n0 8 1 0.1"
    }

    fn open(bytes: &[u8]) -> Result<PlyReader<'_>> {
        PlyReader::new(bytes, bytes.len() as u64, Path::new("a.ply"))
    }

    /// Returns every row of every element as text, with the `wanted` properties.
    fn all(bytes: &[u8], wanted: impl Fn(usize) -> bool) -> Result<Vec<String>> {
        let mut reader = open(bytes)?;
        let mut out = Vec::new();
        let mut batch = PlyBatch::default();
        while let Some(element) = reader.next_element()? {
            let wanted: Vec<usize> = (0..element.properties.len()).filter(|&p| wanted(p)).collect();
            reader.want(wanted.iter().copied());
            while reader.read_batch(&mut batch)? {
                for row in 0..batch.len() {
                    let values: Vec<String> = wanted
                        .iter()
                        .map(|&p| {
                            if element.properties[p].is_list() {
                                format!("{:?}", batch.list(p, row))
                            } else {
                                batch.scalars(p)[row].to_string()
                            }
                        })
                        .collect();
                    out.push(format!(
                        "{} {}: {}",
                        element.name,
                        batch.first_row() + row as u64,
                        values.join(" ")
                    ));
                }
            }
        }
        assert!(!reader.has_more()?);
        Ok(out)
    }

    #[test]
    fn all_encodings_say_the_same() {
        let mut expected: Vec<String> = (0..3)
            .map(|r| format!("a {r}: {}", ROWS[r].map(|v| v.to_string()).join(" ")))
            .collect();
        expected.extend(["b 0: [-3.0, 4.0] 7 []".to_owned(), "b 1: [] 8 [0.1]".to_owned()]);
        assert_eq!(all(ascii().as_bytes(), |_| true).unwrap(), expected);
        assert_eq!(all(&bytes(false), |_| true).unwrap(), expected);
        assert_eq!(all(&bytes(true), |_| true).unwrap(), expected);
        let some = ["a 0: 255", "a 1: 0", "a 2: 1", "b 0: 7", "b 1: 8"];
        for file in [ascii().into_bytes(), bytes(false), bytes(true)] {
            assert_eq!(all(&file, |p| p == 1).unwrap(), some);
        }
    }

    #[test]
    fn every_cut_is_noticed() {
        for (file, last) in [(bytes(false), 1), (bytes(true), 1), (ascii().into_bytes(), 3)] {
            for length in 0..file.len() {
                let outcome = all(&file[..length], |_| true);
                // The last number of an ASCII file may lose digits.
                if length + last <= file.len() && length < file.len() - 2 {
                    let message = outcome.unwrap_err().to_string();
                    let known = ["cut off", "no PLY", "`-` is no number"];
                    assert!(known.iter().any(|words| message.contains(words)), "{length}: {message}");
                }
            }
        }

        let claims = header("binary_little_endian").replace("element a 3", "element a 18446744073709551615");
        let message = all(claims.as_bytes(), |_| true).unwrap_err().to_string();
        assert!(
            message.ends_with("18446744073709551615 rows of the element \"a\", and it ends after 0"),
            "{message}"
        );
    }

    fn file_of(rows: &str) -> String {
        format!(
            "ply\nformat ascii 1.0\nelement v 2\nproperty float x\nproperty uchar c\n\
                     property list char int l\nend_header\n{rows}"
        )
    }

    #[test]
    fn faults_of_rows_are_named() {
        for (rows, words) in [
            ("1 2 0\nx 2 0\n", "a.ply, line 9: v 1: `x` is no number, but x is"),
            ("1 2 0\n1 256 0\n", "line 9: v 1: `256` does not fit c, which is a uchar"),
            ("1 2 0\n1 -1 0\n", "`-1` does not fit c"),
            ("1 0.5 0\n1 1 0\n", "line 8: v 0: `0.5` does not fit c"),
            ("1 nan 0\n1 1 0\n", "`nan` does not fit c"),
            ("1 2 -1\n1 2 0\n", "line 8: v 0: the list l has a length of -1"),
            ("1 2 0 7\n1 2 0\n", "line 8: v 1: this line has more numbers than the row before needs"),
            // A number is missing: the row takes one from the next line.
            ("1 2\n0 3 0\n", "line 9: v 1: this line has more numbers"),
            ("1 2 1 1.5\n", "`1.5` does not fit l, which is a int"),
            (&format!("1 2 0\n{}", "1".repeat(5000)), "line 9: v 1: a word of more than 4096 characters"),
        ] {
            let message = all(file_of(rows).as_bytes(), |_| true).unwrap_err().to_string();
            assert!(message.contains(words), "{rows:?}: {message}");
        }
        assert!(
            all(file_of("-NaN(ind) 255.0 0\ninf 2e1 0\n").as_bytes(), |_| true).unwrap()[0]
                .starts_with("v 0: NaN")
        );

        let text = file_of("1 2 0\n1 2 0\n 3");
        let mut reader = open(text.as_bytes()).unwrap();
        while reader.next_element().unwrap().is_some() {}
        assert!(reader.has_more().unwrap());

        let negative =
            b"ply\nformat binary_little_endian 1.0\nelement v 1\nproperty list char int l\nend_header\n\xff";
        assert!(
            all(negative, |_| true)
                .unwrap_err()
                .to_string()
                .contains("v 0: the list l has a length of -1")
        );
        let huge = b"ply\nformat binary_little_endian 1.0\nelement v 1\nproperty list uint int l\n\
                     end_header\n\xff\xff\xff\xff";
        assert!(
            all(huge, |_| true)
                .unwrap_err()
                .to_string()
                .contains("4294967295 entries")
        );
        assert!(all(huge, |_| false).unwrap_err().to_string().contains("cut off"));
    }

    #[test]
    fn rows_beyond_one_batch_and_one_buffer() {
        let n = 3 * BATCH_ROWS as usize + 5;
        let mut file = format!(
            "ply\nformat binary_big_endian 1.0\nelement f {n}\nproperty list ushort uint l\nend_header\n"
        )
        .into_bytes();
        let mut ascii =
            format!("ply\nformat ascii 1.0\nelement f {n}\nproperty list ushort uint l\nend_header\n");
        for i in 0..n {
            let length = if i == 100 { 60_000 } else { i % 5 };
            file.extend((length as u16).to_be_bytes());
            ascii += &length.to_string();
            for k in 0..length {
                file.extend(((i + k) as u32).to_be_bytes());
                ascii += &format!(" {}", i + k);
            }
            ascii += "\n";
        }

        for file in [file, ascii.into_bytes()] {
            let mut reader = open(&file).unwrap();
            let element = reader.next_element().unwrap().unwrap();
            assert!(reader.plausible_rows(&element) >= n);
            reader.want([0]);
            let mut batch = PlyBatch::default();
            let mut row = 0;
            while reader.read_batch(&mut batch).unwrap() {
                for r in 0..batch.len() {
                    let length = if row == 100 { 60_000 } else { row % 5 };
                    let list = batch.list(0, r);
                    assert!(
                        list.len() == length && list.iter().enumerate().all(|(k, &v)| v == (row + k) as f64)
                    );
                    row += 1;
                }
            }
            assert_eq!(row, n);
        }
    }
}
