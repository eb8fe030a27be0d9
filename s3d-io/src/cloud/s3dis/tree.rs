//! Finds the files of an S3DIS tree: an area's folder of rooms, and their folders of annotated instances.
//! [`PointReader`](crate::cloud::PointReader) reads the points. Source: [`crate::formats`], "What is
//! written".

use crate::cloud::on_fault::OnFault;
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use s3d_label::{Class, Room, Taxonomy, UnknownClass};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// How [`AnnotationTree::open_with`] interprets names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TreeOptions {
    /// The classes and the types of rooms.
    pub taxonomy: Taxonomy,
    /// What to do about a folder that names no room, a room without annotations, or a file that names no
    /// instance.
    pub on_fault: OnFault,
    /// Whether an unknown class (`stairs_1.txt` in the published area) counts as clutter
    /// ([`Taxonomy::clutter`]), as in the data set's own loaders. Such instances are numbered after the
    /// room's clutter.
    pub unknown_as_clutter: bool,
    /// The class that a word in a file's name stands for, even if the word is a class itself. `None`: such
    /// files are left out without a warning. If the class is not the word's own, the instances are numbered
    /// after the room's own ones of that class, as with clutter.
    pub classes: BTreeMap<String, Option<Class>>,
}

/// The annotated instances of an area, by room.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AnnotationTree {
    /// The rooms, by type and number; see [`Room`]. At least one.
    pub rooms: Vec<RoomFiles>,
    /// What was left out or reinterpreted: a sentence each, for the user.
    pub warnings: Vec<String>,
}

/// A room's folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RoomFiles {
    /// The room.
    pub room: Room,
    /// Its folder, which holds `Annotations`.
    pub path: PathBuf,
    /// Its instances, by class and number. At least one.
    pub instances: Vec<InstanceFile>,
}

/// The file of an instance's points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InstanceFile {
    /// Its class.
    pub class: Class,
    /// Its number among the room's instances of the same class, from 1.
    pub number: u32,
    /// The file: `x y z r g b` a line.
    pub path: PathBuf,
}

impl AnnotationTree {
    /// Finds the instances below `dir`, an area's folder: `dir/ROOM/Annotations/CLASS_N.txt`.
    ///
    /// Hidden files do not count. Other files that are not `.txt`, and files in the place of folders, become
    /// [`AnnotationTree::warnings`].
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a folder that names no room, a room without annotations, a file
    /// that names no instance or the same one as another file, and an area without rooms.
    pub fn open(dir: &Path) -> Result<Self> {
        Self::open_with(dir, &TreeOptions::default())
    }

    /// Opens a tree like [`AnnotationTree::open`], with a choice of what to do about odd names.
    ///
    /// # Errors
    /// The errors of [`AnnotationTree::open`]; with [`OnFault::Skip`] only [`Error::Io`] and an area without
    /// rooms.
    pub fn open_with(dir: &Path, options: &TreeOptions) -> Result<Self> {
        let mut tree = Self { rooms: Vec::new(), warnings: Vec::new() };
        for path in entries(dir)? {
            if path.is_dir() {
                match tree.open_room(&path, options) {
                    Ok(room) => tree.rooms.push(room),
                    Err(e) => tree.fault(e, options)?,
                }
            } else if !name_of(&path).ends_with("_alignmentAngle.txt") {
                tree.warnings
                    .push(format!("{}: not a room's folder, left out", path.display()));
            }
        }

        if tree.rooms.is_empty() {
            let form =
                "an area's folder holds ROOM/Annotations/CLASS_N.txt, as in office_3/Annotations/chair_1.txt";
            return Err(Error::format(dir, format!("has no annotated room; {form}")));
        }
        tree.rooms.sort_by_key(|r| r.room);
        Ok(tree)
    }

    fn fault(&mut self, error: Error, options: &TreeOptions) -> Result<()> {
        match (options.on_fault, &error) {
            (OnFault::Skip, Error::Format { .. }) => {
                self.warnings.push(format!("{error}; left out"));
                Ok(())
            }
            _ => Err(error),
        }
    }

    fn open_room(&mut self, path: &Path, options: &TreeOptions) -> Result<RoomFiles> {
        let room = options.taxonomy.room_of_word(&name_of(path));
        let room = room.map_err(|e| Error::format(path, format!("{e}")))?;
        let annotations = path.join("Annotations");
        if !annotations.is_dir() {
            return Err(Error::format(path, "is a room without a folder Annotations"));
        }

        let mut instances: BTreeMap<(Class, u32), PathBuf> = BTreeMap::new();
        let mut others: Vec<(Class, PathBuf)> = Vec::new();
        for path in entries(&annotations)? {
            let is_text = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("txt"));
            if !is_text || path.is_dir() {
                self.warnings
                    .push(format!("{}: not a file of points, left out", path.display()));
                continue;
            }
            let found = match instance_of(&path, options) {
                Ok(Named::Instance(class, number)) => (class, number),
                Ok(Named::Other(class)) => {
                    others.push((class, path));
                    continue;
                }
                Ok(Named::Unlabelled) => continue,
                Err(e) => {
                    self.fault(e, options)?;
                    continue;
                }
            };

            match instances.get(&found) {
                Some(first) => {
                    let message = format!("is a second {}_{} beside {}", found.0, found.1, name_of(first));
                    self.fault(Error::format(&path, message), options)?;
                }
                None => drop(instances.insert(found, path)),
            }
        }

        // Instances of other words get the numbers after the last of their class.
        for (class, path) in others {
            let last = instances.range((class, 0)..=(class, u32::MAX)).next_back();
            let number = last.map_or(0, |((_, n), _)| *n) + 1;
            let name = quote(name_of(&path).as_bytes());
            self.warnings
                .push(format!("{}: {name} is taken for {class}_{number}", path.display()));
            instances.insert((class, number), path);
        }

        if instances.is_empty() {
            return Err(Error::format(&annotations, "holds no CLASS_N.txt"));
        }
        let instances = instances
            .into_iter()
            .map(|((class, number), path)| InstanceFile { class, number, path })
            .collect();
        Ok(RoomFiles { room, path: path.to_owned(), instances })
    }
}

/// The meaning of a file's name.
enum Named {
    Instance(Class, u32),
    /// The word is no class of its own, but counts as this one.
    Other(Class),
    /// The points do not count.
    Unlabelled,
}

fn instance_of(path: &Path, options: &TreeOptions) -> Result<Named> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let digits = stem
        .rsplit_once('_')
        .filter(|(_, n)| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let number = digits
        .and_then(|(_, n)| n.parse().ok())
        .filter(|&n: &u32| n > 0 && n < u32::MAX);
    let (Some((word, _)), Some(number)) = (digits, number) else {
        let mut message =
            "names no instance: a name is CLASS_N.txt, with N from 1, as in chair_3.txt".to_owned();
        if let Some((original, _)) = stem.split_once([' ', '(']) {
            message += &format!(
                "; it looks like a copy of {original}.txt: delete it if it is one, or else give it a number \
                 of its own"
            );
        }
        return Err(Error::format(path, message));
    };

    match class_of_word(&options.taxonomy, &options.classes, options.unknown_as_clutter, word) {
        Ok(Some(ClassOfWord::Own(class))) => Ok(Named::Instance(class, number)),
        Ok(Some(ClassOfWord::Other(class))) => Ok(Named::Other(class)),
        Ok(None) => Ok(Named::Unlabelled),
        Err(e) => Err(Error::format(path, format!("{e}"))),
    }
}

/// The class of an instance, from the word in its name.
pub(crate) enum ClassOfWord {
    /// The word is the class's name: the instance keeps its number.
    Own(Class),
    /// The word is another one for the class: an instance with the class's name may have the same number.
    Other(Class),
}

/// The class of an instance that is named after `word`. Returns `None` if it is unlabelled.
pub(crate) fn class_of_word(
    taxonomy: &Taxonomy,
    classes: &BTreeMap<String, Option<Class>>,
    unknown_as_clutter: bool,
    word: &str,
) -> std::result::Result<Option<ClassOfWord>, UnknownClass> {
    let own = taxonomy.class(word);
    let meant = classes.get(word).copied().or_else(|| taxonomy.meaning(word));
    match (meant, &own, taxonomy.clutter()) {
        (Some(None), ..) => Ok(None),
        (Some(Some(class)), Ok(own), _) if class == *own => Ok(Some(ClassOfWord::Own(class))),
        (Some(Some(class)), ..) => Ok(Some(ClassOfWord::Other(class))),
        (None, _, Some(clutter)) if unknown_as_clutter => Ok(Some(ClassOfWord::Other(clutter))),
        (None, ..) => own.map(|class| Some(ClassOfWord::Own(class))),
    }
}

/// The entries of a folder, sorted by name, without hidden ones.
fn entries(dir: &Path) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(dir).map_err(|e| Error::io(dir, "read the folder", e))? {
        let path = entry.map_err(|e| Error::io(dir, "read the folder", e))?.path();
        if !name_of(&path).starts_with('.') {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(files: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for file in files {
            let path = dir.path().join(file);
            if file.ends_with('/') {
                fs::create_dir_all(path).unwrap();
            } else {
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                fs::write(path, "").unwrap();
            }
        }
        dir
    }

    fn names(tree: &AnnotationTree) -> Vec<String> {
        tree.rooms
            .iter()
            .flat_map(|r: &RoomFiles| -> Vec<String> {
                r.instances
                    .iter()
                    .map(|i| format!("{} {}_{}", r.room, i.class, i.number))
                    .collect()
            })
            .collect()
    }

    #[test]
    fn rooms_and_instances_are_in_order() {
        let dir = area(&[
            "office_10/Annotations/wall_2.txt",
            "office_9/office_9.txt",
            "office_9/Annotations/wall_10.txt",
            "office_9/Annotations/wall_9.TXT",
            "office_9/Annotations/ceiling_1.txt",
            "office_9/Annotations/.DS_Store",
            "office_9/Annotations/notes.md",
            "WC_1/Annotations/clutter_1.txt",
            "Area_1_alignmentAngle.txt",
            "readme.txt",
            ".hidden/x.txt",
        ]);
        let tree = AnnotationTree::open(dir.path()).unwrap();
        let expected = [
            "office_9 ceiling_1",
            "office_9 wall_9",
            "office_9 wall_10",
            "office_10 wall_2",
            "WC_1 clutter_1",
        ];
        assert_eq!(names(&tree), expected);
        assert_eq!(tree.warnings.len(), 2, "{:?}", tree.warnings);
        assert!(
            tree.rooms[0].instances[0]
                .path
                .ends_with("office_9/Annotations/ceiling_1.txt")
        );
    }

    #[test]
    fn every_odd_name_stops_with_its_path() {
        for (file, words) in [
            ("office_1/Annotations/stairs_1.txt", "\"stairs\" is no class"),
            ("office_1/Annotations/wall_3 (1).txt", "a copy of wall_3.txt: delete it"),
            ("office_1/Annotations/wall.txt", "CLASS_N.txt"),
            ("office_1/Annotations/wall_0.txt", "N from 1"),
            ("office_1/Annotations/wall_9999999999.txt", "CLASS_N.txt"),
            ("office_1/Annotations/wall_01.txt", "is a second wall_1"),
            ("kitchen_1/Annotations/wall_1.txt", "\"kitchen\" is no type of room"),
            ("office_2/", "office_2: is a room without a folder Annotations"),
            ("office_2/Annotations/", "Annotations: holds no CLASS_N.txt"),
        ] {
            let dir = area(&["office_1/Annotations/wall_1.txt", file]);
            let message = AnnotationTree::open(dir.path()).unwrap_err().to_string();
            assert!(
                message.contains(words) && message.contains(file.split('/').next().unwrap()),
                "{message}"
            );
            let skip = TreeOptions { on_fault: OnFault::Skip, ..TreeOptions::default() };
            let tree = AnnotationTree::open_with(dir.path(), &skip).unwrap();
            assert_eq!(names(&tree), ["office_1 wall_1"]);
            assert!(tree.warnings[0].contains(words) && tree.warnings[0].ends_with("left out"));
        }
        let dir = area(&["notes.md"]);
        assert!(
            AnnotationTree::open(dir.path())
                .unwrap_err()
                .to_string()
                .contains("no annotated room")
        );
        assert!(matches!(AnnotationTree::open(&dir.path().join("gone")), Err(Error::Io { .. })));
    }

    #[test]
    fn unknown_classes_can_be_clutter() {
        let dir = area(&[
            "office_1/Annotations/clutter_4.txt",
            "office_1/Annotations/stairs_1.txt",
            "office_1/Annotations/stairs_2.txt",
        ]);
        let options = TreeOptions { unknown_as_clutter: true, ..TreeOptions::default() };
        let tree = AnnotationTree::open_with(dir.path(), &options).unwrap();
        assert_eq!(names(&tree), ["office_1 clutter_4", "office_1 clutter_5", "office_1 clutter_6"]);
        assert!(tree.warnings[0].contains("`stairs_1.txt` is taken for clutter_5"));
    }
}
