//! Reads annotated points of PCD files.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::pcd::header::{Data, PcdField, PcdHeader};
use crate::cloud::pcd::lzf::Lzf;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::line_block::{LineBlock, parse_lines};
use crate::cloud::table::records::{Field, Kind, Part, Table};
use crate::cloud::table::rows::Reading;
use crate::cloud::table::wanted::Wanted;
use crate::cloud::table::words::{Lines, Separator, WordTable, is_packed};
use crate::error::{Error, Result};
use crate::fs::source::{Bytes, Source};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// The most bytes that one compressed byte stands for: three of them are at most 264.
const MOST_EXPANSION: u64 = 88;

/// A `.pcd` file.
pub(crate) struct PcdCloud<'a> {
    source: Source,
    wanted: Wanted<'a>,
}

/// The points of a file behind its header.
struct Body<'h> {
    header: &'h PcdHeader,
    /// Where they start.
    start: u64,
    /// The bytes of the file.
    size: u64,
}

impl<'a> PcdCloud<'a> {
    pub(crate) fn new(source: Source, wanted: Wanted<'a>) -> Self {
        Self { source, wanted }
    }

    /// Reads points as text. `lines` is behind the header.
    fn read_ascii(
        &self,
        header: &PcdHeader,
        mut lines: Lines<BufReader<Bytes>>,
        colors: ColorRange,
        reading: &mut Reading<'_>,
    ) -> Result<bool> {
        let path = self.source.name();
        let mut names = Vec::new();
        let mut floats = Vec::new();
        for field in &header.fields {
            names.extend((0..field.count).map(|i| field.column(i)));
            floats.extend((0..field.count).map(|_| field.kind.is_float()));
        }
        let is_float = |column: usize| floats.get(column).copied().unwrap_or(false);
        let table = WordTable::new(path, &names, Separator::Blanks, is_float, self.wanted)?;
        reading.told = table.told(Some(header.points));

        let mut done = 0u64;
        let mut holes = 0u64;
        let next = |block: &mut LineBlock| {
            if done == header.points {
                return Ok(false);
            }
            if lines.next()?.is_none() {
                let message = format!("has {} POINTS, and {done} are there: it is cut short", header.points);
                return Err(Error::format(path, message));
            }
            if !lines.line().is_empty() {
                done = done.saturating_add(1);
                block.push(lines.number(), lines.line());
            }
            Ok(true)
        };
        let is_narrow = parse_lines(path, &table, colors, reading, next, |reading, place, row| {
            if row.position.is_nan() {
                holes = holes.saturating_add(1);
                return Ok(());
            }
            reading.push_line(place.line, row)
        })?;
        if !is_narrow {
            return Ok(false);
        }

        // PCL reads no more either.
        while let Some(line) = lines.next()? {
            if !line.is_empty() {
                let shown = path.display();
                reading
                    .notes
                    .push(format!("{shown}: lines after its {done} POINTS are left out"));
                break;
            }
        }
        self.note(holes, header, reading);
        Ok(true)
    }

    fn read_binary(&self, body: &Body<'_>, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let path = self.source.name();
        let mut fields = Vec::new();
        let mut stride = 0usize;
        for field in &body.header.fields {
            if !field.is_padding() {
                push_columns(&mut fields, field, stride);
            }
            stride = stride.saturating_add(field.size());
        }

        let table = self.table(fields, stride)?;
        let left = body.size.saturating_sub(body.start);
        if body
            .header
            .points
            .checked_mul(stride as u64)
            .is_none_or(|bytes| bytes > left)
        {
            return Err(self.cut_short(body.header, stride, left));
        }
        let file = self.file_at(body.start)?;
        let is_narrow = table.read(path, file, body.header.points, colors, reading)?;
        self.note(table.holes.map_or(0, Cell::into_inner), body.header, reading);
        Ok(is_narrow)
    }

    /// Reads compressed points. In them, the numbers of all points lie side by side, field after field; each
    /// field that is needed gets its own reader of the file.
    fn read_compressed(
        &self,
        body: &Body<'_>,
        colors: ColorRange,
        reading: &mut Reading<'_>,
    ) -> Result<bool> {
        let path = self.source.name();
        let mut fields = Vec::new();
        // Each field's place in a point, and its bytes. Padding is not stored.
        let mut stored = Vec::new();
        let mut stride = 0usize;
        for field in body.header.fields.iter().filter(|f| !f.is_padding()) {
            push_columns(&mut fields, field, stride);
            stored.push((stride, field.size()));
            stride = stride.saturating_add(field.size());
        }

        let table = self.table(fields, stride)?;
        let compressed = self.check_compressed(body, stride)?;
        let wanted = wanted_bytes(&table);
        let mut parts = Vec::new();
        for (at, stride) in stored {
            let end = at.saturating_add(stride);
            if wanted.range(at..end).next().is_none() {
                continue;
            }
            let file = self.file_at(body.start.saturating_add(8))?.take(compressed);
            let mut source = Lzf::new(file);
            let before = body.header.points.saturating_mul(at as u64);
            let skipped = std::io::copy(&mut source.by_ref().take(before), &mut std::io::sink());
            let skipped = skipped.map_err(|e| Error::format(path, format!("cannot be unpacked: {e}")))?;
            if skipped < before {
                let message = format!("ends after {skipped} bytes of its points: it is cut short");
                return Err(Error::format(path, message));
            }
            parts.push(Part { path: path.to_owned(), source, at, stride });
        }

        let is_narrow = table.read_parts(path, &mut parts, body.header.points, colors, reading)?;
        self.note(table.holes.map_or(0, Cell::into_inner), body.header, reading);
        Ok(is_narrow)
    }

    /// Checks the two sizes before compressed points, and returns the bytes of these.
    fn check_compressed(&self, body: &Body<'_>, stride: usize) -> Result<u64> {
        let path = self.source.name();
        let left = body.size.saturating_sub(body.start).saturating_sub(8);
        let mut sizes = [0; 8];
        self.file_at(body.start)?
            .read_exact(&mut sizes)
            .map_err(|_| Error::format(path, "ends before its compressed points: it is cut short"))?;
        let [a, b, c, d, e, f, g, h] = sizes;
        let compressed = u64::from(u32::from_le_bytes([a, b, c, d]));
        let unpacked = u64::from(u32::from_le_bytes([e, f, g, h]));

        if compressed > left {
            let message = format!("claims {compressed} bytes of points in {left}: it is cut short");
            return Err(Error::format(path, message));
        }
        let due = body.header.points.checked_mul(stride as u64);
        let most = compressed.saturating_mul(MOST_EXPANSION);
        if due.is_none_or(|due| due > unpacked || due > most) {
            return Err(self.cut_short(body.header, stride, unpacked.min(most)));
        }
        Ok(compressed)
    }

    fn table(&self, fields: Vec<Field>, stride: usize) -> Result<Table> {
        let mut table = Table::new(self.source.name(), fields, stride, self.wanted)?;
        table.holes = Some(Cell::new(0));
        Ok(table)
    }

    fn file_at(&self, at: u64) -> Result<BufReader<Bytes>> {
        let (mut file, _) = self.source.open()?;
        file.seek(SeekFrom::Start(at))
            .map_err(|e| Error::io(self.source.name(), "read", e))?;
        Ok(BufReader::with_capacity(1 << 16, file))
    }

    fn cut_short(&self, header: &PcdHeader, stride: usize, left: u64) -> Error {
        let points = header.points;
        let message = format!("claims {points} points of {stride} bytes in {left} bytes: it is cut short");
        Error::format(self.source.name(), message)
    }

    /// Tells how many points have no position: in an organised cloud, rays without a return.
    fn note(&self, holes: u64, header: &PcdHeader, reading: &mut Reading<'_>) {
        if holes > 0 {
            let path = self.source.name().display();
            let points = header.points;
            reading
                .notes
                .push(format!("{path}: {holes} of {points} points have no coordinates (NaN), left out"));
        }
    }
}

/// Adds the columns of a field that starts `at` bytes into a point. A packed colour becomes three bytes.
fn push_columns(fields: &mut Vec<Field>, field: &PcdField, at: usize) {
    let mut push = |name: String, at, kind| fields.push(Field { name, at, kind, big_endian: false });
    if is_packed(&field.name) && field.count == 1 && field.kind.size() == 4 {
        for (name, byte) in [("red", 2), ("green", 1), ("blue", 0)] {
            push(name.to_owned(), at.saturating_add(byte), Kind::U8);
        }
        return;
    }
    for i in 0..field.count {
        push(field.column(i), at.saturating_add(i.saturating_mul(field.kind.size())), field.kind);
    }
}

/// Where the columns that are read start in a record.
fn wanted_bytes(table: &Table) -> BTreeSet<usize> {
    let columns = table.columns.all();
    columns
        .filter_map(|i| table.fields.get(i))
        .map(|field| field.at)
        .collect()
}

impl Cloud for PcdCloud<'_> {
    fn path(&self) -> &Path {
        self.source.name()
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let path = self.source.name();
        let (file, size) = self.source.open()?;
        let mut lines = Lines::new(path, BufReader::with_capacity(1 << 18, file));
        let header = PcdHeader::read(path, &mut lines)?;
        let body = Body { header: &header, start: lines.bytes(), size };
        match header.data {
            Data::Ascii => self.read_ascii(&header, lines, colors, reading),
            Data::Binary => self.read_binary(&body, colors, reading),
            Data::Compressed => self.read_compressed(&body, colors, reading),
        }
    }
}
