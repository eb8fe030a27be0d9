//! Lines of a text, gathered in blocks that all threads parse.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::cloud::ColorRange;
use crate::cloud::table::rows::{Reading, Row};
use crate::cloud::table::words::{Parsed, WordTable};
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::path::Path;

/// The bytes of lines that are parsed together.
const BLOCK_BYTES: usize = 1 << 20;
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

/// Parses lines block by block, on all threads; meanwhile the next block is read. `next` adds the next line to a block, or none, and returns
/// false at the end. `each` gets the rows in their order. Returns false if a colour may be in a wider range.
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
        while block.bytes.len() < BLOCK_BYTES {
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
