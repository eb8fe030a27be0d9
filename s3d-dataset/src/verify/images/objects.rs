//! Checks the objects of an image against what the mesh shows.

use super::{ImageCheck, Scratch};
use crate::verify::report::Topic;
use s3d_geom::Camera;
use s3d_io::dataset::{BoxCorners, Corner, DatasetImage, Domain, ImageObject, ObjectsFile, read_objects};

const OBJECTS: (Topic, &str) = (Topic::Rays, "objects");

/// How far shares, angles, distances and projected corners may be off, absolutely or relative to their size.
/// The camera of a pose file differs in its last bits from the one that the image was made with, and files
/// have four digits behind the point. Numbers and masks of pixels are compared exactly.
const OFF: f64 = 1e-3;

impl ImageCheck<'_> {
    /// Checks the file of an image's objects. The memory has the hits of `camera`, if there is one.
    pub(super) fn check_objects(
        &self,
        image: &DatasetImage,
        size: (u32, u32),
        camera: Option<&Camera>,
        memory: &mut Scratch<'_>,
    ) {
        let path = image.path(self.layout, Domain::Objects);
        self.files.check(&path, self.report);
        let Some(found) = self.report.read(Topic::Images, &path, read_objects) else { return };
        let checks = self.report.of(OBJECTS, &path);
        checks.check((found.width, found.height) == size, || {
            format!(
                "{} × {} pixels, and the manifest tells of {} × {}",
                found.width, found.height, size.0, size.1
            )
        });

        let instances = self.reference.and_then(|reference| reference.instances);
        if let (Some(camera), Some(instances), Some(objects)) = (camera, instances, &mut memory.objects) {
            let expected = instances.find(objects, &memory.hits, camera);
            let fault = fault(&found, &expected);
            checks.check(fault.is_none(), || fault.unwrap_or_default());
        }
    }
}

/// Returns how a file differs from what the mesh shows.
fn fault(found: &ObjectsFile, expected: &ObjectsFile) -> Option<String> {
    let labels =
        |file: &ObjectsFile| file.objects.iter().map(|object| object.label_index).collect::<Vec<_>>();
    let [there, shown] = [found, expected].map(labels);
    if there != shown {
        return Some(format!("lists the labels {there:?}, and the mesh shows {shown:?}"));
    }
    let mut pairs = found.objects.iter().zip(&expected.objects);
    pairs.find_map(|(found, expected)| {
        let what = difference(found, expected)?;
        Some(format!("{}: {what} is not what the mesh shows", found.label))
    })
}

/// Returns the name of the first value in which two objects differ.
fn difference(found: &ImageObject, expected: &ImageObject) -> Option<&'static str> {
    let near = |a: f64, b: f64| (a - b).abs() <= OFF * b.abs().max(1.0);
    let near_all = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(*a, *b));
    let near_m = |a: f32, b: f32| near(f64::from(a), f64::from(b));
    let beyond = match (found.beyond, expected.beyond) {
        (Some(a), Some(b)) => {
            let bounds = |bounds: Option<[f64; 4]>| bounds.map_or(Vec::new(), Vec::from);
            near(a.truncation, b.truncation) && near_all(&bounds(a.bounds), &bounds(b.bounds))
        }
        (a, b) => a == b,
    };
    let angles = match (found.angles, expected.angles) {
        (Some(a), Some(b)) => {
            near_all(&a.azimuth_deg, &b.azimuth_deg) && near_all(&a.elevation_deg, &b.elevation_deg)
        }
        (a, b) => a == b,
    };
    let corners = |of: &BoxCorners| {
        let all = [of.axis_aligned, of.upright, of.oriented];
        all.into_iter().flatten().collect::<Vec<Corner>>()
    };
    let corners = corners(&found.corners)
        .iter()
        .zip(corners(&expected.corners))
        .all(|(a, b)| match (a, b) {
            (Some(a), Some(b)) => near_all(a, &b),
            (a, b) => a.is_none() == b.is_none(),
        });

    [
        ("its name", found.label == expected.label),
        ("its class", found.class == expected.class),
        ("its room", found.room == expected.room),
        ("the number of visible pixels", found.visible_pixels == expected.visible_pixels),
        ("the box of visible pixels", found.visible_box == expected.visible_box),
        ("the number of amodal pixels", found.amodal_pixels == expected.amodal_pixels),
        ("the amodal box", found.amodal_box == expected.amodal_box),
        ("the amodal mask", found.amodal_mask == expected.amodal_mask),
        ("the occlusion", near(found.occlusion, expected.occlusion)),
        ("what hides it", found.hidden_by == expected.hidden_by),
        ("the nearest distance", near_m(found.nearest_m, expected.nearest_m)),
        ("the median distance", near_m(found.median_m, expected.median_m)),
        ("what the border cuts off", beyond),
        ("the angles of its box", angles),
        ("a corner of its boxes", corners),
    ]
    .into_iter()
    .find_map(|(name, is_same)| (!is_same).then_some(name))
}
