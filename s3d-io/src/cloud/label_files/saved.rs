//! The labels of the faces of a mesh in a folder such as `scan.labels`, as `s3d-annotate` makes them: the
//! archive `labels.npz`. The log of the work, `events.jsonl`, lies beside it.

use crate::cloud::npy::npz::{NpzReader, NpzWriter, bytes, numbers};
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use crate::fs::checksum::{Checksum, ChecksumOfParts};
use crate::fs::open::open_file;
use crate::mesh::file::MeshFile;
use crate::mesh::labels::{LabelledObject, LabelledRoom, MeshLabels};
use s3d_geom::{NO_INDEX, TriMesh};
use std::collections::{HashMap, HashSet};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The name of the archive of labels in a folder of labels.
pub const LABELS_FILE: &str = "labels.npz";

/// The name of the log of the work in a folder of labels.
pub const EVENTS_FILE: &str = "events.jsonl";

/// The number of a face without an instance, a class or a room.
const NONE: i32 = -1;

/// Labels of the faces of a mesh: what `labels.npz` holds.
///
/// | array | type, shape | |
/// |---|---|---|
/// | `class` | `<i4` (faces) | for each face its place in `classes`, or −1 |
/// | `instance` | `<i4` (faces) | the number of its instance, which is one of `instances`, or −1 |
/// | `room` | `<i4` (faces) | the number of its room, which is one of `rooms`, or −1 |
/// | `classes` | `<U…` (classes) | the names of the classes |
/// | `instances`, `instance_names` | `<i4`, `<U…` (instances) | their numbers; names such as `chair_3` |
/// | `rooms`, `room_names` | `<i4`, `<U…` (rooms) | their numbers; `office_1`, or nothing without a type |
/// | `mesh` | `<U32` (1) | the checksum of the mesh: [`mesh_checksum`] |
/// | `revision` | `<u8` (1) | the number of the last event of the log that is in it |
///
/// ```
/// use s3d_io::cloud::{SavedLabels, mesh_checksum};
/// use s3d_geom::{TriMesh, glam::Vec3};
///
/// # let folder = tempfile::tempdir().unwrap();
/// let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
/// let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2], [1, 3, 2]])?;
/// let labels = SavedLabels {
///     mesh: mesh_checksum(&mesh),
///     revision: 1,
///     class: vec![0, -1],
///     instance: vec![7, -1],
///     room: vec![-1, -1],
///     classes: vec!["chair".into()],
///     instances: vec![(7, "chair_1".into())],
///     rooms: Vec::new(),
/// };
/// labels.write(folder.path())?;
/// assert_eq!(SavedLabels::read(folder.path())?, labels);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedLabels {
    /// The checksum of the mesh.
    pub mesh: Checksum,
    /// The number of the last event of the log that is in them.
    pub revision: u64,
    /// For each face its place in `classes`, or −1.
    pub class: Vec<i32>,
    /// For each face the number of its instance, or −1.
    pub instance: Vec<i32>,
    /// For each face the number of its room, or −1.
    pub room: Vec<i32>,
    /// The names of the classes.
    pub classes: Vec<String>,
    /// The numbers of the instances that have a face, and their names, such as `chair_3`.
    pub instances: Vec<(i32, String)>,
    /// The numbers of the rooms, and their names, such as `office_1`; empty for a room without a type.
    pub rooms: Vec<(i32, String)>,
}

/// Returns the checksum that a mesh is known by: of the positions of its vertices and the corners of its
/// faces, in their order. Colours and textures do not count, as labels of faces do not depend on them.
pub fn mesh_checksum(mesh: &TriMesh) -> Checksum {
    let mut parts = ChecksumOfParts::default();
    let mut block = Vec::new();
    let mut flush = |block: &mut Vec<u8>, at_least: usize| {
        if block.len() >= at_least {
            parts.add(block);
            block.clear();
        }
    };

    for position in mesh.positions() {
        block.extend(position.to_array().into_iter().flat_map(f32::to_le_bytes));
        flush(&mut block, BLOCK);
    }
    for face in mesh.faces() {
        block.extend(face.iter().flat_map(|corner| corner.to_le_bytes()));
        flush(&mut block, BLOCK);
    }
    flush(&mut block, 0);
    parts.finish().1
}

/// How many bytes are summed up at once.
const BLOCK: usize = 1 << 16;

impl SavedLabels {
    /// Writes `labels.npz` in the folder, whole or not at all, and returns its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    ///
    /// # Panics
    /// If there is not one class, instance and room a face.
    pub fn write(&self, folder: &Path) -> Result<u64> {
        let faces = self.class.len();
        assert!([&self.instance, &self.room].iter().all(|column| column.len() == faces), "one entry a face");
        let path = folder.join(LABELS_FILE);
        let file = AtomicFile::create(&path)?;
        self.write_archive(file)
            .map_err(|e| Error::io(&path, "write", e))?
            .commit()
    }

    fn write_archive(&self, file: AtomicFile) -> io::Result<AtomicFile> {
        let mut archive = NpzWriter::new(file);
        let mut column = |name: &str, values: &mut dyn ExactSizeIterator<Item = i32>| {
            let length = values.len() as u64;
            archive.array(name, "<i4", &[length], bytes(values, i32::to_le_bytes))
        };
        column("class", &mut self.class.iter().copied())?;
        column("instance", &mut self.instance.iter().copied())?;
        column("room", &mut self.room.iter().copied())?;
        column("instances", &mut self.instances.iter().map(|(number, _)| *number))?;
        column("rooms", &mut self.rooms.iter().map(|(number, _)| *number))?;

        archive.texts("classes", &self.classes)?;
        archive.texts("instance_names", &self.instances.iter().map(|(_, name)| name).collect::<Vec<_>>())?;
        archive.texts("room_names", &self.rooms.iter().map(|(_, name)| name).collect::<Vec<_>>())?;
        archive.texts("mesh", &[self.mesh.to_string()])?;
        archive.array("revision", "<u8", &[1], self.revision.to_le_bytes())?;
        archive.finish()
    }

    /// Reads `labels.npz` of a folder.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if it is damaged, if its columns have different lengths, or if a face
    /// has a number that is not listed.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = &folder.join(LABELS_FILE);
        let mut archive = NpzReader::new(open_file(path)?, path)?;
        let mut column = |name: &str| {
            let data = archive.whole(name, |_| "<i4".to_owned(), |bytes| vec![bytes as u64 / 4]);
            data.map(|data| numbers(&data, i32::from_le_bytes))
        };
        let [class, instance, room] = [column("class")?, column("instance")?, column("room")?];
        let [instances, rooms] = [column("instances")?, column("rooms")?];
        let revision = archive.whole("revision", |_| "<u8".to_owned(), |bytes| vec![bytes as u64 / 8])?;

        let classes = archive.texts("classes")?;
        let instances = named(path, "instance", instances, archive.texts("instance_names")?)?;
        let rooms = named(path, "room", rooms, archive.texts("room_names")?)?;
        let mesh = archive.texts("mesh")?.pop().unwrap_or_default();
        let mesh = mesh
            .parse()
            .map_err(|e| Error::format(path, format!("the array \"mesh\": {e}")))?;
        let revision = numbers(&revision, u64::from_le_bytes).pop().unwrap_or(0);

        let labels = Self { mesh, revision, class, instance, room, classes, instances, rooms };
        labels.check(path)?;
        Ok(labels)
    }

    fn check(&self, path: &Path) -> Result<()> {
        let counts = [&self.class, &self.instance, &self.room].map(Vec::len);
        let [classes, instances, rooms] = counts;
        if classes != instances || classes != rooms {
            let message =
                format!("has a class for {classes} faces, an instance for {instances}, a room for {rooms}");
            return Err(Error::format(path, message));
        }

        let is_place = |class: &i32| usize::try_from(*class).is_ok_and(|place| place < self.classes.len());
        let unknown = |listed: &[(i32, String)], column: &[i32]| {
            let listed: std::collections::HashSet<i32> = listed.iter().map(|(number, _)| *number).collect();
            column
                .iter()
                .copied()
                .find(|number| *number != NONE && !listed.contains(number))
        };
        let fault = [
            (
                "class",
                self.class
                    .iter()
                    .copied()
                    .find(|class| *class != NONE && !is_place(class)),
            ),
            ("instance", unknown(&self.instances, &self.instance)),
            ("room", unknown(&self.rooms, &self.room)),
        ];
        match fault.iter().find_map(|(what, number)| Some((what, (*number)?))) {
            Some((what, number)) => Err(Error::format(path, format!("lists no {what} {number} of a face"))),
            None => Ok(()),
        }
    }

    /// Takes the labels from faces that are in no room with a type. Returns a warning if there are some.
    ///
    /// # Errors
    /// [`Error::Format`] if there are no others.
    fn leave_out_roomless(&mut self, archive: &Path, mesh: &TriMesh) -> Result<Option<String>> {
        let typed = self.rooms.iter().filter(|(_, name)| !name.is_empty());
        let typed: HashSet<i32> = typed.map(|(number, _)| *number).collect();

        let (mut kept, mut left_out_m2) = (0u64, 0.0);
        let columns = self.class.iter_mut().zip(&self.room);
        for (face, (class, room)) in (0..).zip(columns).filter(|(_, (class, _))| **class != NONE) {
            if typed.contains(room) {
                kept += 1;
            } else {
                *class = NONE;
                left_out_m2 += mesh.area(face);
            }
        }

        let how = "rooms get their types on the plan of `s3d label`";
        if kept == 0 && left_out_m2 > 0.0 {
            let message = format!(
                "no label is in a room that has a type: {how}; or say room = \"office_1\" under \
                 [annotations], if all of it is one room"
            );
            return Err(Error::format(archive, message));
        }
        let path = archive.display();
        Ok((left_out_m2 > 0.0).then(|| {
            format!(
                "{path}: {left_out_m2:.1} m² with labels are in no room that has a type, and count as \
                 unlabelled: {how}"
            )
        }))
    }

    /// Returns the labels as objects: one for each instance and room.
    fn into_mesh_labels(self) -> MeshLabels {
        let room_names: HashMap<i32, String> = self.rooms.into_iter().collect();
        let mut objects = Vec::new();
        let mut index: HashMap<(i32, i32, i32), u32> = HashMap::new();
        let columns = self.class.iter().zip(&self.instance).zip(&self.room);
        let faces = columns.map(|((&class, &instance), &room)| {
            let Some(word) = usize::try_from(class).ok().and_then(|class| self.classes.get(class)) else {
                return NO_INDEX;
            };
            *index.entry((class, instance, room)).or_insert_with(|| {
                // A room without a type is no room of any data set.
                let name = room_names.get(&room).filter(|name| !name.is_empty()).cloned();
                let room = name.map(|name| LabelledRoom { number: room.into(), name: Some(name) });
                objects.push(LabelledObject { class: word.clone(), instance: instance.into(), room });
                objects.len() as u32 - 1
            })
        });
        let faces = faces.collect();
        MeshLabels::Objects { objects, faces, are_names: false }
    }
}

/// Puts numbers and names together.
fn named(path: &Path, what: &str, numbers: Vec<i32>, names: Vec<String>) -> Result<Vec<(i32, String)>> {
    if numbers.len() == names.len() {
        return Ok(numbers.into_iter().zip(names).collect());
    }
    let message = format!("has {} numbers of {what}s and {} names", numbers.len(), names.len());
    Err(Error::format(path, message))
}

/// Returns the archive of a folder of labels, if it is one. The archive may be missing.
pub(super) fn archive_in(dir: &Path) -> Option<PathBuf> {
    let is_one = [LABELS_FILE, EVENTS_FILE].iter().any(|name| dir.join(name).is_file());
    is_one.then(|| dir.join(LABELS_FILE))
}

/// Reads the labels in `folder` for the faces of a mesh, with warnings, such as that the log has more than
/// they have. `needs_rooms`: nothing says where labels belong that are in no room with a type. They are left
/// out then.
///
/// # Errors
/// The errors of [`SavedLabels::read`]; [`Error::Format`] if they are about another mesh, not written yet, or
/// all left out.
pub(crate) fn read_for(
    archive: &Path,
    mesh: &MeshFile,
    needs_rooms: bool,
) -> Result<(MeshLabels, Vec<String>)> {
    let folder = super::folder_of(archive);
    if !archive.exists() {
        let message = "is not there yet: the labels of this folder were never written, only their log";
        return Err(Error::format(archive, message));
    }

    let mut labels = SavedLabels::read(&folder)?;
    let faces = mesh.mesh.faces().len();
    if labels.mesh != mesh_checksum(&mesh.mesh) || labels.class.len() != faces {
        let n = labels.class.len();
        let message = format!(
            "has labels for another mesh, of {n} faces; the mesh of the scene has {faces}: carry the labels \
             over to it, or give the scene the mesh that was labelled"
        );
        return Err(Error::format(archive, message));
    }

    let revision = labels.revision;
    let mut warnings = Vec::new();
    if needs_rooms {
        warnings.extend(labels.leave_out_roomless(archive, &mesh.mesh)?);
    }
    let newer = last_event(&folder.join(EVENTS_FILE))
        .filter(|last| *last > revision)
        .map(|last| {
            let path = archive.display();
            format!(
                "{path}: has the labels up to event {revision} of {last}: write them anew to have the rest"
            )
        });
    warnings.extend(newer);
    Ok((labels.into_mesh_labels(), warnings))
}

/// Returns the number of the last event of a log, if it can be told from its end.
fn last_event(log: &Path) -> Option<u64> {
    let mut file = open_file(log).ok()?;
    let bytes = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(bytes.saturating_sub(TAIL))).ok()?;
    let mut tail = Vec::new();
    file.take(TAIL).read_to_end(&mut tail).ok()?;

    let whole = tail.iter().rposition(|byte| *byte == b'\n')?;
    let last = tail.get(..whole)?.rsplit(|byte| *byte == b'\n').next()?;
    let line: LastEvent = serde_json::from_slice(last).ok()?;
    Some(line.n)
}

/// As much of the end of a log as is looked at, bytes.
const TAIL: u64 = 1 << 22;

/// What is read of the last line.
#[derive(serde::Deserialize)]
struct LastEvent {
    n: u64,
}
