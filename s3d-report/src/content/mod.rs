//! The content of a data set, and its way into the files of a report, on all threads.

mod entries;
mod pairs;
mod pictures;

pub(crate) use pictures::ReadImage;

use crate::faults::Faults;
use crate::index::{GroundEntry, MeshEntry, RoomEntry, Shown, Surface};
use s3d_dataset::{DataSet, Result};
use s3d_io::dataset::{DatasetImage, Frame, PhotographRecord, ViewRecord};
use s3d_label::LabelTable;
use std::collections::BTreeMap;

/// The number of pictures of views in a file. The page loads a file to show a large view.
const VIEWS_PER_FILE: usize = 12;

/// The number of small images for the grid in a file.
const THUMBS_PER_FILE: usize = 48;

/// The content of a data set, before its images are read.
pub(crate) struct Content<'a> {
    data: &'a DataSet,
    table: Option<LabelTable>,
    photographs: BTreeMap<(u32, String), PhotographRecord>,
    /// The area and the uuid of each scan location, in order, with its room if it has an image.
    locations: Vec<(u32, String, Option<String>)>,
    /// Panoramas with the indices of their locations.
    panoramas: Vec<(usize, DatasetImage)>,
    views: Vec<DatasetImage>,
    /// The numbers of the pictures of views. Each area begins with a new file.
    pictures: Vec<usize>,
    /// All entries of `views.json`, with their areas.
    candidates: Vec<(u32, ViewRecord)>,
}

/// All images and meshes that were written.
#[derive(Default)]
pub(crate) struct Written {
    pub(crate) bytes: u64,
    /// In the order of `Content::panoramas`.
    pub(crate) panoramas: Vec<ReadImage>,
    /// In the order of `Content::views`.
    pub(crate) views: Vec<ReadImage>,
    /// The small images of panoramas, by location.
    small: Vec<Option<String>>,
    meshes: Vec<MeshEntry>,
    grounds: Vec<GroundEntry>,
    /// Classes and their surface in an area.
    surfaces: Vec<(usize, Surface)>,
    /// The rooms of all areas.
    rooms: Vec<RoomEntry>,
    /// The areas with pairs of images.
    pairs: Vec<u32>,
}

impl<'a> Content<'a> {
    pub(crate) fn read(data: &'a DataSet, faults: &mut Faults) -> Result<Self> {
        let root = data.layout().root();
        let mut content = Content {
            data,
            table: data.labels()?,
            photographs: BTreeMap::new(),
            locations: Vec::new(),
            panoramas: Vec::new(),
            views: Vec::new(),
            pictures: Vec::new(),
            candidates: Vec::new(),
        };

        let mut rooms: BTreeMap<(u32, String), Option<String>> = BTreeMap::new();
        let mut images = Vec::new();
        for &area in data.areas() {
            let photographs = faults.keep(root, data.photographs(area))?.unwrap_or_default();
            let of_area = photographs.into_iter().map(|p| ((area, p.camera_uuid.clone()), p));
            content.photographs.extend(of_area);

            for view in faults.keep(root, data.views(area))?.unwrap_or_default() {
                rooms.entry((area, view.camera_uuid.clone())).or_default();
                content.candidates.push((area, view));
            }
            for image in data.images(area) {
                let key = (area, image.uuid.clone());
                // A photograph that is a panorama is shown as a location.
                if image.frame == Frame::Panorama || !content.photographs.contains_key(&key) {
                    rooms.insert(key, Some(image.room.clone()));
                }
                images.push(image);
            }
        }
        content.locations = rooms
            .into_iter()
            .map(|((area, uuid), room)| (area, uuid, room))
            .collect();

        for image in images {
            match image.frame {
                Frame::View(_) => {
                    let next = match (content.views.last(), content.pictures.last()) {
                        (Some(view), Some(last)) if view.area == image.area => last + 1,
                        (_, Some(last)) => (last + 1).next_multiple_of(THUMBS_PER_FILE),
                        (_, None) => 0,
                    };
                    content.pictures.push(next);
                    content.views.push(image);
                }
                Frame::Panorama => {
                    if let Some(i) = content.location_of(image.area, &image.uuid) {
                        content.panoramas.push((i, image));
                    }
                }
            }
        }
        Ok(content)
    }

    fn location_of(&self, area: u32, uuid: &str) -> Option<usize> {
        self.locations
            .binary_search_by(|(a, u, _)| (*a, u.as_str()).cmp(&(area, uuid)))
            .ok()
    }

    /// Returns the places where images are shown, by area, scan location, room and frame.
    pub(crate) fn shown(&self) -> BTreeMap<(u32, String, String, Frame), Shown> {
        let panoramas = self.panoramas.iter().map(|(i, image)| (image, Shown::Panorama(*i)));
        let views = self
            .views
            .iter()
            .zip(&self.pictures)
            .map(|(image, i)| (image, Shown::Picture(*i)));
        panoramas
            .chain(views)
            .map(|(image, shown)| (key_of(image), shown))
            .collect()
    }
}

fn key_of(image: &DatasetImage) -> (u32, String, String, Frame) {
    (image.area, image.uuid.clone(), image.room.clone(), image.frame)
}
