//! Laser scans that do not tell where their scanner stood: their points may.

use crate::context::Context;
use crate::error::{Error, Result};
use glam::{DVec3, Vec3};
use s3d_fusion::find_origin;
use s3d_io::raw::LaserScans;

/// Of larger scans some points are kept, which look random.
const MOST_POINTS: usize = 4_000_000;

/// Finds the scanner's place for each scan without one. Returns a sentence about each.
///
/// # Errors
/// [`Error::Input`] if the points of a scan do not tell it.
pub(super) fn find_places(scans: &mut LaserScans, ctx: &Context) -> Result<Vec<String>> {
    let Err(missing) = scans.require_origins() else { return Ok(Vec::new()) };
    let mut told = Vec::new();
    for number in 0..scans.scans().len() {
        let info = scans.scans()[number].clone();
        if info.origin_m.is_some() {
            continue;
        }
        let (corner, points) = some_points(scans, number, ctx)?;
        let found = find_origin(&points).map_err(|why| {
            let missing = missing.message();
            Error::unfit(&info.path, format!("{missing}. Its points do not tell it either: {why}"))
        })?;
        let origin_m = corner + found.origin;
        let [x, y, z] = origin_m.to_array();
        told.push(format!(
            "{}: scan {} does not tell where the scanner stood. By its points it was at {x:.2}, {y:.2}, \
             {z:.2}: {:.1} % of them lie behind others from there. If that is wrong, give the place",
            info.path.display(),
            info.name,
            found.hidden * 100.0
        ));
        scans.place(number, origin_m);
    }
    Ok(told)
}

/// Reads some points of a scan. They are relative to the first, since positions are numbers of 32 bits.
fn some_points(scans: &LaserScans, number: usize, ctx: &Context) -> Result<(DVec3, Vec<Vec3>)> {
    let mut corner = None;
    let mut points: Vec<(u32, Vec3)> = Vec::new();
    let (mut most, mut seen) = (u32::MAX, 0_u32);
    scans.read(number, |block| {
        ctx.check()?;
        for position in &block.positions_m {
            // Multiples of the golden ratio fall evenly, and repeat no pattern of the scanner.
            let chance = seen.wrapping_mul(0x9e37_79b9);
            seen = seen.wrapping_add(1);
            if chance <= most {
                let corner = *corner.get_or_insert(*position);
                points.push((chance, (*position - corner).as_vec3()));
            }
        }
        while points.len() > MOST_POINTS {
            most /= 2;
            points.retain(|(chance, _)| *chance <= most);
        }
        Ok::<(), Error>(())
    })?;
    Ok((corner.unwrap_or_default(), points.into_iter().map(|(_, point)| point).collect()))
}
