//! Lists of one number for each face or vertex.

use super::Key;
use super::names::ClassNames;
use s3d_geom::TriMesh;
use s3d_io::Error as FileError;
use s3d_io::cloud::{NpyArray, NpzArchive, is_number_list, read_number_list, read_whole_numbers};
use s3d_io::fs::open_file;
use s3d_io::mesh::{LabelColumn, LabelElement, MeshLabels, NO_LABEL};
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

type Result<T> = std::result::Result<T, FileError>;

/// The arrays of an archive that hold classes, the surest first.
const CLASS: [&str; 10] = [
    "class",
    "label",
    "labels",
    "semantic",
    "semantic_label",
    "semantic_labels",
    "sem_label",
    "prediction",
    "pred",
    "segment",
];

/// The arrays of an archive that hold instances.
const INSTANCE: [&str; 6] =
    ["instance", "instances", "instance_id", "instance_label", "ins_label", "object_id"];

/// The array of an archive that holds the names of the classes.
const NAMES: &str = "classes";

/// The arrays of an archive that hold places: then it is a table of points.
const PLACE: [&str; 7] = ["xyz", "coord", "coords", "points", "position", "positions", "x"];

/// A list of numbers for the faces or vertices of a mesh.
pub(super) struct List {
    element: LabelElement,
    class: Vec<i64>,
    instance: Option<Vec<i64>>,
    /// The names of the classes, if the file has them.
    classes: Option<Vec<String>>,
}

impl List {
    /// Reads a list. Returns `None` if the file is of another kind.
    ///
    /// # Errors
    /// [`FileError`] with the place for numbers that are not whole, and for a list of another length.
    pub(super) fn read(path: &Path, mesh: &TriMesh) -> Result<Option<Self>> {
        if path.is_dir() {
            return Ok(None);
        }
        let mut head = Vec::new();
        let opened = open_file(path)?;
        let read = opened.take(1 << 16).read_to_end(&mut head);
        read.map_err(|e| FileError::io(path, "read", e))?;
        if head.starts_with(b"PK\x03\x04") {
            return Self::of_archive(path, mesh);
        }
        // Tables of named columns and of several dimensions are no lists.
        if !is_number_list(path) {
            return Ok(None);
        }
        let class = read_number_list(path)?;
        let element = element(path, class.len() as u64, mesh)?;
        Ok(Some(Self { element, class, instance: None, classes: None }))
    }

    fn of_archive(path: &Path, mesh: &TriMesh) -> Result<Option<Self>> {
        let mut archive = NpzArchive::open(path)?;
        let names = archive.names().to_vec();
        let has = |known: &[&str]| {
            let mut all = known.iter();
            all.find(|known| names.iter().any(|name| name == **known))
                .map(|name| (*name).to_owned())
        };
        if has(&PLACE).is_some() {
            return Ok(None);
        }
        let instance = has(&INSTANCE);
        let class = has(&CLASS).or_else(|| {
            let is_other = |name: &&String| Some(*name) != instance.as_ref() && *name != NAMES;
            let mut others = names.iter().filter(is_other);
            let first = others.next().cloned();
            first.filter(|_| others.next().is_none())
        });
        let Some(class) = class else {
            let message =
                format!("has no array of classes among its arrays ({}): call it class", names.join(", "));
            return Err(FileError::format(path, message));
        };

        let mut column = |name: &str| -> Result<(u64, Vec<i64>, LabelElement)> {
            let mut array = archive.array(name)?;
            if array.shape().len() != 1 {
                let sides = array.shape().len();
                let message = format!("has {sides} dimensions: a list of classes or instances has one");
                return Err(FileError::format(array.name(), message));
            }
            let length = length(&array);
            let element = element(array.name(), length, mesh)?;
            Ok((length, read_whole_numbers(&mut array)?, element))
        };
        let (length, class, element) = column(&class)?;
        let instance = match instance {
            None => None,
            Some(name) => {
                let (other, numbers, _) = column(&name)?;
                if other != length {
                    let message = format!("has {length} classes and {other} instances: they do not fit");
                    return Err(FileError::format(path, message));
                }
                Some(numbers)
            }
        };
        let classes = has(&[NAMES]).map(|name| archive.texts(&name)).transpose()?;
        Ok(Some(Self { element, class, instance, classes }))
    }

    /// Returns what each face belongs to.
    ///
    /// # Errors
    /// [`FileError`] for the first number without a meaning.
    pub(super) fn keys(
        self,
        path: &Path,
        mesh: &TriMesh,
        names: &ClassNames<'_>,
    ) -> Result<Vec<Option<Key>>> {
        // Names beside the file go before those in it.
        let own = match &self.classes {
            Some(words) if !names.are_said() => {
                let words = (0..)
                    .zip(words)
                    .map(|(n, word): (u32, _)| (n.to_string(), Some(word.clone())));
                Some(ClassNames::of_words(words.collect(), path.join(NAMES), names.taxonomy)?)
            }
            _ => None,
        };
        let names = own.as_ref().unwrap_or(names);
        let mut meanings: HashMap<i64, _> = HashMap::new();
        let mut keys: Vec<Key> = Vec::new();
        let mut known: HashMap<Key, i64> = HashMap::new();
        let mut key_of_each = Vec::with_capacity(self.class.len());
        for (place, number) in self.class.iter().enumerate() {
            let class = match meanings.get(number) {
                Some(class) => *class,
                None => {
                    let class = names.class_of_number(*number).map_err(|why| {
                        let what = match self.element {
                            LabelElement::Face => "face",
                            LabelElement::Vertex => "vertex",
                        };
                        FileError::format(path, format!("{what} {place}, counted from 0, has {why}"))
                    })?;
                    meanings.insert(*number, class);
                    class
                }
            };
            let instance = self.instance.as_ref().and_then(|column| column.get(place).copied());
            key_of_each.push(class.map_or(NO_LABEL, |class| {
                let key = (class, instance.filter(|number| *number >= 0));
                *known.entry(key).or_insert_with(|| {
                    keys.push(key);
                    keys.len() as i64 - 1
                })
            }));
        }

        let column = LabelColumn { name: String::new(), values: key_of_each };
        let labels = MeshLabels::Numbers { element: self.element, class: Some(column), instance: None };
        let MeshLabels::Numbers { class: Some(column), .. } = labels.into_faces(mesh) else {
            return Ok(vec![None; mesh.faces().len()]);
        };
        let key = |place: &i64| keys.get(usize::try_from(*place).ok()?).copied();
        Ok(column.values.iter().map(key).collect())
    }
}

/// Returns what a list of this length is about.
fn element(path: &Path, count: u64, mesh: &TriMesh) -> Result<LabelElement> {
    let [vertices, faces] = [mesh.positions().len() as u64, mesh.faces().len() as u64];
    match (count == vertices, count == faces) {
        (true, false) => Ok(LabelElement::Vertex),
        (false, true) => Ok(LabelElement::Face),
        (both, _) => {
            let why = if both {
                "so it may be about either: write the labels as a property of the faces in a PLY file"
            } else {
                "so it is about neither: it needs one for each face or for each vertex of this mesh, without \
                 the faces that have no area"
            };
            let message =
                format!("has {count} numbers, and the mesh has {vertices} vertices and {faces} faces, {why}");
            Err(FileError::format(path, message))
        }
    }
}

fn length<R: Read>(array: &NpyArray<R>) -> u64 {
    array.shape().first().copied().unwrap_or(0)
}
