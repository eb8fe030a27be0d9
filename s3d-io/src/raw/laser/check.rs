//! Looks at the first points of each scan: what they have, and whether they can be metres from the scanner.

use crate::error::{Error, Result};
use crate::raw::laser::read::move_into_world;
use crate::raw::laser::{LaserScans, ScanInfo};
use s3d_geom::glam::DVec3;

/// A median distance from the scanner above this is no building's, metres; nor is one below.
const FARTHEST_M: f64 = 1000.0;
const NEAREST_M: f64 = 0.02;

/// Reads the first points of each scan, fills in what they have, and refuses distances that cannot be metres.
///
/// # Errors
/// The errors of reading; [`Error::Format`] for a scan whose distances are too large or too small.
pub(super) fn look(found: &mut LaserScans) -> Result<()> {
    let LaserScans { scans, sources, trajectory, world_from_file, columns, on_fault, .. } = found;
    for (scan, source) in scans.iter_mut().zip(sources) {
        let mut places = Vec::new();
        let mut times = Vec::new();
        let passed = source.read_first(columns, *on_fault, &mut |block| {
            move_into_world(block, world_from_file);
            places.append(&mut block.positions_m);
            times.append(&mut block.times_s);
            Ok(())
        })?;
        let told = passed.told;
        scan.points = scan.points.or(told.points);
        scan.has_colors = told.has_colors;
        scan.has_intensity = told.has_intensity;
        scan.has_times = told.has_times;

        if let Some(trajectory) = trajectory {
            if !told.has_times {
                let message = "has no times, so the trajectory does not tell where the scanner was: export \
                               the points with their GPS time";
                return Err(Error::format(&scan.path, message));
            }
            scan.origin_m = None;
            let origins = times.iter().map(|time| trajectory.place_at(*time));
            let ranges = places.iter().zip(origins);
            check(
                scan,
                ranges
                    .filter_map(|(place, origin)| Some(place.distance(origin?)))
                    .collect(),
            )?;
        } else if let Some(origin) = scan.origin_m {
            check(scan, places.iter().map(|place: &DVec3| place.distance(origin)).collect())?;
        }
    }
    Ok(())
}

/// Refuses a scan whose median range is too large or too small.
fn check(scan: &ScanInfo, mut ranges_m: Vec<f64>) -> Result<()> {
    ranges_m.retain(|range| *range > 0.0);
    if ranges_m.is_empty() {
        return Ok(());
    }
    let middle = ranges_m.len() / 2;
    let (_, median_m, _) = ranges_m.select_nth_unstable_by(middle, f64::total_cmp);
    let median_m = *median_m;
    if (NEAREST_M..=FARTHEST_M).contains(&median_m) {
        return Ok(());
    }

    let is_far = median_m > FARTHEST_M;
    let scale = if is_far { 0.001 } else { 1000.0 };
    let message = format!(
        "{}: half of the first points are {} than {median_m:.4} m from the scanner: is its place in the \
         frame of the points, and are these metres? With a scale of {scale}, it would be {:.2} m",
        scan.name,
        if is_far { "farther" } else { "nearer" },
        median_m * scale
    );
    Err(Error::format(&scan.path, message))
}
