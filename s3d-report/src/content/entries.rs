//! The index of a report: the entries of its images, locations and views.

use super::{Content, THUMBS_PER_FILE, VIEWS_PER_FILE, Written};
use crate::areas;
use crate::faults::Faults;
use crate::index::{
    DataSetEntry, FORM, Index, LocationEntry, Surface, ViewEntry, degrees, folder_name, rounded,
};
use crate::selection::{PoolPlace, places};
use s3d_dataset::Result;
use s3d_io::Error as FileError;
use s3d_io::dataset::{Frame, ViewRecord};
use std::collections::BTreeMap;
use std::path::Path;

impl Content<'_> {
    /// Returns the index of the report.
    pub(crate) fn index(&self, out: &Path, made: &Written, mut faults: Faults) -> Result<Index> {
        let data = self.data;
        let classes = areas::classes(data);

        // The sums over all images and meshes.
        let mut pixels_by_class = vec![0; classes.len()];
        let mut pixels_unlabelled = 0;
        let mut surface_by_class = vec![Surface::default(); classes.len()];
        for (class, Surface { faces, m2 }) in &made.surfaces {
            if let Some(sum) = surface_by_class.get_mut(*class) {
                *sum = Surface { faces: sum.faces + faces, m2: sum.m2 + m2 };
            }
        }
        for seen in made
            .panoramas
            .iter()
            .chain(&made.views)
            .filter_map(|made| made.seen.as_ref())
        {
            pixels_unlabelled += seen.pixels_unlabelled;
            for (class, pixels) in &seen.pixels_by_class {
                if let Some(sum) = pixels_by_class.get_mut(*class) {
                    *sum += pixels;
                }
            }
        }

        let (files, bytes) = data.size();
        let manifest = data.layout().manifest();
        let options = serde_json::to_value(data.options());
        let data_set = DataSetEntry {
            name: folder_name(out),
            missing_yet: data.missing_yet().map(<[String]>::to_vec),
            version: data.version().to_owned(),
            seed: data.seed(),
            files,
            bytes,
            taxonomy: data.taxonomy().map(|t| t.name().to_owned()),
            depth_units_per_m: data.options().depth_units.per_m(),
            options: options.map_err(|e| FileError::format(&manifest, e.to_string()))?,
        };

        let locations = self.locations(made);
        let views = self.view_entries(made);
        let labels = self.table.as_ref().map(areas::labels).unwrap_or_default();
        let votes = areas::votes(data, &mut faults)?;
        let statistics = areas::statistics(data, &mut faults)?;
        Ok(Index {
            form: FORM,
            data_set,
            areas: areas::areas(data)?,
            classes,
            labels,
            rooms: made.rooms.clone(),
            locations,
            views,
            meshes: made.meshes.clone(),
            grounds: made.grounds.clone(),
            pairs: made.pairs.clone(),
            scores: 0,
            against: None,
            views_per_file: VIEWS_PER_FILE,
            thumbs_per_file: THUMBS_PER_FILE,
            statistics,
            votes,
            pixels_by_class,
            surface_by_class,
            pixels_unlabelled,
            faults: faults.into_vec(),
            verified: None,
        })
    }

    /// Returns the scan locations in their order.
    pub(super) fn locations(&self, made: &Written) -> Vec<LocationEntry> {
        let entry = |(area, uuid, room): &(u32, String, Option<String>)| LocationEntry {
            area: *area,
            uuid: uuid.clone(),
            room: room.clone().unwrap_or_default(),
            ..LocationEntry::default()
        };
        let mut entries: Vec<LocationEntry> = self.locations.iter().map(entry).collect();

        // The views of a location tell its place, too, if it has no panorama.
        for (image, made) in self.views.iter().zip(&made.views) {
            let entry = self
                .location_of(image.area, &image.uuid)
                .and_then(|i| entries.get_mut(i));
            if let (Some(entry), Some(located)) = (entry, &made.located) {
                entry.position = Some(located.original.0);
                entry.azimuth_rad = Some(located.original.1);
            }
        }

        for ((i, _), made) in self.panoramas.iter().zip(&made.panoramas) {
            let Some(entry) = entries.get_mut(*i) else { continue };
            if let Some(located) = &made.located {
                entry.position = Some(located.position);
                entry.azimuth_rad = Some(located.azimuth_rad);
            }
            entry.pano = made.seen.is_some();
            entry.look_deg = made.look_deg;
            entry.seen.clone_from(&made.seen);
        }
        entries
    }

    /// Returns kept views and photographs in the order of their files, then the dropped candidates.
    fn view_entries(&self, made: &Written) -> Vec<ViewEntry> {
        let options = self.data.options();
        let listed: Vec<(u32, &ViewRecord)> =
            self.candidates.iter().map(|(area, view)| (*area, view)).collect();
        let places = places(&listed, options.pool, options.keep_all);
        let mut kept = BTreeMap::new();
        let mut dropped = Vec::new();
        for ((area, view), place) in listed.into_iter().zip(places) {
            match view.frame_num {
                Some(frame) => drop(kept.insert((area, view.camera_uuid.as_str(), frame), (view, place))),
                None => dropped.push((area, view, place)),
            }
        }

        let mut entries = Vec::with_capacity(self.views.len() + dropped.len());
        for ((image, made), picture) in self.views.iter().zip(&made.views).zip(&self.pictures) {
            let photograph = self.photographs.get(&(image.area, image.uuid.clone()));
            let Frame::View(frame) = image.frame else { continue };
            let angles = made.located.as_ref().map(|located| located.angles_deg);
            let is_photograph = photograph.is_some();
            let of_photograph = made.located.as_ref().filter(|_| is_photograph);
            let entry = ViewEntry {
                area: image.area,
                location: self.location_of(image.area, &image.uuid),
                room: image.room.clone(),
                photograph: photograph.map(|p| p.name.clone()),
                frame: Some(frame),
                picture: Some(*picture).filter(|_| made.seen.is_some()),
                yaw_deg: angles.filter(|_| !is_photograph).map(|[yaw, ..]| yaw),
                pitch_deg: angles.filter(|_| !is_photograph).map(|[_, pitch, _]| pitch),
                fov_deg: angles.map(|[.., fov]| fov),
                position: of_photograph.map(|located| located.position),
                forward: of_photograph.map(|located| located.forward),
                up: of_photograph.map(|located| located.up),
                seen: made.seen.clone(),
                objects: made.objects,
                ..ViewEntry::default()
            };

            let record = kept
                .get(&(image.area, image.uuid.as_str(), frame))
                .filter(|_| !is_photograph);
            entries.push(match record {
                Some((view, place)) => of_record(entry, view, *place),
                None => entry,
            });
        }

        for (area, view, place) in dropped {
            let location = self.location_of(area, &view.camera_uuid);
            let room = location
                .and_then(|i| self.locations.get(i))
                .and_then(|(.., room)| room.clone());
            let entry = ViewEntry { area, location, room: room.unwrap_or_default(), ..ViewEntry::default() };
            entries.push(of_record(entry, view, place));
        }
        entries
    }
}

/// Adds the record of a candidate to the entry of its view.
fn of_record(entry: ViewEntry, view: &ViewRecord, place: PoolPlace) -> ViewEntry {
    ViewEntry {
        candidate: Some(view.candidate),
        yaw_deg: Some(degrees(view.yaw_rad)),
        pitch_deg: Some(degrees(view.pitch_rad)),
        fov_deg: Some(degrees(view.fov_rad)),
        entropy: Some(rounded(view.entropy, 4)),
        place: Some(place),
        ..entry
    }
}
