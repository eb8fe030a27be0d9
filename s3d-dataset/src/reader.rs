//! A data set that is read by other crates.

use crate::context::Context;
use crate::error::Result;
use crate::options::ExportOptions;
use crate::tables::dataset::Dataset;
use s3d_geom::Camera;
use s3d_io::Error as FileError;
use s3d_io::dataset::{
    DatasetImage, Domain, Frame, Layout, PhotographRecord, PoseFile, ViewRecord, read_labels, read_pose,
    read_views,
};
use s3d_label::{LabelTable, Taxonomy};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A complete data set, to be read. Whatever is read of it is held against its list of files: sizes before a
/// file is opened, checksums of what is read as a whole. Files that the list does not name are refused.
///
/// ```no_run
/// use s3d_dataset::DataSet;
/// use s3d_dataset::s3d_io::dataset::Domain;
///
/// let data = DataSet::open("dataset".as_ref())?;
/// for image in data.images(data.areas()[0]) {
///     let png = data.read(&image.path(data.layout(), Domain::Rgb))?;
///     println!("{}: {} bytes", image.stem(), png.len());
/// }
/// # Ok::<(), s3d_dataset::Error>(())
/// ```
pub struct DataSet(Dataset);

impl DataSet {
    /// Opens the data set in a folder: its manifest, its list of files and its conventions, which must agree.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) with the one that does not, or if the export did not finish.
    pub fn open(folder: &Path) -> Result<Self> {
        Dataset::open(&Layout::new(folder)).map(Self)
    }

    /// Where its files lie.
    pub fn layout(&self) -> &Layout {
        &self.0.layout
    }

    /// The version of s3d that made it.
    pub fn version(&self) -> &str {
        &self.0.manifest.version
    }

    /// The seed that it was made with.
    pub fn seed(&self) -> u64 {
        self.0.manifest.seed
    }

    /// The options that it was made with, but for the seed.
    pub fn options(&self) -> &ExportOptions {
        &self.0.manifest.options
    }

    /// How many files it has, all but `manifest.json` and `files.csv`, and their bytes.
    pub fn size(&self) -> (u64, u64) {
        self.0.manifest.files.as_ref().map_or((0, 0), |list| (list.count, list.bytes))
    }

    /// The numbers of its areas.
    pub fn areas(&self) -> &[u32] {
        &self.0.manifest.area_numbers
    }

    /// What the manifest tells of its areas: the entries of `areas`, which serialize as they stand there.
    pub fn area_entries(&self) -> impl Iterator<Item = impl Serialize + use<'_>> {
        self.0.manifest.areas.iter()
    }

    /// The classes and types of rooms of its labels; `None` if it has no labels.
    pub fn taxonomy(&self) -> Option<&Taxonomy> {
        self.0.label_taxonomy()
    }

    /// Its labels; `None` if it has none.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the table is damaged, or holds what is no label.
    pub fn labels(&self) -> Result<Option<LabelTable>> {
        let Some(taxonomy) = self.taxonomy() else { return Ok(None) };
        let path = self.layout().labels_json();
        let table = taxonomy.table_from_names(&read_labels(self.0.files.checked(&path)?)?);
        Ok(Some(table.map_err(|e| FileError::format(&path, e.to_string()))?))
    }

    /// The images of an area, by scan location and room, views by number and the panorama last.
    pub fn images(&self, area: u32) -> Vec<DatasetImage> {
        self.0.files.images(self.layout(), area)
    }

    /// Every candidate view of an area, kept or dropped.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn views(&self, area: u32) -> Result<Vec<ViewRecord>> {
        Ok(read_views(self.0.files.checked(&self.layout().views_json(area))?)?)
    }

    /// The photographs of an area that became views.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn photographs(&self, area: u32) -> Result<Vec<PhotographRecord>> {
        self.0.photographs(area)
    }

    /// The pose of an image.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn pose(&self, image: &DatasetImage) -> Result<PoseFile> {
        Ok(read_pose(self.0.files.checked(&image.path(self.layout(), Domain::Pose))?)?)
    }

    /// The camera of an image of so many pixels, of which `pose` is the pose: a panorama, or the pinhole that
    /// its K describes.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the two do not make a camera.
    pub fn camera(&self, image: &DatasetImage, pose: &PoseFile, size: [u32; 2]) -> Result<Camera> {
        let path = image.path(self.layout(), Domain::Pose);
        let [width, height] = size;
        if image.frame == Frame::Panorama {
            if u64::from(width) != 2 * u64::from(height) || height == 0 {
                let message = format!("{width} × {height} pixels: a panorama is twice as wide as high");
                return Err(FileError::format(&path, message).into());
            }
            return Ok(Camera::equirectangular(pose.pose(), width));
        }
        let of_k = Camera::from_k_rt(pose.camera_k_matrix, pose.pose().rt_matrix(), width, height);
        Ok(of_k.map_err(|e| FileError::format(&path, e.to_string()))?)
    }

    /// Whether the list of files names this path.
    pub fn names(&self, path: &Path) -> bool {
        self.0.files.bytes(path).is_ok()
    }

    /// The content of a file.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if it is missing or damaged, or the list does not name it.
    pub fn read(&self, path: &Path) -> Result<Vec<u8>> {
        Ok(self.0.files.read_bytes(path)?)
    }

    /// The files that are gone or of another size than was written, with what is wrong with each, by path
    /// below the data set's folder. No file is opened.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled); [`Error::Temporary`](crate::Error::Temporary).
    pub fn missing(&self, ctx: &Context) -> Result<BTreeMap<String, String>> {
        self.0.files.faults(ctx, |_| true)
    }
}
