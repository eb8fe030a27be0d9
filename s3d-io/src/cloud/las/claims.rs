//! Checks the claims of a LAS header against the file, before the decoder believes them.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::number_at;
use crate::error::{Error, Result};
use crate::fs::source::{Bytes, Source};
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

/// The most points that a byte of a compressed file stands for: a hundred times as many as in the flattest
/// scans. Layers that say nothing take no bytes, so a header could claim any number.
const MAX_POINTS_PER_BYTE: u64 = 1024;

/// Where the header counts its records, and where its extended records.
const VLRS_AT: u64 = 100;
const EVLRS_AT: u64 = 243;

/// The compressor of LASzip that makes no chunks.
const WITHOUT_CHUNKS: u16 = 1;

/// Wrong numbers of the header: where each stands, and the right number.
pub(super) type Mends = Vec<(u64, u32)>;

/// The points, as the header describes them.
struct Points {
    /// Where they start in the file.
    start: u64,
    record_bytes: u64,
    count: u64,
    is_compressed: bool,
}

/// Checks the header of a file and returns its wrong numbers. Records that are missing are reported in
/// `notes` and mended: they hold coordinate systems and names of dimensions, which the points can do without.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no LAS file or is cut short.
pub(super) fn check_claims(source: &Source, notes: &mut Vec<String>) -> Result<Mends> {
    let path = source.name();
    let (file, size) = source.open()?;
    let mut file = BufReader::new(file);
    let mut head = Vec::new();
    file.by_ref()
        .take(375)
        .read_to_end(&mut head)
        .map_err(|e| Error::io(path, "read", e))?;

    let Some(header) = head.first_chunk::<227>().filter(|h| h.starts_with(b"LASF")) else {
        return Err(Error::format(path, "is no LAS file: it does not begin with LASF and a header"));
    };
    let header_1_4 = head.first_chunk::<375>().filter(|h| h[25] >= 4);
    let points = Points::of_header(header, header_1_4);
    points.check_size(path, size)?;

    let mut mends = Mends::new();
    mends.extend(check_records(path, &mut file, header, points.start, notes)?);
    if let Some(header) = header_1_4 {
        mends.extend(check_extended_records(path, &mut file, size, header, &points, notes));
    }
    if points.is_compressed {
        if compressor(&mut file, header, points.start) == Some(WITHOUT_CHUNKS) {
            let message = "is compressed point by point, as LASzip did before version 2: compress it anew, \
                           as LAStools do with `las2las -i OLD.laz -o NEW.laz`";
            return Err(Error::unsupported(path, message));
        }
        check_chunk_table(path, &mut file, size, points.start)?;
    }
    Ok(mends)
}

impl Points {
    fn of_header(header: &[u8; 227], header_1_4: Option<&[u8; 375]>) -> Self {
        let count = u64::from(number_at(header, 107).map_or(0, u32::from_le_bytes));
        let count_1_4 = header_1_4.and_then(|h| number_at(h, 247)).map_or(0, u64::from_le_bytes);
        Self {
            start: u64::from(number_at(header, 96).map_or(0, u32::from_le_bytes)),
            record_bytes: u64::from(number_at(header, 105).map_or(0, u16::from_le_bytes)),
            count: count.max(count_1_4),
            is_compressed: header[104] & 0x80 != 0,
        }
    }

    /// Where the points would end uncompressed. `None`: beyond 64 bits.
    fn end(&self) -> Option<u64> {
        self.count
            .checked_mul(self.record_bytes)
            .and_then(|n| n.checked_add(self.start))
    }

    fn check_size(&self, path: &Path, size: u64) -> Result<()> {
        let is_bomb = self.is_compressed && self.count > size.saturating_mul(MAX_POINTS_PER_BYTE);
        let is_cut = self.end().is_none_or(|end| !self.is_compressed && end > size);
        if self.start > size || is_bomb || is_cut {
            let Self { count, record_bytes, .. } = self;
            let claim = format!("{count} points of {record_bytes} bytes in a file of {size} bytes");
            return Err(cut_short(path, &claim));
        }
        Ok(())
    }
}

fn cut_short(path: &Path, claim: &str) -> Error {
    Error::format(path, format!("claims {claim}: the file is cut short"))
}

/// Counts the records before the points, and mends the header's count if some are missing.
fn check_records(
    path: &Path,
    file: &mut BufReader<Bytes>,
    header: &[u8; 227],
    points_start: u64,
    notes: &mut Vec<String>,
) -> Result<Option<(u64, u32)>> {
    let claimed = number_at(header, 100).map_or(0, u32::from_le_bytes);
    let start = u64::from(number_at(header, 94).map_or(0, u16::from_le_bytes));
    let there = whole_records(file, start..points_start, claimed).map_err(|e| Error::io(path, "read", e))?;
    if there == claimed {
        return Ok(None);
    }
    notes.push(format!(
        "{}: its header counts {claimed} records before the points, and {there} are there; those are read",
        path.display()
    ));
    Ok(Some((VLRS_AT, there)))
}

/// Counts the records, up to `claimed`, that lie one after the other and whole in a range of bytes.
fn whole_records(file: &mut BufReader<Bytes>, place: Range<u64>, claimed: u32) -> std::io::Result<u32> {
    let mut at = place.start;
    let mut head = [0; 54];
    for n in 0..claimed {
        if at.saturating_add(54) > place.end {
            return Ok(n);
        }
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut head)?;
        let length = number_at(&head, 20).map_or(0, u16::from_le_bytes);
        at = at.saturating_add(54).saturating_add(u64::from(length));
        if at > place.end {
            return Ok(n);
        }
    }
    Ok(claimed)
}

/// Checks the extended records of a 1.4 header, whose lengths have 64 bits. Mends their count to 0 if the
/// first is not where the header says.
fn check_extended_records(
    path: &Path,
    file: &mut BufReader<Bytes>,
    size: u64,
    header: &[u8; 375],
    points: &Points,
    notes: &mut Vec<String>,
) -> Option<(u64, u32)> {
    if number_at(header, 243).map_or(0, u32::from_le_bytes) == 0 {
        return None;
    }
    let start = number_at(header, 235).map_or(0, u64::from_le_bytes);
    let mut record = [0; 60];
    let read = file
        .seek(SeekFrom::Start(start))
        .and_then(|_| file.read_exact(&mut record));

    let length = number_at(&record, 20).map_or(0, u64::from_le_bytes);
    let is_inside = start
        .checked_add(60)
        .and_then(|n| n.checked_add(length))
        .is_some_and(|n| n <= size);
    let is_behind = points.is_compressed || points.end().is_some_and(|end| end <= start);
    if start == 0 || (read.is_ok() && is_inside && is_behind) {
        return None;
    }
    notes.push(format!(
        "{}: its header tells of extended records at byte {start}, where none are; it is read without them",
        path.display()
    ));
    Some((EVLRS_AT, 0))
}

/// Returns which of LASzip's compressors made the points, as the first number of its record states.
fn compressor(file: &mut BufReader<Bytes>, header: &[u8; 227], points_start: u64) -> Option<u16> {
    let mut at = u64::from(number_at(header, 94).map_or(0, u16::from_le_bytes));
    let mut record = [0; 56];
    while at < points_start {
        file.seek(SeekFrom::Start(at)).ok()?;
        file.read_exact(&mut record).ok()?;
        if record.get(2..)?.starts_with(b"laszip encoded") {
            return number_at(&record, 54).map(u16::from_le_bytes);
        }
        let length = number_at(&record, 20).map_or(0, u16::from_le_bytes);
        at = at.saturating_add(54).saturating_add(u64::from(length));
    }
    None
}

/// Checks that a compressed file has its table of chunks.
fn check_chunk_table(path: &Path, file: &mut BufReader<Bytes>, size: u64, points_start: u64) -> Result<()> {
    let mut table = read_u64(file, points_start);
    if table
        .as_ref()
        .is_ok_and(|t| t.cast_signed() <= points_start.cast_signed())
    {
        // A writer that could not seek back puts the table's place at the end.
        table = read_u64(file, size.saturating_sub(8));
    }
    // A chunk has at least one byte.
    match table.and_then(|at| read_u64(file, at)) {
        Ok(entry) if entry >> 32 <= size => Ok(()),
        _ => Err(cut_short(path, "a table of chunks that is not there")),
    }
}

fn read_u64(file: &mut BufReader<Bytes>, at: u64) -> std::io::Result<u64> {
    let mut bytes = [0; 8];
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}
