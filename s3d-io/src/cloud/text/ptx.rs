//! PTX: organised scans, each with a header of ten lines and a pose.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::cloud::ColorRange;
use crate::cloud::table::line_block::{LineBlock, parse_lines};
use crate::cloud::table::measured::{Measured, Told};
use crate::cloud::table::rows::{Reading, Row};
use crate::cloud::table::wanted::{Wanted, usual_names};
use crate::cloud::table::words::Lines;
use crate::cloud::text::layout::Layout;
use crate::cloud::text::read::TextFile;
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use crate::fs::text::words;
use s3d_geom::glam::{DAffine3, DVec3};
use std::path::Path;

/// A scan's header.
#[derive(Clone, Debug)]
pub(crate) struct Scan {
    pub(crate) columns: u64,
    pub(crate) rows: u64,
    /// Where the header says that the scanner was, in the file's frame.
    pub(crate) scanner: DVec3,
    /// From the scan to the file's frame.
    pub(crate) pose: DAffine3,
    /// `columns` × `rows`.
    points: u64,
}

/// A scan of a file: its header, and where it begins.
#[derive(Clone, Debug)]
pub(crate) struct ScanPlace {
    pub(crate) scan: Scan,
    /// The number of words in the line of its first point; 0 if it has none.
    pub(crate) width: usize,
    /// The bytes and the lines before its header.
    before: (u64, u64),
}

impl Scan {
    /// Reads the ten lines: columns, rows, the scanner's place and axes, and a matrix whose last row is the
    /// shift. Returns `None` at the end of the file.
    fn read(path: &Path, lines: &mut Lines<TextFile>) -> Result<Option<Self>> {
        let columns = loop {
            match lines.next()? {
                None => return Ok(None),
                Some([]) => {}
                Some(_) => break count(path, lines)?,
            }
        };
        next(path, lines)?;
        let rows = count(path, lines)?;
        let mut place = [[0.0; 3]; 4];
        for row in &mut place {
            next(path, lines)?;
            *row = numbers(path, lines)?;
        }
        let [scanner, ..] = place.map(DVec3::from_array);

        let mut matrix = [DVec3::ZERO; 4];
        for row in &mut matrix {
            next(path, lines)?;
            let [x, y, z, _] = numbers(path, lines)?;
            *row = DVec3::new(x, y, z);
        }
        let [x, y, z, shift] = matrix;
        let points = columns
            .checked_mul(rows)
            .ok_or_else(|| Error::line(path, lines.number(), format!("claims {columns} × {rows} points")))?;
        let pose = DAffine3::from_cols(x, y, z, shift);
        Ok(Some(Self { columns, rows, scanner, pose, points }))
    }
}

impl Scan {
    /// Returns the row and column of the point with a number. A scan is written column by column.
    fn cell(&self, number: u64) -> Option<[u32; 2]> {
        let row = number.checked_rem(self.rows)?;
        let column = number.checked_div(self.rows)?;
        Some([u32::try_from(row).ok()?, u32::try_from(column).ok()?])
    }
}

/// Reads the next line, which must be there.
fn next(path: &Path, lines: &mut Lines<TextFile>) -> Result<()> {
    if lines.next()?.is_some() {
        return Ok(());
    }
    let message = format!("ends in the header of a scan, after line {}: it is cut short", lines.number());
    Err(Error::format(path, message))
}

fn count(path: &Path, lines: &Lines<TextFile>) -> Result<u64> {
    let word = std::str::from_utf8(lines.line()).ok();
    word.and_then(|word| word.parse().ok()).ok_or_else(|| {
        let message = format!(
            "{} is no number of columns or rows, with which a scan of a PTX file begins",
            quote(lines.line())
        );
        Error::line(path, lines.number(), message)
    })
}

/// The finite numbers of the last line.
fn numbers<const N: usize>(path: &Path, lines: &Lines<TextFile>) -> Result<[f64; N]> {
    let parsed = words(lines.line()).map(|word| std::str::from_utf8(word).ok()?.parse().ok());
    let parsed: Option<Vec<f64>> = parsed.collect();
    let all = parsed.filter(|all| all.iter().all(|v| v.is_finite()));
    all.and_then(|all| <[f64; N]>::try_from(all).ok()).ok_or_else(|| {
        let line = quote(lines.line());
        Error::line(path, lines.number(), format!("{N} numbers of a PTX header are due: {line}"))
    })
}

/// Lists the scans of a file. All its lines are passed over, but no point is parsed.
#[cfg(feature = "raw")]
pub(crate) fn list(path: &Path, lines: &mut Lines<TextFile>) -> Result<Vec<ScanPlace>> {
    let mut places = Vec::new();
    loop {
        let before = (lines.bytes(), lines.number());
        let Some(scan) = Scan::read(path, lines)? else { return Ok(places) };
        let mut width = 0;
        let mut done = 0u64;
        while done < scan.points {
            if lines.next()?.is_none() {
                return Err(cut_short(path, done, &scan));
            }
            if lines.line().is_empty() {
                continue;
            }
            if done == 0 {
                width = words(lines.line()).count();
            }
            done = done.saturating_add(1);
        }
        places.push(ScanPlace { scan, width, before });
    }
}

#[cfg(feature = "raw")]
impl ScanPlace {
    /// Returns the bytes and the lines before the scan's header.
    pub(crate) fn before(&self) -> (u64, u64) {
        self.before
    }
}

fn cut_short(path: &Path, done: u64, scan: &Scan) -> Error {
    Error::format(path, format!("ends after {done} of {} points of a scan: it is cut short", scan.points))
}

/// Reads the scans of a file, at most so many. Points at 0 0 0 are rays without a return, and left out.
/// `open` opens the file at the header of a scan.
pub(super) fn read_ptx(
    path: &Path,
    open: impl Fn() -> Result<Lines<TextFile>>,
    wanted: Wanted<'_>,
    most: Option<u64>,
    colors: ColorRange,
    reading: &mut Reading<'_>,
) -> Result<bool> {
    let mut lines = open()?;
    if Scan::read(path, &mut lines)?.is_none() {
        return Err(Error::format(path, "holds no scan"));
    }
    let layout = Layout::find(path, &mut lines, false)?;
    let table = layout.table(path, wanted, usual_names)?;

    let mut lines = open()?;
    let mut points = 0u64;
    let mut empty = 0u64;
    let mut scans = 0u64;
    while most.is_none_or(|most| scans < most)
        && let Some(scan) = Scan::read(path, &mut lines)?
    {
        scans = scans.saturating_add(1);
        reading.told = Told { has_grid: true, ..table.told(Some(scan.points)) };
        let mut done = 0u64;
        let next = |block: &mut LineBlock| {
            if done == scan.points {
                return Ok(false);
            }
            if lines.next()?.is_none() {
                return Err(cut_short(path, done, &scan));
            }
            if !lines.line().is_empty() {
                done = done.saturating_add(1);
                block.push(lines.number(), lines.line());
            }
            Ok(true)
        };
        let is_narrow = parse_lines(path, &table, colors, reading, next, |reading, place, row| {
            if row.position == DVec3::ZERO {
                empty = empty.saturating_add(1);
                return Ok(());
            }
            let position = scan.pose.transform_point3(row.position);
            let measured = Measured { cell: scan.cell(place.index), ..row.measured };
            reading.push_line(place.line, &Row { position, measured, ..*row })
        })?;
        if !is_narrow {
            return Ok(false);
        }
        points = points.saturating_add(done);
    }

    if empty > 0 {
        let path = path.display();
        let note = format!("{path}: {empty} of {points} points are 0 0 0, rays without a return; left out");
        reading.notes.push(note);
    }
    Ok(true)
}
