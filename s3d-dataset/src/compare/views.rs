//! Compares the views, photographs and scan locations of both data sets, and pairs their images.

use super::comparison::{LocationName, Side, ViewChanges, ViewName};
use super::sides::Sides;
use crate::error::Result;
use s3d_io::dataset::{DatasetImage, Frame, PhotographRecord, ViewRecord};
use std::collections::{BTreeMap, BTreeSet};

/// Identifies an image in both data sets. Images are compared in this order.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ImageKey {
    pub(crate) area: u32,
    pub(crate) uuid: String,
    pub(crate) kind: ImageKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ImageKind {
    /// A view, by its number among its location's candidates.
    Candidate(u32),
    /// A view with only a frame number, the one in its name.
    Frame(u32),
    Photograph,
    Panorama,
}

/// An image and its expected size.
#[derive(Clone, Debug)]
pub(crate) struct FoundImage {
    pub(crate) image: DatasetImage,
    /// Width and height, as the manifest says.
    pub(crate) size: [u32; 2],
}

/// The images of A and of B, paired.
pub(crate) type ImagePairs = BTreeMap<ImageKey, [Option<FoundImage>; 2]>;

/// The views and images of both data sets.
pub(crate) struct Views {
    pub(crate) changes: ViewChanges,
    pub(crate) images: ImagePairs,
    /// Views that both keep, at other angles.
    pub(crate) redrawn: BTreeSet<ImageKey>,
}

/// The lists of an area.
struct Listed {
    views: Option<Vec<ViewRecord>>,
    photographs: BTreeMap<String, PhotographRecord>,
}

/// Reads the lists of an area; empty lists if the data set lacks it.
fn listed(sides: &Sides, side: Side, area: u32) -> Result<Listed> {
    let data = sides.of(side);
    if !data.areas().contains(&area) {
        return Ok(Listed { views: Some(Vec::new()), photographs: BTreeMap::new() });
    }
    let views = sides.keep(side, data.views(area))?;
    let photographs = sides.keep(side, data.photographs(area))?.unwrap_or_default();
    let photographs = photographs
        .into_iter()
        .map(|record| (record.camera_uuid.clone(), record))
        .collect();
    Ok(Listed { views, photographs })
}

/// Reads both lists, and pairs the images.
pub(crate) fn compare(sides: &Sides) -> Result<Views> {
    let mut views =
        Views { changes: ViewChanges::default(), images: BTreeMap::new(), redrawn: BTreeSet::new() };
    for area in sides.areas() {
        let a = listed(sides, Side::A, area)?;
        let b = listed(sides, Side::B, area)?;
        let both = [(Side::A, &a), (Side::B, &b)];
        let mut numbers: [BTreeMap<(&str, u32), u32>; 2] = Default::default();
        if let (Some(views_a), Some(views_b)) = (&a.views, &b.views) {
            views.drawn(area, views_a, views_b);
            numbers = [views_a, views_b].map(|all| candidates(all));
        }

        for (place, (side, listed)) in both.into_iter().enumerate() {
            let data = sides.of(side);
            for image in data.images(area) {
                let photograph = listed.photographs.get(&image.uuid);
                let kind = match (image.frame, photograph) {
                    (Frame::Panorama, _) => ImageKind::Panorama,
                    (Frame::View(_), Some(_)) => ImageKind::Photograph,
                    (Frame::View(frame), None) => {
                        let candidate = numbers[place].get(&(image.uuid.as_str(), frame)).copied();
                        candidate.map_or(ImageKind::Frame(frame), ImageKind::Candidate)
                    }
                };

                let options = data.options();
                let size = match (kind, photograph) {
                    (_, Some(record)) => [record.width, record.height],
                    (ImageKind::Panorama, None) => [options.pano_width, options.pano_width / 2],
                    (_, None) => [options.size; 2],
                };

                let key = ImageKey { area, uuid: image.uuid.clone(), kind };
                views.images.entry(key).or_default()[place] = Some(FoundImage { image, size });
            }
        }

        let [locations_a, locations_b] = both.map(|(side, listed)| locations(sides, side, listed, area));
        let [photos_a, photos_b] = [&a, &b].map(|of| of.photographs.keys().cloned().collect());
        let changes = &mut views.changes;
        changes.locations_lost.extend(only_in(area, &locations_a, &locations_b));
        changes
            .locations_gained
            .extend(only_in(area, &locations_b, &locations_a));
        changes.photographs_lost.extend(only_in(area, &photos_a, &photos_b));
        changes.photographs_gained.extend(only_in(area, &photos_b, &photos_a));
    }

    Ok(views)
}

/// The candidate numbers of kept views, by location and frame number.
fn candidates(views: &[ViewRecord]) -> BTreeMap<(&str, u32), u32> {
    let kept = views
        .iter()
        .filter_map(|v| Some(((v.camera_uuid.as_str(), v.frame_num?), v.candidate)));
    kept.collect()
}

/// The scan locations of an area, from its candidate views and panoramas.
fn locations(sides: &Sides, side: Side, listed: &Listed, area: u32) -> BTreeSet<String> {
    let of_views = listed.views.iter().flatten().map(|view| view.camera_uuid.clone());
    let images = sides.of(side).images(area).into_iter();
    let of_images = images
        .map(|image| image.uuid)
        .filter(|uuid| !listed.photographs.contains_key(uuid));
    of_views.chain(of_images).collect()
}

impl Views {
    /// Compares the kept views of an area.
    fn drawn(&mut self, area: u32, a: &[ViewRecord], b: &[ViewRecord]) {
        type Kept<'v> = BTreeMap<(&'v str, u32), &'v ViewRecord>;
        fn by_name(views: &[ViewRecord]) -> Kept<'_> {
            let kept = views.iter().filter(|view| view.frame_num.is_some());
            kept.map(|view| ((view.camera_uuid.as_str(), view.candidate), view))
                .collect()
        }

        let changes = &mut self.changes;
        changes.kept_a += kept(a);
        changes.kept_b += kept(b);

        let a = by_name(a);
        let b = by_name(b);

        let name = |(uuid, candidate): (&str, u32)| ViewName { area, uuid: uuid.to_owned(), candidate };
        changes
            .lost
            .extend(a.keys().filter(|key| !b.contains_key(*key)).map(|key| name(*key)));
        changes
            .gained
            .extend(b.keys().filter(|key| !a.contains_key(*key)).map(|key| name(*key)));

        for (key, view) in a {
            if b.get(&key).is_some_and(|other| angles_of(view) != angles_of(other)) {
                changes.redrawn.push(name(key));
                let uuid = key.0.to_owned();
                let kind = ImageKind::Candidate(key.1);
                self.redrawn.insert(ImageKey { area, uuid, kind });
            }
        }
    }
}

/// The places whose uuids are in the first list alone.
fn only_in(area: u32, uuids: &BTreeSet<String>, others: &BTreeSet<String>) -> Vec<LocationName> {
    uuids
        .difference(others)
        .map(|uuid| LocationName { area, uuid: uuid.clone() })
        .collect()
}

/// The number of kept views.
fn kept(views: &[ViewRecord]) -> u64 {
    views.iter().filter(|view| view.frame_num.is_some()).count() as u64
}

fn angles_of(view: &ViewRecord) -> [f64; 3] {
    [view.yaw_rad, view.pitch_rad, view.fov_rad]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(candidate: u32, yaw_rad: f64, frame_num: Option<u32>) -> ViewRecord {
        ViewRecord {
            camera_uuid: "a".into(),
            candidate,
            yaw_rad,
            pitch_rad: 0.0,
            fov_rad: 1.0,
            entropy: 0.0,
            frame_num,
        }
    }

    fn name(candidate: u32) -> ViewName {
        ViewName { area: 7, uuid: "a".into(), candidate }
    }

    #[test]
    fn views_are_named_by_location_and_candidate() {
        let a = [view(0, 0.0, Some(0)), view(1, 0.5, Some(1)), view(2, 1.0, None), view(3, 1.5, Some(2))];
        let b = [view(0, 0.0, None), view(1, 0.5, Some(0)), view(2, 1.0, Some(1)), view(3, 1.6, Some(2))];

        let mut views =
            Views { changes: ViewChanges::default(), images: BTreeMap::new(), redrawn: BTreeSet::new() };
        views.drawn(7, &a, &b);

        let ViewChanges { kept_a, kept_b, lost, gained, redrawn, .. } = views.changes;
        assert_eq!((kept_a, kept_b), (3, 3));
        assert_eq!((lost, gained, redrawn), (vec![name(0)], vec![name(2)], vec![name(3)]));
        assert_eq!(candidates(&b)[&("a", 0)], 1);
        assert_eq!(views.redrawn.len(), 1);
    }
}
