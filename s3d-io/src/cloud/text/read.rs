//! Reads annotated points of text files.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::line_block::{LineBlock, parse_lines};
use crate::cloud::table::rows::Reading;
use crate::cloud::table::wanted::{Wanted, usual_names};
use crate::cloud::table::words::Lines;
use crate::cloud::text::layout::{Layout, count_of, is_comment};
use crate::cloud::text::ptx::read_ptx;
use crate::error::{Error, Result};
use crate::fs::encoding::Utf8Reader;
use crate::fs::source::{Bytes, Source};
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;

/// A file of text: `.asc`, `.xyz`, `.txt`, `.csv`, `.pts` or `.ptx`.
pub(crate) struct TextCloud<'a> {
    source: Source,
    wanted: Wanted<'a>,
    is_ptx: bool,
    /// The only scan of a PTX file that is read: the bytes and lines before it.
    only: Option<(u64, u64)>,
}

/// The file, as UTF-8.
pub(crate) type TextFile = BufReader<Utf8Reader<Bytes>>;

impl<'a> TextCloud<'a> {
    pub(crate) fn new(source: Source, wanted: Wanted<'a>) -> Self {
        let is_ptx = has_ending(&source, "ptx");
        Self { source, wanted, is_ptx, only: None }
    }

    /// Returns one scan of a PTX file.
    #[cfg(feature = "raw")]
    pub(crate) fn ptx_scan(source: Source, wanted: Wanted<'a>, before: (u64, u64)) -> Self {
        Self { source, wanted, is_ptx: true, only: Some(before) }
    }

    fn lines(&self) -> Result<Lines<TextFile>> {
        lines_from(&self.source, self.only.unwrap_or_default())
    }

    fn read_rows(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let path = self.source.name();
        let layout = Layout::find(path, &mut self.lines()?, true)?;
        // Scanners' programs write these columns, and annotated points have others.
        let is_usual = has_ending(&self.source, "pts") || self.wanted.annotations().is_none();
        let table = layout.table(path, self.wanted, |width| usual_names(width).filter(|_| is_usual))?;
        reading.told = table.told(layout.count);

        let mut lines = self.lines()?;
        // The points that the last count states, and how many of them came.
        let mut stated = layout.count;
        let mut done = 0u64;
        let next = |block: &mut LineBlock| {
            if lines.next()?.is_none() {
                return Ok(false);
            }
            let (number, line) = (lines.number(), lines.line());
            if number < layout.first || line.is_empty() || is_comment(line) {
                return Ok(true);
            }
            // A PTS file may hold several scans, each with its count.
            if stated == Some(done)
                && let Some(points) = count_of(line)
            {
                stated = Some(points);
                done = 0;
                return Ok(true);
            }

            done = done.saturating_add(1);
            block.push(number, line);
            Ok(true)
        };
        let is_narrow = parse_lines(path, &table, colors, reading, next, |reading, place, row| {
            reading.push_line(place.line, row)
        })?;
        if !is_narrow {
            return Ok(false);
        }

        match stated {
            Some(points) if done < points => {
                let message = format!("states {points} points, and {done} are there: it is cut short");
                Err(Error::format(path, message))
            }
            Some(points) if done > points => {
                let path = path.display();
                reading
                    .notes
                    .push(format!("{path}: states {points} points, and {done} are there; all are read"));
                Ok(true)
            }
            _ => Ok(true),
        }
    }
}

fn has_ending(source: &Source, ending: &str) -> bool {
    source
        .name()
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// Opens a text after this many bytes and lines, in UTF-8 unless it is opened at its start.
pub(crate) fn lines_from(source: &Source, (bytes, lines): (u64, u64)) -> Result<Lines<TextFile>> {
    let (mut file, _) = source.open()?;
    if bytes > 0 {
        file.seek(SeekFrom::Start(bytes))
            .map_err(|e| Error::io(source.name(), "read", e))?;
    }
    let file = BufReader::with_capacity(1 << 18, Utf8Reader::new(file));
    Ok(Lines::resumed(source.name(), file, lines))
}

impl Cloud for TextCloud<'_> {
    fn path(&self) -> &Path {
        self.source.name()
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        if self.is_ptx {
            read_ptx(self.source.name(), || self.lines(), self.wanted, self.only.map(|_| 1), colors, reading)
        } else {
            self.read_rows(colors, reading)
        }
    }
}
