//! Files that label the faces of a mesh: meshes with labels of their own, and the lists of objects of HM3D,
//! Replica, ScanNet++, 3RScan and Matterport3D, and folders of labels that `s3d-annotate` makes.
//!
//! Each kind becomes a mesh with [`MeshLabels`](crate::mesh::MeshLabels). `transfer` hands its labels to the
//! faces of the scene's mesh.

mod hm3d;
mod house;
pub(crate) mod numbers;
mod replica;
pub(crate) mod saved;
mod segments;
pub(crate) mod transfer;

use crate::error::{Error, Result};
use crate::fs::open::open_file;
use crate::house::is_house;
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis};
use crate::mesh::labels::MeshLabels;
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::read::{MeshFormat, read_mesh_with};
use std::io::Read;
use std::path::{Path, PathBuf};

/// A file of labels, by its kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum LabelFile {
    /// A mesh with labels of its faces or vertices, or with names of materials or nodes.
    Mesh(PathBuf),
    /// HM3D's `….semantic.txt`.
    Hm3d(PathBuf),
    /// Matterport3D's `.house`.
    House(PathBuf),
    /// Replica's `info_semantic.json`.
    Replica(PathBuf),
    /// Objects as groups of segments: ScanNet++'s `segments_anno.json`, 3RScan's `semseg.v2.json`,
    /// Matterport3D's `region0.semseg.json`.
    Segments(PathBuf),
    /// One number for each vertex or face of the scene's mesh.
    Numbers(PathBuf),
    /// The archive in a folder of labels, for each face of the scene's mesh: see [`saved`].
    Saved(PathBuf),
}

impl LabelFile {
    /// Finds the kind of a file, or of the file of labels in a folder. Returns `None` if it is of another
    /// kind.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Format`] for a PLY file whose header is damaged.
    pub(crate) fn of(path: &Path) -> Result<Option<Self>> {
        if path.is_dir() {
            return Ok(Self::in_folder(path));
        }

        let name = name_of(path);
        if name.ends_with(".aggregation.json") {
            return Ok(None);
        }
        let path = path.to_owned();
        match name.rsplit_once('.').map_or("", |(_, ending)| ending) {
            "ply" => Ok(has_faces(&path)?.then_some(Self::Mesh(path))),
            "house" => Ok(Some(Self::House(path))),
            "json" => Ok(Self::of_json(&path)),
            "txt" if hm3d::is_list(&path) => Ok(Some(Self::Hm3d(path))),
            "txt" | "npy" => Ok(numbers::is_number_list(&path).then_some(Self::Numbers(path))),
            _ => Ok(MeshFormat::of(&path).map(|_| Self::Mesh(path))),
        }
    }

    /// Finds the file of labels in a folder of a data set.
    fn in_folder(dir: &Path) -> Option<Self> {
        if let Some(archive) = saved::archive_in(dir) {
            return Some(Self::Saved(archive));
        }
        let usual = ["segments_anno.json", "semseg.v2.json", "info_semantic.json"];
        let by_name = usual.iter().map(|name| dir.join(name)).find(|path| path.is_file());
        if let Some(path) = by_name {
            return Self::of_json(&path);
        }
        let files = files_of(dir);
        if let Some(house) = files.iter().find(|path| is_house(path) && path.is_file()) {
            return Some(Self::House(house.clone()));
        }
        let list = files
            .into_iter()
            .find(|path| name_of(path).ends_with(".semantic.txt"))?;
        hm3d::is_list(&list).then_some(Self::Hm3d(list))
    }

    /// Finds the kind of a JSON file by its keys.
    fn of_json(path: &Path) -> Option<Self> {
        let head = String::from_utf8_lossy(&head_of(path)).into_owned();
        let keys = ["segGroups", "id_to_label", "class_name", "\"classes\""];
        let has = keys.map(|key| head.contains(key));
        match has {
            [true, ..] => Some(Self::Segments(path.to_owned())),
            [_, false, false, false] => None,
            _ => Some(Self::Replica(path.to_owned())),
        }
    }

    /// Reads the mesh with its labels. Its companions are the other files that were read.
    ///
    /// # Errors
    /// Like [`read_mesh_with`]; [`Error::Format`] for labels that are damaged or do not fit their mesh.
    pub(crate) fn read(&self, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
        match self {
            Self::Mesh(path) => read_mesh_with(path, up, options),
            Self::Hm3d(list) => hm3d::read(list, up, options),
            Self::House(house) => house::read(house, up, options),
            Self::Replica(list) => replica::read(list, up, options),
            Self::Segments(groups) => segments::read(groups, up, options),
            Self::Numbers(list) => Err(Error::unsupported(
                list,
                "has a number for each vertex or face of a mesh: open it for the mesh that it is about",
            )),
            Self::Saved(archive) => Err(Error::unsupported(
                archive,
                "has labels for each face of a mesh: open it for the mesh that it is about",
            )),
        }
    }

    /// Returns the path of the file.
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::Mesh(path)
            | Self::Hm3d(path)
            | Self::House(path)
            | Self::Replica(path)
            | Self::Segments(path)
            | Self::Numbers(path)
            | Self::Saved(path) => path,
        }
    }
}

/// Labels that a list beside a mesh gives to its faces.
pub(crate) struct NamedFaces {
    pub(crate) labels: MeshLabels,
    pub(crate) warnings: Vec<String>,
    /// The list.
    pub(crate) list: PathBuf,
}

/// Reads the list of objects that the data set of a mesh puts beside it, if the mesh has objects without
/// classes, or classes without words, or is HM3D's coloured one. A class column that the user named is meant:
/// then there is no list.
///
/// # Errors
/// [`Error::Io`], and [`Error::Format`] for a list that is damaged or does not fit.
pub(crate) fn named_beside(file: &MeshFile, class_column: Option<&str>) -> Result<Option<NamedFaces>> {
    let Some(path) = file.sources.first().map(|source| &source.path) else { return Ok(None) };
    if class_column.is_some() {
        return Ok(None);
    }

    let mut warnings = Vec::new();
    if let Some(list) = house::house_of(file) {
        let labels = house::named(file, &list, &mut warnings)?;
        return Ok(Some(NamedFaces { labels, warnings, list }));
    }
    if file.sources.len() > 1 {
        return Ok(None);
    }
    let (labels, list) = match &file.labels {
        Some(labels @ MeshLabels::Numbers { class, instance: Some(_), .. }) => {
            if let Some(list) = segments::groups_of_objects_beside(path) {
                (segments::named(labels, &file.mesh, &list)?, list)
            } else if let Some(list) = replica::list_beside(path).filter(|_| class.is_none()) {
                (replica::named(labels, &file.mesh, &list)?, list)
            } else {
                return Ok(None);
            }
        }
        Some(MeshLabels::Numbers { .. } | MeshLabels::Names { .. }) => return Ok(None),
        Some(MeshLabels::Objects { .. }) | None => match hm3d::list_beside(path) {
            Some(list) => (hm3d::named(&file.mesh, &list, &mut warnings)?, list),
            None => return Ok(None),
        },
    };
    Ok(Some(NamedFaces { labels, warnings, list }))
}

/// Returns whether a PLY file is a mesh.
fn has_faces(path: &Path) -> Result<bool> {
    let file = open_file(path)?;
    let bytes = file.metadata().map_err(|e| Error::io(path, "read", e))?.len();
    let reader = PlyReader::new(file, bytes, path)?;
    Ok(reader.header().element("face").is_some_and(|(_, face)| face.count > 0))
}

/// Returns the first 64 KiB of a file, or nothing if it cannot be read.
fn head_of(path: &Path) -> Vec<u8> {
    let mut head = Vec::new();
    // A file that cannot be read, or is a pipe, is of no known kind. Whoever reads it as another kind reports
    // the fault.
    let read = open_file(path).map(|file| file.take(1 << 16).read_to_end(&mut head));
    if !matches!(read, Ok(Ok(_))) {
        head.clear();
    }
    head
}

/// Returns the name of a file in lower case.
fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Returns the files of a folder, by name.
fn files_of(dir: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(dir).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    files
}

/// Returns the folder of a file.
fn folder_of(path: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).to_owned()
}
