//! PTX: organised scans, each with a header of ten lines and a pose.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::table::cloud::ColorRange;
use crate::cloud::table::rows::{Reading, Row};
use crate::cloud::table::words::{Lines, Parsed};
use crate::cloud::text::layout::Layout;
use crate::cloud::text::read::{TextFile, scanner_names};
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use crate::fs::text::words;
use s3d_geom::glam::{DAffine3, DVec3};
use std::path::Path;

/// A scan's header.
struct Scan {
    points: u64,
    /// World from scan.
    pose: DAffine3,
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
        for _ in 0..4 {
            next(path, lines)?;
            numbers::<3>(path, lines)?;
        }

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
        Ok(Some(Self { points, pose: DAffine3::from_cols(x, y, z, shift) }))
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

/// Reads all scans of a file. Points at 0 0 0 are rays without a return, and left out.
pub(super) fn read_ptx(
    path: &Path,
    open: impl Fn() -> Result<Lines<TextFile>>,
    options: &AnnotationOptions,
    colors: ColorRange,
    reading: &mut Reading<'_>,
) -> Result<bool> {
    let mut lines = open()?;
    if Scan::read(path, &mut lines)?.is_none() {
        return Err(Error::format(path, "holds no scan"));
    }
    let layout = Layout::find(path, &mut lines, false)?;
    let table = layout.table(path, options, scanner_names)?;

    let mut lines = open()?;
    let mut points = 0u64;
    let mut empty = 0u64;
    while let Some(scan) = Scan::read(path, &mut lines)? {
        let mut done = 0u64;
        while done < scan.points {
            if lines.next()?.is_none() {
                let message =
                    format!("ends after {done} of {} points of a scan: it is cut short", scan.points);
                return Err(Error::format(path, message));
            }
            let line = lines.line();
            if line.is_empty() {
                continue;
            }

            done = done.saturating_add(1);
            match table.parse(line, colors) {
                Parsed::Row(row) if row.position == DVec3::ZERO => empty = empty.saturating_add(1),
                Parsed::Row(row) => {
                    let position = scan.pose.transform_point3(row.position);
                    reading.push_line(lines.number(), &Row { position, ..row })?;
                }
                Parsed::Wider => return Ok(false),
                Parsed::Fault(why) => reading.fault(Error::line(path, lines.number(), why))?,
            }
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
