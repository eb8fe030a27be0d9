//! The true boxes, from the instances of the data set.

use super::Bbox;
use crate::BoxSource;
use crate::error::{ClassFault, ClassOption, Error, Result};
use crate::task::Task;
use s3d_dataset::s3d_io::Error as FileError;
use s3d_dataset::s3d_label::{Class, Room as RoomKey, Taxonomy};
use std::collections::BTreeMap;
use std::path::Path;

/// The classes to detect.
pub(super) struct Classes {
    taxonomy: Taxonomy,
    pub(super) list: Vec<Class>,
    /// Whether each class stands for the class of S3DIS that it counts as.
    as_s3dis: bool,
}

impl Classes {
    /// Returns the classes that the options name, or the 12 of the paper.
    pub(super) fn new(task: &Task<'_>) -> Result<Self> {
        let Some(taxonomy) = task.data.taxonomy().cloned() else { return Err(task.unlabelled()) };
        let Some(names) = &task.options.classes else {
            let list = Class::S3DIS
                .into_iter()
                .filter(|class| *class != Class::CLUTTER)
                .collect();
            return Ok(Self { taxonomy, list, as_s3dis: true });
        };

        let mut list = Vec::new();
        for name in names {
            let class = taxonomy.class(name).map_err(|e| refused(e.into()))?;
            if list.contains(&class) {
                return Err(refused(ClassFault::Double(class)));
            }
            list.push(class);
        }
        if list.is_empty() {
            return Err(refused(ClassFault::Empty));
        }
        Ok(Self { taxonomy, list, as_s3dis: false })
    }

    /// Returns the class of a name, whether it is to be detected or not. The error lists the classes.
    pub(super) fn named(&self, name: &str) -> Result<Class, String> {
        match self.taxonomy.class(name) {
            Ok(class) if self.as_s3dis => Ok(class.s3dis()),
            Ok(class) => Ok(class),
            Err(e) => name.parse().ok().filter(|_| self.as_s3dis).ok_or_else(|| e.to_string()),
        }
    }

    /// Returns the class and the box of an instance, if it is to be detected. Errors name the file and the
    /// label of `at`.
    fn to_detect(&self, at: (&Path, &str), class: &str, bbox: Bbox) -> Result<Option<(Class, Bbox)>> {
        let class = self.named(class).map_err(|e| wrong(at, e))?;
        Ok(self.list.contains(&class).then_some((class, bbox)))
    }

    /// Returns the room of an instance. Errors name the file and the label of `at`.
    fn room(&self, at: (&Path, &str), name: &str) -> Result<RoomKey> {
        Ok(self.taxonomy.room(name).map_err(|e| wrong(at, e.to_string()))?)
    }

    /// Lists the names of the classes to detect.
    pub(super) fn names(&self) -> String {
        self.list
            .iter()
            .map(|class| class.name())
            .collect::<Vec<_>>()
            .join(", ")
    }
}

/// Returns the error for an instance of a file.
fn wrong((path, label): (&Path, &str), message: String) -> FileError {
    FileError::format(path, format!("{label}: {message}"))
}

fn refused(fault: ClassFault) -> Error {
    Error::Classes { option: ClassOption::Classes, fault }
}

/// The classes and boxes of a room's instances. Boxes are in the world frame, in metres.
type ClassBoxes = Vec<(Class, Bbox)>;

/// A room that is tested.
pub(super) struct Room {
    pub(super) fold: usize,
    pub(super) area: u32,
    /// Its name, such as `office_3`.
    pub(super) name: String,
    /// Its true boxes of the classes to detect.
    pub(super) boxes: ClassBoxes,
    /// Its boxes of these classes by the other [source](crate::BoxSource), as far as it is there.
    pub(super) other_boxes: ClassBoxes,
    /// The least coordinates of its sampled points. `None` if it has none, or they are not known.
    pub(super) corner: Option<[f64; 3]>,
}

/// The rooms of all folds, ordered by fold, area, type and number.
pub(super) struct Rooms {
    pub(super) list: Vec<Room>,
    /// Whether the data set has the boxes of the sampled points.
    pub(super) has_point_boxes: bool,
}

/// Reads the rooms of all folds.
pub(super) fn rooms(task: &Task<'_>, classes: &Classes) -> Result<Rooms> {
    let source = task.options.boxes.unwrap_or_default();
    let mut rooms = Rooms { list: Vec::new(), has_point_boxes: true };
    for (fold, area) in task
        .folds
        .iter()
        .enumerate()
        .flat_map(|(i, f)| f.areas.iter().map(move |a| (i, *a)))
    {
        let mut of_area = BTreeMap::new();
        for instance in task.data.instances(area)? {
            let path = task.data.layout().instances_json(area);
            let at = (path.as_path(), instance.label.as_str());
            let room = of_area
                .entry(classes.room(at, &instance.room)?)
                .or_insert_with(|| Room {
                    fold,
                    area,
                    name: instance.room.clone(),
                    boxes: Vec::new(),
                    other_boxes: Vec::new(),
                    corner: None,
                });
            let boxes = room.boxes_of(BoxSource::Annotations, source);
            boxes.extend(classes.to_detect(at, &instance.class, instance.bbox.map(f64::from))?);
        }

        let point_boxes = task.data.point_boxes(area)?;
        rooms.has_point_boxes &= point_boxes.is_some();
        if source == BoxSource::Points && point_boxes.is_none() {
            return Err(Error::NoPointBoxes { root: task.data.layout().root().to_owned() });
        }

        for found in point_boxes.unwrap_or_default() {
            let path = task.data.layout().point_boxes_json(area);
            let at = (path.as_path(), found.label.as_str());
            let Some(room) = of_area.get_mut(&classes.room(at, &found.room)?) else {
                let message = format!("{}: instances.json has no room {}", found.label, found.room);
                return Err(FileError::format(&path, message).into());
            };
            let corner = room.corner.get_or_insert([f64::INFINITY; 3]);
            corner
                .iter_mut()
                .zip(found.bbox)
                .for_each(|(least, v)| *least = least.min(v));
            let boxes = room.boxes_of(BoxSource::Points, source);
            boxes.extend(classes.to_detect(at, &found.class, found.bbox)?);
        }
        rooms.list.extend(of_area.into_values());
    }

    if rooms.list.is_empty() {
        return Err(task.no_rooms());
    }
    Ok(rooms)
}

impl Room {
    /// Returns the list for boxes of `source`, if `truth` is the source of the true ones.
    fn boxes_of(&mut self, source: BoxSource, truth: BoxSource) -> &mut ClassBoxes {
        if source == truth {
            &mut self.boxes
        } else {
            &mut self.other_boxes
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_of_other_taxonomies_count_as_s3dis() {
        let taxonomy = Taxonomy::built_in("scannet20").unwrap();
        let own = taxonomy.class("bookshelf").unwrap();
        let mut classes = Classes { taxonomy, list: Class::S3DIS[..12].to_vec(), as_s3dis: true };
        assert_eq!(classes.named("bookshelf"), Ok(Class::BOOKCASE));
        assert_eq!(classes.named("beam"), Ok(Class::BEAM));
        assert!(classes.named("stool").unwrap_err().contains("bookshelf"));

        classes.list = vec![own];
        classes.as_s3dis = false;
        assert_eq!((classes.named("bookshelf"), classes.names()), (Ok(own), "bookshelf".to_owned()));
        assert!(classes.named("beam").is_err());
    }
}
