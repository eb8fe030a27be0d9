//! Reads annotated points of text files.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::rows::Reading;
use crate::cloud::table::words::{Lines, Parsed};
use crate::cloud::text::layout::{Layout, count_of, is_comment};
use crate::cloud::text::ptx::read_ptx;
use crate::error::{Error, Result};
use crate::fs::encoding::Utf8Reader;
use crate::fs::source::{Bytes, Source};
use std::io::BufReader;
use std::path::Path;

/// A file of text: `.asc`, `.xyz`, `.txt`, `.csv`, `.pts` or `.ptx`.
pub(crate) struct TextCloud<'a> {
    source: Source,
    options: &'a AnnotationOptions,
}

/// The file, as UTF-8.
pub(super) type TextFile = BufReader<Utf8Reader<Bytes>>;

/// The names of the columns of a PTS or PTX file, by their number.
pub(super) fn scanner_names(width: usize) -> Option<Vec<String>> {
    let names = match width {
        3 => "x y z",
        4 => "x y z intensity",
        6 => "x y z r g b",
        7 => "x y z intensity r g b",
        _ => return None,
    };
    Some(names.split(' ').map(str::to_owned).collect())
}

impl<'a> TextCloud<'a> {
    pub(crate) fn new(source: Source, options: &'a AnnotationOptions) -> Self {
        Self { source, options }
    }

    fn ends_with(&self, ending: &str) -> bool {
        self.source
            .name()
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case(ending))
    }

    fn lines(&self) -> Result<Lines<TextFile>> {
        let (file, _) = self.source.open()?;
        let file = BufReader::with_capacity(1 << 18, Utf8Reader::new(file));
        Ok(Lines::new(self.source.name(), file))
    }

    fn read_rows(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let path = self.source.name();
        let layout = Layout::find(path, &mut self.lines()?, true)?;
        let is_pts = self.ends_with("pts");
        let table = layout.table(path, self.options, |width| scanner_names(width).filter(|_| is_pts))?;

        let mut lines = self.lines()?;
        // The points that the last count states, and how many of them came.
        let mut stated = layout.count;
        let mut done = 0u64;
        while lines.next()?.is_some() {
            let number = lines.number();
            let line = lines.line();
            if number < layout.first || line.is_empty() || is_comment(line) {
                continue;
            }
            // A PTS file may hold several scans, each with its count.
            if stated == Some(done)
                && let Some(points) = count_of(line)
            {
                stated = Some(points);
                done = 0;
                continue;
            }

            done = done.saturating_add(1);
            match table.parse(line, colors) {
                Parsed::Row(row) => reading.push_line(number, &row)?,
                Parsed::Wider => return Ok(false),
                Parsed::Fault(why) => reading.fault(Error::line(path, number, why))?,
            }
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

impl Cloud for TextCloud<'_> {
    fn path(&self) -> &Path {
        self.source.name()
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        if self.ends_with("ptx") {
            read_ptx(self.source.name(), || self.lines(), self.options, colors, reading)
        } else {
            self.read_rows(colors, reading)
        }
    }
}
