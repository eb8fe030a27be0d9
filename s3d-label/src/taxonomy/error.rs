//! What can be wrong with a taxonomy.

use crate::taxonomy::MAX_CLASSES;
use thiserror::Error;

/// Why a definition is no taxonomy. `what` is "class" or "type of room".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum TaxonomyError {
    /// It has the name of the one that cannot be replaced.
    #[error("a taxonomy of one's own cannot be called \"s3dis\", which is built in: give it another name")]
    Reserved,
    /// It has no class.
    #[error(
        "has no classes: a class is written [[classes]], and on lines of their own name = \"bed\" and what \
         else is known"
    )]
    Empty,
    /// It has more classes or types of rooms than an image with a palette has colours.
    #[error(
        "has {count} of the kind \"{what}\", and at most {MAX_CLASSES} fit in an image with a palette: join \
         some"
    )]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many.
        count: usize,
    },
    /// A name that would make labels that cannot be taken apart.
    #[error(
        "{what} {place}: {name:?} is no name: names have letters (those of classes also digits, behind a \
         letter), 40 characters at most, and nowhere \"rgb\"; \"unknown\" is no type of room. Write \
         \"showerCurtain\", and other spellings as aliases"
    )]
    Name {
        /// Of what.
        what: &'static str,
        /// Which entry, from 1; 0 for the name of the taxonomy.
        place: usize,
        /// The name.
        name: String,
    },
    /// A word is the name or an alias of two.
    #[error(
        "{word:?} is a word for {first} and for {second}: which {what} is meant would be open; take it from \
         one of them"
    )]
    Word {
        /// Of what.
        what: &'static str,
        /// The word.
        word: String,
        /// The name of the one.
        first: String,
        /// The name of the other; "none" for unlabelled.
        second: String,
    },
    /// A name is there twice, or twice but for upper and lower case, which file systems do not tell apart.
    #[error(
        "{what} {place}: {name:?} has the name of {what} {first}: names differ, and in more than upper and \
         lower case"
    )]
    SameName {
        /// Of what.
        what: &'static str,
        /// The entry, from 1.
        place: usize,
        /// Its name.
        name: String,
        /// The entry before it, from 1.
        first: usize,
    },
    /// Two classes have the same number.
    #[error("class {second:?} has the id {id} of class {first:?}: each needs one of its own")]
    Id {
        /// The number.
        id: u32,
        /// The name of the one.
        first: String,
        /// The name of the other.
        second: String,
    },
    /// A number of a class that does not fit into COCO's images.
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
        /// The name of the one.
        first: String,
        /// The name of the other.
        second: String,
    },
    /// A word that should be a class or a type of room is none.
    #[error("{place} means {word:?}, which is no {what}: there are {names}")]
    Unknown {
        /// Of what.
        what: &'static str,
        /// Where it stands.
        place: String,
        /// The word.
        word: String,
        /// What there is.
        names: String,
    },
    /// Classes count as one another in a circle.
    #[error("counts_as goes in a circle, so that these count as nothing: {}; let one of them count as a \
             {what} of S3DIS", names.join(" counts as "))]
    Circle {
        /// Of what.
        what: &'static str,
        /// The names along the circle; the first is also the last.
        names: Vec<String>,
    },
}
