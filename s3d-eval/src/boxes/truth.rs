//! The true boxes, from the instances of the data set.

use super::Bbox;
use crate::error::{ClassFault, ClassOption, Error, Result};
use crate::task::Task;
use s3d_dataset::s3d_io::Error as FileError;
use s3d_dataset::s3d_label::{Class, Taxonomy};
use std::collections::BTreeMap;

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

    /// Lists the names of the classes to detect.
    pub(super) fn names(&self) -> String {
        self.list
            .iter()
            .map(|class| class.name())
            .collect::<Vec<_>>()
            .join(", ")
    }
}

fn refused(fault: ClassFault) -> Error {
    Error::Classes { option: ClassOption::Classes, fault }
}

/// A room that is tested.
pub(super) struct Room {
    pub(super) fold: usize,
    pub(super) area: u32,
    /// Its name, such as `office_3`.
    pub(super) name: String,
    /// Its boxes of the classes to detect, in the world frame, in metres.
    pub(super) boxes: Vec<(Class, Bbox)>,
    /// The least coordinates of all its instances.
    pub(super) corner: [f64; 3],
}

/// Returns the rooms of all folds, ordered by fold, area, type and number.
pub(super) fn rooms(task: &Task<'_>, classes: &Classes) -> Result<Vec<Room>> {
    let mut rooms = Vec::new();
    for (fold, area) in task
        .folds
        .iter()
        .enumerate()
        .flat_map(|(i, f)| f.areas.iter().map(move |a| (i, *a)))
    {
        let path = task.data.layout().instances_json(area);
        let mut of_area = BTreeMap::new();
        for instance in task.data.instances(area)? {
            let wrong = |message: String| FileError::format(&path, format!("{}: {message}", instance.label));
            let key = classes
                .taxonomy
                .room(&instance.room)
                .map_err(|e| wrong(e.to_string()))?;
            let class = classes.named(&instance.class).map_err(wrong)?;

            let bbox = instance.bbox.map(f64::from);
            let room = of_area.entry(key).or_insert_with(|| Room {
                fold,
                area,
                name: instance.room.clone(),
                boxes: Vec::new(),
                corner: [f64::INFINITY; 3],
            });
            room.corner
                .iter_mut()
                .zip(bbox)
                .for_each(|(least, v)| *least = least.min(v));
            if classes.list.contains(&class) {
                room.boxes.push((class, bbox));
            }
        }
        rooms.extend(of_area.into_values());
    }
    if rooms.is_empty() {
        return Err(task.no_rooms());
    }
    Ok(rooms)
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
