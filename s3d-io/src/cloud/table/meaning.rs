//! What the classes and rooms of a flat cloud mean, and which instances it holds.

use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::s3dis::tree::OnFault;
use crate::cloud::table::cloud::Cloud;
use crate::cloud::table::rows::{NO_INSTANCE, NO_TAG, Tag, Tags};
use crate::error::{Error, Result};
use s3d_label::{Class, Room};
use std::collections::BTreeMap;
use std::path::Path;

/// The most tags that a message lists.
const LISTED: usize = 20;

/// Points that say the same of themselves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// Index of a tag, or [`NO_TAG`].
    pub(crate) room: u32,
    /// Index of a tag.
    pub(crate) class: u32,
    /// Number in the file, or [`NO_INSTANCE`].
    pub(crate) instance: i64,
    /// The first file that tells of it.
    pub(crate) file: usize,
    pub(crate) points: u64,
}

/// An instance of the area.
#[derive(Clone, Debug)]
pub(crate) struct FlatInstance {
    pub(crate) room: Room,
    pub(crate) class: Class,
    /// Among the room's instances of its class, from 1.
    pub(crate) number: u32,
    pub(crate) points: u64,
    /// The first file that tells of it.
    pub(crate) file: usize,
    /// What the file calls it.
    pub(crate) part: String,
}

/// Which instance each group belongs to.
#[derive(Debug)]
pub(crate) struct Meaning {
    /// By room, class and number: the order of their points.
    pub(crate) instances: Vec<FlatInstance>,
    /// An index into them for each group; `None`: its points are left out.
    pub(crate) instance_of: Vec<Option<usize>>,
}

/// What makes an instance: equal keys are one, and their order is that of the numbers. The tag is `None` for
/// points without an instance number, which are one instance a class and room, whatever their class is
/// called.
type Key = (Room, Class, i64, Option<Tag>);

impl Meaning {
    /// Finds what tags mean. What has no meaning stops with a list of it, or is left out with a warning.
    ///
    /// # Panics
    /// If a group is of none of the classes or of none of the clouds.
    #[expect(clippy::indexing_slicing, clippy::expect_used, reason = "whoever makes groups numbers both")]
    pub(crate) fn new(
        clouds: &[&dyn Cloud],
        options: &AnnotationOptions,
        groups: &[Group],
        classes: &Tags,
        rooms: &Tags,
        warnings: &mut Vec<String>,
    ) -> Result<Self> {
        let mut unknown_classes = Unknown::default();
        let mut unknown_rooms = Unknown::default();
        let mut keys: Vec<Option<Key>> = Vec::new();
        let mut any_known = false;
        for group in groups {
            let room = room_of(options, rooms.get(group.room));
            let tag = classes.get(group.class).expect("groups have classes");
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
                    rooms.get(group.room).map(Tag::key)
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
            let path = clouds.first().map_or(Path::new(""), |cloud| cloud.path());
            return Err(Error::format(path, "has no annotated point: every class in it is unlabelled"));
        }
        let mut instances: Vec<FlatInstance> = Vec::new();
        let mut index: BTreeMap<&Key, usize> = BTreeMap::new();
        for (key, (points, file)) in found {
            let (room, class, in_file, tag) = key;
            let before = instances.last().filter(|i| i.room == *room && i.class == *class);
            let number = before.map_or(0, |i| i.number) + 1;
            index.insert(key, instances.len());
            let part = match tag {
                None => format!("the {class} of {room}"),
                Some(tag) => format!("instance {in_file} of class {} in {room}", tag.key()),
            };
            instances.push(FlatInstance { room: *room, class: *class, number, points, file, part });
        }
        let instance_of = keys.iter().map(|key| index.get(key.as_ref()?).copied()).collect();
        Ok(Self { instances, instance_of })
    }
}

/// The class that a tag means: `Some(None)` for unlabelled, `None` if that is not known.
fn class_of(cloud: &dyn Cloud, options: &AnnotationOptions, tag: &Tag) -> Option<Option<Class>> {
    if let Some(class) = options.classes.get(&tag.key()) {
        return Some(*class);
    }
    let meant = match tag {
        Tag::Name(name) => options.taxonomy.meaning(name),
        Tag::Number(number) => options.taxonomy.meaning_of_number(*number),
    };
    // What formats know of themselves is told in classes of S3DIS.
    meant.or_else(|| {
        if options.taxonomy.is_s3dis() {
            cloud.class_of(tag).map(Some)
        } else {
            None
        }
    })
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

/// Tags without a meaning, their points and the first file of each.
#[derive(Default)]
struct Unknown(BTreeMap<String, (u64, usize)>);

impl Unknown {
    fn add(&mut self, key: String, group: &Group) {
        let (points, file) = self.0.entry(key).or_insert((0, group.file));
        *points += group.points;
        *file = (*file).min(group.file);
    }

    /// The first file, the list for a message, and the number of points.
    fn list<'c>(&self, clouds: &[&'c dyn Cloud]) -> Option<(&'c Path, String, u64)> {
        let file = self.0.values().map(|(_, file)| *file).min()?;
        let path = clouds.get(file)?.path();
        let mut rows: Vec<_> = self.0.iter().collect();
        // Numbers in their order, before names.
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

    fn tell_classes(
        &self,
        clouds: &[&dyn Cloud],
        options: &AnnotationOptions,
        any_known: bool,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
        let Some((path, list, points)) = self.list(clouds) else { return Ok(()) };
        if let (true, Some(clutter)) = (options.unknown_as_clutter, options.taxonomy.clutter()) {
            warnings.push(format!("{}: classes taken for {clutter}: {list}", path.display()));
        } else if options.on_fault == OnFault::Skip && any_known {
            let message = format!("{points} points left out, whose class is none: {list}");
            warnings.push(format!("{}: {message}", path.display()));
        } else {
            let first = self.0.keys().next().map_or("", String::as_str);
            // Without them nothing would be left, so that there is nothing to be lenient about.
            let column = if any_known {
                ""
            } else {
                ". No point has another: if the classes are in another column, name it, as in class = \
                 \"label\""
            };
            let taxonomy = &options.taxonomy;
            let of = if taxonomy.is_s3dis() {
                "the 13".to_owned()
            } else {
                format!("the {} of {}", taxonomy.classes().len(), taxonomy.name())
            };
            let example = taxonomy
                .classes()
                .get(Class::CHAIR.index())
                .or(taxonomy.classes().first());
            let example = example.map_or("chair", |class| class.name());
            return Err(Error::format(
                path,
                format!(
                    "classes that are none of {of}: {list}. Say what they are in [annotations.classes], as \
                     in {first:?} = {example:?}, or \"\" for points without a label; or take all of them for \
                     clutter with unknown_as_clutter = true{column}"
                ),
            ));
        }
        Ok(())
    }

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
                format!("rooms that are none: {list}. A room is named as in office_1, or numbered from 1")
            }
            (None, None) => format!(
                "rooms that are none: {list}. A room is named as in office_1; if they are numbers, say what \
                 type of room they are, as in room = \"office_1\""
            ),
        };
        if options.on_fault == OnFault::Skip && any_left && !self.0.contains_key("") {
            warnings.push(format!("{}: {points} points left out; {message}", path.display()));
            return Ok(());
        }
        Err(Error::format(path, message))
    }
}
