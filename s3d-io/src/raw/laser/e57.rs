//! The scans of an E57 file: their places, grids, and what their points have. Source: ASTM E2807, "data3D".

use crate::camera::programs::e57::{open, rotation_of, scan_uuid};
use crate::cloud::e57::grid::{grid_of, has_color_and_intensity};
use crate::error::{Error, Result};
use crate::guarded::guarded;
use crate::raw::laser::ScanInfo;
use crate::raw::laser::source::{Listed, Part, ScanSource};
use crate::raw::options::RawOptions;
use s3d_geom::Pose;
use s3d_geom::glam::{DQuat, DVec3, dvec3};
use std::path::Path;

/// Lists the scans that have points. Also returns what is doubtful, a sentence each.
pub(super) fn list(path: &Path, options: &RawOptions) -> Result<Listed> {
    let file = open(path)?;
    let clouds = guarded(|| file.reader.pointclouds()).ok_or_else(|| Error::format(path, "is damaged"))?;
    let mut scans = Vec::new();
    let mut without_pose = 0;

    for (number, cloud) in clouds.iter().enumerate().filter(|(_, cloud)| cloud.records > 0) {
        let name = cloud.name.clone().or_else(|| cloud.guid.clone());
        let name = name.unwrap_or_else(|| format!("scan {number}"));
        let pose = match &cloud.transform {
            Some(transform) => {
                let t = &transform.translation;
                let rotation = rotation_of(&transform.rotation).ok_or_else(|| {
                    let q = &transform.rotation;
                    Error::format(path, format!("{name}: has a pose without a rotation: {q:?}"))
                })?;
                Some(Pose::from_scanner(dvec3(t.x, t.y, t.z), rotation))
            }
            // Ranges and angles are measured from the scanner.
            None if !cloud.has_cartesian() => Some(Pose::from_scanner(DVec3::ZERO, DQuat::IDENTITY)),
            None => None,
        };
        without_pose += usize::from(pose.is_none());
        let pose = pose.map(|pose| pose.moved(&options.world_from_file));

        let [has_colors, has_intensity] = has_color_and_intensity(cloud);
        let info = ScanInfo {
            name,
            path: path.to_owned(),
            uuid: Some(scan_uuid(number, cloud)),
            origin_m: pose.map(|pose| pose.location),
            pose,
            grid: grid_of(cloud),
            points: Some(cloud.records),
            has_colors,
            has_intensity,
            has_times: false,
        };
        scans.push((info, ScanSource::new(path.to_owned(), Part::E57(number))));
    }

    if scans.is_empty() {
        return Err(Error::format(path, "holds no scan with points"));
    }
    let mut warnings = Vec::new();
    let count = scans.len();
    if without_pose > 0 {
        warnings.push(format!(
            "{}: {without_pose} of {count} scans have no pose, so they do not tell where the scanner stood: \
             export the file with the places of the scans",
            path.display()
        ));
    }
    let places: Vec<DVec3> = scans.iter().filter_map(|(scan, _)| scan.origin_m).collect();
    if let [first, rest @ ..] = places.as_slice()
        && !rest.is_empty()
        && rest.iter().all(|place| place.distance(*first) < 1e-3)
    {
        warnings.push(format!(
            "{}: all {} scans are told to be taken at one place, {first}: were their poses lost in an \
             export?",
            path.display(),
            places.len()
        ));
    }
    Ok((scans, warnings))
}
