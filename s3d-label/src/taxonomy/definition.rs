//! The definition of a taxonomy, as a file contains it.

use std::collections::BTreeMap;

/// The definition of a taxonomy. [`Taxonomy::new`](crate::Taxonomy::new) checks it and fills in omitted
/// values.
///
/// Names consist of letters and have at most 40 characters. Names of classes may also contain digits, after a
/// letter. Labels join names by underscores.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct TaxonomyDefinition {
    /// The name of the taxonomy; not `s3dis`, which is built in.
    pub name: String,
    /// The class for unknown words, if they are not refused. If omitted, it is the class `clutter`, if there
    /// is one.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub clutter: Option<String>,
    /// The classes, in the order of their indices.
    pub classes: Vec<ClassDefinition>,
    /// The room types. If omitted, they are the 11 of S3DIS.
    #[cfg_attr(feature = "serde", serde(default))]
    pub rooms: Vec<RoomTypeDefinition>,
    /// Further words with the class that each means, or `""` for "no class" (unlabelled). Numbers are written
    /// as decimals.
    #[cfg_attr(feature = "serde", serde(default))]
    pub aliases: BTreeMap<String, String>,
}

/// The definition of a class.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ClassDefinition {
    /// The spelling in labels.
    pub name: String,
    /// The number in the data set, 0 to 65,535. If omitted, it is the place in the list, from 1.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub id: Option<u32>,
    /// Red, green and blue. If omitted, it is a colour that no other class has.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub color: Option<[u8; 3]>,
    /// Thing or stuff. If omitted, it is stuff for a class that counts as ceiling, floor or wall, else thing.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub kind: Option<Kind>,
    /// Other words for the class, such as the words of a data set.
    #[cfg_attr(feature = "serde", serde(default))]
    pub aliases: Vec<String>,
    /// The class of S3DIS that it counts as, or a class of this taxonomy that counts as the same. If omitted,
    /// it is the class of S3DIS with the same name, or else `clutter`.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub counts_as: Option<String>,
}

/// The kind of a class: countable or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Kind {
    /// Instances are told apart, as with chairs.
    Thing,
    /// Instances are not told apart, as with floors.
    Stuff,
}

/// The definition of a room type.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct RoomTypeDefinition {
    /// The spelling in names of rooms.
    pub name: String,
    /// Other words for the room type.
    #[cfg_attr(feature = "serde", serde(default))]
    pub aliases: Vec<String>,
    /// The room type of S3DIS that it counts as, or a room type of this taxonomy that counts as the same. If
    /// omitted, it is the room type of S3DIS with the same name, or else none.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub counts_as: Option<String>,
}
