//! A published area, or an export, as input: its mesh, its labels and its scan locations.

use crate::camera::poses;
use crate::camera::poses::PublishedLocation;
use crate::cloud::annotations::Annotations;
use crate::dataset::{read_photographs, read_taxonomy_json_or_s3dis, read_world_offsets};
use crate::error::{Error, Result};
use crate::mesh::file::{MeshFile, UpAxis};
use crate::mesh::read::read_mesh;
use s3d_geom::glam::{DAffine3, DVec3, Vec3};
use s3d_geom::{NO_INDEX, TriMesh};
use s3d_label::{Label, Taxonomy};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The options of [`PublishedArea::open_with`].
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedOptions {
    /// The area's number. `None`: the number in the folder's name (`area_3`, `area_5a`).
    pub area: Option<u32>,
    /// The transform from the area's frame to the world: a rotation, a shift and a scale. It is meant for
    /// areas 5a and 5b: it brings one to the frame of the other. No file of the published data set holds it.
    pub world_from_area: DAffine3,
}

impl Default for PublishedOptions {
    /// Returns the options that keep the number in the folder's name and the frame of the files.
    fn default() -> Self {
        Self { area: None, world_from_area: DAffine3::IDENTITY }
    }
}

/// The folder of an area, as published: `area_3`.
///
/// | file | |
/// |---|---|
/// | `3d/rgb.obj` | the mesh, +Y up; needed |
/// | `3d/semantic.obj` | the same faces; its materials are named by the labels; it may be missing |
/// | `data/pose/*.json`, `pano/pose/*.json` | scan locations; one file of each is read |
/// | `3d/pointcloud.mat` | annotated points, if it exists |
/// | `assets/taxonomy.json` | beside the area's folder, if the classes are not S3DIS's |
/// | `assets/semantic_labels.json` | beside the area's folder or in it, if it exists |
///
/// Source: [`crate::formats`], "What is written".
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedArea {
    /// The folder.
    pub path: PathBuf,
    /// The area's number; 5 for 5a and 5b.
    pub area: u32,
    /// The textured mesh.
    pub mesh: PathBuf,
    /// The labelled mesh, if there are labels.
    pub semantic_mesh: Option<PathBuf>,
    /// The axis that points up in both meshes.
    pub up: UpAxis,
    /// `pointcloud.mat`, if it exists. [`Annotations::open`] reads it, in the frame of the files.
    pub point_cloud: Option<PathBuf>,
    /// The classes of the data set.
    pub taxonomy: Taxonomy,
    /// The data set's list of labels, if there is one.
    pub labels: Option<PathBuf>,
    /// The scan locations in the world, sorted by uuid.
    pub locations: Vec<PublishedLocation>,
    /// The transform from the files' frame to the world.
    pub world_from_area: DAffine3,
    /// The offset that was subtracted from the coordinates of the area's scan when it was exported, metres.
    /// It is read from the `conventions.json` beside the area's folder. It is 0 if there is no such file, or
    /// `world_from_area` moves the area.
    pub world_offset_m: DVec3,
    /// Everything odd that was found, a sentence each.
    pub warnings: Vec<String>,
}

/// A published mesh with the label of each face.
#[derive(Clone, Debug)]
pub struct PublishedMesh {
    /// The mesh with its textures, in the world.
    pub file: MeshFile,
    /// The different labels, in the order of their first faces.
    pub labels: Vec<Label>,
    /// For each face of the mesh its place in `labels`, or [`NO_INDEX`] if it has none. Empty if there are no
    /// labels.
    pub label_of_face: Vec<u32>,
}

impl PublishedArea {
    /// Finds the files in the folder `path`, and reads the area's scan locations.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] that names the missing file, or the pose file that is wrong.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_with(path, &PublishedOptions::default())
    }

    /// Finds and reads like [`PublishedArea::open`], with a number and a frame.
    ///
    /// # Errors
    /// Like [`PublishedArea::open`].
    pub fn open_with(path: &Path, options: &PublishedOptions) -> Result<Self> {
        std::fs::read_dir(path).map_err(|e| Error::io(path, "read the folder", e))?;
        let Some(area) = options.area.or_else(|| area_of(path)) else {
            let message = "has no name of a published area, as in area_3 or area_5a: rename the folder";
            return Err(Error::format(path, message));
        };
        let Some(mesh) = existing(path.join("3d/rgb.obj")) else {
            return Err(Error::format(path, "has no 3d/rgb.obj, the textured mesh of a published area"));
        };

        let labels = "assets/semantic_labels.json";
        let mut this = Self {
            path: path.to_owned(),
            area,
            mesh,
            semantic_mesh: existing(path.join("3d/semantic.obj")),
            up: UpAxis::Y,
            point_cloud: existing(path.join("3d/pointcloud.mat")),
            taxonomy: read_taxonomy_json_or_s3dis(&path.join("../assets/taxonomy.json"))?,
            labels: existing(path.join("..").join(labels)).or_else(|| existing(path.join(labels))),
            locations: Vec::new(),
            world_from_area: options.world_from_area,
            world_offset_m: DVec3::ZERO,
            warnings: Vec::new(),
        };

        this.find_world_offset();
        this.read_locations()?;
        if this.semantic_mesh.is_none() {
            this.warnings
                .push(format!("{}: has no 3d/semantic.obj, so that there are no labels", path.display()));
        }
        Ok(this)
    }

    /// Reads what was subtracted from the area's coordinates. It does not apply if the area is moved.
    fn find_world_offset(&mut self) {
        if self.world_from_area != DAffine3::IDENTITY {
            return;
        }
        let Some(number) = area_of(&self.path) else { return };

        match read_world_offsets(&self.conventions()) {
            Ok(offsets) => {
                self.world_offset_m = offsets.get(&number).copied().map_or(DVec3::ZERO, DVec3::from_array);
            }
            Err(e) => self.warnings.push(e.to_string()),
        }
    }

    fn read_locations(&mut self) -> Result<()> {
        let folders = ["data/pose", "pano/pose"].map(|folder| self.path.join(folder));
        let mut found = poses::read(&folders, &self.world_from_area, &self.taxonomy)?;

        // The places of photographs are no scan locations.
        let photographs = self.path.join("frames.json");
        if photographs.is_file() {
            let photographs = read_photographs(&photographs)?;
            found.retain(|(_, l)| photographs.iter().all(|p| p.camera_uuid != l.location.uuid));
        }
        if found.is_empty() {
            return Err(Error::format(
                &self.path,
                "has no data/pose/*.json or pano/pose/*.json: without poses there are no scan locations",
            ));
        }

        for (file, location) in found {
            if location.room.is_none() && self.semantic_mesh.is_some() {
                self.warnings.push(format!("{}: names no room", file.display()));
            }
            self.locations.push(location);
        }
        Ok(())
    }

    /// Returns the path of the taxonomy's file, beside the area's folder. If it does not exist, the taxonomy
    /// is S3DIS's.
    pub fn taxonomy_json(&self) -> PathBuf {
        self.path.join("../assets/taxonomy.json")
    }

    /// Returns the path of the file that describes the area's frame, beside the area's folder. It may not
    /// exist.
    pub fn conventions(&self) -> PathBuf {
        self.path.join("../conventions.json")
    }

    /// Reads both meshes. The textured one gives the mesh, the other one the labels of its faces, if it
    /// exists.
    ///
    /// Both usually have the same faces in the same order. If not, a face gets the label of the first face
    /// with the same corners, whichever corner comes first.
    ///
    /// # Errors
    /// Like [`read_mesh`]; [`Error::Format`] for `3d/semantic.obj` if it has fewer than half of the
    /// faces, or none of its materials is a label.
    pub fn read_mesh(&self) -> Result<PublishedMesh> {
        let mut file = read_mesh(&self.mesh, self.up)?;
        file.offset_m = self.world_offset_m;
        let Some(path) = &self.semantic_mesh else { return self.moved(file, Vec::new(), Vec::new()) };
        let semantic = LabelledMesh::new(read_mesh(path, self.up)?.mesh, &self.taxonomy);
        let fault = |message: String| Error::format(path, message);

        let mesh = &file.mesh;
        let faces = mesh.faces().len() as u32;
        let mut labels = LabelList::default();
        let label_of_face: Vec<u32> = if semantic.is_paired_with(mesh) {
            (0..faces)
                .map(|face| labels.place_of(semantic.label_of(face)))
                .collect()
        } else {
            let found = semantic.labels_by_corners(mesh);
            let missing = found.iter().filter(|label| label.is_none()).count();
            if 2 * missing > found.len() {
                return Err(fault(format!(
                    "{missing} of the {faces} faces of rgb.obj are not in it: it labels another mesh"
                )));
            }
            file.warnings.push(format!(
                "the faces of semantic.obj and rgb.obj are in different orders: they are matched by their \
                 corners, {missing} without a label"
            ));
            found
                .into_iter()
                .map(|label| labels.place_of(label.flatten()))
                .collect()
        };

        if labels.labels.is_empty() {
            return Err(fault("no material of a face is a label, as in chair_3_office_5_1".into()));
        }
        self.moved(file, labels.labels, label_of_face)
    }

    /// Takes a mesh from the frame of its file to the world.
    fn moved(&self, file: MeshFile, labels: Vec<Label>, label_of_face: Vec<u32>) -> Result<PublishedMesh> {
        let mut mesh = PublishedMesh { file, labels, label_of_face };
        if self.world_from_area != DAffine3::IDENTITY {
            mesh.turn(&self.world_from_area)
                .map_err(|source| Error::Mesh { path: self.mesh.clone(), source })?;
        }
        Ok(mesh)
    }

    /// Returns the labels of the mesh's faces as annotations: see [`Annotations::from_face_labels`].
    ///
    /// # Errors
    /// Like [`Annotations::from_face_labels`].
    pub fn annotations(&self, mesh: &PublishedMesh) -> Result<Annotations> {
        let path = self.semantic_mesh.as_ref().unwrap_or(&self.mesh);
        let mut found =
            Annotations::from_face_labels(path, &mesh.file.mesh, &mesh.labels, &mesh.label_of_face)?;
        found.taxonomy = self.taxonomy.clone();
        Ok(found)
    }
}

impl PublishedMesh {
    /// Transforms positions and normals. Labels stay with their faces.
    fn turn(&mut self, world_from_area: &DAffine3) -> std::result::Result<(), s3d_geom::MeshError> {
        let labels = std::mem::take(&mut self.label_of_face);
        let labelled = self.file.mesh.clone().with_face_tags(labels);
        self.file.mesh = labelled.transformed(world_from_area)?;
        self.label_of_face = self.file.mesh.take_face_tags();
        Ok(())
    }
}

/// The mesh of `semantic.obj`.
struct LabelledMesh {
    mesh: TriMesh,
    /// The label in the name of each material; `None` if it has none.
    label_of_material: Vec<Option<Label>>,
}

impl LabelledMesh {
    fn new(mesh: TriMesh, taxonomy: &Taxonomy) -> Self {
        let label_of_material = mesh
            .materials()
            .iter()
            .map(|m| taxonomy.parse_name(&m.name).ok().flatten())
            .collect();
        Self { mesh, label_of_material }
    }

    fn label_of(&self, face: u32) -> Option<Label> {
        let material = self.mesh.material_of(face)?;
        *self.label_of_material.get(material as usize)?
    }

    /// Returns whether both meshes have the same faces in the same order.
    fn is_paired_with(&self, mesh: &TriMesh) -> bool {
        mesh.faces().len() == self.mesh.faces().len()
            && (0..mesh.faces().len() as u32).all(|face| near(mesh.triangle(face), self.mesh.triangle(face)))
    }

    /// Returns for each face of `mesh` the label of the face here with the same corners. The outer `None`
    /// means that there is no such face, the inner one that it has no label.
    fn labels_by_corners(&self, mesh: &TriMesh) -> Vec<Option<Option<Label>>> {
        let mut by_corners: HashMap<[[u32; 3]; 3], Option<Label>> = HashMap::new();
        for face in 0..self.mesh.faces().len() as u32 {
            by_corners
                .entry(corners(self.mesh.triangle(face)))
                .or_insert(self.label_of(face));
        }
        (0..mesh.faces().len() as u32)
            .map(|face| by_corners.get(&corners(mesh.triangle(face))).copied())
            .collect()
    }
}

/// The different labels of a mesh, in the order in which they are first asked for.
#[derive(Default)]
struct LabelList {
    labels: Vec<Label>,
    places: HashMap<Label, u32>,
}

impl LabelList {
    /// Returns the place of a label in the list, and adds it if it is new. Returns [`NO_INDEX`] for `None`.
    fn place_of(&mut self, label: Option<Label>) -> u32 {
        let Some(label) = label else { return NO_INDEX };
        *self.places.entry(label).or_insert_with(|| {
            self.labels.push(label);
            self.labels.len() as u32 - 1
        })
    }
}

fn existing(file: PathBuf) -> Option<PathBuf> {
    file.is_file().then_some(file)
}

/// Returns the number in the name of an area's folder: 3 for `area_3`, 5 for `area_5a`.
fn area_of(path: &Path) -> Option<u32> {
    let path = std::fs::canonicalize(path).ok()?;
    let name = path.file_name()?.to_str()?.to_ascii_lowercase();
    let number = name.strip_prefix("area_")?;
    number
        .strip_suffix(['a', 'b'])
        .unwrap_or(number)
        .parse()
        .ok()
        .filter(|n| *n > 0)
}

/// Returns whether two faces are the same, except for the way in which their numbers are written.
fn near(a: [Vec3; 3], b: [Vec3; 3]) -> bool {
    a.iter().zip(&b).all(|(a, b)| a.abs_diff_eq(*b, 1e-3))
}

/// Returns the corners of a face as a key that compares bits. The order of the corners does not matter.
fn corners(face: [Vec3; 3]) -> [[u32; 3]; 3] {
    // Adding 0 turns −0 into 0.
    let mut key = face.map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
    key.sort_unstable();
    key
}
