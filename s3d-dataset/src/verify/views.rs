//! Checks the list of views against its draws and selection, and against the images.

use super::photographs::Photographs;
use super::report::{Report, Topic};
use crate::export::views::select;
use crate::record::manifest::Manifest;
use crate::survey::candidate::Candidate;
use s3d_io::dataset::{DatasetImage, Domain, Frame, Layout, ViewRecord, read_views};
use s3d_sample::{View, ViewDistribution, draw_view};
use std::collections::{BTreeMap, BTreeSet};

const DRAWS: (Topic, &str) = (Topic::Views, "draws and selection");
const THERE: (Topic, &str) = (Topic::Views, "images and the list of views");

/// The views of all areas.
#[derive(Default)]
pub(crate) struct Views {
    by_area: BTreeMap<u32, Vec<ViewRecord>>,
    kept: BTreeMap<(u32, String, u32), ViewRecord>,
}

impl Views {
    /// Reads and checks `views.json` of every area.
    pub(crate) fn read(layout: &Layout, manifest: &Manifest, report: &Report) -> Self {
        let mut views = Self::default();
        let mut all_there = true;
        for &area in &manifest.area_numbers {
            match report.read(Topic::Views, &layout.views_json(area), read_views) {
                Some(records) => {
                    let locations = manifest.area(area).map_or(0, |area| area.locations as u64);
                    let expected = locations.saturating_mul(manifest.options.views.into());
                    report.check(records.len() as u64 == expected, DRAWS, &layout.views_json(area), || {
                        format!(
                            "{} candidates; the manifest tells of {locations} locations and {} candidates \
                             each",
                            records.len(),
                            manifest.options.views
                        )
                    });
                    let kept = records
                        .iter()
                        .filter_map(|r| Some(((area, r.camera_uuid.clone(), r.frame_num?), r.clone())));
                    views.kept.extend(kept);
                    views.by_area.insert(area, records);
                }
                None => all_there = false,
            }
        }

        // Another version may draw differently.
        if manifest.is_of_this_version() {
            views.check_draws(layout, manifest, report);
        }
        // The selection uses all candidates, so every list must be there.
        if manifest.is_of_this_version() && all_there {
            views.check_selection(layout, manifest, report);
        }
        views
    }

    /// The record of a kept view.
    pub(crate) fn draw_of(&self, image: &DatasetImage) -> Option<&ViewRecord> {
        let Frame::View(number) = image.frame else { return None };
        self.kept.get(&(image.area, image.uuid.clone(), number))
    }

    /// The candidates of a location, in the order of the list.
    pub(crate) fn of_location<'a>(
        &'a self,
        area: u32,
        uuid: &'a str,
    ) -> impl Iterator<Item = &'a ViewRecord> {
        self.by_area
            .get(&area)
            .into_iter()
            .flatten()
            .filter(move |r| r.camera_uuid == uuid)
    }

    /// The number of candidates of an area's first location; `None` without one.
    pub(crate) fn candidates_of_a_location(&self, area: u32) -> Option<u32> {
        let first = self.by_area.get(&area)?.first()?;
        u32::try_from(self.of_location(area, &first.camera_uuid).count()).ok()
    }

    /// Checks that every candidate is what the seed draws.
    fn check_draws(&self, layout: &Layout, manifest: &Manifest, report: &Report) {
        let distribution = ViewDistribution::default();
        for (area, records) in &self.by_area {
            let path = layout.views_json(*area);
            let checks = report.of(DRAWS, &path);
            let mut seen = BTreeSet::new();
            for r in records {
                let View { yaw_rad, pitch_rad, fov_rad } =
                    draw_view(&distribution, manifest.seed, &r.camera_uuid, r.candidate);
                let same = (yaw_rad, pitch_rad, fov_rad) == (r.yaw_rad, r.pitch_rad, r.fov_rad);
                checks.check(same, || {
                    format!(
                        "candidate {} of {} is not what seed {} draws",
                        r.candidate, r.camera_uuid, manifest.seed
                    )
                });
                checks.check(seen.insert((&r.camera_uuid, r.candidate)), || {
                    format!("candidate {} of {} stands there twice", r.candidate, r.camera_uuid)
                });
            }
        }
    }

    /// Checks that the kept views are those that selection by entropies gives.
    fn check_selection(&self, layout: &Layout, manifest: &Manifest, report: &Report) {
        let mut candidates = Vec::new();
        for (&area, records) in manifest
            .area_numbers
            .iter()
            .filter_map(|a| self.by_area.get_key_value(a))
        {
            let mut location = 0;
            for (i, r) in records.iter().enumerate() {
                location += usize::from(i > 0 && records[i - 1].camera_uuid != r.camera_uuid);
                candidates.push(Candidate {
                    area,
                    location,
                    camera_uuid: r.camera_uuid.clone(),
                    candidate: r.candidate,
                    yaw_rad: r.yaw_rad,
                    pitch_rad: r.pitch_rad,
                    fov_rad: r.fov_rad,
                    entropy: r.entropy,
                    frame_num: None,
                });
            }
        }

        select(&mut candidates, manifest.options.pool, manifest.options.keep_all, manifest.seed);

        let found = manifest
            .area_numbers
            .iter()
            .filter_map(|a| self.by_area.get(a))
            .flatten();

        for (c, r) in candidates.iter().zip(found) {
            report.check(c.frame_num == r.frame_num, DRAWS, &layout.views_json(c.area), || {
                format!(
                    "candidate {} of {}: frame_num {:?}, and the selection by entropies gives {:?}",
                    r.candidate, r.camera_uuid, r.frame_num, c.frame_num
                )
            });
        }
    }

    /// Checks the images against the list. There must be each kept view, each location's panorama, and
    /// nothing else.
    pub(crate) fn check_images(
        &self,
        layout: &Layout,
        manifest: &Manifest,
        images: &[DatasetImage],
        photographs: &Photographs,
        report: &Report,
    ) {
        let mut locations: BTreeMap<u32, BTreeSet<&str>> = BTreeMap::new();
        for (area, records) in &self.by_area {
            locations
                .entry(*area)
                .or_default()
                .extend(records.iter().map(|r| r.camera_uuid.as_str()));
        }

        let mut there = BTreeSet::new();
        let mut panoramas: BTreeMap<u32, u64> = BTreeMap::new();
        let mut views: BTreeMap<u32, u64> = BTreeMap::new();
        for image in images {
            let path = image.path(layout, image.domains.first().copied().unwrap_or(Domain::Pose));
            let known = match image.frame {
                Frame::View(_) => {
                    let is_listed = self.draw_of(image).is_some() || photographs.of(image).is_some();
                    is_listed || !self.by_area.contains_key(&image.area)
                }
                Frame::Panorama if photographs.of(image).is_some() => true,
                // Areas without candidates have no list of locations.
                Frame::Panorama => locations
                    .get(&image.area)
                    .is_none_or(|known| known.is_empty() || known.contains(image.uuid.as_str())),
            };

            report.check(known, THERE, &path, || {
                "neither views.json nor frames.json tells of this image".to_owned()
            });
            report.check(manifest.is_chosen(&image.uuid), THERE, &path, || {
                "the manifest's option only does not name this location".to_owned()
            });
            let first = there.insert((image.area, image.uuid.as_str(), image.frame));
            report.check(first, THERE, &path, || {
                "another room has an image of this number and location".to_owned()
            });

            let count = if image.frame == Frame::Panorama {
                &mut panoramas
            } else {
                &mut views
            };
            *count.entry(image.area).or_default() += 1;
        }

        if manifest.domains().is_empty() {
            return;
        }

        self.check_missing(layout, manifest, &locations, &there, photographs, report);
        check_counts(layout, manifest, [&panoramas, &views], &locations, report);
    }

    /// Checks that there is an image of each kept view, each location and each photograph.
    fn check_missing(
        &self,
        layout: &Layout,
        manifest: &Manifest,
        locations: &BTreeMap<u32, BTreeSet<&str>>,
        there: &BTreeSet<(u32, &str, Frame)>,
        photographs: &Photographs,
        report: &Report,
    ) {
        let missing = |area: u32, uuid: &str, frame: Frame| {
            let name = format!("camera_{uuid}_…_frame_{frame}_…");
            let folder = layout.area_dir(area).join(frame.folder());
            report.check(there.contains(&(area, uuid, frame)), THERE, &folder, || {
                format!("{name}: missing, in every modality")
            });
        };
        for (area, known) in locations {
            known
                .iter()
                .filter(|u| manifest.is_chosen(u))
                .for_each(|uuid| missing(*area, uuid, Frame::Panorama));
        }
        for (area, uuid, number) in self.kept.keys().filter(|(_, uuid, _)| manifest.is_chosen(uuid)) {
            missing(*area, uuid, Frame::View(*number));
        }
        photographs
            .cameras()
            .for_each(|(area, uuid, frame)| missing(area, uuid, frame));
    }
}

/// Checks the numbers of panoramas, views and locations that the manifest tells.
fn check_counts(
    layout: &Layout,
    manifest: &Manifest,
    [panoramas, views]: [&BTreeMap<u32, u64>; 2],
    locations: &BTreeMap<u32, BTreeSet<&str>>,
    report: &Report,
) {
    for area in &manifest.areas {
        let path = layout.manifest();
        let checks = report.of((Topic::Manifest, "counts"), &path);
        let is = |what: &str, manifest: u64, found: u64| {
            checks.check(manifest == found, || {
                format!("area {}: {manifest} {what}, there are {found}", area.area)
            });
        };
        is("panoramas", area.panoramas, panoramas.get(&area.area).copied().unwrap_or(0));
        is("views", area.views, views.get(&area.area).copied().unwrap_or(0));
        if let Some(known) = locations.get(&area.area).filter(|known| !known.is_empty()) {
            is("locations", area.locations as u64, known.len() as u64);
        }
    }
}
