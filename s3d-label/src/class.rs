//! Classes of objects.

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A class of objects: its place in a [`Taxonomy`](crate::Taxonomy), and its name. The constants are the 13
/// classes of S3DIS. [`Taxonomy::class`](crate::Taxonomy::class) finds the classes of other taxonomies.
///
/// `Ord` is the order of the taxonomy. The order of S3DIS is in `s3d_io::formats`, "What is written".
///
/// ```
/// use s3d_label::Class;
///
/// assert_eq!("chair".parse(), Ok(Class::CHAIR));
/// assert_eq!((Class::CHAIR.index(), Class::S3DIS.len()), (8, 13));
/// assert!("stairs".parse::<Class>().is_err());
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Class {
    index: u8,
    /// The place in [`Class::S3DIS`] of the class that it counts as.
    s3dis: u8,
    /// A reference of one word, since there are many labels, and errors contain them.
    name: &'static &'static str,
}

/// A word that is not a class of the taxonomy.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{word:?} is no class; the classes are {classes}")]
pub struct UnknownClass {
    /// The word.
    pub word: String,
    /// The classes of the taxonomy, separated by blanks.
    pub classes: String,
}

macro_rules! s3dis {
    ($($constant:ident $index:literal $name:literal;)*) => {
        impl Class {
            $(
                #[doc = concat!("`", $name, "` of S3DIS.")]
                pub const $constant: Self = Self { index: $index, s3dis: $index, name: &$name };
            )*

            /// The classes of S3DIS, each at its [`Class::index`].
            pub const S3DIS: [Self; 13] = [$(Self::$constant),*];
        }
    };
}

s3dis! {
    CEILING 0 "ceiling";
    FLOOR 1 "floor";
    WALL 2 "wall";
    BEAM 3 "beam";
    COLUMN 4 "column";
    WINDOW 5 "window";
    DOOR 6 "door";
    TABLE 7 "table";
    CHAIR 8 "chair";
    SOFA 9 "sofa";
    BOOKCASE 10 "bookcase";
    BOARD 11 "board";
    CLUTTER 12 "clutter";
}

impl Class {
    /// Makes the class at `index` of a taxonomy, which counts as the class of S3DIS at `s3dis`.
    pub(crate) const fn new(index: u8, s3dis: u8, name: &'static &'static str) -> Self {
        Self { index, s3dis, name }
    }

    /// Returns the spelling of the class in names of labels: letters and digits.
    pub const fn name(self) -> &'static str {
        self.name
    }

    /// Returns the place in the taxonomy, from 0, which is also the bin in a histogram of classes.
    pub const fn index(self) -> usize {
        self.index as usize
    }

    /// Returns the class of S3DIS that it counts as; [`Class::CLUTTER`] if no other fits. Loaders of S3DIS
    /// need these classes, and so do questions such as "is it a floor?".
    pub fn s3dis(self) -> Self {
        Self::S3DIS
            .get(usize::from(self.s3dis))
            .copied()
            .unwrap_or(Self::CLUTTER)
    }
}

impl fmt::Debug for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name)
    }
}

impl FromStr for Class {
    type Err = UnknownClass;

    /// Finds the class of S3DIS with exactly the name `word`.
    fn from_str(word: &str) -> Result<Self, UnknownClass> {
        Self::S3DIS
            .into_iter()
            .find(|class| *class.name == word)
            .ok_or_else(|| UnknownClass { word: word.to_owned(), classes: names(&Self::S3DIS) })
    }
}

/// Joins the names of classes, for a message.
pub(crate) fn names(classes: &[Class]) -> String {
    classes.iter().map(|class| *class.name).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_indices_go_both_ways() {
        let names = "ceiling floor wall beam column window door table chair sofa bookcase board clutter";
        assert_eq!(Class::S3DIS.map(Class::name).join(" "), names);
        for (i, class) in Class::S3DIS.into_iter().enumerate() {
            assert_eq!(class.index(), i);
            assert_eq!(class.to_string().parse(), Ok(class));
            assert_eq!(class.s3dis(), class);
        }
        assert_eq!(format!("[{:>6}]", Class::WALL), "[  wall]");
    }

    #[test]
    fn a_strange_word_is_named_beside_the_valid_ones() {
        for word in ["stairs", "Wall", "wall ", "", "<UNK>"] {
            let message = word.parse::<Class>().unwrap_err().to_string();
            assert!(message.contains(&format!("{word:?}")), "{message}");
            assert!(message.ends_with("sofa bookcase board clutter"), "{message}");
        }
    }
}
