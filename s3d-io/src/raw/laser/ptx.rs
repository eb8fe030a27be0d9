//! The scans of a PTX file: their places and grids. Source: "Leica Cyclone: PTX and PTS file formats".

use crate::cloud::text::ptx::{Scan, list as list_scans};
use crate::cloud::text::read::lines_from;
use crate::error::{Error, Result};
use crate::fs::source::Source;
use crate::raw::laser::ScanInfo;
use crate::raw::laser::source::{Listed, Part, ScanSource};
use crate::raw::options::RawOptions;
use s3d_geom::Pose;
use s3d_geom::glam::{DMat3, DQuat, DVec3};
use std::io::Read;
use std::path::Path;

/// The largest error of a rotation matrix that was written with few decimals.
const ROTATION_ERROR: f64 = 1e-2;

/// Two places of one scanner are at most so far apart, metres.
const SAME_M: f64 = 0.01;

/// Returns whether the first bytes of a file are the header of a scan: two lines of one whole number, and
/// four of three numbers.
pub(super) fn is_ptx(head: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(head) else { return false };
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let mut is_count = || lines.next().is_some_and(|line| line.parse::<u64>().is_ok());
    let are_counts = is_count() && is_count();
    let is_place = |line: &str| {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        words.len() == 3 && words.iter().all(|word| word.parse::<f64>().is_ok())
    };
    are_counts && (0..4).all(|_| lines.next().is_some_and(is_place))
}

/// Lists the scans that have points. Also returns what is doubtful, a sentence each.
pub(super) fn list(path: &Path, options: &RawOptions) -> Result<Listed> {
    let source = Source::file(path);
    let mut start = [0; 2];
    let read = source
        .open()?
        .0
        .read(&mut start)
        .map_err(|e| Error::io(path, "read", e))?;
    if read == 2 && matches!(start, [0xff, 0xfe] | [0xfe, 0xff] | [0xef, 0xbb]) {
        return Err(Error::unsupported(
            path,
            "begins with a byte order mark: save it as plain text, without one",
        ));
    }

    let mut scans = Vec::new();
    let mut warnings = Vec::new();
    for (number, place) in list_scans(path, &mut lines_from(&source, (0, 0))?)?
        .into_iter()
        .enumerate()
    {
        let Scan { columns, rows, .. } = place.scan;
        if place.width == 0 {
            continue;
        }
        let name = format!("scan {number}");
        let (origin, warning) = origin_of(&place.scan);
        warnings.extend(warning.map(|warning| format!("{}: {name}: {warning}", path.display())));
        let pose = rotation_of(&place.scan.pose.matrix3)
            .map(|rotation| Pose::from_scanner(origin, rotation).moved(&options.world_from_file));

        let grid = u32::try_from(rows).ok().zip(u32::try_from(columns).ok());
        let (bytes, lines) = place.before();
        let info = ScanInfo {
            uuid: None,
            name,
            path: path.to_owned(),
            origin_m: Some(options.world_from_file.transform_point3(origin)),
            pose,
            grid: grid
                .filter(|(rows, columns)| *rows > 1 && *columns > 1)
                .map(|(rows, columns)| [rows, columns]),
            points: rows.checked_mul(columns),
            has_colors: matches!(place.width, 6 | 7),
            has_intensity: matches!(place.width, 4 | 7),
            has_times: false,
        };
        scans.push((info, ScanSource::new(path.to_owned(), Part::Ptx(bytes, lines))));
    }
    if scans.is_empty() {
        return Err(Error::format(path, "holds no scan with points"));
    }
    Ok((scans, warnings))
}

/// Returns where the scanner stood, in the frame of the file, and what is doubtful about it. The points are
/// measured from the zero of the scan, which the matrix takes to its place. Programs that write points in the
/// frame of the file have a matrix that moves nothing, and the place in another line.
fn origin_of(scan: &Scan) -> (DVec3, Option<String>) {
    let moved = scan.pose.translation;
    let told = scan.scanner;
    if moved == DVec3::ZERO {
        return (told, None);
    }
    let is_same = told == DVec3::ZERO || told.distance(moved) <= SAME_M;
    let warning = (!is_same)
        .then(|| format!("its header has the scanner at {told}, and its matrix at {moved}, which is taken"));
    (moved, warning)
}

/// Returns the rotation of a matrix, if it is one.
fn rotation_of(matrix: &DMat3) -> Option<DQuat> {
    let square = matrix.transpose() * *matrix;
    let is_rotation = square.abs_diff_eq(DMat3::IDENTITY, ROTATION_ERROR) && matrix.determinant() > 0.0;
    is_rotation.then(|| DQuat::from_mat3(matrix).normalize())
}
