//! The data set that is packed: its images, and what is known of them.

use super::options::PackedImages;
use crate::error::{Error, Result};
use crate::tables::manifest::Head;
use s3d_io::Error as FileError;
use s3d_io::dataset::{
    DatasetImage, Domain, Frame, Layout, PoseFile, check_images_complete, dataset_images, read_labels,
    read_pose,
};
use s3d_io::fs::read_json;
use s3d_label::LabelTable;
use serde::Deserialize;
use std::path::Path;

/// The depth of a pixel that shows nothing, or something farther than can be said.
pub(crate) const DEPTH_MISSING: u16 = u16::MAX;

/// A data set, or some of it.
pub(crate) struct Source {
    pub(crate) layout: Layout,
    /// The areas that are packed, and all of their images that are.
    pub(crate) areas: Vec<u32>,
    pub(crate) images: Vec<DatasetImage>,
    /// Units a metre of depth images.
    pub(crate) depth_units_per_m: f64,
}

impl Source {
    /// Opens the complete data set in `root`.
    pub(crate) fn open(root: &Path, areas: &[u32], which: PackedImages) -> Result<Self> {
        let layout = Layout::new(root);
        let head = Head::require(&layout)?;
        if let Some(area) = areas.iter().find(|a| !head.area_numbers.contains(a)) {
            let there: Vec<String> = head.area_numbers.iter().map(u32::to_string).collect();
            return Err(Error::Usage(format!(
                "--areas {area}: the data set in {} has no such area; there are {}",
                root.display(),
                there.join(", ")
            )));
        }
        let chosen = |a: &u32| areas.is_empty() || areas.contains(a);
        let mut areas: Vec<u32> = head.area_numbers.iter().copied().filter(chosen).collect();
        areas.sort_unstable();
        areas.dedup();
        let mut images = Vec::new();
        for area in &areas {
            images.extend(dataset_images(&layout, *area)?);
        }
        images.retain(|image| match which {
            PackedImages::Views => image.frame != Frame::Panorama,
            PackedImages::Panoramas => image.frame == Frame::Panorama,
            PackedImages::All => true,
        });
        check_images_complete(&layout, &images)?;
        if images.is_empty() {
            let what = if which == PackedImages::All { "images".to_owned() } else { which.to_string() };
            return Err(Error::Input(format!("{}: the data set has no {what} to pack", root.display())));
        }
        let depth_units_per_m = depth_units_per_m(&layout)?;
        Ok(Self { layout, areas, images, depth_units_per_m })
    }

    /// The images of an area.
    pub(crate) fn of_area(&self, area: u32) -> Vec<&DatasetImage> {
        self.images.iter().filter(|image| image.area == area).collect()
    }

    /// Refuses a data set in which images lack what the package needs.
    pub(crate) fn require(&self, domain: Domain, whom: &str) -> Result<()> {
        match self.images.iter().find(|image| !image.has(domain)) {
            None => Ok(()),
            Some(image) => Err(FileError::format(
                &image.path(&self.layout, domain),
                format!("missing: {whom} needs {domain}; export with this modality"),
            )
            .into()),
        }
    }

    /// Whether all images have a file of this domain.
    pub(crate) fn has(&self, domain: Domain) -> bool {
        self.images.iter().all(|image| image.has(domain))
    }

    /// The pose of an image.
    pub(crate) fn pose(&self, image: &DatasetImage) -> Result<PoseFile> {
        Ok(read_pose(&image.path(&self.layout, Domain::Pose))?)
    }

    /// Its size in pixels.
    ///
    /// # Panics
    /// If it has no PNG file.
    pub(crate) fn size(&self, image: &DatasetImage) -> Result<(u32, u32)> {
        let size = image.size(&self.layout)?;
        Ok(size.expect("packages that ask for a size require an image"))
    }

    /// The labels of the data set.
    pub(crate) fn labels(&self) -> Result<LabelTable> {
        let path = self.layout.labels_json();
        LabelTable::from_names(&read_labels(&path)?)
            .map_err(|e| FileError::format(&path, e.to_string()).into())
    }
}

/// Units a metre of depth images, as the manifest has them: 512, as published, where it tells of none.
/// Source: formats.md, "What is written".
fn depth_units_per_m(layout: &Layout) -> Result<f64> {
    #[derive(Deserialize)]
    struct Manifest {
        options: Options,
    }
    #[derive(Deserialize)]
    struct Options {
        depth_units: Option<String>,
    }
    let path = layout.manifest();
    let manifest: Manifest = read_json(&path)?;
    match manifest.options.depth_units.as_deref() {
        None | Some("512") => Ok(512.0),
        Some("mm") => Ok(1000.0),
        Some(other) => {
            Err(FileError::format(&path, format!("options.depth_units is \"{other}\", neither 512 nor mm"))
                .into())
        }
    }
}
