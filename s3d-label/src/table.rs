//! The label table, which maps indices to labels and back.

use crate::{Class, Label, LabelError, NULL_NAME, Taxonomy};
use std::cmp::Ordering;
use std::fmt;
use thiserror::Error;

/// The largest number of entries of a label table, with the null label.
///
/// A semantic image writes an index as a colour, and the colour (13, 13, 13) means that the ray hit nothing
/// (`s3d_io::formats`, "What is written"). So every index is below 13·65536 + 13·256 + 13.
pub const MAX_LABELS: usize = 13 * 65_536 + 13 * 256 + 13;

/// An index into a label table. Semantic images store it, and points vote for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct LabelId(pub u32);

impl LabelId {
    /// The index of the null label, which stands for "no class".
    pub const NULL: Self = Self(0);

    /// Returns true for the index of the null label.
    pub const fn is_null(self) -> bool {
        self.0 == 0
    }

    /// Returns the index as a position in a slice.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for LabelId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// The labels of a data set in the published order. Index 0 is the null label; the others are sorted by `Ord`
/// of [`Label`]. Source: `s3d_io::formats`, "What is written".
///
/// ```
/// use s3d_label::{Class, LabelId, LabelTable, NULL_NAME};
///
/// let table = LabelTable::from_labels(["wall_1_office_1_5".parse()?, "chair_1_office_1_5".parse()?])?;
/// assert_eq!(table.names(), [NULL_NAME, "chair_1_office_1_5", "wall_1_office_1_5"]);
/// assert_eq!(table.class_of(LabelId(2)), Some(Class::WALL));
/// assert_eq!(table.get(LabelId::NULL), None);
/// assert_eq!(LabelTable::from_names(&table.names())?, table);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LabelTable {
    taxonomy: Taxonomy,
    /// The labels, sorted. The label with index i is at i − 1.
    labels: Vec<Label>,
}

/// The reason why labels are not a table.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableError {
    /// The first entry is not the null label.
    #[error("index 0 of a label table is {NULL_NAME:?}, not {found:?}")]
    NoNull {
        /// The first entry; an empty string in an empty table.
        found: String,
    },
    /// An entry is not a label.
    #[error("index {index}: {source}")]
    Name {
        /// The index of the entry.
        index: usize,
        /// The error of the entry.
        source: LabelError,
    },
    /// The null label comes before the last label.
    #[error("index {index}: the null label again, though labels follow")]
    Null {
        /// The index of the null label.
        index: usize,
    },
    /// An entry comes after an entry that it should precede.
    #[error(
        "index {index}: {label} stands behind {before}; labels are sorted by class_instance_, then by area, \
         as strings"
    )]
    Order {
        /// The index of the label.
        index: usize,
        /// The label.
        label: Label,
        /// The label at the index before.
        before: Label,
    },
    /// Two labels are the same instance: they have the same class, instance number and area.
    #[error("index {index}: {label} is the same instance as {other} at index {first}")]
    Duplicate {
        /// The index of the second label. In a table that is being built, it is the index that it would have.
        index: usize,
        /// The second label.
        label: Label,
        /// The index of the first label.
        first: usize,
        /// The first label.
        other: Label,
    },
    /// A label contains the number 0, which names do not allow.
    #[error("{label} cannot stand in a table: instances, rooms and areas are numbered from 1")]
    Zero {
        /// The label.
        label: Label,
    },
    /// The class or room type of a label belongs to another taxonomy.
    #[error("{label} is no label of {taxonomy}: its class or its type of room is another taxonomy's")]
    Foreign {
        /// The label.
        label: Label,
        /// The name of the taxonomy.
        taxonomy: String,
    },
    /// There are more labels than colours for them.
    #[error("{count} labels (the null label included): a semantic image can tell {MAX_LABELS} apart")]
    TooMany {
        /// The number of labels, with the null label.
        count: usize,
    },
}

impl LabelTable {
    /// Makes a table of labels of S3DIS, given in any order. [`Taxonomy::table`] is for other taxonomies.
    ///
    /// # Errors
    /// The errors of [`Taxonomy::table`].
    pub fn from_labels(labels: impl IntoIterator<Item = Label>) -> Result<Self, TableError> {
        Taxonomy::s3dis().table(labels)
    }

    /// Reads a table of labels of S3DIS from its names. [`Taxonomy::table_from_names`] is for other
    /// taxonomies.
    ///
    /// # Errors
    /// The errors of [`Taxonomy::table_from_names`].
    pub fn from_names(names: &[String]) -> Result<Self, TableError> {
        Taxonomy::s3dis().table_from_names(names)
    }

    /// Returns the taxonomy of the labels.
    pub fn taxonomy(&self) -> &Taxonomy {
        &self.taxonomy
    }
}

impl Taxonomy {
    /// Makes a table of `labels`, given in any order.
    ///
    /// # Errors
    /// [`TableError::Duplicate`] if two labels are the same instance, [`TableError::Zero`] for a number 0,
    /// [`TableError::TooMany`] above [`MAX_LABELS`], [`TableError::Foreign`] for a class or room type of
    /// another taxonomy.
    pub fn table(&self, labels: impl IntoIterator<Item = Label>) -> Result<LabelTable, TableError> {
        let mut labels: Vec<Label> = labels.into_iter().collect();
        if let Some(&label) = labels
            .iter()
            .find(|l| l.instance == 0 || l.room.number == 0 || l.area == 0)
        {
            return Err(TableError::Zero { label });
        }
        let is_ours = |l: &Label| {
            self.classes().get(l.class.index()) == Some(&l.class)
                && self.room_types().get(l.room.room_type.index()) == Some(&l.room.room_type)
        };
        if let Some(&label) = labels.iter().find(|l| !is_ours(l)) {
            return Err(TableError::Foreign { label, taxonomy: self.name().to_owned() });
        }

        labels.sort_unstable();
        let mut pairs = (1..).zip(labels.array_windows());
        if let Some((first, &[other, label])) = pairs.find(|(_, [a, b])| a.cmp_key(b).is_eq()) {
            return Err(TableError::Duplicate { index: first + 1, label, first, other });
        }
        LabelTable { taxonomy: self.clone(), labels }.checked_count()
    }

    /// Reads a table from its names, which are in the order of their indices, as in `semantic_labels.json`.
    /// Null labels after the last label are padding, and are dropped.
    ///
    /// # Errors
    /// [`TableError`] for the first index with a wrong order, an invalid name or a duplicate.
    pub fn table_from_names(&self, names: &[String]) -> Result<LabelTable, TableError> {
        if names.first().is_none_or(|name| name != NULL_NAME) {
            return Err(TableError::NoNull { found: names.first().cloned().unwrap_or_default() });
        }

        let last = names.iter().rposition(|name| name != NULL_NAME).unwrap_or(0);
        let mut labels: Vec<Label> = Vec::with_capacity(last);
        for (index, name) in names.iter().enumerate().take(last + 1).skip(1) {
            let label = self
                .parse_name(name)
                .map_err(|source| TableError::Name { index, source })?
                .ok_or(TableError::Null { index })?;

            if let Some(&before) = labels.last()
                && before.cmp_key(&label) != Ordering::Less
            {
                // The labels so far are sorted, so a duplicate is found by bisection.
                let same = labels.binary_search_by(|l| l.cmp_key(&label)).ok();
                return Err(match same.and_then(|i| Some((i, *labels.get(i)?))) {
                    Some((i, other)) => TableError::Duplicate { index, label, first: i + 1, other },
                    None => TableError::Order { index, label, before },
                });
            }
            labels.push(label);
        }
        LabelTable { taxonomy: self.clone(), labels }.checked_count()
    }
}

impl LabelTable {
    fn checked_count(self) -> Result<Self, TableError> {
        let count = self.len();
        if count <= MAX_LABELS {
            Ok(self)
        } else {
            Err(TableError::TooMany { count })
        }
    }

    /// Returns the index of `label`, or `None` if it is not in the table.
    pub fn id_of(&self, label: &Label) -> Option<LabelId> {
        self.labels.binary_search(label).ok().map(|i| LabelId(i as u32 + 1))
    }

    /// Returns the label at an index, or `None` for the null label and for an index out of range.
    pub fn get(&self, id: LabelId) -> Option<&Label> {
        self.labels.get(id.index().checked_sub(1)?)
    }

    /// Returns the class at an index, or `None` for the null label and for an index out of range.
    pub fn class_of(&self, id: LabelId) -> Option<Class> {
        self.get(id).map(|label| label.class)
    }

    /// Returns the name at an index, or [`NULL_NAME`] for the null label and for an index out of range.
    pub fn name_of(&self, id: LabelId) -> String {
        self.get(id).map_or_else(|| NULL_NAME.to_owned(), Label::to_string)
    }

    /// Returns all names, each at its index: the content of `semantic_labels.json`.
    pub fn names(&self) -> Vec<String> {
        std::iter::once(NULL_NAME.to_owned())
            .chain(self.labels.iter().map(Label::to_string))
            .collect()
    }

    /// Iterates over all labels with their indices, in order, without the null label.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (LabelId, &Label)> {
        self.labels
            .iter()
            .enumerate()
            .map(|(i, label)| (LabelId(i as u32 + 1), label))
    }

    /// Returns the number of entries, with the null label: at least 1.
    #[allow(clippy::len_without_is_empty)] // The null label is always there.
    pub fn len(&self) -> usize {
        self.labels.len() + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::tests::any_label;
    use proptest::prelude::*;

    /// Labels of the published table in its order. A plain order by string or number would differ.
    const PUBLISHED: [&str; 16] = [
        NULL_NAME,
        "beam_10_hallway_6_1",
        "beam_10_storage_4_2",
        "beam_10_office_9_3",
        "beam_10_hallway_2_6",
        "beam_19_office_1_6",
        "beam_1_conferenceRoom_1_1",
        "beam_1_conferenceRoom_1_2",
        "beam_1_hallway_13_4",
        "beam_20_office_2_1",
        "beam_2_conferenceRoom_2_1",
        "board_3_hallway_4_6",
        "board_40_office_39_5",
        "window_8_office_6_6",
        "window_9_office_7_1",
        "window_9_lobby_1_4",
    ];

    fn owned(names: &[&str]) -> Vec<String> {
        names.iter().map(|&name| name.to_owned()).collect()
    }

    /// Returns the items in a fixed random order.
    fn shuffled<T: Clone>(items: &[T]) -> Vec<T> {
        let mut items = items.to_vec();
        let mut state = 1u64;
        for i in (1..items.len()).rev() {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            items.swap(i, (state >> 33) as usize % (i + 1));
        }
        items
    }

    #[test]
    fn published_names_are_rebuilt_in_order() {
        let labels: Vec<Label> = PUBLISHED[1..].iter().map(|name| name.parse().unwrap()).collect();
        let table = LabelTable::from_labels(shuffled(&labels)).unwrap();
        assert_eq!(table.names(), owned(&PUBLISHED));
        assert_eq!(LabelTable::from_names(&owned(&PUBLISHED)).as_ref(), Ok(&table));
        for (id, label) in table.iter() {
            assert_eq!(table.id_of(label), Some(id));
            assert_eq!(table.get(id), Some(label));
            assert_eq!(table.name_of(id), PUBLISHED[id.index()]);
        }
        assert_eq!(table.len(), 16);
        assert_eq!(table.class_of(LabelId(12)), Some(Class::BOARD));
        assert_eq!(table.id_of(&"board_3_hallway_5_6".parse().unwrap()), None);
    }

    #[test]
    fn null_and_indices_out_of_range_have_no_label() {
        let table = LabelTable::from_names(&owned(&PUBLISHED)).unwrap();
        for id in [LabelId::NULL, LabelId(16), LabelId(u32::MAX)] {
            assert_eq!((table.get(id), table.class_of(id)), (None, None));
            assert_eq!(table.name_of(id), NULL_NAME);
        }
        assert_eq!(LabelTable::default().names(), [NULL_NAME]);
        assert_eq!(LabelTable::from_labels([]), Ok(LabelTable::default()));
    }

    #[test]
    fn padding_is_dropped_and_nothing_else() {
        let mut names = owned(&PUBLISHED);
        names.extend(owned(&[NULL_NAME, NULL_NAME]));
        assert_eq!(LabelTable::from_names(&names).unwrap().names(), owned(&PUBLISHED));
        assert_eq!(LabelTable::from_names(&owned(&[NULL_NAME; 3])), Ok(LabelTable::default()));
        names.push("window_9_hallway_9_5".to_owned());
        assert_eq!(LabelTable::from_names(&names), Err(TableError::Null { index: 16 }));
    }

    fn refused(names: &[&str]) -> String {
        LabelTable::from_names(&owned(names)).unwrap_err().to_string()
    }

    #[test]
    fn faults_are_named_with_their_index() {
        assert_eq!(refused(&[]), format!("index 0 of a label table is {NULL_NAME:?}, not \"\""));
        assert!(refused(&["wall_1_office_1_1"]).ends_with("not \"wall_1_office_1_1\""));
        let text = refused(&[NULL_NAME, "wall_1_office_1_1", "wall_x_office_1_1"]);
        assert!(text.starts_with("index 2: ") && text.contains("\"x\""), "{text}");
        let text = refused(&[NULL_NAME, "beam_1_office_1_1", "beam_10_office_1_1"]);
        assert!(text.starts_with("index 2: beam_10_office_1_1 stands behind beam_1_office_1_1"), "{text}");
        let text = refused(&[NULL_NAME, "beam_1_office_1_1", "beam_2_office_1_1", "beam_1_office_2_1"]);
        assert_eq!(text, "index 3: beam_1_office_2_1 is the same instance as beam_1_office_1_1 at index 1");
    }

    #[test]
    fn a_table_cannot_be_made_of_clashing_or_numberless_labels() {
        let a: Label = "wall_1_office_1_1".parse().unwrap();
        let b = Label { room: "office_2".parse().unwrap(), ..a };
        let clash = TableError::Duplicate { index: 2, label: b, first: 1, other: a };
        assert_eq!(LabelTable::from_labels([b, a]), Err(clash));
        let zero = Label { instance: 0, ..a };
        assert_eq!(LabelTable::from_labels([a, zero]), Err(TableError::Zero { label: zero }));
        let many = (1..=MAX_LABELS as u32).map(|instance| Label { instance, ..a });
        assert_eq!(LabelTable::from_labels(many.clone()), Err(TableError::TooMany { count: MAX_LABELS + 1 }));
        assert_eq!(LabelTable::from_labels(many.skip(1)).unwrap().len(), MAX_LABELS);
    }

    proptest! {
        #[test]
        fn a_table_survives_its_names(
            mut labels in prop::collection::vec(any_label(), 0..40),
            one_area in any::<bool>(),
        ) {
            for label in labels.iter_mut().filter(|_| one_area) {
                label.area = 1;
            }
            let mut unique = labels.clone();
            unique.sort();
            unique.dedup_by(|a, b| a.cmp_key(b).is_eq());
            match LabelTable::from_labels(labels.iter().copied()) {
                Ok(table) => {
                    prop_assert_eq!(unique.len(), labels.len());
                    prop_assert_eq!(LabelTable::from_names(&table.names()), Ok(table));
                }
                Err(_) => prop_assert!(unique.len() < labels.len()),
            }
        }
    }
}
