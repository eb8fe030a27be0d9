//! Numbers the labels of both data sets together, by name.

use super::comparison::{ClassPair, ClassPixels, InstanceChange, LabelChanges, LabelCounts, LabelPairs};
use super::comparison::{NOTHING, Side, UNLABELLED};
use super::sides::Sides;
use crate::error::Result;
use s3d_label::{LabelId, LabelTable, NULL_NAME};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The most instances that are reported.
const MAX_INSTANCES: usize = 50;

/// The most pairs of classes that are reported for an image. All pairs of S3DIS's classes fit.
const MAX_PAIRS: usize = 256;

/// The number of the null label.
pub(crate) const NULL: u32 = 0;

/// The number for pixels that see nothing.
pub(crate) const MISSING: u32 = u32::MAX;

/// The labels of both data sets, numbered together: the null label first, then all others by name.
pub(crate) struct Names {
    names: Vec<String>,
    number_of: BTreeMap<String, u32>,
    a: Numbered,
    b: Numbered,
}

/// The labels of one data set.
struct Numbered {
    /// The number of each label, by its index in the data set's table.
    numbers: Vec<u32>,
    /// The class of each label, by number; `None` if the data set lacks the label.
    classes: Vec<Option<&'static str>>,
    /// The index of each label, by number; 0 if the data set lacks the label.
    indices: Vec<u32>,
}

impl Names {
    /// Reads both tables. Returns `None` if neither data set has labels, or a table cannot be read.
    pub(crate) fn read(sides: &Sides) -> Result<Option<Self>> {
        let mut tables = Vec::new();
        for (side, data) in sides.both() {
            let Some(table) = sides.keep(side, data.labels())? else { return Ok(None) };
            tables.push(table);
        }
        let [a, b] = &tables[..] else { return Ok(None) };
        Ok((a.is_some() || b.is_some()).then(|| Self::of_tables(a.as_ref(), b.as_ref())))
    }

    /// Numbers the labels of two tables.
    pub(crate) fn of_tables(a: Option<&LabelTable>, b: Option<&LabelTable>) -> Self {
        let mut number_of: BTreeMap<String, u32> = BTreeMap::new();
        number_of.extend(names_of(a).into_iter().map(|name| (name, 0)));
        number_of.extend(names_of(b).into_iter().map(|name| (name, 0)));
        number_of.insert(NULL_NAME.to_owned(), 0);

        let mut all = vec![NULL_NAME.to_owned()];
        for (name, number) in number_of.iter_mut().filter(|(name, _)| *name != NULL_NAME) {
            *number = all.len() as u32;
            all.push(name.clone());
        }

        let a = Numbered::new(a, &number_of);
        let b = Numbered::new(b, &number_of);
        Self { a, b, names: all, number_of }
    }

    fn of_side(&self, side: Side) -> &Numbered {
        match side {
            Side::A => &self.a,
            Side::B => &self.b,
        }
    }

    /// The number of the label at an index of a data set's table. `None` if the table is shorter.
    pub(crate) fn at(&self, side: Side, index: u32) -> Option<u32> {
        self.of_side(side).numbers.get(index as usize).copied()
    }

    /// The index of a numbered label in a data set's table. Labels that the table lacks have the null label's
    /// index.
    pub(crate) fn index(&self, side: Side, number: u32) -> u32 {
        self.of_side(side).indices.get(number as usize).copied().unwrap_or(NULL)
    }

    /// The number of labels of a data set, including the null label.
    pub(crate) fn count(&self, side: Side) -> usize {
        self.of_side(side).numbers.len()
    }

    /// Whether every index that both tables have stands for the same label.
    pub(crate) fn have_same_indices(&self) -> bool {
        self.a.numbers.iter().zip(&self.b.numbers).all(|(a, b)| a == b)
    }

    /// The number of the label with this name; `None` if the data set lacks it.
    pub(crate) fn number(&self, side: Side, name: &str) -> Option<u32> {
        let number = *self.number_of.get(name)?;
        self.has(side, number).then_some(number)
    }

    fn has(&self, side: Side, number: u32) -> bool {
        number == NULL
            || self
                .of_side(side)
                .classes
                .get(number as usize)
                .is_some_and(Option::is_some)
    }

    /// The class of a numbered label in a data set.
    fn class(&self, side: Side, number: u32) -> &'static str {
        match number {
            MISSING => NOTHING,
            _ => {
                let class = self.of_side(side).classes.get(number as usize).copied().flatten();
                class.unwrap_or(UNLABELLED)
            }
        }
    }

    /// Whether the label at index `a` of A's table and the label at index `b` of B's have the same class.
    pub(crate) fn have_same_class(&self, a: u32, b: u32) -> bool {
        let [a, b] = [(Side::A, a), (Side::B, b)]
            .map(|(side, index)| self.at(side, index).map(|number| self.class(side, number)));
        a == b
    }

    /// Counts an image's pixels with other labels, by class in A and in B. The most frequent pair comes
    /// first; there are at most 256 pairs.
    pub(crate) fn classes_of_image(&self, pairs: &LabelPairs) -> Vec<ClassPixels> {
        let mut by_class: BTreeMap<(&'static str, &'static str), u64> = BTreeMap::new();
        for (&(a, b), counts) in pairs {
            *by_class
                .entry((self.class(Side::A, a), self.class(Side::B, b)))
                .or_default() += counts.pixels;
        }

        let mut all: Vec<ClassPixels> = by_class
            .into_iter()
            .map(|((a, b), pixels)| ClassPixels { a, b, pixels })
            .collect();

        // The sort is stable, so the first by name wins a tie.
        all.sort_by_key(|pair| Reverse(pair.pixels));
        all.truncate(MAX_PAIRS);
        all
    }

    /// The names of the labels that one side has and the other has not.
    fn alone(&self, side: Side, other: Side) -> Vec<String> {
        let numbers = (1..self.names.len() as u32).filter(|n| self.has(side, *n) && !self.has(other, *n));
        numbers.map(|n| self.names[n as usize].clone()).collect()
    }

    /// The differences between the labels. `pairs` counts the surface and pixels with another label.
    pub(crate) fn changes(&self, pairs: &LabelPairs) -> LabelChanges {
        let [a, b] = [Side::A, Side::B].map(|side| self.count(side).saturating_sub(1) as u64);
        let mut changes = LabelChanges {
            a,
            b,
            added: self.alone(Side::B, Side::A),
            gone: self.alone(Side::A, Side::B),
            ..LabelChanges::default()
        };

        let mut matrix: BTreeMap<(&'static str, &'static str), LabelCounts> = BTreeMap::new();
        let mut instances: BTreeMap<u32, InstanceChange> = BTreeMap::new();
        for (&(a, b), &counts) in pairs {
            let class_a = self.class(Side::A, a);
            let class_b = self.class(Side::B, b);
            changes.changed += counts;
            *matrix.entry((class_a, class_b)).or_default() += counts;
            let of_class = if class_a == class_b {
                LabelCounts::default()
            } else {
                counts
            };
            changes.class_changed += of_class;
            for (number, is_lost) in [(a, true), (b, false)] {
                if number == NULL || number == MISSING {
                    continue;
                }
                let of = instances.entry(number).or_default();
                if is_lost {
                    of.lost += counts
                } else {
                    of.gained += counts
                }
                of.class_changed += of_class;
            }
        }

        changes.matrix = matrix
            .into_iter()
            .map(|((a, b), counts)| ClassPair { a, b, counts })
            .collect();

        // The sort is stable, so the first by name wins a tie.
        changes
            .matrix
            .sort_by_key(|pair| (pair.a == pair.b, Reverse(size(&pair.counts))));

        changes.instances = instances
            .into_iter()
            .map(|(n, change)| InstanceChange { name: self.names[n as usize].clone(), ..change })
            .collect();
        changes.instances.sort_by_key(|of| {
            let mut all = of.lost;
            all += of.gained;
            Reverse((size(&of.class_changed), size(&all)))
        });

        changes.instances.truncate(MAX_INSTANCES);
        changes
    }
}

/// The names of a table's labels; none without a table.
fn names_of(table: Option<&LabelTable>) -> Vec<String> {
    table.map(LabelTable::names).unwrap_or_default()
}

impl Numbered {
    /// The labels of a table under the numbers of both.
    fn new(table: Option<&LabelTable>, number_of: &BTreeMap<String, u32>) -> Self {
        let mut numbered = Self {
            numbers: Vec::new(),
            classes: vec![None; number_of.len()],
            indices: vec![NULL; number_of.len()],
        };
        for (index, name) in (0..).zip(names_of(table)) {
            let number = number_of[&name];
            numbered.numbers.push(number);
            numbered.indices[number as usize] = index;
            let class = table.and_then(|table| table.class_of(LabelId(index)));
            numbered.classes[number as usize] = class.map(|class| class.name());
        }
        numbered
    }
}

/// A key to sort counts by surface, then by pixels. Areas are finite and not negative, so their bits have the
/// same order.
fn size(counts: &LabelCounts) -> (u64, u64, u64) {
    (counts.m2.to_bits(), counts.pixels, counts.faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(names: &[&str]) -> LabelTable {
        LabelTable::from_labels(names.iter().map(|name| name.parse().unwrap())).unwrap()
    }

    fn counts(faces: u64, m2: f64, pixels: u64) -> LabelCounts {
        LabelCounts { faces, m2, pixels }
    }

    fn index(table: &LabelTable, name: &str) -> u32 {
        table.id_of(&name.parse().unwrap()).unwrap().0
    }

    #[test]
    fn labels_are_compared_by_name_whatever_their_index() {
        let a = table(&["chair_1_office_1_1", "chair_2_office_1_1", "wall_1_office_1_1"]);
        let b = table(&["chair_1_office_1_1", "table_1_office_1_1", "wall_1_office_1_1"]);
        let names = Names::of_tables(Some(&a), Some(&b));
        let wall = |side| names.number(side, "wall_1_office_1_1").unwrap();
        assert_eq!(wall(Side::A), wall(Side::B));
        assert_ne!(index(&a, "wall_1_office_1_1"), index(&b, "chair_1_office_1_1"));
        assert_eq!(names.at(Side::A, index(&a, "wall_1_office_1_1")), Some(wall(Side::B)));
        assert_eq!((names.at(Side::A, 4), names.number(Side::B, "chair_2_office_1_1")), (None, None));

        let [c1, c2] = ["chair_1_office_1_1", "chair_2_office_1_1"];
        let [c1, c2] = [c1, c2].map(|name| names.number(Side::A, name).unwrap());
        let t = names.number(Side::B, "table_1_office_1_1").unwrap();
        let pairs = LabelPairs::from([
            ((c2, t), counts(4, 0.5, 10)),
            ((c2, c1), counts(1, 2.0, 0)),
            ((NULL, c1), counts(2, 0.25, 3)),
            ((wall(Side::A), MISSING), counts(0, 0.0, 7)),
        ]);

        let changes = names.changes(&pairs);
        assert_eq!((changes.a, changes.b), (3, 3));
        assert_eq!(
            (&changes.gone[..], &changes.added[..]),
            (&["chair_2_office_1_1".to_owned()][..], &["table_1_office_1_1".to_owned()][..])
        );
        assert_eq!(changes.changed, counts(7, 2.75, 20));
        assert_eq!(changes.class_changed, counts(6, 0.75, 20));

        let of_image = names.classes_of_image(&pairs);
        let of_image: Vec<_> = of_image.iter().map(|p| (p.a, p.b, p.pixels)).collect();
        assert_eq!(of_image[..2], [("chair", "table", 10), ("wall", NOTHING, 7)]);
        let matrix: Vec<_> = changes.matrix.iter().map(|p| (p.a, p.b, p.counts.pixels)).collect();
        let expected =
            [("chair", "table", 10), (UNLABELLED, "chair", 3), ("wall", NOTHING, 7), ("chair", "chair", 0)];
        assert_eq!(matrix, expected);

        let first = &changes.instances[0];
        // The chair and the table lost and gained the same; in all, the chair has changed more.
        assert_eq!((first.name.as_str(), first.lost), ("chair_2_office_1_1", counts(5, 2.5, 10)));
        assert_eq!((first.gained, first.class_changed), (counts(0, 0.0, 0), counts(4, 0.5, 10)));
        assert_eq!(changes.instances.len(), 4);
    }

    #[test]
    fn one_without_labels_has_the_null_label_alone() {
        let a = table(&["chair_1_office_1_1"]);
        let names = Names::of_tables(Some(&a), None);
        assert_eq!(names.changes(&LabelPairs::new()).gone, ["chair_1_office_1_1"]);
        assert_eq!((names.at(Side::B, 0), names.count(Side::B)), (None, 0));
    }
}
