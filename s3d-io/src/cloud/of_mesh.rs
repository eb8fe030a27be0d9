//! Annotations from the labels that came with a mesh.

use crate::cloud::annotations::{AnnotationOptions, Annotations};
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::meaning::{Group, Meaning};
use crate::cloud::table::rows::{CloudTags, NO_INSTANCE, NO_TAG, Reading, Tag, Value};
use crate::cloud::words::class_of_word;
use crate::error::{Error, Result};
use crate::mesh::file::MeshFile;
use crate::mesh::labels::{LabelledObject, MATTERPORT_NAMES, MeshLabels, NO_LABEL};
use s3d_geom::{NO_INDEX, TriMesh};
use s3d_label::{Class, Label};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

impl Annotations {
    /// Takes the annotations that came with a mesh: see [`MeshLabels`].
    ///
    /// [`AnnotationOptions::classes`] gives the meaning of the numbers of faces or vertices. The room is
    /// [`AnnotationOptions::room`], or else the one that the mesh's file is named after (`office_3.ply`).
    /// Faces of one room, class and object number are one instance; faces without a number are one instance a
    /// class and room. Without such numbers, the names of materials are labels (`chair_3_office_5_1`) if at
    /// least half of the faces have a material named so. The points are the ones of
    /// [`Annotations::from_face_labels`].
    ///
    /// # Errors
    /// [`Error::Format`] if the mesh has no labels or no classes, and for classes and rooms without a
    /// meaning, unless they are skipped.
    ///
    /// # Panics
    /// If [`MeshFile::sources`] is empty.
    #[expect(clippy::indexing_slicing, reason = "a mesh of no file is a caller's mistake: see Panics")]
    pub fn of_mesh(file: &MeshFile, options: &AnnotationOptions) -> Result<Self> {
        FaceLabels::of_mesh(file, options)?.annotate(&file.sources[0].path, &file.mesh, options, true)
    }
}

/// The labels of the faces of a mesh.
pub(crate) struct FaceLabels {
    pub(crate) labels: Vec<Label>,
    /// For each face its index into the labels, or [`NO_INDEX`].
    pub(crate) faces: Vec<u32>,
    warnings: Vec<String>,
    /// The other files that say them.
    companions: Vec<PathBuf>,
}

impl FaceLabels {
    /// Takes the labels that came with a mesh.
    ///
    /// # Errors
    /// The errors of [`Annotations::of_mesh`].
    #[expect(clippy::indexing_slicing, reason = "a mesh of no file is a caller's mistake: see `of_mesh`")]
    pub(crate) fn of_mesh(file: &MeshFile, options: &AnnotationOptions) -> Result<Self> {
        let path = &file.sources[0].path;
        let mut companions = Vec::new();
        // Names of materials that are labels of the data set say more than words for classes.
        let names = match &file.labels {
            Some(MeshLabels::Numbers { .. } | MeshLabels::Names { .. }) => None,
            Some(MeshLabels::Objects { .. }) | None => {
                MeshLabels::from_materials(&file.mesh, &options.taxonomy)
            }
        };

        let (labels, mut warnings) = if let Some(names) = names {
            names
        } else if let Some((labels, warnings, list)) = named_beside(file, options)? {
            companions.push(list);
            (labels, warnings)
        } else if let Some(labels) = &file.labels {
            refuse_rows_of_mapping(path, labels, options)?;
            (labels.clone(), Vec::new())
        } else {
            // Features of a glTF file that are none, and why.
            let why = file.warnings.iter().find(|warning| warning.contains("are no labels"));
            let why = why.map_or_else(String::new, |why| format!("; {why}"));
            let message = format!(
                "came without labels: it has no column of classes of faces or vertices (name it with class = \
                 \"…\"), no words of nodes or features, and its materials are not named as labels, as in \
                 chair_3_office_5_1{why}"
            );
            return Err(Error::format(path, message));
        };

        let mut found = Self::of_labels(file, labels, options)?;
        warnings.append(&mut found.warnings);
        Ok(Self { warnings, companions, ..found })
    }

    /// Takes these labels of the mesh.
    ///
    /// # Errors
    /// The errors of [`Annotations::of_mesh`].
    #[expect(clippy::indexing_slicing, reason = "a mesh of no file is a caller's mistake: see `of_mesh`")]
    pub(crate) fn of_labels(
        file: &MeshFile,
        labels: MeshLabels,
        options: &AnnotationOptions,
    ) -> Result<Self> {
        let path = &file.sources[0].path;
        let mut warnings = Vec::new();
        let (labels, faces) = match labels.into_faces(&file.mesh) {
            MeshLabels::Names { labels, faces } => (labels, faces),
            MeshLabels::Objects { objects, faces, .. } => {
                of_tags(file, &ObjectTags::new(&objects, &faces, options), options, &mut warnings)?
            }
            MeshLabels::Numbers { class, instance, .. } => {
                let Some(class) = class else {
                    let message = "has a column of objects and none of classes: name it with class = \"…\"";
                    return Err(Error::format(path, message));
                };
                let instance = instance.map(|column| column.values);
                let numbers = NumberTags { classes: &class.values, instances: instance.as_deref() };
                of_tags(file, &numbers, options, &mut warnings)?
            }
        };
        Ok(Self { labels, faces, warnings, companions: Vec::new() })
    }

    /// Makes annotations of them for the faces of `mesh`. The points know these faces if they are the faces
    /// of the scene's mesh. Messages name the file `path`.
    ///
    /// # Errors
    /// [`Error::Format`] if no face has a label.
    pub(crate) fn annotate(
        self,
        path: &Path,
        mesh: &TriMesh,
        options: &AnnotationOptions,
        know_faces: bool,
    ) -> Result<Annotations> {
        let mut found = Annotations::from_labelled_faces(path, mesh, &self.labels, &self.faces, know_faces)?;
        found.taxonomy = options.taxonomy.clone();
        found.warnings = self.warnings;
        found.companions = self.companions;
        Ok(found)
    }
}

/// Refuses the classes of Matterport3D's meshes where they would be taken for ids of mpcat40. They are rows
/// of another table.
fn refuse_rows_of_mapping(path: &Path, labels: &MeshLabels, options: &AnnotationOptions) -> Result<()> {
    let MeshLabels::Numbers { class: Some(class), instance: Some(instance), .. } = labels else {
        return Ok(());
    };
    let [_, object, category] = MATTERPORT_NAMES;
    let is_matterport = class.name == category && instance.name == object;
    if !is_matterport || options.taxonomy.name() != "matterport40" || !options.classes.is_empty() {
        return Ok(());
    }
    let message = "category_id has rows of category_mapping.tsv, which are not the ids of matterport40: put \
                   the .house file of the house beside it (of a region, into house_segmentations beside its \
                   folder), or say in [annotations.classes] what the numbers mean";
    Err(Error::format(path, message))
}

/// Returns the labels that a list beside a mesh gives to its faces, with warnings and the path of the list.
#[cfg(feature = "labels")]
fn named_beside(file: &MeshFile, options: &AnnotationOptions) -> Result<Option<Named>> {
    let named = crate::cloud::label_files::named_beside(file, options.class_column.as_deref())?;
    Ok(named.map(|named| (named.labels, named.warnings, named.list)))
}

/// Without the feature, no list is read.
#[cfg(not(feature = "labels"))]
fn named_beside(_: &MeshFile, _: &AnnotationOptions) -> Result<Option<Named>> {
    Ok(None)
}

type Named = (MeshLabels, Vec<String>, PathBuf);

/// What a file says of each face of its mesh.
trait FaceTags {
    /// Returns the class of a face, or `None` if it has none.
    fn class(&self, face: u32) -> Option<Value<'_>>;
    /// Returns the number of its object, or [`NO_LABEL`].
    fn instance(&self, face: u32) -> i64;
    /// Returns the number or the name of its room, if the file tells it.
    fn room(&self, face: u32) -> Option<Value<'_>>;
}

/// Columns of numbers, one number a face.
struct NumberTags<'a> {
    classes: &'a [i64],
    instances: Option<&'a [i64]>,
}

impl FaceTags for NumberTags<'_> {
    fn class(&self, face: u32) -> Option<Value<'_>> {
        let class = self
            .classes
            .get(face as usize)
            .copied()
            .filter(|class| *class != NO_LABEL)?;
        Some(Value::Whole(class))
    }

    fn instance(&self, face: u32) -> i64 {
        let instance = self.instances.and_then(|column| column.get(face as usize));
        instance.copied().unwrap_or(NO_LABEL)
    }

    fn room(&self, _face: u32) -> Option<Value<'_>> {
        None
    }
}

/// Objects with words for classes, and the object of each face.
struct ObjectTags<'a> {
    objects: &'a [LabelledObject],
    faces: &'a [u32],
    /// Whether rooms are called by their names. They are if the taxonomy knows one of these; else the numbers
    /// count.
    by_name: bool,
}

impl<'a> ObjectTags<'a> {
    fn new(objects: &'a [LabelledObject], faces: &'a [u32], options: &AnnotationOptions) -> Self {
        let mut names = objects.iter().filter_map(|object| object.room.as_ref()?.name.as_ref());
        let by_name = names.any(|name| options.taxonomy.room_of_word(name).is_ok());
        Self { objects, faces, by_name }
    }

    fn object(&self, face: u32) -> Option<&LabelledObject> {
        self.objects.get(*self.faces.get(face as usize)? as usize)
    }
}

impl FaceTags for ObjectTags<'_> {
    fn class(&self, face: u32) -> Option<Value<'_>> {
        self.object(face).map(|object| Value::Name(&object.class))
    }

    fn instance(&self, face: u32) -> i64 {
        self.object(face).map_or(NO_LABEL, |object| object.instance)
    }

    fn room(&self, face: u32) -> Option<Value<'_>> {
        let room = self.object(face)?.room.as_ref()?;
        let name = room.name.as_deref().filter(|_| self.by_name);
        Some(name.map_or(Value::Whole(room.number), Value::Name))
    }
}

/// Returns the labels that the tags of faces stand for, and for each face an index into them.
#[expect(clippy::indexing_slicing, reason = "columns have an entry a face; groups are counted here")]
fn of_tags(
    file: &MeshFile,
    faces: &dyn FaceTags,
    options: &AnnotationOptions,
    warnings: &mut Vec<String>,
) -> Result<(Vec<Label>, Vec<u32>)> {
    let clouds: Vec<Source> = file.sources.iter().map(|s| Source(s.path.clone())).collect();
    let clouds: Vec<&dyn Cloud> = clouds.iter().map(|c| c as &dyn Cloud).collect();
    let mut tags = CloudTags::new();
    let mut groups: Vec<Group> = Vec::new();
    let mut index: HashMap<(u32, u32, i64), u32> = HashMap::new();
    let mut group_of = vec![NO_INDEX; file.mesh.faces().len()];

    for (source, cloud) in clouds.iter().enumerate() {
        let path = cloud.path();
        let too_many = || Error::format(path, "has too many different classes: is the column another one?");
        let usual_room = match options.room.or(cloud.room(&options.taxonomy)) {
            Some(room) => tags.rooms.name(&room.to_string()).ok_or_else(too_many)?,
            None => NO_TAG,
        };

        for face in file.faces_of(source) {
            let class = match faces.class(face) {
                Some(Value::Name(name)) => tags.classes.name(name),
                Some(Value::Whole(number)) => tags.classes.number(number),
                _ => continue,
            };
            let class = class.ok_or_else(too_many)?;
            let room = match faces.room(face) {
                Some(Value::Name(name)) => tags.rooms.name(name).ok_or_else(too_many)?,
                Some(Value::Whole(number)) => tags.rooms.number(number).ok_or_else(too_many)?,
                _ => usual_room,
            };
            let instance = faces.instance(face).max(NO_INSTANCE);
            let group = *index.entry((room, class, instance)).or_insert_with(|| {
                groups.push(Group { room, class, instance, file: source, points: 0 });
                groups.len() as u32 - 1
            });
            groups[group as usize].points += 1;
            group_of[face as usize] = group;
        }
    }

    if groups.is_empty() {
        let message = "has labels, but no face with a class";
        return Err(Error::format(&file.sources[0].path, message));
    }

    let meaning = Meaning::new(&clouds, options, &groups, &tags, warnings)?;
    // The area does not matter here: instances are numbered by room.
    let labels = meaning
        .instances
        .iter()
        .map(|i| Label { class: i.class, instance: i.number, room: i.room, area: 1 })
        .collect();

    let label_of_face = group_of.into_iter().map(|group| match group {
        NO_INDEX => NO_INDEX,
        group => meaning.instance_of[group as usize].map_or(NO_INDEX, |i| i as u32),
    });
    Ok((labels, label_of_face.collect()))
}

/// A mesh's file, which may name its room and is named in messages.
struct Source(PathBuf);

impl Cloud for Source {
    fn path(&self) -> &Path {
        &self.0
    }

    fn class_of(&self, tag: &Tag) -> Option<Class> {
        match tag {
            Tag::Name(word) => class_of_word(word),
            Tag::Number(_) => None,
        }
    }

    fn read(&self, _colors: ColorRange, _reading: &mut Reading<'_>) -> Result<bool> {
        Err(Error::unsupported(&self.0, "is a mesh and no cloud"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::file::UpAxis;
    use crate::mesh::join::read_meshes;
    use crate::mesh::read::read_mesh;
    use s3d_geom::PointCloud;
    use s3d_label::Class;
    use std::fmt::Write as _;
    use std::fs;

    /// A PLY file with a strip of quads in a plane, each with a class and an object.
    fn strip(labels: &[(i64, i64)], of_vertices: bool) -> String {
        let n = labels.len();
        let columns = "property int label\nproperty int instance\n";
        let v = if of_vertices { columns } else { "" };
        let f = if of_vertices { "" } else { columns };
        let mut ply = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
             {v}element face {n}\nproperty list uchar int vertex_indices\n{f}end_header\n",
            4 * n
        );

        for (i, (class, instance)) in labels.iter().enumerate() {
            for (x, y) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let _ = write!(ply, "{} {y} 0", 2 * i + x);
                let _ = writeln!(
                    ply,
                    "{}",
                    if of_vertices {
                        format!(" {class} {instance}")
                    } else {
                        String::new()
                    }
                );
            }
        }

        for (i, (class, instance)) in labels.iter().enumerate() {
            let c = 4 * i;
            let _ = write!(ply, "4 {c} {} {} {}", c + 1, c + 2, c + 3);
            let _ = writeln!(
                ply,
                "{}",
                if of_vertices {
                    String::new()
                } else {
                    format!(" {class} {instance}")
                }
            );
        }

        ply
    }

    fn options() -> AnnotationOptions {
        let classes = [("2", Some(Class::FLOOR)), ("5", Some(Class::CHAIR)), ("0", None)];
        let classes = classes.map(|(key, class)| (key.to_owned(), class)).into();
        AnnotationOptions { classes, room: "office_7".parse().ok(), ..Default::default() }
    }

    #[test]
    fn numbers_are_ids_of_the_taxonomy() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bedroom_2.ply");
        fs::write(&path, strip(&[(4, -1), (28, 1), (0, 1), (22, 1)], false)).unwrap();
        let file = read_mesh(&path, UpAxis::Z).unwrap();
        let taxonomy = s3d_label::Taxonomy::built_in("scannet20").unwrap();
        let found =
            Annotations::of_mesh(&file, &AnnotationOptions { taxonomy, ..Default::default() }).unwrap();
        let [room] = &found.rooms[..] else { panic!("{found:?}") };
        // 0 is unannotated; 22, the ceiling, is not among the benchmark's classes.
        let names: Vec<&str> = room.instances.iter().map(|i| i.class.name()).collect();
        assert_eq!(
            (room.room.to_string().as_str(), &names[..]),
            ("bedroom_2", &["bed", "showerCurtain"][..])
        );
    }

    #[test]
    fn numbers_of_faces_and_of_vertices_are_labels() {
        let dir = tempfile::tempdir().unwrap();

        for of_vertices in [false, true] {
            let path = dir.path().join("scan.ply");
            fs::write(&path, strip(&[(2, -1), (5, 40), (5, 3), (0, 1), (2, -1), (5, 40)], of_vertices))
                .unwrap();
            let file = read_mesh(&path, UpAxis::Z).unwrap();
            let found = Annotations::of_mesh(&file, &options()).unwrap();
            let [room] = &found.rooms[..] else { panic!("{found:?}") };
            assert_eq!(room.room.to_string(), "office_7");

            let seen: Vec<(Class, u32, Vec<u32>)> = room
                .instances
                .iter()
                .map(|i| {
                    let mut cloud = PointCloud::default();
                    i.read(&mut cloud).unwrap();
                    cloud.faces.dedup();
                    (i.class, i.number, cloud.faces)
                })
                .collect();
            let chairs = [(Class::CHAIR, 1, vec![4, 5]), (Class::CHAIR, 2, vec![2, 3, 10, 11])];
            assert_eq!(seen[0], (Class::FLOOR, 1, vec![0, 1, 8, 9]));
            assert_eq!(seen[1..], chairs);
        }
    }

    #[test]
    fn files_named_after_rooms_are_rooms() {
        let dir = tempfile::tempdir().unwrap();
        let paths = ["office_1.ply", "WC_2.ply"].map(|name| dir.path().join(name));
        // The second file's room lies a metre higher.
        fs::write(&paths[0], strip(&[(2, 1), (5, 1)], false)).unwrap();
        fs::write(&paths[1], strip(&[(2, 1), (5, 1)], false).replace(" 0\n", " 1\n")).unwrap();
        let file = read_meshes(&paths, UpAxis::Z).unwrap();
        let found = Annotations::of_mesh(&file, &AnnotationOptions { room: None, ..options() }).unwrap();
        let rooms: Vec<String> = found.rooms.iter().map(|r| r.room.to_string()).collect();
        assert_eq!(rooms.len(), 2);
        assert!(rooms.contains(&"office_1".to_owned()) && rooms.contains(&"WC_2".to_owned()));
    }

    #[test]
    fn what_has_no_meaning_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scan.ply");
        let message = |text: &str, options: &AnnotationOptions| {
            fs::write(&path, text).unwrap();
            Annotations::of_mesh(&read_mesh(&path, UpAxis::Z).unwrap(), options)
                .unwrap_err()
                .to_string()
        };

        let good = strip(&[(2, 1), (9, 1)], false);
        assert!(message(&good, &options()).contains('9'));
        let no_room = AnnotationOptions { room: None, ..options() };
        assert!(message(&strip(&[(2, 1)], false), &no_room).contains("room"));
        let plain = strip(&[(2, 1)], false)
            .replace("int label", "int foo")
            .replace("int instance", "int bar");
        let without = message(&plain, &options());
        assert!(without.contains("came without labels") && without.ends_with("chair_3_office_5_1"));
        let mut features = read_mesh(&path, UpAxis::Z).unwrap();
        features
            .warnings
            .push("features of faces are no labels: they have no property table".into());
        let told = Annotations::of_mesh(&features, &options()).unwrap_err().to_string();
        assert!(told.ends_with("; features of faces are no labels: they have no property table"), "{told}");
        let objects = strip(&[(2, 1)], false).replace("int label", "int foo");
        assert!(message(&objects, &options()).contains("none of classes"));
        assert!(message(&strip(&[(0, 1)], false), &options()).contains("unlabelled"));
    }
}
