//! Replica's labels: objects of the faces of `mesh_semantic.ply`, and their classes in `info_semantic.json`.
//! Source: facebookresearch/Replica-Dataset, README.md ("habitat/info_semantic.json").

use crate::cloud::label_files::folder_of;
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis};
use crate::mesh::labels::{LabelledObject, MeshLabels, NO_LABEL};
use crate::mesh::read::read_mesh_with;
use s3d_geom::{NO_INDEX, TriMesh};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

const LIST: &str = "info_semantic.json";
const MESH: &str = "mesh_semantic.ply";

#[derive(Deserialize)]
struct Info {
    #[serde(default)]
    classes: Vec<Class>,
    #[serde(default)]
    objects: Vec<Object>,
    /// The class of each object, by the object's number. Some files have this alone.
    #[serde(default)]
    id_to_label: Vec<i64>,
}

#[derive(Deserialize)]
struct Class {
    id: i64,
    name: String,
}

#[derive(Deserialize)]
struct Object {
    id: i64,
    class_id: Option<i64>,
    class_name: Option<String>,
}

/// Returns the list that belongs to a mesh, if it lies beside it.
pub(super) fn list_beside(mesh: &Path) -> Option<PathBuf> {
    let dir = folder_of(mesh);
    let places = [dir.join(LIST), dir.join("habitat").join(LIST)];
    places.into_iter().find(|path| path.is_file())
}

/// Reads the mesh that a list is about.
///
/// # Errors
/// [`Error::Format`] if the mesh is not beside the list, or its faces have no objects.
pub(super) fn read(list: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let dir = folder_of(list);
    let places = [dir.join(MESH), dir.join("..").join(MESH)];
    let mesh = places
        .into_iter()
        .find(|path| path.is_file())
        .ok_or_else(|| Error::format(list, format!("the mesh that it is about is not beside it: {MESH}")))?;
    let mut file = read_mesh_with(&mesh, up, options)?;
    let labels = file.labels.as_ref().ok_or_else(|| no_objects(list))?;
    file.labels = Some(named(labels, &file.mesh, list)?);
    Ok(file)
}

/// Gives the objects of a mesh their classes.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the list is damaged or names no object, or the mesh has none.
pub(super) fn named(labels: &MeshLabels, mesh: &TriMesh, list: &Path) -> Result<MeshLabels> {
    let info: Info = read_json(list)?;
    let class_of_object = classes_of_objects(&info);
    if class_of_object.is_empty() {
        return Err(Error::format(list, "names no object: it has neither objects nor id_to_label"));
    }
    let MeshLabels::Numbers { instance: Some(column), .. } = labels.clone().into_faces(mesh) else {
        return Err(no_objects(list));
    };

    let mut objects = Vec::new();
    let mut index: HashMap<i64, u32> = HashMap::new();
    let faces = column.values.iter().map(|&number| {
        *index.entry(number).or_insert_with(|| {
            let Some(class) = class_of_object.get(&number).filter(|_| number != NO_LABEL) else {
                return NO_INDEX;
            };
            objects.push(LabelledObject { class: class.clone(), instance: number, room: None });
            objects.len() as u32 - 1
        })
    });
    let faces = faces.collect();
    Ok(MeshLabels::Objects { objects, faces, are_names: false })
}

fn no_objects(list: &Path) -> Error {
    Error::format(list, "its mesh has no column of objects, such as object_id")
}

/// Returns the class of each object, by its number. Objects without a class are left out.
fn classes_of_objects(info: &Info) -> HashMap<i64, String> {
    let names: HashMap<i64, &str> = info.classes.iter().map(|c| (c.id, c.name.as_str())).collect();
    let mut found = HashMap::new();
    for (number, class) in (0..).zip(&info.id_to_label) {
        if let Some(name) = names.get(class) {
            found.insert(number, (*name).to_owned());
        }
    }
    for object in &info.objects {
        let by_id = object.class_id.and_then(|id| names.get(&id).copied());
        if let Some(name) = object.class_name.as_deref().or(by_id).filter(|name| !name.is_empty()) {
            found.insert(object.id, name.to_owned());
        }
    }
    found
}
