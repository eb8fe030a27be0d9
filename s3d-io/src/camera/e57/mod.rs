//! The pictures of an E57 file, as the source of the colours of its scan locations.
//!
//! Source: ASTM E2807, 8.4.11 (Image2D), 8.4.13 (pinhole) and 8.4.14 (spherical). The axes are told in
//! [`crate::formats`], "The scanner's pictures".

mod blob;
mod lens;
mod owners;

#[cfg(test)]
mod tests;

use crate::camera::programs::e57::{E57File, open, rotation_of, scan_uuid};
use crate::camera::table::FARTHEST_M;
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use crate::guarded::guarded;
use blob::{check_image, check_mask, decode_image, decode_mask, read_blob};
use e57::{Blob, Image, Projection};
use lens::{Axes, lens_of, pose_of};
pub use owners::E57Owners;
use owners::Unused;
use rayon::prelude::*;
use s3d_geom::glam::{DAffine3, dvec3};
use s3d_geom::{CaptureLens, Pose, Raster};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What is said of a file without pictures.
const NO_PICTURES: &str = "has no image with a pose and a pinhole or spherical projection, so there are no \
                           colours in it: export it from the scanner's program with its pictures, or write \
                           rgb = \"texture\"";

/// The pictures of an E57 file that have a projection and a pose. Their pixels are read when they are asked
/// for.
#[derive(Debug)]
pub struct E57Pictures {
    path: PathBuf,
    pictures: Vec<E57Picture>,
    /// The uuid of the scan location of each scan, by the key of the scan's guid.
    scans: BTreeMap<String, String>,
    unused: Unused,
}

/// A picture of an E57 file: where it lies in the file, and how it was taken.
#[derive(Clone, Debug)]
struct E57Picture {
    /// What messages call it: its number, from 0, and its name or guid.
    name: String,
    /// The key of the guid of the scan that it belongs to, if it says so.
    scan: Option<String>,
    pose: Pose,
    projection: Projection,
    image: Blob,
    mask: Option<Blob>,
}

/// A picture as it was read.
#[derive(Clone, Debug)]
pub struct E57Shot {
    /// The pixels.
    pub image: Raster<[u8; 3]>,
    /// The lens, for the size of the picture.
    pub lens: CaptureLens,
    /// The camera's position and rotation, in this project's axes (x right, y up, looking along −z).
    pub pose: Pose,
    /// 0 for each pixel that the file marks as invalid, else 255. `None` if it marks none.
    pub mask: Option<Raster<u8>>,
}

impl E57Pictures {
    /// Lists the pictures of an E57 file. `world_from_file` is the transform from the frame of the file to
    /// the world (metres, Z-up): a rotation, a shift and a scale.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the file is damaged, or has no picture with a projection and a
    /// pose.
    pub fn open(path: &Path, world_from_file: &DAffine3) -> Result<Self> {
        let E57File { reader, .. } = open(path)?;
        let listed = guarded(|| (reader.pointclouds(), reader.images()))
            .ok_or_else(|| Error::format(path, "is damaged: its lists of scans and images cannot be read"))?;
        let scans = listed.0;
        let images = listed.1;

        let mut uuids = BTreeMap::new();
        for (number, scan) in scans.iter().enumerate() {
            if let Some(key) = scan.guid.as_deref().and_then(key_of) {
                uuids.entry(key).or_insert_with(|| scan_uuid(number, scan));
            }
        }

        let mut unused = Unused::default();
        let mut pictures = Vec::new();
        for (number, image) in images.into_iter().enumerate() {
            let name = name_of(number, &image);
            match E57Picture::new(name.clone(), image, world_from_file) {
                Ok(picture) => pictures.push(picture),
                Err(reason) => unused.add(reason, name),
            }
        }

        if pictures.is_empty() {
            let mut sentences = vec![NO_PICTURES.to_owned()];
            sentences.extend(unused.sentences());
            return Err(Error::format(path, sentences.join("; ")));
        }
        Ok(Self { path: path.to_owned(), pictures, scans: uuids, unused })
    }

    /// Returns the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Moves all poses, such as from the frame of the mesh's file to where the mesh lies.
    pub fn move_all(&mut self, by: &DAffine3) {
        for picture in &mut self.pictures {
            picture.pose = picture.pose.moved(by);
        }
    }

    /// Moves the pictures of locations: `motions` holds the motion of each, or `None` for a location that
    /// stays.
    pub fn move_pictures(&mut self, owners: &E57Owners, motions: &[Option<DAffine3>]) {
        for (numbers, motion) in owners.pictures.iter().zip(motions) {
            let Some(motion) = motion else { continue };
            for number in numbers {
                if let Some(picture) = self.pictures.get_mut(*number) {
                    picture.pose = picture.pose.moved(motion);
                }
            }
        }
    }

    /// Checks pictures, by their numbers, without decoding them: their bytes, sizes and ends, and the
    /// numbers of their projections. One picture is in memory at a time.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] with the name of the image if its bytes are damaged, its size is not
    /// the size that its projection is for, or no lens has the numbers of the projection.
    pub fn check(&self, numbers: &[usize]) -> Result<()> {
        let mut file = open(&self.path)?;
        for picture in self.chosen(numbers) {
            let lens = picture.lens(&self.path)?;
            let bytes = picture.bytes(&mut file, &self.path)?;
            check_image(&bytes, lens.size()).map_err(|m| picture.fault(&self.path, &m))?;

            if let Some(bytes) = picture.mask_bytes(&mut file, &self.path)? {
                check_mask(&bytes, lens.size()).map_err(|m| picture.fault(&self.path, &m))?;
            }
        }
        Ok(())
    }

    /// Reads pictures, by their numbers and in this order. They are decoded on all threads of the current
    /// rayon pool.
    ///
    /// # Errors
    /// Like [`check`](Self::check).
    pub fn read(&self, numbers: &[usize]) -> Result<Vec<E57Shot>> {
        let mut file = open(&self.path)?;
        let mut encoded = Vec::new();
        for picture in self.chosen(numbers) {
            let lens = picture.lens(&self.path)?;
            let image = picture.bytes(&mut file, &self.path)?;
            let mask = picture.mask_bytes(&mut file, &self.path)?;
            encoded.push(Encoded { picture, lens, image, mask });
        }

        let shots = encoded.into_par_iter().map(|encoded| {
            let picture = encoded.picture;
            encoded.decode().map_err(|m| picture.fault(&self.path, &m))
        });
        shots.collect()
    }

    fn chosen<'a>(&'a self, numbers: &'a [usize]) -> impl Iterator<Item = &'a E57Picture> {
        numbers.iter().filter_map(|number| self.pictures.get(*number))
    }
}

impl E57Picture {
    /// Returns the picture, or the reason why it is of no use.
    fn new(
        name: String,
        image: Image,
        world_from_file: &DAffine3,
    ) -> std::result::Result<Self, &'static str> {
        let projection = image.projection.ok_or("is a preview without a projection")?;
        let (axes, place, mask) = match &projection {
            Projection::Pinhole(pinhole) => (Axes::Pinhole, &pinhole.blob, &pinhole.mask),
            Projection::Spherical(sphere) => (Axes::Spherical, &sphere.blob, &sphere.mask),
            Projection::Cylindrical(_) => return Err("is cylindrical"),
        };
        let blob = place.data.clone();
        let mask = mask.clone();

        let transform = image.transform.ok_or("has no pose")?;
        let rotation = rotation_of(&transform.rotation).ok_or("has a pose without a rotation")?;
        let t = &transform.translation;
        let pose = pose_of(dvec3(t.x, t.y, t.z), rotation, axes).moved(world_from_file);
        if !pose.location.is_finite() || pose.location.abs().max_element() > FARTHEST_M {
            return Err("has a pose more than 10,000 km from the origin");
        }

        let scan = image.pointcloud_guid.as_deref().and_then(key_of);
        Ok(Self { name, scan, pose, image: blob, mask, projection })
    }

    fn lens(&self, path: &Path) -> Result<CaptureLens> {
        lens_of(&self.projection).map_err(|message| self.fault(path, &message))
    }

    fn bytes(&self, file: &mut E57File, path: &Path) -> Result<Vec<u8>> {
        read_blob(file, &self.image).map_err(|message| self.fault(path, &message))
    }

    fn mask_bytes(&self, file: &mut E57File, path: &Path) -> Result<Option<Vec<u8>>> {
        let Some(mask) = &self.mask else { return Ok(None) };
        let bytes = read_blob(file, mask).map_err(|m| self.fault(path, &format!("its mask {m}")))?;
        Ok(Some(bytes))
    }

    /// Returns an error about this picture, with what to do.
    fn fault(&self, path: &Path, message: &str) -> Error {
        let name = &self.name;
        let message = message.trim_end();
        let message =
            format!("{name}: {message}: export the file again, or leave the location out of [cameras]");
        Error::format(path, message)
    }
}

/// A picture as the file has it.
struct Encoded<'a> {
    picture: &'a E57Picture,
    lens: CaptureLens,
    image: Vec<u8>,
    mask: Option<Vec<u8>>,
}

impl Encoded<'_> {
    fn decode(self) -> std::result::Result<E57Shot, String> {
        let size = self.lens.size();
        let image = decode_image(self.image, size)?;
        let mask = self.mask.map(|bytes| decode_mask(&bytes, size)).transpose()?;
        Ok(E57Shot { image, lens: self.lens, pose: self.picture.pose, mask })
    }
}

/// Returns what messages call an image.
fn name_of(number: usize, image: &Image) -> String {
    let name = image.name.as_deref().filter(|name| !name.trim().is_empty());
    match name.or(image.guid.as_deref()) {
        Some(name) => format!("image {number} {}", quote(name.as_bytes())),
        None => format!("image {number}"),
    }
}

/// Returns what guids are compared by: the digits of a uuid, or the text. Returns `None` if there is none.
fn key_of(guid: &str) -> Option<String> {
    let digits: String = guid.chars().filter(char::is_ascii_hexdigit).collect();
    if digits.len() == 32 {
        return Some(digits.to_ascii_lowercase());
    }
    let text = guid.trim();
    (!text.is_empty()).then(|| text.to_owned())
}
