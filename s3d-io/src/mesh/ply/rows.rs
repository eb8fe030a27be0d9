//! Reads rows in each encoding of PLY: of a fixed size, with lists, and as words.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::fs::quote::quote;
use crate::mesh::ply::batch::PlyBatch;
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::ply::header::{PlyEncoding, PlyProperty, PlyType};
use crate::mesh::ply::source::{BUFFER, Fault, Outcome, column_of, decode, number, parse_f64};

/// A batch ends early when its lists hold this many numbers.
const BATCH_VALUES: usize = 1 << 18;
/// The largest number of entries in a list. Strips of the largest published scans have a tenth of it.
const MAX_LIST: usize = 1 << 26;

impl PlyReader<'_> {
    /// Reads rows of a fixed size, column by column.
    pub(super) fn fixed_rows(
        &mut self,
        properties: &[PlyProperty],
        rows: u64,
        batch: &mut PlyBatch,
    ) -> Outcome {
        let size: usize = properties.iter().map(|p| p.kind.size()).sum();
        if rows == 0 {
            return Ok(());
        }
        if !self.source.need(size)? {
            return Err(Fault::End);
        }

        let bytes = self.source.bytes();
        let there = bytes.len().checked_div(size).unwrap_or(0);
        let rows = usize::try_from(rows).map_or(there, |rows| rows.min(there));
        let bytes = bytes.get(..rows.saturating_mul(size)).unwrap_or_default();

        let big = self.header.encoding == PlyEncoding::BigEndian;
        let mut offset = 0usize;
        for ((property, wanted), column) in properties.iter().zip(&self.wanted).zip(&mut batch.columns) {
            if *wanted {
                column_of(bytes, size, offset, property.kind, big, &mut column.values);
            }
            offset = offset.saturating_add(property.kind.size());
        }

        batch.rows = rows;
        let read = bytes.len();
        self.source.pass(read);
        Ok(())
    }

    /// Reads rows with lists. The size of each row is known only when it is read.
    pub(super) fn binary_rows(
        &mut self,
        properties: &[PlyProperty],
        rows: u64,
        batch: &mut PlyBatch,
    ) -> Outcome {
        let big = self.header.encoding == PlyEncoding::BigEndian;
        let mut values = 0usize;

        for _ in 0..rows {
            for ((property, wanted), column) in properties.iter().zip(&self.wanted).zip(&mut batch.columns) {
                let column = wanted.then_some(column);
                let n = match property.list {
                    None => 1,
                    Some(kind) => {
                        let length = number(self.source.take(kind.size())?, kind, big);
                        list_length(length, column.is_some(), property).map_err(Fault::Row)?
                    }
                };

                let size = property.kind.size();
                let Some(column) = column else {
                    self.source.skip((n as u64).saturating_mul(size as u64))?;
                    continue;
                };

                let mut rest = n.saturating_mul(size);
                while rest > 0 {
                    let bytes = self.source.take(rest.min(BUFFER / 2))?;
                    decode(bytes, property.kind, big, &mut column.values);
                    rest = rest.saturating_sub(bytes.len());
                }
                if property.is_list() {
                    column.ends.push(column.values.len());
                    values = values.saturating_add(n);
                }
            }

            batch.rows = batch.rows.saturating_add(1);
            if values > BATCH_VALUES {
                break;
            }
        }
        Ok(())
    }

    /// Reads rows of words. A row starts on a new line and may continue on the next.
    #[expect(
        clippy::indexing_slicing,
        reason = "`wanted` and the batch's columns have an entry for each property"
    )]
    pub(super) fn ascii_rows(
        &mut self,
        properties: &[PlyProperty],
        rows: u64,
        batch: &mut PlyBatch,
    ) -> Outcome {
        let mut values = 0usize;

        for _ in 0..rows {
            for (p, property) in properties.iter().enumerate() {
                let wanted = self.wanted[p];
                let n = match property.list {
                    None => 1,
                    Some(kind) => {
                        let length = self.ascii_number(kind, property)?;
                        self.check_row_start(p == 0, batch)?;
                        list_length(length, wanted, property).map_err(|m| Fault::Line(self.line, m))?
                    }
                };

                for k in 0..n {
                    let value = self.ascii_number(property.kind, property)?;
                    self.check_row_start(p == 0 && k == 0 && !property.is_list(), batch)?;
                    if wanted {
                        batch.columns[p].values.push(value);
                    }
                }

                if wanted && property.is_list() {
                    let column = &mut batch.columns[p];
                    column.ends.push(column.values.len());
                    values = values.saturating_add(n);
                }
            }

            self.row_end = self.line;
            batch.rows = batch.rows.saturating_add(1);
            if values > BATCH_VALUES {
                break;
            }
        }
        Ok(())
    }

    /// Notes the line of a row, at its first number. A row may not start on the line of the previous one.
    fn check_row_start(&self, first: bool, batch: &mut PlyBatch) -> Outcome {
        if !first {
            return Ok(());
        }
        if self.line == self.row_end {
            let message = "this line has more numbers than the row before needs; are properties missing in \
                           the header, or numbers on the line before?";
            return Err(Fault::Line(self.line, message.into()));
        }
        batch.lines.push(self.line);
        Ok(())
    }

    /// Reads a word and the number that it spells.
    fn ascii_number(&mut self, kind: PlyType, property: &PlyProperty) -> std::result::Result<f64, Fault> {
        let word = self.source.word(self.header.line_end, &mut self.line)?;
        let Some(value) = parse_f64(word) else {
            return Err(Fault::Line(
                self.line,
                format!("{} is no number, but {} is", quote(word), property.name),
            ));
        };
        if kind.is_integer() {
            let (least, most) = kind.range();
            if value.fract() != 0.0 || !(least..=most).contains(&value) {
                let word = quote(word);
                let name = &property.name;
                let kind = kind.name();
                return Err(Fault::Line(self.line, format!("{word} does not fit {name}, which is a {kind}")));
            }
        }
        Ok(value)
    }
}

/// Checks the length of a list. A list that is not wanted may have any number of entries.
fn list_length(length: f64, wanted: bool, property: &PlyProperty) -> std::result::Result<usize, String> {
    if length < 0.0 {
        return Err(format!("the list {} has a length of {length}", property.name));
    }
    if wanted && length > MAX_LIST as f64 {
        return Err(format!("the list {} has {length} entries; up to {MAX_LIST} are read", property.name));
    }
    #[expect(clippy::cast_possible_truncation, reason = "a whole number of at most 32 bits")]
    Ok(length as usize)
}
