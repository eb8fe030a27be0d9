//! Whether scans and depth pictures lie on each other, and motions that bring laser scans there.

use super::images::{Images, Seen};
use crate::context::Context;
use crate::error::{Error, Result};
use glam::DAffine3;
use s3d_fusion::{PairResidual, RegisterOptions, ScanPoints, pair_residuals, refine_poses};
use std::num::NonZeroU32;

/// Comparing more scans than these would take longer than fusing them.
const MOST_SCANS: usize = 100;

/// Two scans are off if a motion lessens their distance by this much, metres, and by half.
const OFF_M: f64 = 0.005;

/// So many depth pictures are compared, evenly spread over all.
const PICTURES: usize = 16;

/// Steps of a motion that tells whether a pair of depth pictures is off.
const PICTURE_STEPS: usize = 4;

/// So many points of a depth picture are compared with each other picture, at most.
const PICTURE_POINTS: usize = 800;

/// Of the rows and columns of a depth picture, each third is compared: a cube holds a dozen points of them.
const PICTURE_STRIDE: NonZeroU32 = NonZeroU32::new(3).unwrap();

/// Two depth pictures are off if a motion lessens their distance by this much, metres, and by half. Their
/// noise is larger than that of laser scans.
const PICTURES_OFF_M: f64 = 0.02;

/// The share of pairs of depth pictures that may be off before it is a warning. A person who walks by makes
/// some.
const MOST_OFF: f64 = 0.25;

/// Compares laser scans pair by pair and says which are off. Returns a motion for each scan if poses are to
/// be refined. Of depth pictures, some are compared.
///
/// # Errors
/// [`Error::Input`] if poses are to be refined, and the scans are no laser scans from fixed places.
pub(super) fn fit(images: &Images, refine: bool, ctx: &Context) -> Result<Option<Vec<DAffine3>>> {
    let names = images.scan_names();
    if names.is_empty() && !refine {
        compare_pictures(images, ctx)?;
        return Ok(None);
    }
    if names.len() != images.len() || names.len() < 2 || names.len() > MOST_SCANS {
        if refine {
            let why = format!("poses are refined of 2 to {MOST_SCANS} laser scans, and of nothing else");
            return Err(Error::unfit(images.path(), why));
        }
        return Ok(None);
    }

    let options = RegisterOptions::default();
    let task = ctx.progress("comparing", images.unit(), names.len() as u64);
    let mut scans = Vec::new();
    images.each(ctx, |seen, _| {
        if let Seen::Image(image) = seen {
            let (points, normals) = image.surface_points(options.cell_m as f32, NonZeroU32::MIN);
            scans.push(ScanPoints::sampled(&points, &normals, options.cell_m));
        }
        task.add(1);
        Ok(true)
    })?;
    if scans.len() != names.len() {
        let why = "some scans have no fixed place, or nothing in range: their poses are not compared";
        ctx.info(format_args!("{}: {why}", images.path().display()));
        return Ok(None);
    }

    let unfit = |e: s3d_fusion::RegisterError| Error::unfit(images.path(), e.to_string());
    let poses = vec![DAffine3::IDENTITY; scans.len()];
    let pairs = pair_residuals(&scans, &poses, &options).map_err(unfit)?;
    for pair in &pairs {
        let [a, b] = pair.scans.map(|scan| &names[scan]);
        let [before_mm, after_mm] = [&pair.before, &pair.after].map(|of| of.median_m * 1e3);
        let told = format!(
            "scans {a} and {b}: half of {} points are within {before_mm:.1} mm",
            pair.before.correspondences
        );
        let is_off = before_mm - after_mm > OFF_M * 1e3 && after_mm < before_mm / 2.0;
        match (is_off, refine) {
            (true, false) => ctx.warn(format_args!(
                "{told}, and {after_mm:.1} mm if one moves by {:.1} cm: their poses are off, and can be \
                 refined",
                pair.motion.translation.length() * 1e2
            )),
            _ => ctx.info(told),
        }
    }
    if !refine {
        return Ok(None);
    }

    let refined = refine_poses(&scans, &poses, &options).map_err(unfit)?;
    for (name, motion) in names.iter().zip(&refined.motions) {
        ctx.info(format_args!(
            "scan {name} moved by {:.1} mm and {:.3}°",
            motion.translation.length() * 1e3,
            motion.rotation.length().to_degrees()
        ));
    }
    for open in &refined.open {
        let moving: Vec<&str> = open.motions.iter().map(|(scan, _)| names[*scan].as_str()).collect();
        ctx.warn(format_args!(
            "a motion of {} changes no distance, as along a bare corridor: nothing was done along it",
            moving.join(", ")
        ));
    }
    Ok(Some(refined.poses))
}

/// Says how far the surfaces of some depth pictures are apart, and warns if their poses seem to be off.
fn compare_pictures(images: &Images, ctx: &Context) -> Result<()> {
    let options = RegisterOptions {
        iterations: PICTURE_STEPS,
        most_points: PICTURE_POINTS,
        min_correspondences: PICTURE_POINTS / 8,
        ..RegisterOptions::default()
    };
    let mut names = Vec::new();
    let mut scans = Vec::new();
    for (name, image) in images.some_pictures(PICTURES, ctx)? {
        let (points, normals) = image.surface_points(options.cell_m as f32, PICTURE_STRIDE);
        scans.push(ScanPoints::sampled(&points, &normals, options.cell_m));
        names.push(name);
    }

    let unfit = |e: s3d_fusion::RegisterError| Error::unfit(images.path(), e.to_string());
    let poses = vec![DAffine3::IDENTITY; scans.len()];
    let mut pairs = pair_residuals(&scans, &poses, &options).map_err(unfit)?;
    pairs.sort_by(|a, b| a.before.median_m.total_cmp(&b.before.median_m));
    let Some(worst) = pairs.last() else { return Ok(()) };

    let [a, b] = worst.scans.map(|scan| &names[scan]);
    let told = format!(
        "{} of {} depth pictures compared, of which {} pairs overlap: half of the points of a pair are \
         within {:.1} mm, and within {:.1} mm of {a} and {b}, the worst pair",
        scans.len(),
        images.len(),
        pairs.len(),
        pairs[pairs.len() / 2].before.median_m * 1e3,
        worst.before.median_m * 1e3,
    );
    let is_off = |pair: &&PairResidual| {
        let [before_m, after_m] = [&pair.before, &pair.after].map(|of| of.median_m);
        before_m - after_m > PICTURES_OFF_M && after_m < before_m / 2.0
    };
    let off = pairs.iter().filter(is_off).count();
    if off as f64 > MOST_OFF * pairs.len() as f64 {
        ctx.warn(format_args!(
            "{told}. {off} pairs would fit much better if one picture moved: the poses are off, or another \
             camera's"
        ));
    } else {
        ctx.info(told);
    }
    Ok(())
}
