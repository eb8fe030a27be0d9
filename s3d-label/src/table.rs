//! The label table: from indices to labels and back.

use crate::{Class, Label, LabelError, NULL_NAME, Taxonomy};
use std::cmp::Ordering;
use std::fmt;
use thiserror::Error;

/// The most entries a label table can have, the null label included.
///
/// A semantic image writes an index as a colour, and the colour (13, 13, 13) means that the ray hit nothing
/// (formats.md, "What is written"): every index stays below 13·65536 + 13·256 + 13.
pub const MAX_LABELS: usize = 13 * 65_536 + 13 * 256 + 13;

/// An index into a label table: what a semantic image stores, and what a point votes for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct LabelId(pub u32);

impl LabelId {
    /// The index of the null label: no class.
    pub const NULL: Self = Self(0);

    /// Whether it is the null label's.
    pub const fn is_null(self) -> bool {
        self.0 == 0
    }

    /// The index as a position in a slice.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for LabelId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// The labels of a data set in the published order: index 0 is the null label, the rest is sorted as
/// [`Label`]'s `Ord` sorts. Source: formats.md, "What is written".
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
    /// Sorted; the label of index i is at i − 1.
    labels: Vec<Label>,
}

/// Why labels make no table.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableError {
    /// The first entry is not the null label.
    #[error("index 0 of a label table is {NULL_NAME:?}, not {found:?}")]
    NoNull {
        /// What stands there; nothing in an empty table.
        found: String,
    },
    /// An entry is no label.
    #[error("index {index}: {source}")]
    Name {
        /// Its index.
        index: usize,
        /// What is wrong with it.
        source: LabelError,
    },
    /// The null label stands before the end of the labels.
    #[error("index {index}: the null label again, though labels follow")]
    Null {
        /// Its index.
        index: usize,
    },
    /// An entry stands behind one that it should stand before.
    #[error(
        "index {index}: {label} stands behind {before}; labels are sorted by class_instance_, then by area, \
         as strings"
    )]
    Order {
        /// Its index.
        index: usize,
        /// The label.
        label: Label,
        /// The label at the index before.
        before: Label,
    },
    /// Two labels are the same instance: class, instance number and area are those of another.
    #[error("index {index}: {label} is the same instance as {other} at index {first}")]
    Duplicate {
        /// The index of the second of the two (of a table that is being built: the one it would have).
        index: usize,
        /// The second.
        label: Label,
        /// The index of the first.
        first: usize,
        /// The first.
        other: Label,
    },
    /// A label holds a number 0, so that its name would be none.
    #[error("{label} cannot stand in a table: instances, rooms and areas are numbered from 1")]
    Zero {
        /// The label.
        label: Label,
    },
    /// A label's class or type of room is another taxonomy's.
    #[error("{label} is no label of {taxonomy}: its class or its type of room is another taxonomy's")]
    Foreign {
        /// The label.
        label: Label,
        /// The name of the taxonomy.
        taxonomy: String,
    },
    /// There are more labels than colours to write them with.
    #[error("{count} labels (the null label included): a semantic image can tell {MAX_LABELS} apart")]
    TooMany {
        /// How many there are.
        count: usize,
    },
}

impl LabelTable {
    /// The table of `labels` of S3DIS, in whatever order they come. [`Taxonomy::table`] is for others.
    ///
    /// # Errors
    /// As [`Taxonomy::table`].
    pub fn from_labels(labels: impl IntoIterator<Item = Label>) -> Result<Self, TableError> {
        Taxonomy::s3dis().table(labels)
    }

    /// Reads a table of labels of S3DIS. [`Taxonomy::table_from_names`] is for others.
    ///
    /// # Errors
    /// As [`Taxonomy::table_from_names`].
    pub fn from_names(names: &[String]) -> Result<Self, TableError> {
        Taxonomy::s3dis().table_from_names(names)
    }

    /// What its classes and room types are.
    pub fn taxonomy(&self) -> &Taxonomy {
        &self.taxonomy
    }
}

impl Taxonomy {
    /// The table of `labels`, in whatever order they come.
    ///
    /// # Errors
    /// [`TableError::Duplicate`] if two are the same instance, [`TableError::Zero`] for a number 0,
    /// [`TableError::TooMany`] above [`MAX_LABELS`], [`TableError::Foreign`] for a class or type of room of
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

    /// Reads a table from its names, index by index, as `semantic_labels.json` holds them. Null labels behind
    /// the last label are padding and dropped.
    ///
    /// # Errors
    /// [`TableError`] says at which index the order, a name or a duplicate is wrong; the first such index
    /// counts.
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
                // The labels so far are sorted: a duplicate of any of them is found by bisection.
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

    /// The index of `label`, `None` if it is not in the table.
    pub fn id_of(&self, label: &Label) -> Option<LabelId> {
        self.labels.binary_search(label).ok().map(|i| LabelId(i as u32 + 1))
    }

    /// The label at an index, `None` for the null label and for indices out of range.
    pub fn get(&self, id: LabelId) -> Option<&Label> {
        self.labels.get(id.index().checked_sub(1)?)
    }

    /// The class at an index, `None` for the null label and for indices out of range.
    pub fn class_of(&self, id: LabelId) -> Option<Class> {
        self.get(id).map(|label| label.class)
    }

    /// The name at an index: [`NULL_NAME`] for the null label and for indices out of range.
    pub fn name_of(&self, id: LabelId) -> String {
        self.get(id).map_or_else(|| NULL_NAME.to_owned(), Label::to_string)
    }

    /// All names, each at its index: the content of `semantic_labels.json`.
    pub fn names(&self) -> Vec<String> {
        std::iter::once(NULL_NAME.to_owned())
            .chain(self.labels.iter().map(Label::to_string))
            .collect()
    }

    /// All labels with their indices, in order; without the null label.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (LabelId, &Label)> {
        self.labels
            .iter()
            .enumerate()
            .map(|(i, label)| (LabelId(i as u32 + 1), label))
    }

    /// Number of entries, the null label included: at least 1.
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

    /// Labels of the published table in its order, chosen where plain string or number order would differ.
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

    /// A fixed permutation of 0..n.
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

    #[test]
    fn faults_are_named_with_their_index() {
        let read = |names: &[&str]| LabelTable::from_names(&owned(names)).unwrap_err().to_string();
        assert_eq!(read(&[]), format!("index 0 of a label table is {NULL_NAME:?}, not \"\""));
        assert!(read(&["wall_1_office_1_1"]).ends_with("not \"wall_1_office_1_1\""));
        let text = read(&[NULL_NAME, "wall_1_office_1_1", "wall_x_office_1_1"]);
        assert!(text.starts_with("index 2: ") && text.contains("\"x\""), "{text}");
        let text = read(&[NULL_NAME, "beam_1_office_1_1", "beam_10_office_1_1"]);
        assert!(text.starts_with("index 2: beam_10_office_1_1 stands behind beam_1_office_1_1"), "{text}");
        let text = read(&[NULL_NAME, "beam_1_office_1_1", "beam_2_office_1_1", "beam_1_office_2_1"]);
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
