//! Lines of a text, gathered in blocks that all threads parse.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::cloud::ColorRange;
use crate::cloud::table::rows::{Reading, Row};
use crate::cloud::table::words::{Parsed, WordTable};
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::path::Path;

/// The most bytes, and lines, that are parsed together.
const BLOCK_BYTES: usize = 1 << 20;
const BLOCK_LINES: usize = 1 << 15;
/// The fewest lines that a thread parses at a time.
const FEWEST: usize = 512;

/// Lines that wait to be parsed.
#[derive(Debug, Default)]
pub(crate) struct LineBlock {
    bytes: Vec<u8>,
    /// The number of each line in the file, and where it ends in the bytes.
    lines: Vec<(u64, usize)>,
}

/// Where a row comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// The number of lines before it that were parsed, valid or not.
    pub(crate) index: u64,
    /// The number of its line in the file, from 1.
    pub(crate) line: u64,
}

impl LineBlock {
    /// Adds a line.
    pub(crate) fn push(&mut self, number: u64, line: &[u8]) {
        self.bytes.extend_from_slice(line);
        self.lines.push((number, self.bytes.len()));
    }

    fn is_full(&self) -> bool {
        self.bytes.len() >= BLOCK_BYTES || self.lines.len() >= BLOCK_LINES
    }

    /// Returns what each line turned out to be.
    fn parse(&self, table: &WordTable, colors: ColorRange) -> Vec<Parsed<'_>> {
        let parse = |i: usize| {
            let start = i
                .checked_sub(1)
                .and_then(|before| self.lines.get(before))
                .map_or(0, |l| l.1);
            let end = self.lines.get(i).map_or(start, |l| l.1);
            table.parse(self.bytes.get(start..end).unwrap_or_default(), colors)
        };
        let count = self.lines.len();
        (0..count).into_par_iter().with_min_len(FEWEST).map(parse).collect()
    }
}

/// Parses lines block by block, on all threads; meanwhile the next block is read. Returns false if a colour
/// may be in a wider range.
///
/// `next` adds the next line to a block, or none, and returns false at the end. `each` gets the rows in their
/// order.
///
/// # Errors
/// The first error in the order of the lines: [`Error::Format`] for a line that is no row, unless faults are
/// skipped; the errors of `next` and `each`.
pub(crate) fn parse_lines<'a>(
    path: &Path,
    table: &WordTable,
    colors: ColorRange,
    reading: &mut Reading<'a>,
    mut next: impl FnMut(&mut LineBlock) -> Result<bool> + Send,
    mut each: impl FnMut(&mut Reading<'a>, Place, &Row<'_>) -> Result<()>,
) -> Result<bool> {
    let mut fill = |block: &mut LineBlock| {
        block.bytes.clear();
        block.lines.clear();
        while !block.is_full() {
            if !next(block)? {
                return Ok(false);
            }
        }
        Ok(true)
    };
    let mut block = LineBlock::default();
    let mut ahead = LineBlock::default();
    let mut more = fill(&mut block);
    let mut index = 0u64;
    loop {
        let is_more = matches!(more, Ok(true));
        let (rows, filled) = rayon::join(|| block.parse(table, colors), || is_more.then(|| fill(&mut ahead)));

        // A fault in these lines comes before an error behind them.
        for (parsed, (line, _)) in rows.into_iter().zip(&block.lines) {
            match parsed {
                Parsed::Row(row) => each(reading, Place { index, line: *line }, &row)?,
                Parsed::Wider => return Ok(false),
                Parsed::Fault(why) => reading.fault(Error::line(path, *line, why))?,
            }
            index = index.saturating_add(1);
        }
        let Some(filled) = filled else { return more.map(|_| true) };
        more = filled;
        std::mem::swap(&mut block, &mut ahead);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::annotations::AnnotationOptions;
    use crate::cloud::on_fault::OnFault;
    use crate::cloud::table::rows::{CloudTags, Rows};
    use crate::cloud::table::words::Separator;

    /// The lines of a file that cannot be read behind its 100,000th line.
    fn next(number: &mut u64, faulty: u64, block: &mut LineBlock) -> Result<bool> {
        *number += 1;
        if *number > 100_000 {
            return Err(Error::format(Path::new("a.txt"), "the disk is gone"));
        }
        let x = if *number == faulty {
            "x".to_owned()
        } else {
            number.to_string()
        };
        block.push(*number, format!("{x} 0 0 1").as_bytes());
        Ok(true)
    }

    /// Returns the x of all rows, the places where they come from, what was left out, and the error.
    fn read(faulty: u64, on_fault: OnFault) -> (Vec<f32>, Vec<Place>, Option<String>, String) {
        let path = Path::new("a.txt");
        let names = ["x", "y", "z", "class"].map(str::to_owned);
        let options = AnnotationOptions { on_fault, ..AnnotationOptions::default() };
        let table = WordTable::new(path, &names, Separator::Blanks, |_| false, (&options).into()).unwrap();
        let (mut tags, mut x, mut places) = (CloudTags::new(), Vec::new(), Vec::new());
        let mut sink = |rows: &Rows| {
            x.extend(rows.positions.iter().map(|p| p.x));
            Ok(())
        };
        let mut reading = Reading::new(path, &options, 0, &mut tags, &mut sink);

        let mut number = 0;
        let next = |block: &mut LineBlock| next(&mut number, faulty, block);
        let end = parse_lines(path, &table, ColorRange::Narrow, &mut reading, next, |reading, place, row| {
            places.push(place);
            reading.push_line(place.line, row)
        });
        reading.flush().unwrap();
        let first = reading.skipped.first.take().map(|e| e.to_string());
        (x, places, first, end.unwrap_err().to_string())
    }

    #[test]
    fn rows_keep_their_order_over_blocks() {
        let (x, places, first, end) = read(70_000, OnFault::Skip);
        let expected = |i: &u64| *i != 70_000;
        assert!(x.into_iter().eq((1..=100_000).filter(expected).map(|i| i as f32)));
        let place = |line: u64| Place { index: line - 1, line };
        assert!(places.into_iter().eq((1..=100_000).filter(expected).map(place)));
        assert_eq!(first.as_deref(), Some("a.txt, line 70000: the coordinate `x` is no number"));
        assert_eq!(end, "a.txt: the disk is gone");
    }

    #[test]
    fn a_faulty_line_comes_before_an_error_behind_it() {
        let (x, _, _, end) = read(99_999, OnFault::Stop);
        assert_eq!(end, "a.txt, line 99999: the coordinate `x` is no number");
        assert_eq!(x.len(), 99_998);
    }
}
