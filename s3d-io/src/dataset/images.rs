//! The images of a data set on the disk, and their files.

use crate::dataset::domain::Domain;
use crate::dataset::layout::{Frame, ImageName, Layout, image_stem, is_valid_uuid};
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use crate::fs::open::open_file;
use crate::image::png::MAX_PIXELS;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashSet};
use std::fs;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// An image of a data set: one view or panorama with the files that show it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatasetImage {
    /// The number of the area.
    pub area: u32,
    /// The scan location.
    pub uuid: String,
    /// Type and number of the room: "office_3".
    pub room: String,
    /// The number of the image among the location's images, or the panorama.
    pub frame: Frame,
    /// The domains in which the image has a file, in the order of [`Domain::ALL`].
    pub domains: Vec<Domain>,
}

impl DatasetImage {
    /// Returns the name by which `pairs.npz` calls the image: its folder, and its name without the domain.
    pub fn pair_name(&self) -> String {
        format!("{}/{}", self.frame.folder(), self.stem())
    }

    /// Returns the name without the domain: `camera_{uuid}_{room}_frame_{frame}`. It is unique in an area.
    pub fn stem(&self) -> String {
        image_stem(&self.uuid, &self.room, self.frame)
    }

    /// Returns whether the image has a file of this domain.
    pub fn has(&self, domain: Domain) -> bool {
        self.domains.contains(&domain)
    }

    /// Returns the path of the image's file of a domain. The file need not exist.
    pub fn path(&self, layout: &Layout, domain: Domain) -> PathBuf {
        layout.image_path(self.area, &self.uuid, &self.room, self.frame, domain)
    }

    /// Returns the path below the root of the data set, with `/` on every system:
    /// `area_1/data/rgb/camera_….png`.
    pub fn relative_path(&self, domain: Domain) -> String {
        let name = ImageName { uuid: self.uuid.clone(), room: self.room.clone(), frame: self.frame, domain };
        format!("area_{}/{}/{}/{name}", self.area, self.frame.folder(), domain.folder())
    }
}

/// Returns the images of an area, found by the names of their files. They are sorted by scan location and
/// room (as text), then views by number, the panorama last. Files with other names are skipped. An area
/// without images gives an empty list.
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

    let images = found.into_iter();
    Ok(images
        .map(|((uuid, room, frame), domains)| DatasetImage { area, uuid, room, frame, domains })
        .collect())
}

/// Checks that the images of an area and kind (view or panorama) all have files in the same domains.
///
/// # Errors
/// [`Error::Format`] that names the first missing file.
pub fn check_images_complete(layout: &Layout, images: &[DatasetImage]) -> Result<()> {
    let mut domains: BTreeMap<(u32, bool), Vec<Domain>> = BTreeMap::new();
    for image in images {
        let all = domains.entry(kind(image)).or_default();
        for domain in &image.domains {
            if !all.contains(domain) {
                all.push(*domain);
            }
        }
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

/// Returns the area of an image, and whether it is a panorama.
fn kind(image: &DatasetImage) -> (u32, bool) {
    (image.area, image.frame == Frame::Panorama)
}

/// A candidate view of `views.json`. The fields have the names of the file's keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewRecord {
    /// The scan location.
    pub camera_uuid: String,
    /// The candidate's number, from 0. It keys the random draw.
    pub candidate: u32,
    /// The heading relative to the location's original camera, to the left.
    pub yaw_rad: f64,
    /// The angle above the original camera's horizon.
    pub pitch_rad: f64,
    /// The horizontal angle of view.
    pub fov_rad: f64,
    /// The Shannon entropy of the classes of the view's pixels, nats, as it was scored for the selection.
    pub entropy: f64,
    /// The number in the names of the view's files, if the view was kept.
    pub frame_num: Option<u32>,
}

impl ViewRecord {
    /// Returns what is wrong with the record by itself, if anything is.
    fn fault(&self) -> Option<String> {
        let Self { camera_uuid: uuid, candidate, .. } = self;
        if !is_valid_uuid(uuid) {
            return Some(format!("{uuid:?} is no uuid of a scan location"));
        }
        let angles = [self.yaw_rad, self.pitch_rad, self.fov_rad];
        if !angles.iter().all(|angle| angle.is_finite()) {
            return Some(format!("candidate {candidate} of {uuid} has the angles {angles:?}"));
        }
        let entropy = self.entropy;
        let is_entropy = entropy.is_finite() && entropy >= 0.0;
        (!is_entropy).then(|| format!("candidate {candidate} of {uuid} has the entropy {entropy}"))
    }
}

/// Reads `area_N/views.json`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file holds something else, an invalid uuid, an entropy that is
/// negative or not finite, or the same candidate or frame number of a location twice.
pub fn read_views(path: &Path) -> Result<Vec<ViewRecord>> {
    let records: Vec<ViewRecord> = read_json(path)?;
    let mut candidates = HashSet::new();
    let mut frames = HashSet::new();
    for record in &records {
        let uuid = &record.camera_uuid;
        let is_new = candidates.insert((uuid, record.candidate));
        let has_own_frame = record.frame_num.is_none_or(|number| frames.insert((uuid, number)));
        let twice =
            || format!("candidate {} of {uuid} or its frame number stands there twice", record.candidate);
        if let Some(fault) = record.fault().or_else(|| (!is_new || !has_own_frame).then(twice)) {
            return Err(Error::format(path, fault));
        }
    }
    Ok(records)
}

/// A photograph that became a view or a panorama, in `frames.json`. The fields have the names of the file's
/// keys. The view is [`Frame::View`] 0 of its own camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhotographRecord {
    /// The view's camera. It follows from the number of the area and the name.
    pub camera_uuid: String,
    /// The photograph's name in the list of photographs.
    pub name: String,
    /// Type and number of the room in which it was taken.
    pub room: String,
    /// The width of the view in pixels.
    pub width: u32,
    /// The height of the view in pixels.
    pub height: u32,
    /// The share of the view's pixels that lie outside of the photograph. Their colour is 0, 0, 0.
    pub masked: f64,
    /// The share of the view's pixels that see the mesh.
    pub seen: f64,
    /// The agreement of the edges in photograph and mesh: their correlation, at most 1. `None` if there are
    /// no edges.
    pub agreement: Option<f64>,
    /// The agreement of photograph and mesh when they are displaced against each other: what chance gives.
    pub chance: Option<f64>,
    /// Whether the photograph is a panorama. The file has the key for panoramas alone.
    #[serde(default, skip_serializing_if = "is_false")]
    pub panorama: bool,
}

impl PhotographRecord {
    /// Returns the frame of the photograph's image.
    pub fn frame(&self) -> Frame {
        if self.panorama { Frame::Panorama } else { Frame::View(0) }
    }

    /// Returns what is wrong with the record by itself, if anything is.
    fn fault(&self) -> Option<String> {
        let Self { camera_uuid: uuid, name, width, height, masked, seen, .. } = self;
        if !is_valid_uuid(uuid) {
            return Some(format!("{uuid:?} is no uuid of a camera"));
        }
        if !(1..=MAX_PIXELS).contains(&(u64::from(*width) * u64::from(*height))) {
            return Some(format!("{name} has {width} × {height} pixels, and images up to {MAX_PIXELS}"));
        }
        let are_shares = [masked, seen].iter().all(|share| (0.0..=1.0).contains(*share));
        (!are_shares).then(|| format!("{name} has the shares {masked} masked and {seen} seen"))
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_false(value: &bool) -> bool {
    !value
}

/// Reads `area_N/frames.json`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file holds something else, an invalid uuid, a camera twice, a size
/// that no image has, or a share beyond 0 to 1.
pub fn read_photographs(path: &Path) -> Result<Vec<PhotographRecord>> {
    let records: Vec<PhotographRecord> = read_json(path)?;
    let mut cameras = HashSet::new();
    for record in &records {
        let is_new = cameras.insert(&record.camera_uuid);
        let twice = || format!("the camera {} stands there twice", record.camera_uuid);
        if let Some(fault) = record.fault().or_else(|| (!is_new).then(twice)) {
            return Err(Error::format(path, fault));
        }
    }
    Ok(records)
}

/// Returns width and height of a PNG file in pixels, from its first 24 bytes.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file is not PNG, or has no pixel.
pub fn read_png_size(path: &Path) -> Result<(u32, u32)> {
    read_png_size_from(open_file(path)?, path)
}

/// Reads width and height like [`read_png_size`]. `path` is the file's name in errors.
///
/// # Errors
/// Like [`read_png_size`].
pub fn read_png_size_from(file: impl Read, path: &Path) -> Result<(u32, u32)> {
    let mut head = Vec::with_capacity(24);
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
    fn views_that_cannot_be_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("views.json");
        let record = |candidate: u32, entropy: f64, frame_num: Option<u32>| ViewRecord {
            camera_uuid: "a".into(),
            candidate,
            yaw_rad: 1.0,
            pitch_rad: 0.0,
            fov_rad: 1.0,
            entropy,
            frame_num,
        };
        let good = [record(0, 0.0, Some(0)), record(1, 1.5, None), record(2, 1.0, Some(1))];
        crate::fs::json::write_json(&path, &good[..]).unwrap();
        assert_eq!(read_views(&path).unwrap(), good);
        for (odd, words) in [
            (record(1, 1.0, None), "candidate 1 of a or its frame number stands there twice"),
            (record(3, 1.0, Some(1)), "candidate 3 of a or its frame number stands there twice"),
            (record(3, -1.0, None), "candidate 3 of a has the entropy -1"),
        ] {
            crate::fs::json::write_json(&path, &[&good[..], &[odd]].concat()).unwrap();
            let e = read_views(&path).unwrap_err().to_string();
            assert!(e.contains("views.json") && e.contains(words), "{e}");
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
        assert_eq!(records[0].frame(), Frame::View(0));
        write_bytes(&path, text.replace("\"seen\"", "\"panorama\": true, \"seen\"").as_bytes()).unwrap();
        assert_eq!(read_photographs(&path).unwrap()[0].frame(), Frame::Panorama);
        for (from, to, words) in [
            ("\"width\": 4", "\"width\": 4294967295", "4294967295 × 3 pixels"),
            ("\"height\": 3", "\"height\": 0", "4 × 0 pixels"),
            ("\"seen\": 1", "\"seen\": 1.5", "0.25 masked and 1.5 seen"),
        ] {
            write_bytes(&path, text.replace(from, to).as_bytes()).unwrap();
            let e = read_photographs(&path).unwrap_err().to_string();
            assert!(e.contains(words), "{e}");
        }
        let twice = text.replace(['[', ']'], "");
        write_bytes(&path, format!("[{twice}, {twice}]").as_bytes()).unwrap();
        let e = read_photographs(&path).unwrap_err().to_string();
        assert!(e.contains("the camera a stands there twice"), "{e}");

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
