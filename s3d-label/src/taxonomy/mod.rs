//! Taxonomies: which classes and types of rooms there are, and what is known of each.

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

/// The most classes that a taxonomy can have: an image with a palette has 256 colours, and the last means
/// that nothing was hit.
pub const MAX_CLASSES: usize = 255;

/// The classes and types of rooms of a data set: S3DIS's, those of another data set, or a user's own. Cheap
/// to clone.
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
    /// With everything that was left out filled in.
    definition: TaxonomyDefinition,
    classes: Vec<Class>,
    details: Vec<Details>,
    room_types: Vec<RoomType>,
    /// Names and aliases; `None`: they mean no class.
    words: HashMap<String, Option<Class>>,
    room_words: HashMap<String, RoomType>,
    clutter: Option<Class>,
}

/// What is known of a class beside its name.
struct Details {
    id: u32,
    color: [u8; 3],
    is_stuff: bool,
}

impl Taxonomy {
    /// The name of the taxonomy of S3DIS.
    pub const S3DIS: &str = "s3dis";

    /// The names of the taxonomies that are built in.
    pub const BUILT_IN: [&str; 5] = [Self::S3DIS, "nyu40", "scannet20", "scannet200", "matterport40"];

    /// The 13 classes and 11 types of rooms of S3DIS, without aliases.
    pub fn s3dis() -> Self {
        built_in::s3dis()
    }

    /// One of [`Taxonomy::BUILT_IN`], by its name.
    pub fn built_in(name: &str) -> Option<Self> {
        built_in::find(name)
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.0.definition.name
    }

    /// Whether it is that of S3DIS, which a data set need not name.
    pub fn is_s3dis(&self) -> bool {
        self.name() == Self::S3DIS
    }

    /// What it was made of, with everything that was left out filled in.
    pub fn definition(&self) -> &TaxonomyDefinition {
        &self.0.definition
    }

    /// Its classes, each at its [`Class::index`].
    pub fn classes(&self) -> &[Class] {
        &self.0.classes
    }

    /// Its types of rooms, each at its [`RoomType::index`].
    pub fn room_types(&self) -> &[RoomType] {
        &self.0.room_types
    }

    /// The number of a class in its data set, and its category in COCO's files.
    ///
    /// # Panics
    /// If the class is another taxonomy's, which has more classes. So do the others that take a class.
    pub fn id(&self, class: Class) -> u32 {
        self.details(class).id
    }

    /// The colour of a class.
    pub fn color(&self, class: Class) -> [u8; 3] {
        self.details(class).color
    }

    /// Whether the instances of a class are not told apart: floors, walls and the like.
    pub fn is_stuff(&self, class: Class) -> bool {
        self.details(class).is_stuff
    }

    #[expect(clippy::indexing_slicing, reason = "a caller's mistake: see Panics")]
    fn details(&self, class: Class) -> &Details {
        &self.0.details[class.index()]
    }

    /// The class for what has a name that nobody knows; `None` if the taxonomy has none.
    pub fn clutter(&self) -> Option<Class> {
        self.0.clutter
    }

    /// The class that is spelled `name`, to the letter.
    ///
    /// # Errors
    /// [`UnknownClass`].
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

    /// The class that a word of a data set means, by its name or an alias: `Some(None)` if it means no class
    /// (unlabelled), `None` if nobody knows it.
    pub fn meaning(&self, word: &str) -> Option<Option<Class>> {
        self.0.words.get(word).copied()
    }

    /// The class that a number of a data set means: by an alias or its [`Taxonomy::id`]. Numbers mean nothing
    /// in S3DIS, whose files hold names.
    pub fn meaning_of_number(&self, number: i64) -> Option<Option<Class>> {
        if self.is_s3dis() {
            return None;
        }
        let by_id = || {
            let place = self.0.details.iter().position(|d| i64::from(d.id) == number)?;
            self.classes().get(place).copied().map(Some)
        };
        self.meaning(&number.to_string()).or_else(by_id)
    }

    /// The type of room that is spelled `name`, to the letter.
    ///
    /// # Errors
    /// [`UnknownRoomType`].
    pub fn room_type(&self, name: &str) -> Result<RoomType, UnknownRoomType> {
        find_type(self.room_types(), name)
    }

    /// The room that is spelled `name`: a type and a number, as in `office_3`.
    ///
    /// # Errors
    /// [`RoomError`].
    pub fn room(&self, name: &str) -> Result<Room, RoomError> {
        parse_room(self.room_types(), name)
    }

    /// As [`Taxonomy::room`], but its type may also be an alias.
    ///
    /// # Errors
    /// [`RoomError`].
    pub fn room_of_word(&self, word: &str) -> Result<Room, RoomError> {
        let by_alias = |(alias, number): (&str, &str)| {
            let room_type = *self.0.room_words.get(alias)?;
            self.room(&format!("{room_type}_{number}")).ok()
        };
        self.room(word)
            .or_else(|e| word.rsplit_once('_').and_then(by_alias).ok_or(e))
    }

    /// As [`Taxonomy::parse_name`], but the null label is an error.
    ///
    /// # Errors
    /// [`LabelError`].
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
