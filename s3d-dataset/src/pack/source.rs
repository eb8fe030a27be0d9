//! The data set that is packed: its images and tables.

use super::options::PackedImages;
use crate::context::Context;
use crate::error::{InputError, Result, UsageError};
use crate::record::data_set::DataSet;
use s3d_geom::{PointCloud, Raster};
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame, PhotographRecord, WorldOffsets, check_images_complete};
use s3d_io::fs::write_bytes;
use s3d_io::image::{decode_gray16, decode_rgb8};
use s3d_render::MISSING_DEPTH;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A data set or a part of it. Everything read from it is checked against its list of files.
pub(crate) struct Source {
    pub(crate) data: DataSet,
    /// The areas that are packed.
    pub(crate) areas: Vec<u32>,
    /// The images that are packed, of all these areas.
    pub(crate) images: Vec<DatasetImage>,
    /// The depth units in a metre.
    pub(crate) depth_units_per_m: f64,
    /// The offsets that were subtracted from the coordinates of the areas' scans.
    offsets: WorldOffsets,
    /// The records of photographs, by area and camera.
    photographs: BTreeMap<(u32, String), PhotographRecord>,
}

impl Source {
    /// Takes a data set. `which` are the images to pack, `None` for none.
    pub(crate) fn of(
        ctx: &Context,
        data: DataSet,
        areas: &[u32],
        which: Option<PackedImages>,
    ) -> Result<Self> {
        let root = data.layout.root();
        let mut photographs = BTreeMap::new();
        for &area in &data.manifest.area_numbers {
            let of_area = data.photographs(area)?.into_iter();
            photographs.extend(of_area.map(|record| ((area, record.camera_uuid.clone()), record)));
        }

        let DataSet { layout, manifest, files, .. } = &data;
        let there = &manifest.area_numbers;
        if let Some(area) = areas.iter().find(|a| !there.contains(a)) {
            let there: Vec<String> = there.iter().map(u32::to_string).collect();
            return Err(UsageError::InvalidValue {
                option: "areas",
                value: area.to_string(),
                why: format!(
                    "the data set in {} has no such area; there are {}",
                    root.display(),
                    there.join(", ")
                ),
            }
            .into());
        }

        let mut areas: Vec<u32> = there
            .iter()
            .copied()
            .filter(|area| areas.is_empty() || areas.contains(area))
            .collect();
        areas.sort_unstable();

        let mut images: Vec<DatasetImage> =
            areas.iter().flat_map(|area| files.images(layout, *area)).collect();
        images.retain(|image| match which {
            Some(PackedImages::Views) => image.frame != Frame::Panorama,
            Some(PackedImages::Panoramas) => image.frame == Frame::Panorama,
            Some(PackedImages::All) => true,
            None => false,
        });

        check_images_complete(layout, &images)?;
        if let Some(which) = which
            && images.is_empty()
        {
            let what = if which == PackedImages::All {
                "images".to_owned()
            } else {
                which.to_string()
            };
            return Err(InputError::NothingToPack { dataset: root.to_owned(), what }.into());
        }

        let needed: BTreeSet<PathBuf> = images
            .iter()
            .flat_map(|image| image.domains.iter().map(|domain| image.path(layout, *domain)))
            .collect();
        files.require(ctx, |path| needed.contains(path))?;

        let depth_units_per_m = manifest.conventions().depth_units.per_m();
        let offsets = manifest.request().world_offsets();
        Ok(Self { data, areas, images, depth_units_per_m, offsets, photographs })
    }

    /// A sentence on the coordinates of each area whose scan has another frame.
    pub(crate) fn frame_notes(&self) -> Vec<String> {
        let packed = self.offsets.iter().filter(|(area, _)| self.areas.contains(area));
        packed
            .map(|(area, offset_m)| {
                format!("area {area}: coordinates are those of its scan less offset_m = {offset_m:?}")
            })
            .collect()
    }

    /// The record of the photograph that an image shows.
    pub(crate) fn photograph(&self, image: &DatasetImage) -> Option<&PhotographRecord> {
        let record = self.photographs.get(&(image.area, image.uuid.clone()));
        record.filter(|record| image.frame == record.frame())
    }

    /// The images of an area.
    pub(crate) fn of_area(&self, area: u32) -> Vec<&DatasetImage> {
        self.images.iter().filter(|image| image.area == area).collect()
    }

    /// Fails if images lack a modality that the package needs.
    pub(crate) fn require(&self, domain: Domain, whom: &str) -> Result<()> {
        match self.images.iter().find(|image| !image.has(domain)) {
            None => Ok(()),
            Some(image) => Err(FileError::format(
                &image.path(&self.data.layout, domain),
                format!("missing: {whom} needs {domain}; export with this modality"),
            )
            .into()),
        }
    }

    /// Whether all images have a file of this domain.
    pub(crate) fn has(&self, domain: Domain) -> bool {
        self.images.iter().all(|image| image.has(domain))
    }

    /// The size of an image in pixels.
    ///
    /// # Panics
    /// If the image has no PNG file.
    pub(crate) fn size(&self, image: &DatasetImage) -> Result<(u32, u32)> {
        let size = self.data.size_of(image)?;
        Ok(size.expect("packages that ask for a size require an image"))
    }

    /// The bytes of a file of an image.
    pub(crate) fn bytes(&self, image: &DatasetImage, domain: Domain) -> Result<Vec<u8>> {
        Ok(self.data.files.read_bytes(&image.path(&self.data.layout, domain))?)
    }

    /// The number of bytes of a file of an image.
    pub(crate) fn byte_count(&self, image: &DatasetImage, domain: Domain) -> Result<u64> {
        Ok(self.data.files.bytes(&image.path(&self.data.layout, domain))?)
    }

    /// Copies a file of an image.
    pub(crate) fn copy(&self, image: &DatasetImage, domain: Domain, to: &Path) -> Result<()> {
        Ok(write_bytes(to, &self.bytes(image, domain)?).map(drop)?)
    }

    /// The pixels of a file of an image, 8-bit RGB.
    pub(crate) fn rgb8(&self, image: &DatasetImage, domain: Domain) -> Result<Raster<[u8; 3]>> {
        Ok(decode_rgb8(&self.bytes(image, domain)?, &image.path(&self.data.layout, domain))?)
    }

    /// The depth of an image.
    pub(crate) fn depth(&self, image: &DatasetImage) -> Result<Raster<u16>> {
        Ok(decode_gray16(&self.bytes(image, Domain::Depth)?, &image.path(&self.data.layout, Domain::Depth))?)
    }

    /// Points of an area's cloud, at most `most`.
    pub(crate) fn points(&self, area: u32, most: usize) -> Result<PointCloud> {
        // Only a small part of a large cloud is read.
        Ok(s3d_io::cloud::read_point_sample(
            self.data.files.sized(&self.data.layout.point_cloud(area))?,
            most,
        )?)
    }

    /// The files that say what the numbers in images mean, by name: the conventions, the label table if there
    /// are labels, and the taxonomy unless it is S3DIS's.
    pub(crate) fn tables(&self) -> Result<Vec<(&'static str, Vec<u8>)>> {
        let mut tables =
            vec![("conventions.json", self.data.files.read_bytes(&self.data.layout.conventions())?)];
        if self.data.manifest.is_labelled() {
            tables
                .push(("semantic_labels.json", self.data.files.read_bytes(&self.data.layout.labels_json())?));
        }
        if !self.data.taxonomy.is_s3dis() {
            tables.push(("taxonomy.json", self.data.files.read_bytes(&self.data.layout.taxonomy_json())?));
        }
        Ok(tables)
    }
}

/// Depth in millimetres, rounded; 0 if missing or beyond 65.535 m.
pub(crate) fn millimetres(depth: &Raster<u16>, units_per_m: f64) -> Raster<u16> {
    let mut converted = depth.clone();
    for depth in converted.pixels_mut() {
        let mm = (f64::from(*depth) * (1000.0 / units_per_m)).round();
        *depth = if *depth == MISSING_DEPTH || mm > f64::from(u16::MAX) {
            0
        } else {
            mm as u16
        };
    }
    converted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_in_millimetres() {
        let depth = Raster::from_vec(3, 2, vec![0, 512, 1, 65_535, 33_553, 33_555]);
        assert_eq!(millimetres(&depth, 512.0).pixels(), [0, 1000, 2, 0, 65_533, 0]);
        assert_eq!(millimetres(&depth, 1000.0).pixels(), [0, 512, 1, 0, 33_553, 33_555]);
    }
}
