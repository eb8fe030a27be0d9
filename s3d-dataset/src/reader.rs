//! Reading a data set from other crates.

use crate::context::Context;
use crate::error::Result;
use crate::memory::check_memory;
use crate::options::ExportOptions;
use crate::profile::room::{TreeInstance, TreeRoom, rooms_of};
use crate::record::data_set::DataSet;
use crate::record::tables::NumberRecord;
use memchr::memchr_iter;
use s3d_geom::{Camera, PointCloud};
use s3d_io::Error as FileError;
use s3d_io::cloud::LabelledPoints;
use s3d_io::dataset::{
    DatasetImage, Domain, FaceVoteColumns, Frame, InstanceEntry, Layout, ObjectsFile, PairColumns, PointBox,
    PoseFile, SourceFaces, ViewRecord, read_face_votes, read_instances, read_labels, read_pairs,
    read_point_boxes, read_source_faces, read_views,
};
use s3d_io::fs::{parse_json, read_json};
use s3d_io::mesh::{MeshFile, UpAxis, read_mesh};
use s3d_label::{LabelTable, Taxonomy};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};
use std::path::Path;

impl DataSet {
    /// Opens the data set in a folder. Its manifest, its list of files and its conventions must agree.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) with the first file that does not agree, or if the export did not
    /// finish.
    pub fn open(folder: &Path) -> Result<Self> {
        Self::open_in(&Layout::new(folder))
    }

    /// Opens a data set, also one whose export did not finish, with the files so far.
    /// [`DataSet::missing_yet`] tells what is missing.
    ///
    /// # Errors
    /// The same as for [`DataSet::open`].
    pub fn open_as_far_as_it_is(folder: &Path, ctx: &Context) -> Result<Self> {
        Self::open_unfinished_in(ctx, &Layout::new(folder))
    }

    /// Returns what an unfinished export lacks, a sentence each. Returns `None` if the data set is complete.
    pub fn missing_yet(&self) -> Option<&[String]> {
        self.unfinished.as_ref().map(|unfinished| &*unfinished.missing)
    }

    /// Returns the paths of its files.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the version of s3d that made it.
    pub fn version(&self) -> &str {
        &self.manifest.version
    }

    /// Returns the checksum of its list of files, which has the checksum of each file: XXH3 of 128 bits, in
    /// hexadecimal digits. Empty if the export did not finish.
    pub fn checksum(&self) -> String {
        self.manifest
            .files
            .as_ref()
            .map_or_else(String::new, |list| list.xxh3_128.to_string())
    }

    /// Returns the seed that it was made with.
    pub fn seed(&self) -> u64 {
        self.manifest.seed
    }

    /// Returns the options that it was made with, except for the seed.
    pub fn options(&self) -> &ExportOptions {
        &self.manifest.options
    }

    /// Returns the number and the bytes of its files, without `manifest.json` and `files.csv`.
    pub fn size(&self) -> (u64, u64) {
        self.manifest
            .files
            .as_ref()
            .map_or((0, 0), |list| (list.count, list.bytes))
    }

    /// Returns the numbers of its areas.
    pub fn areas(&self) -> &[u32] {
        &self.manifest.area_numbers
    }

    /// Iterates over the manifest's entries of `areas`. They serialize as they stand there.
    pub fn area_entries(&self) -> impl Iterator<Item = impl Serialize + use<'_>> {
        self.manifest.areas.iter()
    }

    /// Returns the classes and room types of its labels. Returns `None` if it has no labels.
    pub fn taxonomy(&self) -> Option<&Taxonomy> {
        self.manifest.is_labelled().then_some(&self.taxonomy)
    }

    /// Returns its label table. Returns `None` if it has no labels.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the table is damaged, or holds something other than labels.
    pub fn labels(&self) -> Result<Option<LabelTable>> {
        let Some(taxonomy) = self.taxonomy() else { return Ok(None) };
        let path = self.layout().labels_json();
        let table = taxonomy.table_from_names(&read_labels(self.files.checked(&path)?)?);
        Ok(Some(table.map_err(|e| FileError::format(&path, e.to_string()))?))
    }

    /// Returns the coloured mesh of an area with its textures, as its images show it. Faces are in the order
    /// of the file. Returns `None` if the mesh does not exist yet.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the mesh, a material or a texture is missing or damaged, or the
    /// number of faces is not the manifest's.
    pub fn mesh(&self, area: u32) -> Result<Option<MeshFile>> {
        let path = self.layout().rgb_obj(area);
        let folder = self.layout().mesh_dir(area);
        let materials = path.with_extension("mtl");
        let textures = folder.join("rgb_textures");
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

    /// Returns how the annotated points voted for each face of [`DataSet::mesh`]. Returns `None` if the area
    /// has no labels.
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

    /// Returns the file of the scan that each face of [`DataSet::mesh`] comes from, and its number there.
    /// Returns `None` if the mesh came from no file, or the data set is of an earlier version.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn source_faces(&self, area: u32) -> Result<Option<SourceFaces>> {
        let path = self.layout().source_faces_npz(area);
        if !self.names(&path) {
            return Ok(None);
        }
        let source = read_source_faces(self.files.checked(&path)?)?;
        self.fits(area, &path, source.face.len())?;
        Ok(Some(source))
    }

    /// Refuses a file whose number of faces is not the manifest's.
    fn fits(&self, area: u32, path: &Path, faces: usize) -> Result<()> {
        match self.manifest.area(area) {
            Some(entry) if entry.faces != faces => {
                let message = format!("{faces} faces, and the manifest tells of {}", entry.faces);
                Err(FileError::format(path, message).into())
            }
            _ => Ok(()),
        }
    }

    /// Returns the annotated rooms of an area's S3DIS tree, by type and number. Returns none if the data set
    /// has no labels.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the tree is damaged.
    pub fn tree_rooms(&self, area: u32) -> Result<Vec<TreeRoom>> {
        match self.taxonomy() {
            Some(taxonomy) => rooms_of(self.layout(), taxonomy, area),
            None => Ok(Vec::new()),
        }
    }

    /// Returns the number of points of an instance of [`DataSet::tree_rooms`].
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if its file is missing or damaged;
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn point_count(&self, instance: &TreeInstance, ctx: &Context) -> Result<u64> {
        let path = &instance.path;
        let mut file = self.files.open(path)?;
        let mut block = vec![0; 1 << 18];
        let mut lines = 0;
        loop {
            ctx.check()?;
            // The end of the file is an error if its lines, a point each, are not as written.
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

    /// Returns the instances of an area with their boxes. Returns none if the area has no labels.
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

    /// Returns the number in its room of each instance of an area, by its label. Numbers of labels count by
    /// area. Returns none if the area has no labels.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn numbers_in_rooms(&self, area: u32) -> Result<BTreeMap<String, u32>> {
        let path = self.layout().instance_numbers_json(area);
        if !self.names(&path) {
            return Ok(BTreeMap::new());
        }
        let numbers: Vec<NumberRecord> = read_json(self.files.checked(&path)?)?;
        Ok(numbers
            .into_iter()
            .map(|number| (number.label, number.number_in_room))
            .collect())
    }

    /// Returns the sampled points of an area, with the index of the label of each; 0 for none.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File); [`Error::Usage`](crate::Error::Usage) if they do not fit into
    /// memory; [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn points(&self, area: u32, ctx: &Context) -> Result<(PointCloud, Vec<u32>)> {
        /// The bytes of a point with its colour, its face and its label.
        const POINT_BYTES: f64 = 23.0;
        let mut file = LabelledPoints::open(self.files.checked(&self.layout().point_cloud(area))?)?;
        let count = file.count();
        check_memory(&format!("{count} points"), count as f64 * POINT_BYTES)?;

        let progress = ctx.progress("reading", "points", count);
        let (mut cloud, mut labels, mut block) = (PointCloud::default(), Vec::new(), Vec::new());
        while file.read(1 << 16, &mut block)? {
            ctx.check()?;
            cloud.positions.extend(block.iter().map(|point| point.position));
            cloud.colors.extend(block.iter().map(|point| point.color));
            cloud.faces.extend(block.iter().map(|point| point.face));
            labels.extend(block.iter().map(|point| point.label));
            progress.add(block.len() as u64);
        }
        Ok((cloud, labels))
    }

    /// Returns the boxes of the sampled points of an area: one for each file of the S3DIS tree. Returns
    /// `None` if the area has no labels, or the data set is of an earlier version.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn point_boxes(&self, area: u32) -> Result<Option<Vec<PointBox>>> {
        let path = self.layout().point_boxes_json(area);
        if !self.names(&path) {
            return Ok(None);
        }
        Ok(Some(read_point_boxes(self.files.checked(&path)?)?))
    }

    /// Returns the images of an area, sorted by scan location and room: views by number, then the panorama.
    pub fn images(&self, area: u32) -> Vec<DatasetImage> {
        self.files.images(self.layout(), area)
    }

    /// Returns every candidate view of an area, kept or dropped. Returns none if they are not listed yet.
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

    /// Returns width and height of an image in pixels, from the head of its first PNG file. Returns `None` if
    /// it has none.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn size_of(&self, image: &DatasetImage) -> Result<Option<(u32, u32)>> {
        let first = image.domains.iter().find(|domain| domain.extension() == "png");
        let size = first.map(|domain| self.files.png_size(&image.path(self.layout(), *domain)));
        Ok(size.transpose()?)
    }

    /// Returns the pose of an image.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn pose(&self, image: &DatasetImage) -> Result<PoseFile> {
        let path = image.path(self.layout(), Domain::Pose);
        Ok(parse_json(&path, &self.files.read_bytes(&path)?)?)
    }

    /// Returns the objects of an image.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File), also if the image has none.
    pub fn objects(&self, image: &DatasetImage) -> Result<ObjectsFile> {
        let path = image.path(self.layout(), Domain::Objects);
        Ok(parse_json(&path, &self.files.read_bytes(&path)?)?)
    }

    /// Returns the pairs of images of an area that see the same surface. Returns `None` if they were not
    /// looked for.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn pairs(&self, area: u32) -> Result<Option<PairColumns>> {
        let path = self.layout().pairs_npz(area);
        if !self.names(&path) {
            return Ok(None);
        }
        Ok(Some(read_pairs(self.files.checked(&path)?)?))
    }

    /// Returns the camera of an image from its pose and its size in pixels: a panorama, or the pinhole camera
    /// of its matrix K.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if pose and size do not make a camera.
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

    /// Returns whether the list of files names this path.
    pub fn names(&self, path: &Path) -> bool {
        self.files.bytes(path).is_ok()
    }

    /// Returns the content of a file.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if it is missing or damaged, or the list does not name it.
    pub fn read(&self, path: &Path) -> Result<Vec<u8>> {
        Ok(self.files.read_bytes(path)?)
    }

    /// Returns the files that are missing or have another size than was written: their paths below the data
    /// set's folder, each with a message without the path. Opens no file.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled); [`Error::Temporary`](crate::Error::Temporary).
    pub fn missing(&self, ctx: &Context) -> Result<BTreeMap<String, String>> {
        let faults = self.files.faults(ctx, |_| true)?;
        Ok(faults.into_iter().map(|(path, e)| (path, e.message())).collect())
    }
}
