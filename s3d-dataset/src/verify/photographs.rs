//! Checks the list of photographs against the images.

use super::report::{Report, Topic};
use crate::record::manifest::Manifest;
use s3d_io::camera::uuid_from_name;
use s3d_io::dataset::{DatasetImage, Frame, Layout, PhotographRecord, read_photographs};
use std::collections::BTreeMap;

const LIST: (Topic, &str) = (Topic::Views, "photographs");

/// The photographs of all areas.
#[derive(Default)]
pub(crate) struct Photographs {
    by_camera: BTreeMap<(u32, String), PhotographRecord>,
}

impl Photographs {
    /// Reads and checks `frames.json` of every area that has photographs.
    pub(crate) fn read(layout: &Layout, manifest: &Manifest, report: &Report) -> Self {
        let mut photographs = Self::default();
        for area in manifest.areas.iter().filter(|area| area.frames > 0) {
            let path = layout.frames_json(area.area);
            let Some(records) = report.read(Topic::Views, &path, read_photographs) else { continue };
            let checks = report.of(LIST, &path);
            checks.check(records.len() as u64 == area.frames, || {
                format!("{} photographs, and the manifest tells of {}", records.len(), area.frames)
            });

            for record in records {
                let PhotographRecord { camera_uuid, name, masked, seen, .. } = &record;
                let expected = uuid_from_name(&format!("area_{}/{name}", area.area));
                checks.check(*camera_uuid == expected, || {
                    format!("{name:?} has the camera {camera_uuid}, and its name gives {expected}")
                });

                let are_shares = [masked, seen].iter().all(|share| (0.0..=1.0).contains(*share));
                checks
                    .check(are_shares, || format!("{name:?}: masked {masked} and seen {seen} are no shares"));

                let uuid = camera_uuid.clone();
                let text = name.clone();
                let earlier = photographs.by_camera.insert((area.area, uuid), record);
                checks.check(earlier.is_none(), || format!("{text:?} stands there twice"));
            }
        }

        photographs
    }

    /// The record of an image, if it is that of a photograph.
    pub(crate) fn of(&self, image: &DatasetImage) -> Option<&PhotographRecord> {
        let record = self.by_camera.get(&(image.area, image.uuid.clone()))?;
        (image.frame == record.frame()).then_some(record)
    }

    /// The area, camera and frame of each photograph.
    pub(crate) fn cameras(&self) -> impl Iterator<Item = (u32, &str, Frame)> {
        self.by_camera
            .iter()
            .map(|((area, uuid), record)| (*area, uuid.as_str(), record.frame()))
    }

    /// The number of photographs in an area.
    pub(crate) fn count(&self, area: u32) -> usize {
        self.by_camera.keys().filter(|(of, _)| *of == area).count()
    }
}

/// Checks a share in the list, which has six digits, against the counted one.
pub(crate) fn check_share(
    what: &str,
    (told, counted): (f64, f64),
    record: &PhotographRecord,
    path: &std::path::Path,
    report: &Report,
) {
    report.check((told - counted).abs() <= 1e-6, LIST, path, || {
        format!("{what} of {:?} is {told} in frames.json, and {counted} of the pixels are so", record.name)
    });
}
