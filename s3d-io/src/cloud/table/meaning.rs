//! What the classes and rooms of a table of points mean, and which instances it holds.

use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::on_fault::OnFault;
use crate::cloud::table::cloud::Cloud;
use crate::cloud::table::rows::{CloudTags, NO_INSTANCE, NO_TAG, Tag};
use crate::error::{Error, Result};
#[cfg(any(feature = "npy", feature = "kitti"))]
use s3d_label::Taxonomy;
use s3d_label::{Class, Room};
use std::collections::BTreeMap;
use std::path::Path;

/// The most tags that a message lists.
const LISTED: usize = 20;

/// Points with the same room, class and instance number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// Index of the room's tag, or [`NO_TAG`].
    pub(crate) room: u32,
    /// Index of the class's tag.
    pub(crate) class: u32,
    /// The instance number in the file, or [`NO_INSTANCE`].
    pub(crate) instance: i64,
    /// The first file that has points of it.
    pub(crate) file: usize,
    pub(crate) points: u64,
}

/// An instance of the area.
#[derive(Clone, Debug)]
pub(crate) struct TableInstance {
    pub(crate) room: Room,
    pub(crate) class: Class,
    /// Its number among the room's instances of the same class, from 1.
    pub(crate) number: u32,
    pub(crate) points: u64,
    /// The first file that has points of it.
    pub(crate) file: usize,
    /// Its name in the file.
    pub(crate) part: String,
}

/// The instances of a cloud, and the instance of each group.
#[derive(Debug)]
pub(crate) struct Meaning {
    /// By room, class and number, which is the order of their points.
    pub(crate) instances: Vec<TableInstance>,
    /// For each group, an index into the instances. `None`: its points are left out.
    pub(crate) instance_of: Vec<Option<usize>>,
}

/// The key of an instance: points with equal keys are one instance, and instances are numbered in the order
/// of their keys. The tag is `None` for points without an instance number; these are one instance a class and
/// room, whatever the file calls the class.
type Key = (Room, Class, i64, Option<Tag>);

impl Meaning {
    /// Finds the meaning of the tags. Tags without a meaning are an error that lists them, or are left out
    /// with a warning.
    ///
    /// # Panics
    /// If a group has a class or a cloud that is not given.
    #[expect(clippy::indexing_slicing, clippy::expect_used, reason = "whoever makes groups numbers both")]
    pub(crate) fn new(
        clouds: &[&dyn Cloud],
        options: &AnnotationOptions,
        groups: &[Group],
        tags: &CloudTags,
        warnings: &mut Vec<String>,
    ) -> Result<Self> {
        let mut unknown_classes = Unknown::default();
        let mut unknown_rooms = Unknown::default();
        let mut keys: Vec<Option<Key>> = Vec::new();
        let mut any_known = false;

        for group in groups {
            let room = room_of(options, tags.rooms.get(group.room));
            let tag = tags.classes.get(group.class).expect("groups have classes");
            let class = match class_of(clouds[group.file], options, tag) {
                Some(known) => {
                    any_known |= known.is_some();
                    known
                }
                None => {
                    unknown_classes.add(tag.key(), group);
                    if options.unknown_as_clutter {
                        options.taxonomy.clutter()
                    } else {
                        None
                    }
                }
            };

            // Unlabelled points need no room.
            if room.is_none() && class.is_some() {
                let key = if group.room == NO_TAG {
                    None
                } else {
                    tags.rooms.get(group.room).map(Tag::key)
                };
                unknown_rooms.add(key.unwrap_or_default(), group);
            }

            let tag = (group.instance != NO_INSTANCE).then(|| tag.clone());
            keys.push(room.zip(class).map(|(room, class)| (room, class, group.instance, tag)));
        }

        unknown_classes.tell_classes(clouds, options, any_known, warnings)?;
        let any_left = keys.iter().any(Option::is_some);
        unknown_rooms.tell_rooms(clouds, options, any_left, warnings)?;
        Self::number(clouds, groups, &keys)
    }

    fn number(clouds: &[&dyn Cloud], groups: &[Group], keys: &[Option<Key>]) -> Result<Self> {
        let mut found: BTreeMap<&Key, (u64, usize)> = BTreeMap::new();
        for (group, key) in groups.iter().zip(keys) {
            if let Some(key) = key {
                let (points, file) = found.entry(key).or_insert((0, group.file));
                *points += group.points;
                *file = (*file).min(group.file);
            }
        }
        if found.is_empty() {
            let path = first_path(clouds);
            return Err(Error::format(path, "has no annotated point: every class in it is unlabelled"));
        }

        let mut instances: Vec<TableInstance> = Vec::new();
        let mut index: BTreeMap<&Key, usize> = BTreeMap::new();
        for (key, (points, file)) in found {
            let (room, class, in_file, tag) = key;
            let before = instances.last().filter(|i| i.room == *room && i.class == *class);
            let number = before.map_or(0, |instance| instance.number) + 1;
            index.insert(key, instances.len());
            let part = match tag {
                None => format!("the {class} of {room}"),
                Some(tag) => format!("instance {in_file} of class {} in {room}", tag.key()),
            };
            instances.push(TableInstance { room: *room, class: *class, number, points, file, part });
        }

        let instance_of = keys.iter().map(|key| index.get(key.as_ref()?).copied()).collect();
        Ok(Self { instances, instance_of })
    }
}

/// The path of the first cloud, for messages.
pub(crate) fn first_path<'c>(clouds: &[&'c dyn Cloud]) -> &'c Path {
    clouds.first().map_or(Path::new(""), |cloud| cloud.path())
}

/// The class that a tag means. Returns `Some(None)` for unlabelled points, and `None` if the meaning is
/// unknown.
fn class_of(cloud: &dyn Cloud, options: &AnnotationOptions, tag: &Tag) -> Option<Option<Class>> {
    if let Some(class) = options.classes.get(&tag.key()) {
        return Some(*class);
    }
    if let Some(meant) = cloud.own_meaning(tag) {
        return Some(meant);
    }
    let meant = match tag {
        Tag::Name(name) => options.taxonomy.meaning(name),
        Tag::Number(number) => options.taxonomy.meaning_of_number(*number),
    };
    // The classes that formats themselves define are given as classes of S3DIS.
    meant.or_else(|| {
        if options.taxonomy.is_s3dis() {
            cloud.class_of(tag).map(Some)
        } else {
            None
        }
    })
}

/// The class of S3DIS with this number, as in the files of its loaders: 0 ceiling to 12 clutter.
#[cfg(any(feature = "npy", feature = "kitti"))]
pub(crate) fn s3dis_number(tag: &Tag) -> Option<Class> {
    match tag {
        Tag::Number(n) => usize::try_from(*n).ok().and_then(|n| Class::S3DIS.get(n)).copied(),
        Tag::Name(_) => None,
    }
}

/// What class numbers are taken for where nothing says what they mean, for messages.
#[cfg(any(feature = "npy", feature = "kitti"))]
pub(crate) fn plain_numbers(taxonomy: &Taxonomy) -> String {
    if taxonomy.is_s3dis() {
        "S3DIS's, 0 ceiling to 12 clutter".to_owned()
    } else {
        format!("the ids of {}", taxonomy.name())
    }
}

/// The room that a tag means.
fn room_of(options: &AnnotationOptions, tag: Option<&Tag>) -> Option<Room> {
    match tag? {
        Tag::Name(name) => options.taxonomy.room_of_word(name).ok(),
        Tag::Number(number) => {
            let number = u32::try_from(*number).ok().filter(|n| *n > 0)?;
            options.room.map(|room| Room { number, ..room })
        }
    }
}

/// Tags without a meaning: for each the number of its points, and its first file.
#[derive(Default)]
struct Unknown(BTreeMap<String, (u64, usize)>);

impl Unknown {
    fn add(&mut self, key: String, group: &Group) {
        let (points, file) = self.0.entry(key).or_insert((0, group.file));
        *points += group.points;
        *file = (*file).min(group.file);
    }

    /// The first file, the list for a message, and the number of points. Returns `None` if there are no tags.
    fn list<'c>(&self, clouds: &[&'c dyn Cloud]) -> Option<(&'c Path, String, u64)> {
        let file = self.0.values().map(|(_, file)| *file).min()?;
        let path = clouds.get(file)?.path();
        let mut rows: Vec<_> = self.0.iter().collect();
        // Numbers in their order, then names.
        rows.sort_by_key(|(key, _)| (key.parse::<i64>().unwrap_or(i64::MAX), (*key).clone()));

        let mut items: Vec<String> = rows
            .iter()
            .take(LISTED)
            .map(|(key, (n, _))| format!("{key:?} ({n} points)"))
            .collect();
        if rows.len() > LISTED {
            items.push(format!("and {} more", rows.len() - LISTED));
        }
        Some((path, items.join(", "), rows.iter().map(|(_, (n, _))| n).sum()))
    }

    /// Warns of points with unknown classes, or refuses them. `any_known`: some class has a meaning.
    fn tell_classes(
        &self,
        clouds: &[&dyn Cloud],
        options: &AnnotationOptions,
        any_known: bool,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
        let Some((path, list, points)) = self.list(clouds) else { return Ok(()) };
        if options.unknown_as_clutter
            && let Some(clutter) = options.taxonomy.clutter()
        {
            warnings.push(format!("{}: classes taken for {clutter}: {list}", path.display()));
            return Ok(());
        }
        if options.on_fault == OnFault::Skip && any_known {
            let message = format!("{points} points of unknown classes left out: {list}");
            warnings.push(format!("{}: {message}", path.display()));
            return Ok(());
        }
        Err(Error::format(path, self.class_message(options, any_known, &list)))
    }

    fn class_message(&self, options: &AnnotationOptions, any_known: bool, list: &str) -> String {
        let taxonomy = &options.taxonomy;
        let all = if taxonomy.is_s3dis() {
            "the 13".to_owned()
        } else {
            format!("the {} of {}", taxonomy.classes().len(), taxonomy.name())
        };
        let first = self.0.keys().next().map_or("", String::as_str);
        let example = taxonomy
            .classes()
            .get(Class::CHAIR.index())
            .or(taxonomy.classes().first())
            .map_or("chair", |class| class.name());

        // If no class is known, leaving out the unknown ones would leave nothing.
        let column = if any_known {
            ""
        } else {
            ". No point has another: if the classes are in another column, name it, as in class = \"label\""
        };
        format!(
            "classes that are not among {all}: {list}. Say what they are in [annotations.classes], as in \
             {first:?} = {example:?}, or \"\" for points without a label; or take all of them for clutter \
             with unknown_as_clutter = true{column}"
        )
    }

    /// Warns of points without a known room, or refuses them. `any_left`: some points have a known room.
    fn tell_rooms(
        &self,
        clouds: &[&dyn Cloud],
        options: &AnnotationOptions,
        any_left: bool,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
        let Some((path, list, points)) = self.list(clouds) else { return Ok(()) };
        let message = match (self.0.get(""), options.room) {
            (Some((nowhere, _)), _) => format!(
                "{nowhere} points are in no room: name it, as in room = \"office_1\", or name the file after \
                 it, or say which column holds it (`rooms`)"
            ),
            (None, Some(_)) => {
                format!("unknown rooms: {list}. A room is named as in office_1, or numbered from 1")
            }
            (None, None) => format!(
                "unknown rooms: {list}. A room is named as in office_1; if they are numbers, say what type \
                 of room they are, as in room = \"office_1\""
            ),
        };

        if options.on_fault == OnFault::Skip && any_left && !self.0.contains_key("") {
            warnings.push(format!("{}: {points} points left out; {message}", path.display()));
            return Ok(());
        }
        Err(Error::format(path, message))
    }
}
