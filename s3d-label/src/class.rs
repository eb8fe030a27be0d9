//! The 13 classes of objects.

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A class of object. The order is that of formats.md, "What is written"; [`Class::index`] counts along it.
///
/// ```
/// use s3d_label::Class;
///
/// assert_eq!("chair".parse(), Ok(Class::Chair));
/// assert_eq!((Class::Chair.index(), Class::ALL.len()), (8, 13));
/// assert!("stairs".parse::<Class>().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Class {
    /// `ceiling`
    Ceiling,
    /// `floor`
    Floor,
    /// `wall`
    Wall,
    /// `beam`
    Beam,
    /// `column`
    Column,
    /// `window`
    Window,
    /// `door`
    Door,
    /// `table`
    Table,
    /// `chair`
    Chair,
    /// `sofa`
    Sofa,
    /// `bookcase`
    Bookcase,
    /// `board`
    Board,
    /// `clutter`: everything that is none of the others.
    Clutter,
}

/// A word that should be a class and is none of the 13.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{word:?} is no class; the classes are {valid}", valid = Class::ALL.map(Class::name).join(" "))]
pub struct UnknownClass {
    /// The word.
    pub word: String,
}

impl Class {
    /// All classes, each at its [`Class::index`].
    pub const ALL: [Self; 13] = [
        Self::Ceiling,
        Self::Floor,
        Self::Wall,
        Self::Beam,
        Self::Column,
        Self::Window,
        Self::Door,
        Self::Table,
        Self::Chair,
        Self::Sofa,
        Self::Bookcase,
        Self::Board,
        Self::Clutter,
    ];

    /// The class as it is spelled in names.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ceiling => "ceiling",
            Self::Floor => "floor",
            Self::Wall => "wall",
            Self::Beam => "beam",
            Self::Column => "column",
            Self::Window => "window",
            Self::Door => "door",
            Self::Table => "table",
            Self::Chair => "chair",
            Self::Sofa => "sofa",
            Self::Bookcase => "bookcase",
            Self::Board => "board",
            Self::Clutter => "clutter",
        }
    }

    /// The class that is spelled `word`, to the letter.
    pub fn from_name(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|class| class.name() == word)
    }

    /// Its place in [`Class::ALL`], 0 to 12: the bin of a histogram of classes.
    pub const fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Class {
    type Err = UnknownClass;

    fn from_str(word: &str) -> Result<Self, UnknownClass> {
        Self::from_name(word).ok_or_else(|| UnknownClass { word: word.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_indices_go_both_ways() {
        let names = "ceiling floor wall beam column window door table chair sofa bookcase board clutter";
        assert_eq!(Class::ALL.map(Class::name).join(" "), names);
        for (i, class) in Class::ALL.into_iter().enumerate() {
            assert_eq!(class.index(), i);
            assert_eq!(class.to_string().parse(), Ok(class));
        }
        assert_eq!(format!("[{:>6}]", Class::Wall), "[  wall]");
    }

    #[test]
    fn a_strange_word_is_named_beside_the_valid_ones() {
        for word in ["stairs", "Wall", "wall ", "", "<UNK>"] {
            assert_eq!(Class::from_name(word), None);
            let message = word.parse::<Class>().unwrap_err().to_string();
            assert!(message.contains(&format!("{word:?}")), "{message}");
            assert!(message.ends_with("sofa bookcase board clutter"), "{message}");
        }
    }
}
