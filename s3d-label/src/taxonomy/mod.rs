//! Taxonomies: the classes and room types of a data set.

mod built_in;
mod definition;
mod error;
mod resolve;

pub use definition::{ClassDefinition, Kind, RoomTypeDefinition, TaxonomyDefinition};
pub use error::TaxonomyError;

use crate::class::{UnknownClass, names};
use crate::room::{find_type, parse_room};
use crate::{Class, Label, LabelError, Room, RoomError, RoomType, UnknownRoomType};
use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// The largest number of classes in a taxonomy. An image with a palette has 256 colours, and the last one
/// means that nothing was hit.
pub const MAX_CLASSES: usize = 255;

/// The classes and room types of a data set: S3DIS, another data set, or your own. Cheap to clone.
///
/// ```
/// use s3d_label::{Class, Taxonomy};
///
/// let taxonomy = Taxonomy::built_in("scannet20").unwrap();
/// let curtain = taxonomy.class("showerCurtain")?;
/// assert_eq!(
///     (taxonomy.id(curtain), taxonomy.is_stuff(curtain), curtain.s3dis()), (28, false, Class::CLUTTER)
/// );
/// assert_eq!(taxonomy.meaning("shower curtain"), Some(Some(curtain)));
/// assert_eq!(taxonomy.parse_name("bed_2_bedroom_1_7")?.unwrap().room.to_string(), "bedroom_1");
/// assert!("bed_2_bedroom_1_7".parse::<s3d_label::Label>().is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Taxonomy(Arc<Parts>);

struct Parts {
    /// The definition, with omitted values filled in.
    definition: TaxonomyDefinition,
    classes: Vec<Class>,
    details: Vec<Details>,
    room_types: Vec<RoomType>,
    /// The class of each name and alias, or `None` for a word that means "no class".
    words: HashMap<String, Option<Class>>,
    room_words: HashMap<String, RoomType>,
    clutter: Option<Class>,
}

/// The properties of a class besides its name.
struct Details {
    id: u32,
    color: [u8; 3],
    is_stuff: bool,
}

impl Taxonomy {
    /// The name of the taxonomy of S3DIS.
    pub const S3DIS: &str = "s3dis";

    /// The names of the built-in taxonomies.
    pub const BUILT_IN: [&str; 5] = [Self::S3DIS, "nyu40", "scannet20", "scannet200", "matterport40"];

    /// Returns the taxonomy of S3DIS: 13 classes and 11 room types, without aliases.
    pub fn s3dis() -> Self {
        built_in::s3dis()
    }

    /// Returns one of [`Taxonomy::BUILT_IN`] by its name.
    pub fn built_in(name: &str) -> Option<Self> {
        built_in::find(name)
    }

    /// Returns the name of the taxonomy.
    pub fn name(&self) -> &str {
        &self.0.definition.name
    }

    /// Returns true for the taxonomy of S3DIS, which a data set need not name.
    pub fn is_s3dis(&self) -> bool {
        self.name() == Self::S3DIS
    }

    /// Returns the definition, with omitted values filled in.
    pub fn definition(&self) -> &TaxonomyDefinition {
        &self.0.definition
    }

    /// Returns the classes, each at its [`Class::index`].
    pub fn classes(&self) -> &[Class] {
        &self.0.classes
    }

    /// Returns the room types, each at its [`RoomType::index`].
    pub fn room_types(&self) -> &[RoomType] {
        &self.0.room_types
    }

    /// Returns the number of a class in its data set, which is also its category in the files of COCO.
    ///
    /// # Panics
    /// If the class belongs to another taxonomy, with more classes. The other methods that take a class panic
    /// likewise.
    pub fn id(&self, class: Class) -> u32 {
        self.details(class).id
    }

    /// Returns the colour of a class.
    pub fn color(&self, class: Class) -> [u8; 3] {
        self.details(class).color
    }

    /// Returns true if the instances of a class are not told apart, such as floors and walls.
    pub fn is_stuff(&self, class: Class) -> bool {
        self.details(class).is_stuff
    }

    #[expect(clippy::indexing_slicing, reason = "a caller's mistake: see Panics")]
    fn details(&self, class: Class) -> &Details {
        &self.0.details[class.index()]
    }

    /// Returns the class for objects with an unknown name, or `None` if the taxonomy has no such class.
    pub fn clutter(&self) -> Option<Class> {
        self.0.clutter
    }

    /// Finds the class with exactly this name.
    ///
    /// # Errors
    /// [`UnknownClass`] if there is none.
    pub fn class(&self, name: &str) -> Result<Class, UnknownClass> {
        let found = self
            .0
            .words
            .get(name)
            .copied()
            .flatten()
            .filter(|class| class.name() == name);
        found.ok_or_else(|| UnknownClass { word: name.to_owned(), classes: names(self.classes()) })
    }

    /// Returns the class that a word of a data set means, by name or alias. Returns `Some(None)` if the word
    /// means "no class" (unlabelled), and `None` if the word is unknown.
    pub fn meaning(&self, word: &str) -> Option<Option<Class>> {
        self.0.words.get(word).copied()
    }

    /// Returns the class that a number of a data set means, by an alias or its [`Taxonomy::id`]. The result
    /// is as in [`Taxonomy::meaning`]. Numbers are unknown in S3DIS, whose files have names.
    pub fn meaning_of_number(&self, number: i64) -> Option<Option<Class>> {
        if self.is_s3dis() {
            return None;
        }
        self.meaning(&number.to_string()).or_else(|| {
            let place = self.0.details.iter().position(|d| i64::from(d.id) == number)?;
            self.classes().get(place).copied().map(Some)
        })
    }

    /// Finds the room type with exactly this name.
    ///
    /// # Errors
    /// [`UnknownRoomType`] if there is none.
    pub fn room_type(&self, name: &str) -> Result<RoomType, UnknownRoomType> {
        find_type(self.room_types(), name)
    }

    /// Parses the name of a room: a type and a number, as in `office_3`.
    ///
    /// # Errors
    /// [`RoomError`] if the name is not a room.
    pub fn room(&self, name: &str) -> Result<Room, RoomError> {
        parse_room(self.room_types(), name)
    }

    /// Parses a room like [`Taxonomy::room`], but the type may also be an alias.
    ///
    /// # Errors
    /// [`RoomError`] if the word is not a room.
    pub fn room_of_word(&self, word: &str) -> Result<Room, RoomError> {
        self.room(word).or_else(|e| {
            word.rsplit_once('_')
                .and_then(|(alias, number)| {
                    let room_type = *self.0.room_words.get(alias)?;
                    self.room(&format!("{room_type}_{number}")).ok()
                })
                .ok_or(e)
        })
    }

    /// Parses a label like [`Taxonomy::parse_name`], but the null label is an error.
    ///
    /// # Errors
    /// [`LabelError`] if the name is not the label of an instance.
    pub fn label(&self, name: &str) -> Result<Label, LabelError> {
        self.parse_name(name)?.ok_or(LabelError::Null)
    }
}

impl Default for Taxonomy {
    fn default() -> Self {
        Self::s3dis()
    }
}

impl PartialEq for Taxonomy {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0.definition == other.0.definition
    }
}

impl Eq for Taxonomy {}

impl fmt::Debug for Taxonomy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Taxonomy").field(&self.name()).finish()
    }
}

#[cfg(test)]
mod tests;
