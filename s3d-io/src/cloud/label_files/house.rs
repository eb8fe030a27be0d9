//! Matterport3D's labels: the segments, objects and classes of the faces of a mesh, and what the `.house`
//! file of the house says of them. Sources: see [`crate::house`]; niessner/Matterport,
//! code/gaps/apps/mpview/mp.cpp (`ReadMeshFile`, `ReadObjectFile`).
//!
//! `material_id` of a face is its segment. In the mesh of a house, it is a segment of the `.house` file,
//! which tells its object, and this one its class and region. The mesh of a region counts segments and
//! objects of its own, so there `segment_id` is the object and `category_id` a row of `category_mapping.tsv`,
//! which a class of the house has too.

use crate::cloud::label_files::{files_of, folder_of, name_of};
use crate::error::{Error, Result};
use crate::fs::open::open_file;
use crate::fs::quote::count;
use crate::house::{ENDING, House, is_house};
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis};
use crate::mesh::labels::{LabelledObject, LabelledRoom, MATTERPORT_NAMES, MeshLabels, NO_LABEL};
use crate::mesh::ply::batch::{PlyBatch, integer};
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::read::read_mesh_with;
use s3d_geom::NO_INDEX;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The folder of the houses, beside the folder of the regions.
const HOUSES: &str = "house_segmentations";

/// Returns the house that the labels of a mesh belong to, if its file lies where the data set has it: beside
/// the mesh of the house, or in a folder beside the one of the regions.
pub(super) fn house_of(file: &MeshFile) -> Option<PathBuf> {
    let MeshLabels::Numbers { class: Some(class), instance: Some(instance), .. } = file.labels.as_ref()?
    else {
        return None;
    };
    let [_, object, category] = MATTERPORT_NAMES;
    if class.name != category || instance.name != object {
        return None;
    }

    let (first, others) = file.sources.split_first()?;
    let house = beside(&first.path)?;
    let is_same = |path: &Path| region_of(path).is_some() && beside(path).as_ref() == Some(&house);
    let all_are = others.is_empty() || file.sources.iter().all(|source| is_same(&source.path));
    all_are.then_some(house)
}

/// Returns the file of the house that a mesh shows, or shows a region of.
fn beside(mesh: &Path) -> Option<PathBuf> {
    let own = mesh.with_extension(ENDING);
    if own.is_file() || region_of(mesh).is_none() {
        return Some(own).filter(|path| path.is_file());
    }
    let folders = [folder_of(mesh).join("..").join(HOUSES), folder_of(mesh)];
    folders.iter().find_map(|folder| {
        let mut houses = files_of(folder)
            .into_iter()
            .filter(|path| is_house(path) && path.is_file());
        houses.next().filter(|_| houses.next().is_none())
    })
}

/// Returns the number of the region that a mesh shows, from 0: `region3.ply`.
fn region_of(mesh: &Path) -> Option<usize> {
    let name = name_of(mesh);
    name.strip_prefix("region")?.strip_suffix(".ply")?.parse().ok()
}

/// Reads the mesh of a house with its labels.
///
/// # Errors
/// [`Error::Format`] if the mesh is not beside the file of the house, and the errors of [`named`].
pub(super) fn read(house: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let mesh = house.with_extension("ply");
    if !mesh.is_file() {
        let message = format!("the mesh that it is about is not beside it: {}", name_of(&mesh));
        return Err(Error::format(house, message));
    }
    let options = MeshOptions { class_column: None, instance_column: None, ..options.clone() };
    let mut file = read_mesh_with(&mesh, up, &options)?;
    let mut warnings = std::mem::take(&mut file.warnings);
    file.labels = Some(named(&file, house, &mut warnings)?);
    file.warnings = warnings;
    Ok(file)
}

/// Gives the faces of a mesh, or of the regions that it is joined from, the objects of a house. Faces that
/// belong to no object with a class stay unlabelled.
///
/// # Errors
/// [`Error::Io`]; the errors of [`House::read`]; [`Error::Format`] if the mesh has no segments, or none that
/// the house knows, or shows a region that the house does not have.
pub(super) fn named(file: &MeshFile, path: &Path, warnings: &mut Vec<String>) -> Result<MeshLabels> {
    let house = House::read(path)?;
    let shows_regions = file.sources.iter().all(|source| region_of(&source.path).is_some());
    let (objects, faces) = if shows_regions {
        of_regions(file, &house, path)?
    } else {
        of_house(file, &house, path)?
    };

    let unlabelled = faces.iter().filter(|object| **object == NO_INDEX).count();
    if unlabelled == faces.len() {
        return Err(Error::format(path, "no face of the mesh belongs to an object of this house"));
    }
    if unlabelled > 0 {
        let n = count(unlabelled, "face");
        warnings.push(format!("{n} without a label: they belong to no object of {}", path.display()));
    }
    Ok(MeshLabels::Objects { objects, faces, are_names: false })
}

/// Objects, and for each face its place among them.
type Labelled = (Vec<LabelledObject>, Vec<u32>);

/// Takes the objects of the segments of the faces.
fn of_house(file: &MeshFile, house: &House, path: &Path) -> Result<Labelled> {
    let mut objects = Vec::new();
    let mut index = Vec::new();
    for (instance, object) in (0..).zip(&house.objects) {
        let word = object
            .category
            .and_then(|place| house.categories.get(place)?.word.clone());
        let Some(class) = word else {
            index.push(NO_INDEX);
            continue;
        };
        index.push(objects.len() as u32);
        let room = object.region.and_then(|place| room_of(house, place));
        objects.push(LabelledObject { class, instance, room });
    }

    let Some(mesh) = file.sources.first().map(|source| &source.path) else {
        return Err(Error::format(path, "its mesh is no file"));
    };
    let segments = segments_of(mesh)?;
    let faces = file.source_faces.iter().map(|&face| {
        let segment = segments.get(face as usize);
        let object = segment.and_then(|number| *house.segments.get(number)?);
        object.and_then(|place| index.get(place).copied()).unwrap_or(NO_INDEX)
    });
    Ok((objects, faces.collect()))
}

/// Takes the objects and classes of the faces, and the room of the region that each file shows.
fn of_regions(file: &MeshFile, house: &House, path: &Path) -> Result<Labelled> {
    let words: HashMap<i64, &String> = house
        .categories
        .iter()
        .filter_map(|category| Some((category.mapping, category.word.as_ref()?)))
        .collect();
    let Some(MeshLabels::Numbers { class: Some(class), instance: Some(instance), .. }) =
        file.labels.clone().map(|labels| labels.into_faces(&file.mesh))
    else {
        return Err(Error::format(path, "the mesh of a region has no segment_id and category_id"));
    };

    let mut objects = Vec::new();
    let mut faces = Vec::new();
    for (source, mesh) in file.sources.iter().enumerate() {
        let region = region_of(&mesh.path);
        let Some(room) = region.and_then(|place| room_of(house, place)) else {
            let message = format!(
                "shows a region that the house {} with {} does not have",
                path.display(),
                house.regions.len()
            );
            return Err(Error::format(&mesh.path, message));
        };
        let mut index: HashMap<(i64, i64), u32> = HashMap::new();
        for face in file.faces_of(source) {
            let number = |values: &[i64]| values.get(face as usize).copied().unwrap_or(NO_LABEL);
            let key = (number(&class.values), number(&instance.values));
            let Some(word) = words.get(&key.0) else {
                faces.push(NO_INDEX);
                continue;
            };
            faces.push(*index.entry(key).or_insert_with(|| {
                let room = Some(room.clone());
                objects.push(LabelledObject { class: (*word).clone(), instance: key.1, room });
                objects.len() as u32 - 1
            }));
        }
    }
    Ok((objects, faces))
}

/// Returns the room of a region, by its place.
fn room_of(house: &House, place: usize) -> Option<LabelledRoom> {
    let region = house.regions.get(place)?;
    let number = i64::try_from(place).ok()?.checked_add(1)?;
    Some(LabelledRoom { number, name: Some(region.room.clone()) })
}

/// Reads the segment of each face of a PLY file, in the order of the file. The number of a face without one
/// is [`NO_LABEL`].
fn segments_of(mesh: &Path) -> Result<Vec<i64>> {
    let [segment, ..] = MATTERPORT_NAMES;
    let file = open_file(mesh)?;
    let bytes = file.metadata().map_err(|e| Error::io(mesh, "read", e))?.len();
    let mut reader = PlyReader::new(file, bytes, mesh)?;
    while let Some(element) = reader.next_element()? {
        if element.name != "face" {
            continue;
        }
        let Some(property) = element.find_scalar(&[segment]) else { break };
        reader.want([property]);
        let mut numbers = Vec::with_capacity(reader.plausible_rows(&element));
        let mut batch = PlyBatch::default();
        while reader.read_batch(&mut batch)? {
            let values = batch.scalars(property).iter();
            numbers.extend(values.map(|value| integer(*value).unwrap_or(NO_LABEL)));
        }
        return Ok(numbers);
    }
    Err(Error::format(mesh, format!("has no property {segment} of its faces, which tells their segments")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::{AnnotatedMesh, AnnotationOptions, Annotations};
    use crate::house::tests::{HOUSE, with};
    use crate::mesh::join::read_meshes;
    use s3d_geom::PointCloud;
    use s3d_label::Taxonomy;
    use std::fs;

    /// Writes a PLY file of squares of 1 m in a row at height `z`, one face each: with segment, object and
    /// class.
    fn ply(path: &Path, z: f32, faces: &[[i64; 3]]) {
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {}\nproperty list uchar int vertex_indices\nproperty int material_id\n\
             property int segment_id\nproperty int category_id\nend_header\n",
            4 * faces.len(),
            faces.len()
        );
        for i in 0..faces.len() {
            for (x, y) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                text += &format!("{} {y} {z}\n", 2 * i + x);
            }
        }
        for (i, [segment, object, class]) in faces.iter().enumerate() {
            let c = 4 * i;
            text += &format!("4 {c} {} {} {} {segment} {object} {class}\n", c + 1, c + 2, c + 3);
        }
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// The faces of the house. Objects and classes are wrong, so that only segments lead to the right ones.
    const FACES: [[i64; 3]; 6] =
        [[7, 9, 9], [3, 9, 9], [1_000_003, 9, 9], [1_000_007, 9, 9], [-1, 9, 9], [555, 9, 9]];

    fn options(taxonomy: &str, room: &str) -> AnnotationOptions {
        let taxonomy = Taxonomy::built_in(taxonomy).unwrap();
        let room = taxonomy.room_of_word(room).ok();
        AnnotationOptions { taxonomy, room, ..AnnotationOptions::default() }
    }

    /// The instances, sorted: room, class, and the faces that vote for it.
    fn instances(found: &Annotations) -> Vec<(String, &'static str, Vec<u32>)> {
        let mut all = Vec::new();
        for room in &found.rooms {
            for instance in &room.instances {
                let mut cloud = PointCloud::default();
                instance.read(&mut cloud).unwrap();
                cloud.faces.dedup();
                all.push((room.room.to_string(), instance.class.name(), cloud.faces));
            }
        }
        all.sort();
        all
    }

    fn open(mesh: &Path, labels: &Path, options: &AnnotationOptions) -> Result<Annotations> {
        let file = read_mesh_with(mesh, UpAxis::Z, &MeshOptions::default())?;
        let scene = AnnotatedMesh { file: &file, up: UpAxis::Z, units: None, outside_files: false };
        Annotations::open_for(&scene, &[labels.to_owned()], options)
    }

    fn of_mesh(paths: &[PathBuf], options: &AnnotationOptions) -> Result<Annotations> {
        Annotations::of_mesh(&read_meshes(paths, UpAxis::Z)?, options)
    }

    #[test]
    fn segments_lead_to_classes_and_rooms() {
        let dir = tempfile::tempdir().unwrap();
        let [mesh, house] = ["a.ply", "a.house"].map(|name| dir.path().join(name));
        ply(&mesh, 0.0, &FACES);
        fs::write(&house, HOUSE).unwrap();
        let options = options("matterport40", "openspace_1");
        let right = [
            ("bedroom_1".to_owned(), "chair", vec![2, 3]),
            ("bedroom_1".to_owned(), "floor", vec![0, 1]),
            ("kitchen_1".to_owned(), "chestOfDrawers", vec![4, 5]),
        ];

        let found = open(&mesh, &house, &options).unwrap();
        let sorted = instances(&found);
        assert_eq!(sorted, right);
        assert!(found.warnings[0].starts_with("6 faces without a label: they"), "{:?}", found.warnings);
        assert_eq!(found.companions, std::slice::from_ref(&mesh));

        // The file beside the mesh is found.
        let beside = of_mesh(std::slice::from_ref(&mesh), &options).unwrap();
        let sorted = instances(&beside);
        assert_eq!((sorted, &beside.companions), (right.to_vec(), &vec![house.clone()]));

        // The faces of another mesh take the labels of the surface.
        let other = dir.path().join("other.obj");
        fs::write(&other, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 4 0 0\nv 5 0 0\nv 5 1 0\nf 1 2 3\nf 4 5 6\n")
            .unwrap();
        let sorted = instances(&open(&other, &house, &options).unwrap());
        let right = [("bedroom_1".into(), "floor", vec![0]), ("kitchen_1".into(), "chestOfDrawers", vec![1])];
        assert_eq!(sorted, right);
    }

    #[test]
    fn a_taxonomy_without_these_rooms_takes_their_numbers() {
        let dir = tempfile::tempdir().unwrap();
        let [mesh, house] = ["a.ply", "a.house"].map(|name| dir.path().join(name));
        ply(&mesh, 0.0, &FACES);
        fs::write(&house, HOUSE).unwrap();
        let options = AnnotationOptions { unknown_as_clutter: true, ..options("s3dis", "office_1") };
        let found = instances(&open(&mesh, &house, &options).unwrap());
        let right = [
            ("office_1".to_owned(), "chair", vec![2, 3]),
            ("office_1".to_owned(), "floor", vec![0, 1]),
            ("office_2".to_owned(), "clutter", vec![4, 5]),
        ];
        assert_eq!(found, right);
    }

    #[test]
    fn regions_count_their_own_objects() {
        let dir = tempfile::tempdir().unwrap();
        let regions = [0, 1].map(|n| dir.path().join(format!("region_segmentations/region{n}.ply")));
        // Both regions have an object 0 of segment 0.
        ply(&regions[0], 0.0, &[[0, 0, 4], [1, 1, 28], [2, 2, 28]]);
        ply(&regions[1], 3.0, &[[0, 0, 111], [1, -1, -1]]);
        let options = options("matterport40", "openspace_1");
        let message = of_mesh(&regions, &options).unwrap_err().to_string();
        assert!(message.contains("region0.ply: category_id has rows of category_mapping.tsv"), "{message}");

        let house = dir.path().join("house_segmentations/a.house");
        fs::create_dir_all(house.parent().unwrap()).unwrap();
        fs::write(&house, HOUSE).unwrap();
        let found = of_mesh(&regions, &options).unwrap();
        let sorted = instances(&found);
        let right = [
            ("bedroom_1".to_owned(), "chair", vec![2, 3]),
            ("bedroom_1".to_owned(), "chair", vec![4, 5]),
            ("bedroom_1".to_owned(), "floor", vec![0, 1]),
            ("kitchen_1".to_owned(), "chestOfDrawers", vec![6, 7]),
        ];
        assert_eq!(sorted, right);

        let third = dir.path().join("region_segmentations/region2.ply");
        fs::rename(&regions[1], &third).unwrap();
        let message = of_mesh(&[third], &options).unwrap_err().to_string();
        assert!(message.contains("region2.ply: shows a region that the house"), "{message}");
    }

    #[test]
    fn groups_of_segments_of_faces_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        ply(&at("region0.ply"), 0.0, &[[0, 0, 4], [1, 1, 28], [2, 2, 28]]);
        fs::write(at("region0.fsegs.json"), r#"{"segIndices": [10, 11, 12]}"#).unwrap();
        let groups = at("region0.semseg.json");
        let text = r#"{"segGroups": [{"id": 0, "label": "floor", "segments": [10]},
                       {"id": 1, "label": "chair", "segments": [11, 12]}]}"#;
        fs::write(&groups, text).unwrap();
        let options = options("matterport40", "b_1");
        let found = instances(&open(&at("region0.ply"), &groups, &options).unwrap());
        let right = [
            ("bedroom_1".to_owned(), "chair", vec![2, 3, 4, 5]),
            ("bedroom_1".to_owned(), "floor", vec![0, 1]),
        ];
        assert_eq!(found, right);

        for (name, text, words) in [
            ("region0.fsegs.json", r#"{"segIndices": [10]}"#, "has segments for 1 faces"),
            ("region0.fsegs.json", "{", "region0.fsegs.json, line 1"),
        ] {
            fs::write(at(name), text).unwrap();
            let message = open(&at("region0.ply"), &groups, &options).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
        fs::remove_file(at("region0.fsegs.json")).unwrap();
        let message = open(&at("region0.ply"), &groups, &options).unwrap_err().to_string();
        assert!(message.contains("not beside it: region0.fsegs.json"), "{message}");
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let [mesh, house] = ["a.ply", "a.house"].map(|name| dir.path().join(name));
        let options = options("matterport40", "openspace_1");
        ply(&mesh, 0.0, &FACES[4..]);
        fs::write(&house, HOUSE).unwrap();
        let refused = || open(&mesh, &house, &options).unwrap_err().to_string();
        assert!(refused().contains("a.house: no face of the mesh belongs to an object of this house"));
        ply(&mesh, 0.0, &FACES);
        fs::write(&house, with("E 1 1 3", "E 1 4 3")).unwrap();
        assert!(refused().contains("a.house, line 23: names object 4"));
        fs::write(&house, HOUSE).unwrap();
        let text = fs::read_to_string(&mesh).unwrap();
        fs::write(&mesh, text.replace("int material_id", "int part")).unwrap();
        assert!(refused().contains("a.ply: has no property material_id"));
        let other = dir.path().join("b.house");
        fs::rename(&house, &other).unwrap();
        let message = open(&mesh, &other, &options).unwrap_err().to_string();
        assert!(message.contains("b.house: the mesh that it is about is not beside it: b.ply"), "{message}");
    }
}
