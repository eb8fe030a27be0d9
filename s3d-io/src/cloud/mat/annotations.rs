//! Annotations from `pointcloud.mat`.

use crate::cloud::annotations::{
    AnnotatedInstance, AnnotatedRoom, AnnotationOptions, Annotations, InstancePoints, PointBlocks, Skipped,
};
use crate::cloud::mat::read::{MatArea, MatObject, MatRoom};
use crate::cloud::on_fault::OnFault;
use crate::cloud::s3dis::tree::{ClassOfWord, class_of_word};
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use crate::fs::source::Source;
use s3d_geom::PointCloud;
use s3d_geom::glam::DVec3;
use s3d_label::{Class, Room};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;
use std::sync::Arc;

/// The meaning of an object's name.
enum Named {
    Instance(Class, u32),
    /// The word is no class of its own, but counts as this one.
    Other(Class),
    /// The points are left out.
    Unlabelled,
}

impl Annotations {
    /// Takes the objects of a `pointcloud.mat`. Objects without points are left out, with a warning.
    pub(crate) fn from_mat(source: Source, options: &AnnotationOptions) -> Result<Self> {
        let path = source.name();
        let columns = [&options.class_column, &options.instance_column, &options.room_column];
        if columns.iter().any(|c| c.is_some()) || options.room.is_some() || !options.columns.is_empty() {
            return Err(Error::format(
                path,
                "names rooms, classes and instances itself: columns and a room are for clouds",
            ));
        }

        let taxonomy = options.taxonomy.clone();
        let mut all = Self { taxonomy, rooms: Vec::new(), warnings: Vec::new(), companions: Vec::new() };

        for room in MatArea::read(&source)?.rooms {
            if let Some(room) = all.mat_room(path, room, options)? {
                match all.rooms.binary_search_by_key(&room.room, |r| r.room) {
                    Ok(_) => all.fault(path, options, format!("{} is there twice", room.room))?,
                    Err(i) => all.rooms.insert(i, room),
                }
            }
        }

        if all.rooms.is_empty() {
            return Err(Error::format(path, "holds no room with an object that has points"));
        }
        Ok(all)
    }

    /// The room and its objects. Returns `None` if it is left out.
    fn mat_room(
        &mut self,
        path: &Path,
        found: MatRoom,
        options: &AnnotationOptions,
    ) -> Result<Option<AnnotatedRoom>> {
        let room: Room = match options.taxonomy.room_of_word(&found.name) {
            Ok(room) => room,
            Err(e) => {
                self.fault(path, options, format!("{e}"))?;
                return Ok(None);
            }
        };

        let mut objects: BTreeMap<(Class, u32), MatObject> = BTreeMap::new();
        let mut others: Vec<(Class, MatObject)> = Vec::new();
        for object in found.objects {
            if object.len == 0 {
                self.warnings
                    .push(format!("{}: {}: has no points, left out", path.display(), object.part()));
                continue;
            }
            match named(&object.name, options) {
                Ok(Named::Instance(class, number)) => {
                    let Entry::Vacant(place) = objects.entry((class, number)) else {
                        self.fault(path, options, format!("{}: is there twice", object.part()))?;
                        continue;
                    };
                    place.insert(object);
                }
                Ok(Named::Other(class)) => others.push((class, object)),
                Ok(Named::Unlabelled) => {}
                Err(message) => self.fault(path, options, format!("{}: {message}", object.part()))?,
            }
        }

        // Objects of other words get the numbers after the last of their class.
        for (class, object) in others {
            let last = objects.range((class, 0)..=(class, u32::MAX)).next_back();
            let number = last.map_or(0, |((_, n), _)| *n) + 1;
            let part = object.part();
            self.warnings
                .push(format!("{}: {part} is taken for {class}_{number}", path.display()));
            objects.insert((class, number), object);
        }

        let offset_m = options.offset_m;
        let on_fault = options.on_fault;
        let instances: Vec<AnnotatedInstance> = objects
            .into_iter()
            .map(|((class, number), object)| {
                AnnotatedInstance::new(class, number, Arc::new(MatPoints { object, offset_m, on_fault }))
            })
            .collect();
        if instances.is_empty() {
            self.warnings
                .push(format!("{}: {room}: has no object with points, left out", path.display()));
            return Ok(None);
        }
        Ok(Some(AnnotatedRoom { room, instances }))
    }

    fn fault(&mut self, path: &Path, options: &AnnotationOptions, message: String) -> Result<()> {
        let error = Error::format(path, message);
        if options.on_fault == OnFault::Stop {
            return Err(error);
        }
        self.warnings.push(format!("{error}; left out"));
        Ok(())
    }
}

/// The class and number that a name such as "chair_3" stands for.
fn named(name: &str, options: &AnnotationOptions) -> std::result::Result<Named, String> {
    let digits = name
        .rsplit_once('_')
        .filter(|(_, n)| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let number = digits
        .and_then(|(_, n)| n.parse().ok())
        .filter(|&n: &u32| n > 0 && n < u32::MAX);
    let (Some((word, _)), Some(number)) = (digits, number) else {
        let name = quote(name.as_bytes());
        return Err(format!("{name} names no instance: a name is CLASS_N, with N from 1, as in chair_3"));
    };

    Ok(match class_of_word(&options.taxonomy, &options.classes, options.unknown_as_clutter, word) {
        Ok(Some(ClassOfWord::Own(class))) => Named::Instance(class, number),
        Ok(Some(ClassOfWord::Other(class))) => Named::Other(class),
        Ok(None) => Named::Unlabelled,
        Err(e) => return Err(format!("{e}")),
    })
}

/// The points of an object.
#[derive(Debug)]
struct MatPoints {
    object: MatObject,
    offset_m: DVec3,
    on_fault: OnFault,
}

impl InstancePoints for MatPoints {
    fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        self.object.read_with(self.offset_m, self.on_fault, out)
    }

    fn path(&self) -> &Path {
        self.object.path()
    }

    fn part(&self) -> String {
        self.object.part().to_owned()
    }

    fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        Ok(Box::new(MatBlocks { points: self, skipped: Skipped::default() }))
    }
}

/// The points of an object in one block: the file holds them by column.
struct MatBlocks<'a> {
    points: &'a MatPoints,
    skipped: Skipped,
}

impl PointBlocks for MatBlocks<'_> {
    fn read_block(&mut self, _points: usize, out: &mut PointCloud) -> Result<bool> {
        self.skipped = self.points.read(out)?;
        Ok(false)
    }

    fn skipped(&mut self) -> Skipped {
        std::mem::take(&mut self.skipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/fixtures/pointcloud_mat")
            .join(name)
    }

    fn names(annotations: &Annotations) -> Vec<String> {
        annotations
            .rooms
            .iter()
            .flat_map(|r: &AnnotatedRoom| -> Vec<String> {
                r.instances
                    .iter()
                    .map(|i| format!("{} {}_{}", r.room, i.class, i.number))
                    .collect()
            })
            .collect()
    }

    #[test]
    fn objects_are_instances() {
        let path = fixture("area.mat");
        let found = Annotations::open(std::slice::from_ref(&path), &AnnotationOptions::default()).unwrap();
        assert_eq!(names(&found), ["hallway_2 door_1", "office_1 wall_1", "office_1 chair_3"]);
        let chair = &found.rooms[1].instances[1];
        assert_eq!(chair.source(), format!("{}, office_1, chair_3", path.display()));
        let mut cloud = PointCloud::default();
        let offset_m = DVec3::new(100.0, 0.0, 0.0);
        chair.read(&mut cloud).unwrap();
        chair.read(&mut cloud).unwrap();
        assert_eq!((cloud.len(), cloud.colors[6]), (10, [1, 2, 254]));
        let moved = AnnotationOptions { offset_m, ..Default::default() };
        let found = Annotations::open(&[path], &moved).unwrap();
        let before = cloud;
        let mut cloud = PointCloud::default();
        found.rooms[1].instances[1].read(&mut cloud).unwrap();
        assert_eq!(cloud.positions[4].x, before.positions[4].x - 100.0);
    }

    #[test]
    fn odd_names_stop_or_are_left_out() {
        let path = [fixture("cells.mat")];
        let message = Annotations::open(&path, &AnnotationOptions::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains("hallway_2, stairs_1: \"stairs\" is no class"), "{message}");
        let skip = AnnotationOptions { on_fault: OnFault::Skip, ..Default::default() };
        let found = Annotations::open(&path, &skip).unwrap();
        assert_eq!(names(&found), ["hallway_2 door_1", "office_1 wall_1", "office_1 chair_3"]);
        assert!(found.warnings[0].ends_with("left out") && found.warnings[0].contains("stairs"));
        assert!(found.warnings[1].contains("hallway_2, window_1: has no points"), "{:?}", found.warnings);
        let clutter = AnnotationOptions { unknown_as_clutter: true, ..Default::default() };
        let found = Annotations::open(&path, &clutter).unwrap();
        assert_eq!(names(&found)[..2], ["hallway_2 door_1", "hallway_2 clutter_1"]);
        let classes = BTreeMap::from([("stairs".to_owned(), Some(Class::FLOOR)), ("wall".to_owned(), None)]);
        let found = Annotations::open(&path, &AnnotationOptions { classes, ..Default::default() }).unwrap();
        assert_eq!(names(&found), ["hallway_2 floor_1", "hallway_2 door_1", "office_1 chair_3"]);
    }

    #[test]
    fn options_of_clouds_are_refused() {
        let options = AnnotationOptions { class_column: Some("label".into()), ..Default::default() };
        let message = Annotations::open(&[fixture("area.mat")], &options)
            .unwrap_err()
            .to_string();
        assert!(message.contains("are for clouds"), "{message}");
    }
}
