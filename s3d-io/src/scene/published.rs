//! A published area (or one of our exports) as input: its mesh, its labels, its scan locations.

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

/// How [`PublishedArea::open_with`] takes a folder.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedOptions {
    /// The area's number; `None`: the folder's name says it (`area_3`, `area_5a`).
    pub area: Option<u32>,
    /// Takes the area's frame to the world: turns, shifts and scales. For one of 5a and 5b, to bring it to
    /// the other's frame, which is in no file of the published data set.
    pub world_from_area: DAffine3,
}

impl Default for PublishedOptions {
    /// The number in the folder's name, the frame of the files.
    fn default() -> Self {
        Self { area: None, world_from_area: DAffine3::IDENTITY }
    }
}

/// The folder of an area, as published: `area_3`.
///
/// | file | |
/// |---|---|
/// | `3d/rgb.obj` | the mesh, +Y up; needed |
/// | `3d/semantic.obj` | the same faces; the names of their materials are labels; without it there are none |
/// | `data/pose/*.json`, `pano/pose/*.json` | scan locations; one file of each is read |
/// | `3d/pointcloud.mat` | annotated points, if it is there |
/// | `assets/taxonomy.json` | beside the area's folder, if the classes are not S3DIS's |
/// | `assets/semantic_labels.json` | beside the area's folder or in it, if it is there |
///
/// Source: formats.md, "What is written", "World and meshes".
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
    /// Which axis points up in both.
    pub up: UpAxis,
    /// `pointcloud.mat`, if there is one: a source for [`Annotations::open`], in the frame of the files.
    pub point_cloud: Option<PathBuf>,
    /// The classes of the data set.
    pub taxonomy: Taxonomy,
    /// The data set's list of labels, if there is one.
    pub labels: Option<PathBuf>,
    /// The scan locations, by uuid; in the world.
    pub locations: Vec<PublishedLocation>,
    /// Takes the files' frame to the world.
    pub world_from_area: DAffine3,
    /// What was subtracted from the coordinates of the area's scan when it was exported, as the
    /// `conventions.json` beside its folder says; 0 if there is none, or the area is moved by
    /// `world_from_area`.
    pub world_offset_m: DVec3,
    /// What was odd: a sentence each, for the user.
    pub warnings: Vec<String>,
}

/// A published mesh with the label of each face.
#[derive(Clone, Debug)]
pub struct PublishedMesh {
    /// The mesh with its textures, in the world.
    pub file: MeshFile,
    /// The different labels, in the order of their first faces.
    pub labels: Vec<Label>,
    /// One a face of the mesh: its place in `labels`, or [`NO_INDEX`] if it has none. Empty if there are no
    /// labels.
    pub label_of_face: Vec<u32>,
}

impl PublishedArea {
    /// Finds what is in the folder `path`, and reads its scan locations.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] that names what is missing, or the pose file that is not as it should
    /// be.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_with(path, &PublishedOptions::default())
    }

    /// As [`PublishedArea::open`], with a number and a frame.
    ///
    /// # Errors
    /// As [`PublishedArea::open`].
    pub fn open_with(path: &Path, options: &PublishedOptions) -> Result<Self> {
        std::fs::read_dir(path).map_err(|e| Error::io(path, "read the folder", e))?;
        let Some(area) = options.area.or_else(|| area_of(path)) else {
            return Err(Error::format(
                path,
                "is no folder of a published area by its name, as in area_3 or area_5a: rename it",
            ));
        };
        let optional = |file: PathBuf| file.is_file().then_some(file);
        let Some(mesh) = optional(path.join("3d/rgb.obj")) else {
            return Err(Error::format(path, "has no 3d/rgb.obj, the textured mesh of a published area"));
        };
        let semantic_mesh = optional(path.join("3d/semantic.obj"));
        let labels = "assets/semantic_labels.json";
        let mut this = Self {
            path: path.to_owned(),
            area,
            mesh,
            semantic_mesh,
            up: UpAxis::Y,
            point_cloud: optional(path.join("3d/pointcloud.mat")),
            taxonomy: read_taxonomy_json_or_s3dis(&path.join("../assets/taxonomy.json"))?,
            labels: optional(path.join("..").join(labels)).or_else(|| optional(path.join(labels))),
            locations: Vec::new(),
            world_from_area: options.world_from_area,
            world_offset_m: DVec3::ZERO,
            warnings: Vec::new(),
        };
        if this.world_from_area == DAffine3::IDENTITY
            && let Some(number) = area_of(path)
        {
            match read_world_offsets(&this.conventions()) {
                Ok(offsets) => {
                    this.world_offset_m =
                        offsets.get(&number).copied().map_or(DVec3::ZERO, DVec3::from_array);
                }
                Err(e) => this.warnings.push(e.to_string()),
            }
        }
        let folders = ["data/pose", "pano/pose"].map(|folder| path.join(folder));
        let mut found = poses::read(&folders, &this.world_from_area, &this.taxonomy)?;
        // Where photographs were taken nobody stood with a scanner.
        let photographs = path.join("frames.json");
        if photographs.is_file() {
            let photographs = read_photographs(&photographs)?;
            found.retain(|(_, l)| photographs.iter().all(|p| p.camera_uuid != l.location.uuid));
        }
        if found.is_empty() {
            return Err(Error::format(
                path,
                "has no data/pose/*.json or pano/pose/*.json: without poses there are no scan locations",
            ));
        }
        for (file, location) in found {
            if location.room.is_none() && this.semantic_mesh.is_some() {
                this.warnings.push(format!("{}: names no room", file.display()));
            }
            this.locations.push(location);
        }
        if this.semantic_mesh.is_none() {
            this.warnings
                .push(format!("{}: has no 3d/semantic.obj, so that there are no labels", path.display()));
        }
        Ok(this)
    }

    /// The file beside the area's folder that holds its taxonomy; there is none for S3DIS's.
    pub fn taxonomy_json(&self) -> PathBuf {
        self.path.join("../assets/taxonomy.json")
    }

    /// The file beside the area's folder that tells of its frame; there may be none.
    pub fn conventions(&self) -> PathBuf {
        self.path.join("../conventions.json")
    }

    /// Reads both meshes: the textured one, and the labels of its faces from the other, if it is there.
    ///
    /// The two have the same faces, in the same order as a rule. If not, a face gets the label of the one
    /// with the same corners, whichever comes first.
    ///
    /// # Errors
    /// As [`read_mesh`]; [`Error::Format`] for `3d/semantic.obj` if fewer than half of the faces are in it,
    /// or none of its materials is a label.
    pub fn read_mesh(&self) -> Result<PublishedMesh> {
        let mut file = read_mesh(&self.mesh, self.up)?;
        file.offset_m = self.world_offset_m;
        let Some(path) = &self.semantic_mesh else { return self.moved(file, Vec::new(), Vec::new()) };
        let semantic = read_mesh(path, self.up)?.mesh;
        let fault = |message: String| Error::format(path, message);

        let parsed: Vec<Option<Label>> = semantic
            .materials()
            .iter()
            .map(|m| self.taxonomy.parse_name(&m.name).ok().flatten())
            .collect();
        let other = |f: u32| semantic.material_of(f).and_then(|m| *parsed.get(m as usize)?);
        let mut labels = Vec::new();
        let mut places: HashMap<Label, u32> = HashMap::new();
        let mut place = |label: Option<Label>| {
            label.map_or(NO_INDEX, |label| {
                *places.entry(label).or_insert_with(|| {
                    labels.push(label);
                    labels.len() as u32 - 1
                })
            })
        };
        let n = file.mesh.faces().len() as u32;
        let are_paired = n as usize == semantic.faces().len()
            && (0..n).all(|f| near(file.mesh.triangle(f), semantic.triangle(f)));
        let label_of_face: Vec<u32> = if are_paired {
            (0..n).map(|f| place(other(f))).collect()
        } else {
            let mut by_corners: HashMap<[[u32; 3]; 3], Option<Label>> = HashMap::new();
            for f in 0..semantic.faces().len() as u32 {
                by_corners.entry(corners(semantic.triangle(f))).or_insert(other(f));
            }
            let found: Vec<Option<Option<Label>>> = (0..n)
                .map(|f| by_corners.get(&corners(file.mesh.triangle(f))).copied())
                .collect();
            let missing = found.iter().filter(|f| f.is_none()).count();
            if 2 * missing > found.len() {
                return Err(fault(format!(
                    "{missing} of the {n} faces of rgb.obj are not in it: it labels another mesh"
                )));
            }
            file.warnings.push(format!(
                "the faces of semantic.obj stand in another order than those of rgb.obj: matched by their \
                 corners, {missing} without a label"
            ));
            found.into_iter().map(|f| place(f.flatten())).collect()
        };
        if labels.is_empty() {
            return Err(fault("no material of a face is a label, as in chair_3_office_5_1".into()));
        }
        self.moved(file, labels, label_of_face)
    }

    fn moved(&self, file: MeshFile, labels: Vec<Label>, label_of_face: Vec<u32>) -> Result<PublishedMesh> {
        let mut mesh = PublishedMesh { file, labels, label_of_face };
        if self.world_from_area != DAffine3::IDENTITY {
            mesh.turn(&self.world_from_area)
                .map_err(|source| Error::Mesh { path: self.mesh.clone(), source })?;
        }
        Ok(mesh)
    }

    /// The annotations that the labels of the mesh's faces are: see [`Annotations::from_face_labels`].
    ///
    /// # Errors
    /// As there.
    pub fn annotations(&self, mesh: &PublishedMesh) -> Result<Annotations> {
        let path = self.semantic_mesh.as_ref().unwrap_or(&self.mesh);
        let mut found =
            Annotations::from_face_labels(path, &mesh.file.mesh, &mesh.labels, &mesh.label_of_face)?;
        found.taxonomy = self.taxonomy.clone();
        Ok(found)
    }
}

impl PublishedMesh {
    fn turn(&mut self, world_from_area: &DAffine3) -> std::result::Result<(), s3d_geom::MeshError> {
        let mut parts = self.file.mesh.parts().clone();
        let normal_from = world_from_area.matrix3.inverse().transpose();
        for p in &mut parts.positions {
            *p = world_from_area.transform_point3(p.as_dvec3()).as_vec3();
        }
        for n in &mut parts.normals {
            *n = (normal_from * n.as_dvec3()).normalize_or_zero().as_vec3();
        }
        parts.face_tags = std::mem::take(&mut self.label_of_face);
        self.file.mesh = TriMesh::new(parts)?;
        self.label_of_face = self.file.mesh.take_face_tags();
        Ok(())
    }
}

/// The number in the name of an area's folder: `area_3`, `area_5a`.
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

/// Whether two faces are the same, but for what two ways of writing their numbers differ in.
fn near(a: [Vec3; 3], b: [Vec3; 3]) -> bool {
    a.iter().zip(&b).all(|(a, b)| a.abs_diff_eq(*b, 1e-3))
}

/// The corners of a face as a key: to the bit, whichever comes first.
fn corners(face: [Vec3; 3]) -> [[u32; 3]; 3] {
    // Adding 0 turns −0 into 0.
    let mut key = face.map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
    key.sort_unstable();
    key
}
