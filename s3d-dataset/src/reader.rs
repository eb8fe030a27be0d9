//! A data set that is read by other crates.

use crate::context::Context;
use crate::error::Result;
use crate::options::ExportOptions;
use crate::profile::room::{TreeInstance, TreeRoom, rooms_of};
use crate::record::data_set::DataSet;
use memchr::memchr_iter;
use s3d_geom::Camera;
use s3d_io::Error as FileError;
use s3d_io::dataset::{
    DatasetImage, Domain, FaceVoteColumns, Frame, InstanceEntry, Layout, PoseFile, ViewRecord,
    read_face_votes, read_instances, read_labels, read_pose, read_views,
};
use s3d_io::mesh::{MeshFile, UpAxis, read_mesh};
use s3d_label::{LabelTable, Taxonomy};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};
use std::path::Path;

impl DataSet {
    /// Opens the data set in a folder: its manifest, its list of files and its conventions, which must agree.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) with the one that does not, or if the export did not finish.
    pub fn open(folder: &Path) -> Result<Self> {
        Self::open_in(&Layout::new(folder))
    }

    /// The same, of an export that did not finish, too: what is there of it so far. [`DataSet::missing_yet`]
    /// tells what is not.
    ///
    /// # Errors
    /// As [`DataSet::open`].
    pub fn open_as_far_as_it_is(folder: &Path, ctx: &Context) -> Result<Self> {
        Self::open_unfinished_in(ctx, &Layout::new(folder))
    }

    /// What an export that did not finish lacks, a sentence each; `None` if it is complete.
    pub fn missing_yet(&self) -> Option<&[String]> {
        self.unfinished.as_ref().map(|unfinished| &*unfinished.missing)
    }

    /// Where its files lie.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The version of s3d that made it.
    pub fn version(&self) -> &str {
        &self.manifest.version
    }

    /// The seed that it was made with.
    pub fn seed(&self) -> u64 {
        self.manifest.seed
    }

    /// The options that it was made with, but for the seed.
    pub fn options(&self) -> &ExportOptions {
        &self.manifest.options
    }

    /// How many files it has, all but `manifest.json` and `files.csv`, and their bytes.
    pub fn size(&self) -> (u64, u64) {
        self.manifest
            .files
            .as_ref()
            .map_or((0, 0), |list| (list.count, list.bytes))
    }

    /// The numbers of its areas.
    pub fn areas(&self) -> &[u32] {
        &self.manifest.area_numbers
    }

    /// What the manifest tells of its areas: the entries of `areas`, which serialize as they stand there.
    pub fn area_entries(&self) -> impl Iterator<Item = impl Serialize + use<'_>> {
        self.manifest.areas.iter()
    }

    /// The classes and types of rooms of its labels; `None` if it has no labels.
    pub fn taxonomy(&self) -> Option<&Taxonomy> {
        self.manifest.is_labelled().then_some(&self.taxonomy)
    }

    /// Its labels; `None` if it has none.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the table is damaged, or holds what is no label.
    pub fn labels(&self) -> Result<Option<LabelTable>> {
        let Some(taxonomy) = self.taxonomy() else { return Ok(None) };
        let path = self.layout().labels_json();
        let table = taxonomy.table_from_names(&read_labels(self.files.checked(&path)?)?);
        Ok(Some(table.map_err(|e| FileError::format(&path, e.to_string()))?))
    }

    /// The coloured mesh of an area with its textures: the one that its images show. Faces are in the order
    /// of the file. `None` if it is not there yet.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if it, a material or a texture is missing or damaged, or it has
    /// not as many faces as the manifest tells of.
    pub fn mesh(&self, area: u32) -> Result<Option<MeshFile>> {
        let (path, folder) = (self.layout().rgb_obj(area), self.layout().mesh_dir(area));
        let (materials, textures) = (path.with_extension("mtl"), folder.join("rgb_textures"));
        if !self.names(&path) {
            return Ok(None);
        }
        for other in self.files.below(&folder) {
            if other == materials || other.starts_with(&textures) {
                self.files.checked(&other)?;
            }
        }
        let file = read_mesh(self.files.checked(&path)?, UpAxis::Y)?;
        self.fits(area, &path, file.mesh.faces().len())?;
        Ok(Some(file))
    }

    /// How the points of the annotations voted for each face of [`DataSet::mesh`]; `None` if the area has no
    /// labels.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn face_votes(&self, area: u32) -> Result<Option<FaceVoteColumns>> {
        let path = self.layout().votes_npz(area);
        if !self.names(&path) {
            return Ok(None);
        }
        let votes = read_face_votes(self.files.checked(&path)?)?;
        self.fits(area, &path, votes.label.len())?;
        Ok(Some(votes))
    }

    /// Refuses a file that tells of another number of faces than the manifest.
    fn fits(&self, area: u32, path: &Path, faces: usize) -> Result<()> {
        match self.manifest.area(area) {
            Some(entry) if entry.faces != faces => {
                let message = format!("{faces} faces, and the manifest tells of {}", entry.faces);
                Err(FileError::format(path, message).into())
            }
            _ => Ok(()),
        }
    }

    /// The annotated rooms of an area, by type and number: those of its S3DIS tree; none if the data set has
    /// no labels.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the tree is damaged.
    pub fn tree_rooms(&self, area: u32) -> Result<Vec<TreeRoom>> {
        match self.taxonomy() {
            Some(taxonomy) => rooms_of(self.layout(), taxonomy, area),
            None => Ok(Vec::new()),
        }
    }

    /// How many points an instance of [`DataSet::tree_rooms`] has.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if its file is missing or damaged;
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn point_count(&self, instance: &TreeInstance, ctx: &Context) -> Result<u64> {
        let path = &instance.path;
        let mut file = self.files.open(path)?;
        let (mut block, mut lines) = (vec![0; 1 << 18], 0);
        loop {
            ctx.check()?;
            // Its end is an error if these are not the lines that were written, each a point.
            let n = file.read(&mut block).map_err(|e| match e.kind() {
                ErrorKind::InvalidData => FileError::format(path, e.to_string()),
                _ => FileError::io(path, "read", e),
            })?;
            if n == 0 {
                return Ok(lines);
            }
            lines += memchr_iter(b'\n', block.get(..n).unwrap_or_default()).count() as u64;
        }
    }

    /// The instances of an area, with their boxes; none if it has no labels.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn instances(&self, area: u32) -> Result<Vec<InstanceEntry>> {
        let path = self.layout().instances_json(area);
        if !self.names(&path) {
            return Ok(Vec::new());
        }
        Ok(read_instances(self.files.checked(&path)?)?)
    }

    /// The images of an area, by scan location and room, views by number and the panorama last.
    pub fn images(&self, area: u32) -> Vec<DatasetImage> {
        self.files.images(self.layout(), area)
    }

    /// Every candidate view of an area, kept or dropped; none if they are not listed yet.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn views(&self, area: u32) -> Result<Vec<ViewRecord>> {
        let path = self.layout().views_json(area);
        if self.unfinished.is_some() && !self.names(&path) {
            return Ok(Vec::new());
        }
        Ok(read_views(self.files.checked(&path)?)?)
    }

    /// The pose of an image.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn pose(&self, image: &DatasetImage) -> Result<PoseFile> {
        Ok(read_pose(self.files.checked(&image.path(self.layout(), Domain::Pose))?)?)
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
        self.files.bytes(path).is_ok()
    }

    /// The content of a file.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if it is missing or damaged, or the list does not name it.
    pub fn read(&self, path: &Path) -> Result<Vec<u8>> {
        Ok(self.files.read_bytes(path)?)
    }

    /// The files that are gone or of another size than was written: paths below the data set's folder, and
    /// what is wrong with each, without its path. No file is opened.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled); [`Error::Temporary`](crate::Error::Temporary).
    pub fn missing(&self, ctx: &Context) -> Result<BTreeMap<String, String>> {
        let faults = self.files.faults(ctx, |_| true)?;
        Ok(faults.into_iter().map(|(path, e)| (path, e.message())).collect())
    }
}
