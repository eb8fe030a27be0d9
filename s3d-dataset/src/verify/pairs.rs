//! Checks the pairs of images.

use super::report::{Report, Topic};
use s3d_geom::Camera;
use s3d_io::dataset::{DatasetImage, Layout, read_pairs};
use std::collections::BTreeMap;

const PAIRS: (Topic, &str) = (Topic::Images, "pairs of images");

/// How far distances may be off, metres: they have 32 bits, and poses their digits.
const OFF_M: f32 = 1e-3;

/// Checks `pairs.npz` of an area, if it is there: that it names the images, that both images of a pair have
/// it, and that their distance is the one of their cameras.
pub(crate) fn check(
    layout: &Layout,
    area: u32,
    images: &[DatasetImage],
    cameras: &[(usize, Camera)],
    report: &Report,
) {
    let path = layout.pairs_npz(area);
    if !path.exists() {
        return;
    }
    let Some(pairs) = report.read(Topic::Images, &path, read_pairs) else { return };
    let checks = report.of(PAIRS, &path);
    let names: Vec<String> = images.iter().map(DatasetImage::pair_name).collect();
    if !checks.check(pairs.images == names, || "its images are not those of the area".to_owned()) {
        return;
    }

    let rows: Vec<&[u32]> = pairs
        .start
        .array_windows()
        .map(|[start, end]| &pairs.other[*start as usize..*end as usize])
        .collect();
    let cameras: BTreeMap<usize, &Camera> = cameras.iter().map(|(image, camera)| (*image, camera)).collect();
    for (image, row) in rows.iter().enumerate() {
        for (other, place) in row.iter().zip(pairs.start[image] as usize..) {
            let name = || format!("{} and {}", names[image], names[*other as usize]);
            let back = rows[*other as usize].contains(&(image as u32));
            checks.check(back, || format!("the pair of {} is in one row alone", name()));
            checks.check((0.0..=1.0).contains(&pairs.overlap[place]), || {
                format!("{} overlap by {}", name(), pairs.overlap[place])
            });
            if let (Some(a), Some(b)) = (cameras.get(&image), cameras.get(&(*other as usize))) {
                let apart_m = a.pose.location.distance(b.pose.location) as f32;
                checks.check((pairs.distance_m[place] - apart_m).abs() <= OFF_M, || {
                    format!("{} are {apart_m} m apart, and not {} m", name(), pairs.distance_m[place])
                });
            }
        }
    }
}
