//! What comes out of a labelling: `labels.npz` and `rooms.json`.

use super::column::NONE;
use super::error::{Error, Result};
use super::event::Room;
use super::folder::LabelFolder;
use super::state::State;
use crate::segments::Segments;
use s3d_geom::TriMesh;
use s3d_io::cloud::{LABELS_FILE, SavedLabels, mesh_checksum};
use s3d_io::fs::{Checksum, write_json};
use s3d_label::Taxonomy;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;

/// The name of the list of rooms in a folder of labels.
pub const ROOMS_FILE: &str = "rooms.json";

/// The name of the patches and their tree in a folder of labels.
pub const SEGMENTS_FILE: &str = "segments.json";

/// What `segments.json` holds.
#[derive(Serialize)]
struct SegmentList<'s> {
    mesh: Checksum,
    /// The segment of each face, under the name that ScanNet's files have for it.
    #[serde(rename = "segIndices")]
    segment_of_face: &'s [u32],
    /// The node that joins each node to another; `null` for a root. The first nodes are the segments.
    parent: Vec<Option<u32>>,
    cost: Vec<f32>,
}

/// What `rooms.json` holds.
#[derive(Serialize)]
struct RoomList<'s> {
    mesh: Checksum,
    revision: u64,
    rooms: Vec<ListedRoom<'s>>,
}

/// A room of the list.
#[derive(Serialize)]
struct ListedRoom<'s> {
    /// The permanent number.
    number: u32,
    /// Such as `office_1`; `None` without a type.
    label: Option<&'s String>,
    #[serde(flatten)]
    is: &'s Room,
    faces: u64,
    area_m2: f64,
}

impl State {
    /// Returns the names of the instances that have a face, such as `chair_3`. The instances of a class count
    /// from 1 in the order of their permanent numbers, so a name may be another one's later.
    pub fn instance_names(&self) -> BTreeMap<u32, String> {
        let with_faces = self
            .instances()
            .iter()
            .filter(|(number, _)| self.size_of(**number).0 > 0);
        numbered(with_faces.map(|(number, class)| (*number, class.as_str())))
    }

    /// Returns the names of the rooms that have a type, such as `office_1`, numbered likewise.
    pub fn room_names(&self) -> BTreeMap<u32, String> {
        let rooms = self.rooms().iter();
        numbered(rooms.filter_map(|(number, room)| Some((*number, room.kind.as_deref()?))))
    }

    /// Returns the labels as `labels.npz` has them. `room_of_face` is from [`State::room_of_face`]. The
    /// classes are those of the taxonomy in its order, and then other words of the log.
    pub fn saved_labels(&self, mesh: Checksum, room_of_face: &[u32], taxonomy: &Taxonomy) -> SavedLabels {
        let mut classes: Vec<String> = taxonomy.classes().iter().map(|class| class.name().into()).collect();
        let mut places: HashMap<&str, i32> = HashMap::new();
        for (place, class) in (0..).zip(taxonomy.classes()) {
            places.insert(class.name(), place);
        }
        for class in self.instances().values() {
            places.entry(class).or_insert_with(|| {
                classes.push(class.clone());
                classes.len() as i32 - 1
            });
        }

        let class_of: HashMap<u32, i32> = self
            .instances()
            .iter()
            .filter_map(|(number, class)| Some((*number, *places.get(class.as_str())?)))
            .collect();
        let number = |number: &u32| if *number == NONE { -1 } else { *number as i32 };
        let class = |instance: &u32| class_of.get(instance).copied().unwrap_or(-1);
        let listed = |names: BTreeMap<u32, String>| names.into_iter().map(|(n, name)| (n as i32, name));
        let mut room_names = self.room_names();
        for room in self.rooms().keys() {
            room_names.entry(*room).or_default();
        }
        SavedLabels {
            mesh,
            revision: self.revision(),
            class: self.instance_of_face().iter().map(class).collect(),
            instance: self.instance_of_face().iter().map(number).collect(),
            room: room_of_face.iter().map(number).collect(),
            classes,
            instances: listed(self.instance_names()).collect(),
            rooms: listed(room_names).collect(),
        }
    }
}

impl LabelFolder {
    /// Writes `labels.npz` ([`SavedLabels`]) and `rooms.json` (the rooms with their parts, faces and m²)
    /// into the folder, each whole or not at all. Both say the revision that they are of. `s3d export` reads
    /// the folder as `[annotations] path`.
    ///
    /// # Errors
    /// [`Error::OtherMesh`] if `mesh` is not the mesh of the labels; [`Error::File`].
    pub fn write_labels(&self, mesh: &TriMesh) -> Result<()> {
        let labelled = self.state().face_count();
        let faces = mesh.faces().len() as u32;
        if faces != labelled || mesh_checksum(mesh) != self.mesh() {
            return Err(Error::OtherMesh { path: self.path().join(LABELS_FILE), labelled, faces });
        }

        let room_of_face = self.state().room_of_face(mesh);
        let labels = self.state().saved_labels(self.mesh(), &room_of_face, self.taxonomy());
        labels.write(self.path())?;
        self.write_rooms(mesh, &room_of_face)
    }

    /// Writes `segments.json` into the folder: the segment of each face (`segIndices`), and the tree that makes
    /// larger patches of them: for each node its `parent` and its `cost`. Only people's tools read it.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn write_segments(&self, segments: &Segments) -> Result<()> {
        let tree = &segments.tree;
        let nodes = 0..tree.node_count();
        let list = SegmentList {
            mesh: self.mesh(),
            segment_of_face: &segments.segment_of_face,
            parent: nodes.clone().map(|node| tree.parent(node)).collect(),
            cost: nodes.map(|node| tree.cost(node)).collect(),
        };
        write_json(&self.path().join(SEGMENTS_FILE), &list)?;
        Ok(())
    }

    fn write_rooms(&self, mesh: &TriMesh, room_of_face: &[u32]) -> Result<()> {
        let mut sizes: HashMap<u32, (u64, f64)> = HashMap::new();
        for (face, room) in (0..).zip(room_of_face) {
            let (faces, area_m2) = sizes.entry(*room).or_default();
            *faces += 1;
            *area_m2 += mesh.area(face);
        }

        let names = self.state().room_names();
        let rooms = self.state().rooms().iter().map(|(&number, is)| {
            let (faces, area_m2) = sizes.get(&number).copied().unwrap_or_default();
            ListedRoom { number, label: names.get(&number), is, faces, area_m2 }
        });
        let list = RoomList { mesh: self.mesh(), revision: self.state().revision(), rooms: rooms.collect() };
        let path: PathBuf = self.path().join(ROOMS_FILE);
        write_json(&path, &list)?;
        Ok(())
    }
}

/// Gives things names by their words: each word counts from 1.
fn numbered<'s>(things: impl Iterator<Item = (u32, &'s str)>) -> BTreeMap<u32, String> {
    let mut counts: HashMap<&str, u32> = HashMap::new();
    let names = things.map(|(number, word)| {
        let count = counts.entry(word).or_default();
        *count += 1;
        (number, format!("{word}_{count}"))
    });
    names.collect()
}
