//! Makes a taxonomy from a definition: checks it, and fills in omitted values.

use crate::color::pretty_color;
use crate::taxonomy::definition::{ClassDefinition, Kind, RoomTypeDefinition, TaxonomyDefinition};
use crate::taxonomy::{Details, MAX_CLASSES, Parts, Taxonomy, TaxonomyError};
use crate::{Class, RoomType};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::{Arc, Mutex, PoisonError};

/// The largest number of characters of a name. File names contain the name of a class or a room, and more.
const MAX_NAME: usize = 40;

const CLASS: &str = "class";
const ROOM_TYPE: &str = "type of room";

/// Stands for a room type that counts as no type of S3DIS.
const NOTHING: u8 = u8::MAX;

impl Taxonomy {
    /// Checks a definition and fills in omitted values.
    ///
    /// Names stay in memory until the process ends: each word once, however many taxonomies use it.
    ///
    /// # Errors
    /// [`TaxonomyError`] names the entry that is wrong, and says how to repair it.
    pub fn new(definition: TaxonomyDefinition) -> Result<Self, TaxonomyError> {
        if definition.name == Self::S3DIS {
            return Err(TaxonomyError::Reserved);
        }
        Self::any(definition)
    }

    /// Makes a taxonomy like [`Taxonomy::new`], with any name.
    pub(super) fn any(mut definition: TaxonomyDefinition) -> Result<Self, TaxonomyError> {
        check_name(CLASS, 0, &definition.name)?;
        if definition.classes.is_empty() {
            return Err(TaxonomyError::Empty);
        }
        if definition.rooms.is_empty() {
            definition.rooms = RoomType::S3DIS
                .map(|t| RoomTypeDefinition { name: t.name().to_owned(), ..Default::default() })
                .into();
        }
        let classes = resolve_classes(&mut definition.classes)?;
        let room_types = resolve_room_types(&mut definition.rooms)?;

        let words = class_words(&classes, &definition)?;
        let clutter = match &definition.clutter {
            Some(word) => Some(class_named(&classes, word, || "clutter".to_owned())?),
            None => classes
                .iter()
                .copied()
                .find(|class| class.name() == Class::CLUTTER.name()),
        };
        definition.clutter = clutter.map(|class| class.name().to_owned());
        let room_words = room_words(&room_types, &definition.rooms)?;

        let details = definition.classes.iter().map(details).collect();
        Ok(Self(Arc::new(Parts { definition, classes, details, room_types, words, room_words, clutter })))
    }
}

/// Returns the class of each name and alias. `None` stands for a word that means "no class".
fn class_words(
    classes: &[Class],
    definition: &TaxonomyDefinition,
) -> Result<HashMap<String, Option<Class>>, TaxonomyError> {
    let mut words: HashMap<String, Option<Class>> = HashMap::new();
    for (class, entry) in classes.iter().zip(&definition.classes) {
        for word in std::iter::once(&entry.name).chain(&entry.aliases) {
            add_word(&mut words, word, Some(*class))?;
        }
    }
    for (word, meant) in &definition.aliases {
        let meant = match meant.as_str() {
            "" => None,
            name => Some(class_named(classes, name, || format!("the alias {word:?}"))?),
        };
        add_word(&mut words, word, meant)?;
    }

    // The number of a class must not be an alias of another class.
    for (class, entry) in classes.iter().zip(&definition.classes) {
        let id = entry.id.unwrap_or_default().to_string();
        if let Some(other) = words.get(&id).filter(|other| **other != Some(*class)) {
            let first = format!("{class} (its id)");
            return Err(TaxonomyError::Word { what: CLASS, word: id, first, second: name_or_none(*other) });
        }
    }
    Ok(words)
}

fn add_word(
    words: &mut HashMap<String, Option<Class>>,
    word: &str,
    class: Option<Class>,
) -> Result<(), TaxonomyError> {
    match words.insert(word.to_owned(), class) {
        Some(other) if other != class => Err(TaxonomyError::Word {
            what: CLASS,
            word: word.to_owned(),
            first: name_or_none(other),
            second: name_or_none(class),
        }),
        _ => Ok(()),
    }
}

fn name_or_none(class: Option<Class>) -> String {
    class.map_or("none", Class::name).to_owned()
}

/// Finds the class `word`. `place` names the entry with the word, for the error.
fn class_named(
    classes: &[Class],
    word: &str,
    place: impl FnOnce() -> String,
) -> Result<Class, TaxonomyError> {
    let found = classes.iter().copied().find(|class| class.name() == word);
    found.ok_or_else(|| TaxonomyError::Unknown {
        what: CLASS,
        place: place(),
        word: word.to_owned(),
        names: crate::class::names(classes),
    })
}

/// Returns the room type of each name and alias.
fn room_words(
    room_types: &[RoomType],
    entries: &[RoomTypeDefinition],
) -> Result<HashMap<String, RoomType>, TaxonomyError> {
    let mut words: HashMap<String, RoomType> = HashMap::new();
    for (room_type, entry) in room_types.iter().zip(entries) {
        for word in std::iter::once(&entry.name).chain(&entry.aliases) {
            if let Some(other) = words.insert(word.clone(), *room_type).filter(|t| t != room_type) {
                return Err(TaxonomyError::Word {
                    what: ROOM_TYPE,
                    word: word.clone(),
                    first: other.name().to_owned(),
                    second: room_type.name().to_owned(),
                });
            }
        }
    }
    Ok(words)
}

/// Returns the details of a complete entry.
fn details(entry: &ClassDefinition) -> Details {
    Details {
        id: entry.id.unwrap_or_default(),
        color: entry.color.unwrap_or_default(),
        is_stuff: entry.kind == Some(Kind::Stuff),
    }
}

/// Makes the classes of a taxonomy, and fills in omitted values of the entries.
fn resolve_classes(entries: &mut [ClassDefinition]) -> Result<Vec<Class>, TaxonomyError> {
    let names: Vec<String> = entries.iter().map(|entry| entry.name.clone()).collect();
    check_names(CLASS, &names)?;
    let counts_as: Vec<Option<String>> = entries.iter().map(|entry| entry.counts_as.clone()).collect();
    let s3dis = counts_as_s3dis(CLASS, &names, &counts_as, &Class::S3DIS.map(Class::name))?;

    let mut by_id: BTreeMap<u32, &str> = BTreeMap::new();
    let mut by_color: BTreeMap<[u8; 3], &str> = BTreeMap::new();
    for (place, (entry, name)) in entries.iter_mut().zip(&names).enumerate() {
        let id = *entry.id.get_or_insert(place as u32 + 1);
        if id > 0xffff {
            return Err(TaxonomyError::LargeId { name: name.clone(), id });
        }
        if let Some(first) = by_id.insert(id, name) {
            return Err(TaxonomyError::Id { id, first: first.to_owned(), second: name.clone() });
        }
        if let Some(color) = entry.color
            && let Some(first) = by_color.insert(color, name)
        {
            return Err(TaxonomyError::Color { color, first: first.to_owned(), second: name.clone() });
        }
    }

    let mut used: BTreeSet<[u8; 3]> = by_color.into_keys().collect();
    let mut free = 1..;
    let mut classes = Vec::with_capacity(entries.len());
    for (index, ((entry, name), s3dis)) in (0u8..).zip(entries.iter_mut().zip(&names).zip(s3dis)) {
        let s3dis = s3dis.unwrap_or(Class::CLUTTER.index() as u8);
        let class = Class::new(index, s3dis, intern(name));
        let is_shell = [Class::CEILING, Class::FLOOR, Class::WALL].contains(&class.s3dis());
        entry
            .kind
            .get_or_insert(if is_shell { Kind::Stuff } else { Kind::Thing });
        entry.counts_as.get_or_insert_with(|| class.s3dis().name().to_owned());
        if entry.color.is_none() {
            entry.color = free.by_ref().map(pretty_color).find(|color| used.insert(*color));
        }
        classes.push(class);
    }
    Ok(classes)
}

/// Makes the room types of a taxonomy.
fn resolve_room_types(entries: &mut [RoomTypeDefinition]) -> Result<Vec<RoomType>, TaxonomyError> {
    let names: Vec<String> = entries.iter().map(|entry| entry.name.clone()).collect();
    check_names(ROOM_TYPE, &names)?;
    let counts_as: Vec<Option<String>> = entries.iter().map(|entry| entry.counts_as.clone()).collect();
    let s3dis = counts_as_s3dis(ROOM_TYPE, &names, &counts_as, &RoomType::S3DIS.map(RoomType::name))?;
    Ok((0u8..)
        .zip(names.iter().zip(s3dis))
        .map(|(index, (name, s3dis))| RoomType::new(index, s3dis.unwrap_or(NOTHING), intern(name)))
        .collect())
}

fn check_name(what: &'static str, place: usize, name: &str) -> Result<(), TaxonomyError> {
    // In the name of an image, the name of a room ends where digits begin.
    let is_room = what == ROOM_TYPE;
    let plain = name.bytes().all(|b| {
        if is_room {
            b.is_ascii_alphabetic()
        } else {
            b.is_ascii_alphanumeric()
        }
    });
    let starts = name.bytes().next().is_some_and(|b| b.is_ascii_alphabetic());

    // "unknown" is the room in names if no room is known. Loaders look for "rgb" in paths.
    let lower = name.to_ascii_lowercase();
    let taken = lower.contains("rgb") || is_room && lower == "unknown";
    if plain && starts && name.len() <= MAX_NAME && !taken {
        return Ok(());
    }
    Err(TaxonomyError::Name { what, place, name: name.to_owned() })
}

fn check_names(what: &'static str, names: &[String]) -> Result<(), TaxonomyError> {
    if names.len() > MAX_CLASSES {
        return Err(TaxonomyError::TooMany { what, count: names.len() });
    }
    let mut places: BTreeMap<String, usize> = BTreeMap::new();
    for (place, name) in (1..).zip(names) {
        check_name(what, place, name)?;
        if let Some(first) = places.insert(name.to_ascii_lowercase(), place) {
            return Err(TaxonomyError::SameName { what, place, name: name.clone(), first });
        }
    }
    Ok(())
}

/// Follows `counts_as` of each entry to a place in `s3dis`. `None` if the entry counts as nothing there.
fn counts_as_s3dis(
    what: &'static str,
    names: &[String],
    counts_as: &[Option<String>],
    s3dis: &[&str],
) -> Result<Vec<Option<u8>>, TaxonomyError> {
    let place_of = |name: &str| {
        (0u8..)
            .zip(s3dis)
            .find(|(_, word)| **word == name)
            .map(|(place, _)| place)
    };
    let entries: BTreeMap<&str, Option<&str>> = names
        .iter()
        .map(String::as_str)
        .zip(counts_as.iter().map(Option::as_deref))
        .collect();

    let follow = |start: &str| {
        let mut way = vec![start.to_owned()];
        let mut name = start;
        loop {
            // An entry that counts as its own name means the entry of S3DIS with this name.
            match entries
                .get(name)
                .copied()
                .flatten()
                .filter(|next| *next != name || place_of(next).is_none())
            {
                None => return Ok(place_of(name)),
                Some(next) if !entries.contains_key(next) => {
                    return place_of(next).map(Some).ok_or_else(|| TaxonomyError::Unknown {
                        what,
                        place: format!("counts_as of {name:?}"),
                        word: next.to_owned(),
                        names: format!("{} and {} of this taxonomy", s3dis.join(" "), names.join(" ")),
                    });
                }
                Some(next) => {
                    let before = way.iter().position(|earlier| earlier == next);
                    way.push(next.to_owned());
                    if let Some(before) = before {
                        return Err(TaxonomyError::Circle { what, names: way.split_off(before) });
                    }
                    name = next;
                }
            }
        }
    };

    names.iter().map(|name| follow(name)).collect()
}

/// Returns the word with a lifetime as long as the process.
fn intern(word: &str) -> &'static &'static str {
    static WORDS: Mutex<BTreeMap<&'static str, &'static &'static str>> = Mutex::new(BTreeMap::new());
    let mut words = WORDS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = words.get(word) {
        return known;
    }
    let text: &'static str = Box::leak(word.into());
    let word: &'static &'static str = Box::leak(Box::new(text));
    words.insert(text, word);
    word
}
