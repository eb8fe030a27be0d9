//! What a taxonomy is made of, as a file holds it.

use std::collections::BTreeMap;

/// A taxonomy as it is written down. [`Taxonomy::new`](crate::Taxonomy::new) checks it and fills in what is
/// left out.
///
/// Names hold letters (those of classes also digits, behind a letter), and 40 characters at most: labels are
/// joined of them by underscores.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct TaxonomyDefinition {
    /// What it is called; not `s3dis`, which is built in.
    pub name: String,
    /// The class for words that nobody knows, where these are not refused. Left out: there is none, unless a
    /// class is called `clutter`.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub clutter: Option<String>,
    /// The classes, in the order of their indices.
    pub classes: Vec<ClassDefinition>,
    /// The types of rooms. Left out: S3DIS's 11.
    #[cfg_attr(feature = "serde", serde(default))]
    pub rooms: Vec<RoomTypeDefinition>,
    /// Further words, and the class that each means; `""`: none (unlabelled). Numbers are written as
    /// decimals.
    #[cfg_attr(feature = "serde", serde(default))]
    pub aliases: BTreeMap<String, String>,
}

/// A class as it is written down.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ClassDefinition {
    /// How it is spelled in labels.
    pub name: String,
    /// Its number in the data set, 0 to 65,535. Left out: the place in the list, from 1.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub id: Option<u32>,
    /// Red, green and blue. Left out: one that no other class has.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub color: Option<[u8; 3]>,
    /// Left out: stuff if it counts as ceiling, floor or wall.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub kind: Option<Kind>,
    /// Other words for it, such as those of a data set.
    #[cfg_attr(feature = "serde", serde(default))]
    pub aliases: Vec<String>,
    /// Which class of S3DIS it counts as, or which class of this taxonomy it shares that with. Left out: the
    /// class of S3DIS with the same name, or else `clutter`.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub counts_as: Option<String>,
}

/// Whether instances of a class are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Kind {
    /// They are, as with chairs.
    Thing,
    /// They are not, as with floors.
    Stuff,
}

/// A type of room as it is written down.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct RoomTypeDefinition {
    /// How it is spelled in names of rooms.
    pub name: String,
    /// Other words for it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub aliases: Vec<String>,
    /// Which type of S3DIS it counts as, or which type of this taxonomy it shares that with. Left out: the
    /// type of S3DIS with the same name, or else none.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub counts_as: Option<String>,
}
