//! The images of a data set on the disk: which there are, and which of their files.

use crate::dataset::domain::Domain;
use crate::dataset::layout::{Frame, ImageName, Layout, image_stem, is_valid_uuid};
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use crate::fs::open::open_file;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// An image of a data set: one view or panorama with the files that show it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatasetImage {
    /// Number of its area.
    pub area: u32,
    /// The scan location.
    pub uuid: String,
    /// Type and number of the room: "office_3".
    pub room: String,
    /// Which of the location's images.
    pub frame: Frame,
    /// The domains in which it has a file, in the order of [`Domain::ALL`].
    pub domains: Vec<Domain>,
}

impl DatasetImage {
    /// Its name without the domain: `camera_{uuid}_{room}_frame_{frame}`. Unique in its area.
    pub fn stem(&self) -> String {
        image_stem(&self.uuid, &self.room, self.frame)
    }

    /// Whether it has a file of this domain.
    pub fn has(&self, domain: Domain) -> bool {
        self.domains.contains(&domain)
    }

    /// Where its file of a domain lies, whether it is there or not.
    pub fn path(&self, layout: &Layout, domain: Domain) -> PathBuf {
        layout.image_path(self.area, &self.uuid, &self.room, self.frame, domain)
    }

    /// The same below the root of the data set, with `/` on every system: `area_1/data/rgb/camera_….png`.
    pub fn relative_path(&self, domain: Domain) -> String {
        let name = ImageName { uuid: self.uuid.clone(), room: self.room.clone(), frame: self.frame, domain };
        format!("area_{}/{}/{}/{name}", self.area, self.frame.folder(), domain.folder())
    }

    /// Width and height in pixels, from the head of its first PNG file; `None` if it has none.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if that is no PNG file.
    pub fn size(&self, layout: &Layout) -> Result<Option<(u32, u32)>> {
        let first = self.domains.iter().find(|d| d.extension() == "png");
        first.map(|d| read_png_size(&self.path(layout, *d))).transpose()
    }
}

/// The images of an area, found by the names of their files: by scan location and room (as text), views by
/// number and the panorama last. Files with other names are passed over. An area without images gives an
/// empty list.
///
/// # Errors
/// [`Error::Io`] if a folder cannot be read.
pub fn dataset_images(layout: &Layout, area: u32) -> Result<Vec<DatasetImage>> {
    let mut found: BTreeMap<(String, String, Frame), Vec<Domain>> = BTreeMap::new();
    for domain in Domain::ALL {
        for kind in [Frame::View(0), Frame::Panorama] {
            let folder = layout.image_dir(area, kind, domain);
            let entries = match fs::read_dir(&folder) {
                Err(e) if e.kind() == ErrorKind::NotFound => continue,
                entries => entries.map_err(|e| Error::io(&folder, "read", e))?,
            };
            for entry in entries {
                let file_name = entry.map_err(|e| Error::io(&folder, "read", e))?.file_name();
                let Some(name) = file_name.to_str().and_then(ImageName::parse) else { continue };
                if name.domain == domain && name.frame.folder() == kind.folder() {
                    found
                        .entry((name.uuid, name.room, name.frame))
                        .or_default()
                        .push(domain);
                }
            }
        }
    }
    let image = |((uuid, room, frame), domains)| DatasetImage { area, uuid, room, frame, domains };
    Ok(found.into_iter().map(image).collect())
}

/// Checks that every image has a file in each domain in which another of its area and kind (view or panorama)
/// has one.
///
/// # Errors
/// [`Error::Format`] that names the first file that is missing.
pub fn check_images_complete(layout: &Layout, images: &[DatasetImage]) -> Result<()> {
    let kind = |image: &DatasetImage| (image.area, image.frame == Frame::Panorama);
    let mut domains: BTreeMap<(u32, bool), Vec<Domain>> = BTreeMap::new();
    for image in images {
        let all = domains.entry(kind(image)).or_default();
        image.domains.iter().for_each(|d| {
            if !all.contains(d) {
                all.push(*d);
            }
        });
    }
    for image in images {
        let missing = domains
            .get(&kind(image))
            .and_then(|all| all.iter().find(|d| !image.has(**d)));
        if let Some((missing, there)) = missing.zip(image.domains.first()) {
            let path = image.path(layout, *missing);
            let there = image.relative_path(*there);
            return Err(Error::format(
                &path,
                format!("missing: {there} is there, and other images have this modality"),
            ));
        }
    }
    Ok(())
}

/// A candidate view, as `views.json` tells of it. The fields bear the file's names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewRecord {
    /// The scan location.
    pub camera_uuid: String,
    /// From 0: what its draw is keyed by.
    pub candidate: u32,
    /// Heading relative to the location's original camera, to the left.
    pub yaw_rad: f64,
    /// Above the original camera's horizon.
    pub pitch_rad: f64,
    /// The angle of view.
    pub fov_rad: f64,
    /// Shannon entropy of the classes of its pixels, nats, as it was scored for the selection.
    pub entropy: f64,
    /// The number in its files' names, if it was kept.
    pub frame_num: Option<u32>,
}

/// Reads `area_N/views.json`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file holds something else.
pub fn read_views(path: &Path) -> Result<Vec<ViewRecord>> {
    read_json(path)
}

/// A photograph that became a view, as `frames.json` tells of it. The fields bear the file's names. Its view
/// is [`Frame::View`] 0 of a camera of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhotographRecord {
    /// The camera of its view: follows from the number of the area and the name.
    pub camera_uuid: String,
    /// What the list of photographs calls it.
    pub name: String,
    /// Type and number of the room that it was taken in.
    pub room: String,
    /// Width of its view in pixels.
    pub width: u32,
    /// Height of its view in pixels.
    pub height: u32,
    /// The share of the view's pixels that lie outside of the photograph: 0, 0, 0 in its colours.
    pub masked: f64,
    /// The share of the view's pixels that see the mesh.
    pub seen: f64,
    /// How well the edges of photograph and mesh agree: the correlation of both, at most 1. Nothing where
    /// there are no edges.
    pub agreement: Option<f64>,
    /// The same of photograph and mesh displaced against each other: what chance gives.
    pub chance: Option<f64>,
}

/// Reads `area_N/frames.json`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file holds something else, or a uuid that is none.
pub fn read_photographs(path: &Path) -> Result<Vec<PhotographRecord>> {
    let records: Vec<PhotographRecord> = read_json(path)?;
    match records.iter().find(|r| !is_valid_uuid(&r.camera_uuid)) {
        None => Ok(records),
        Some(r) => Err(Error::format(path, format!("{:?} is no uuid of a camera", r.camera_uuid))),
    }
}

/// Width and height of a PNG file, from its first 24 bytes.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no PNG file or has no pixel.
pub fn read_png_size(path: &Path) -> Result<(u32, u32)> {
    let mut head = Vec::with_capacity(24);
    let file = open_file(path)?;
    file.take(24)
        .read_to_end(&mut head)
        .map_err(|e| Error::io(path, "read", e))?;
    let Ok(head) = <[u8; 24]>::try_from(head) else {
        return Err(Error::format(path, "the PNG file ends too early"));
    };
    let width = u32::from_be_bytes([head[16], head[17], head[18], head[19]]);
    let height = u32::from_be_bytes([head[20], head[21], head[22], head[23]]);
    if head[..8] != *b"\x89PNG\r\n\x1a\n" || head[12..16] != *b"IHDR" {
        return Err(Error::format(path, "no PNG file"));
    }
    if width == 0 || height == 0 {
        return Err(Error::format(path, format!("the PNG file says that it has {width} × {height} pixels")));
    }
    Ok((width, height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fs::atomic::{create_dir, write_bytes};
    use crate::image::compression::Compression;
    use crate::image::png::write_gray16;
    use s3d_geom::Raster;

    fn put(layout: &Layout, uuid: &str, room: &str, frame: Frame, domains: &[Domain]) {
        for &domain in domains {
            let path = layout.image_path(2, uuid, room, frame, domain);
            create_dir(path.parent().unwrap()).unwrap();
            write_bytes(&path, b"").unwrap();
        }
    }

    #[test]
    fn images_are_found_in_order_with_their_files() {
        let dir = tempfile::tempdir().unwrap();
        let layout = Layout::new(dir.path());
        assert!(dataset_images(&layout, 2).unwrap().is_empty());
        let both = [Domain::Rgb, Domain::Depth];
        put(&layout, "b", "office_1", Frame::View(10), &both);
        put(&layout, "b", "office_1", Frame::View(9), &both);
        put(&layout, "a", "WC_2", Frame::Panorama, &[Domain::Pose]);
        put(&layout, "a", "WC_2", Frame::View(0), &both);
        // None of these is an image of its folder.
        let folder = layout.image_dir(2, Frame::View(0), Domain::Rgb);
        for name in ["Thumbs.db", ".s3d-x.part", "camera_a_WC_2_frame_equirectangular_domain_rgb.png"] {
            write_bytes(&folder.join(name), b"").unwrap();
        }
        let images = dataset_images(&layout, 2).unwrap();
        let names: Vec<_> = images.iter().map(|i| (i.uuid.as_str(), i.frame)).collect();
        assert_eq!(
            names,
            [("a", Frame::View(0)), ("a", Frame::Panorama), ("b", Frame::View(9)), ("b", Frame::View(10))]
        );
        assert_eq!((&images[1].domains[..], &images[2].domains[..]), (&[Domain::Pose][..], &both[..]));
        for image in &images {
            for &domain in &image.domains {
                assert_eq!(dir.path().join(image.relative_path(domain)), image.path(&layout, domain));
            }
        }
        check_images_complete(&layout, &images).unwrap();

        std::fs::remove_file(images[2].path(&layout, Domain::Depth)).unwrap();
        let images = dataset_images(&layout, 2).unwrap();
        let e = check_images_complete(&layout, &images).unwrap_err().to_string();
        assert!(
            e.contains("camera_b_office_1_frame_9_domain_depth.png: missing: area_2/data/rgb/camera_b"),
            "{e}"
        );
    }

    #[test]
    fn sizes_come_from_the_head() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        write_gray16(&path, &Raster::filled(7, 300, 1), Compression::Fast).unwrap();
        assert_eq!(read_png_size(&path).unwrap(), (7, 300));
        let good = std::fs::read(&path).unwrap();
        for (bytes, words) in [
            (&good[..23], "ends too early"),
            (&good[1..], "no PNG file"),
            (&[&good[..16], &[0; 8]].concat(), "0 × 0"),
        ] {
            write_bytes(&path, bytes).unwrap();
            let e = read_png_size(&path).unwrap_err().to_string();
            assert!(e.contains(words), "{e}");
        }
    }

    #[test]
    fn photographs_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("frames.json");
        let text = r#"[{"camera_uuid": "a", "name": "images/1.jpg", "room": "unknown_1",
            "width": 4, "height": 3,
            "masked": 0.25, "seen": 1, "agreement": 0.5, "chance": null}]"#;
        write_bytes(&path, text.as_bytes()).unwrap();
        let records = read_photographs(&path).unwrap();
        assert_eq!((records[0].agreement, records[0].chance, records[0].masked), (Some(0.5), None, 0.25));
        write_bytes(&path, text.replace("\"a\"", "\"../a\"").as_bytes()).unwrap();
        assert!(
            read_photographs(&path)
                .unwrap_err()
                .to_string()
                .contains("\"../a\" is no uuid")
        );
    }

    #[test]
    fn views_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("views.json");
        let text = r#"[{"camera_uuid": "a", "candidate": 3, "yaw_rad": 1.5, "pitch_rad": 0, "fov_rad": 1,
            "entropy": 0.25, "frame_num": null, "more": 1}]"#;
        write_bytes(&path, text.as_bytes()).unwrap();
        let views = read_views(&path).unwrap();
        assert_eq!((views[0].candidate, views[0].frame_num, views[0].yaw_rad), (3, None, 1.5));
        write_bytes(&path, text.replace("\"candidate\": 3,", "").as_bytes()).unwrap();
        assert!(
            read_views(&path)
                .unwrap_err()
                .to_string()
                .contains("missing field `candidate`")
        );
    }
}
