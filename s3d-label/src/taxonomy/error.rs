//! Errors in the definition of a taxonomy.

use crate::taxonomy::MAX_CLASSES;
use thiserror::Error;

/// The reason why a definition is not a taxonomy. `what` is "class" or "type of room".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum TaxonomyError {
    /// The definition has the name of S3DIS, which cannot be replaced.
    #[error("a taxonomy of one's own cannot be called \"s3dis\", which is built in: give it another name")]
    Reserved,
    /// The definition has no class.
    #[error(
        "has no classes: a class is written [[classes]], and on lines of their own name = \"bed\" and what \
         else is known"
    )]
    Empty,
    /// The definition has more classes or room types than an image with a palette has colours.
    #[error(
        "has {count} of the kind \"{what}\", and at most {MAX_CLASSES} fit in an image with a palette: join \
         some"
    )]
    TooMany {
        /// The kind.
        what: &'static str,
        /// The number of entries.
        count: usize,
    },
    /// A name is not allowed, because labels with it could not be taken apart.
    #[error(
        "{what} {place}: {name:?} is no name: names have letters (those of classes also digits, behind a \
         letter), 40 characters at most, and nowhere \"rgb\"; \"unknown\" is no type of room. Write \
         \"showerCurtain\", and other spellings as aliases"
    )]
    Name {
        /// The kind.
        what: &'static str,
        /// The number of the entry, from 1; 0 for the name of the taxonomy.
        place: usize,
        /// The name.
        name: String,
    },
    /// A word is the name or an alias of two entries.
    #[error(
        "{word:?} is a word for {first} and for {second}: which {what} is meant would be open; take it from \
         one of them"
    )]
    Word {
        /// The kind.
        what: &'static str,
        /// The word.
        word: String,
        /// The name of the first entry.
        first: String,
        /// The name of the second entry; "none" for unlabelled.
        second: String,
    },
    /// Two names are the same, or differ only in case, which some file systems ignore.
    #[error(
        "{what} {place}: {name:?} has the name of {what} {first}: names differ, and in more than upper and \
         lower case"
    )]
    SameName {
        /// The kind.
        what: &'static str,
        /// The number of the second entry, from 1.
        place: usize,
        /// The name of the second entry.
        name: String,
        /// The number of the first entry, from 1.
        first: usize,
    },
    /// Two classes have the same number.
    #[error("class {second:?} has the id {id} of class {first:?}: each needs one of its own")]
    Id {
        /// The number.
        id: u32,
        /// The name of the first class.
        first: String,
        /// The name of the second class.
        second: String,
    },
    /// The number of a class does not fit into the images of COCO.
    #[error("class {name:?} has the id {id}: ids go from 0 to 65,535")]
    LargeId {
        /// The name of the class.
        name: String,
        /// The number.
        id: u32,
    },
    /// Two classes have the same colour.
    #[error(
        "class {second:?} has the colour {color:?} of class {first:?}: pictures could not tell them apart; \
         change one, or leave it out for one that is free"
    )]
    Color {
        /// The colour.
        color: [u8; 3],
        /// The name of the first class.
        first: String,
        /// The name of the second class.
        second: String,
    },
    /// A word is not a class or not a room type.
    #[error("{place} means {word:?}, which is no {what}: there are {names}")]
    Unknown {
        /// The kind.
        what: &'static str,
        /// The entry with the word.
        place: String,
        /// The word.
        word: String,
        /// The valid names.
        names: String,
    },
    /// Classes count as one another in a circle.
    #[error("counts_as goes in a circle, so that these count as nothing: {}; let one of them count as a \
             {what} of S3DIS", names.join(" counts as "))]
    Circle {
        /// The kind.
        what: &'static str,
        /// The names along the circle; the first is also the last.
        names: Vec<String>,
    },
}
