//! Numbers the labels of both data sets together, by name.

use super::comparison::{ClassPair, ClassPixels, LabelChanges, LabelCounts, LabelPairs};
use super::comparison::{NOTHING, Side, UNLABELLED};
use super::instances;
use super::matching::{Matching, SharedSurface};
use super::sides::Sides;
use crate::error::Result;
use s3d_label::{LabelId, LabelTable, NULL_NAME, pretty_color};
use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

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
    matching: Matching,
}

/// How the label of a face or pixel differs in A and in B.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// The same label.
    None,
    /// The same instance of the same class under another name.
    Renumbered,
    /// Another instance of the same class.
    Instance,
    /// Another class.
    Class,
}

impl Change {
    /// Whether the face or pixel belongs to something else. Another name of the same instance is no change.
    pub(crate) fn is_true(self) -> bool {
        matches!(self, Self::Instance | Self::Class)
    }
}

/// The labels of one data set.
struct Numbered {
    /// The number of each label, by its index in the data set's table.
    numbers: Vec<u32>,
    /// The class of each label, by number; `None` if the data set lacks the label.
    classes: Vec<Option<&'static str>>,
    /// The index of each label, by number; 0 if the data set lacks the label.
    indices: Vec<u32>,
    /// The number of each label, by its colour in pretty images; `None` if several have the colour.
    by_color: HashMap<[u8; 3], Option<u32>>,
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
        let matching = Matching::by_name(all.len(), |number| a.has(number) && b.has(number));
        Self { a, b, names: all, number_of, matching }
    }

    /// Matches the instances of an area by the surface that they share on A's mesh and on B's.
    pub(crate) fn match_area(&mut self, on_a: &SharedSurface, on_b: &SharedSurface) {
        let Self { a, b, matching, .. } = self;
        let is_in_both = |number| a.has(number) && b.has(number);
        let is_one_class = |of_a, of_b| a.class(of_a) == b.class(of_b);
        matching.match_area([on_a, on_b], is_in_both, is_one_class);
    }

    pub(crate) fn matching(&self) -> &Matching {
        &self.matching
    }

    /// How two numbered labels of a face or pixel differ, the first in A and the second in B.
    pub(crate) fn change(&self, a: u32, b: u32) -> Change {
        let is_one_class = self.class(Side::A, a) == self.class(Side::B, b);
        let is_same = match self.matching.partner(Side::A, a) {
            Some(partner) => partner == b,
            None => a == b && (a == NULL || a == MISSING),
        };
        match (is_one_class, is_same) {
            (true, true) if a == b => Change::None,
            (true, true) => Change::Renumbered,
            (true, false) => Change::Instance,
            (false, _) => Change::Class,
        }
    }

    /// The numbers of all labels but the null label.
    pub(crate) fn numbers(&self) -> Range<u32> {
        1..self.names.len() as u32
    }

    /// The name of a numbered label.
    pub(crate) fn name(&self, number: u32) -> &str {
        self.names.get(number as usize).map_or("", String::as_str)
    }

    /// The number of the label with a colour of pretty images. `None` if none has it, or several.
    pub(crate) fn of_color(&self, side: Side, color: [u8; 3]) -> Option<u32> {
        self.of_side(side).by_color.get(&color).copied().flatten()
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

    pub(crate) fn has(&self, side: Side, number: u32) -> bool {
        self.of_side(side).has(number)
    }

    /// The class of a numbered label in a data set.
    pub(crate) fn class(&self, side: Side, number: u32) -> &'static str {
        self.of_side(side).class(number)
    }

    /// Whether the label at index `a` of A's table and the label at index `b` of B's have the same class.
    pub(crate) fn have_same_class(&self, a: u32, b: u32) -> bool {
        let [a, b] = [(Side::A, a), (Side::B, b)]
            .map(|(side, index)| self.at(side, index).map(|number| self.class(side, number)));
        a == b
    }

    /// Counts an image's pixels that changed, by class in A and in B. The most frequent pair comes first;
    /// there are at most 256 pairs.
    pub(crate) fn classes_of_image(&self, pairs: &LabelPairs) -> Vec<ClassPixels> {
        let mut by_class: BTreeMap<(&'static str, &'static str), u64> = BTreeMap::new();
        for (&(a, b), counts) in pairs.iter().filter(|((a, b), _)| self.change(*a, *b).is_true()) {
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

    /// The names of a side's labels that have no partner on the other side.
    fn alone(&self, side: Side) -> Vec<String> {
        self.numbers()
            .filter(|n| self.has(side, *n) && self.matching.partner(side, *n).is_none())
            .map(|n| self.name(n).to_owned())
            .collect()
    }

    /// For each label of B's table, the index in A's table of the same instance.
    fn partners_of_b(&self) -> Vec<Option<u32>> {
        let partner = |number: &u32| match *number {
            NULL => Some(NULL),
            number => Some(self.index(Side::A, self.matching.partner(Side::B, number)?)),
        };
        self.b.numbers.iter().map(partner).collect()
    }

    /// The differences between the labels. `pairs` counts the surface and pixels whose labels differ.
    pub(crate) fn changes(&self, pairs: &LabelPairs) -> LabelChanges {
        let [a, b] = [Side::A, Side::B].map(|side| self.count(side).saturating_sub(1) as u64);
        let mut changes = LabelChanges {
            a,
            b,
            added: self.alone(Side::B),
            gone: self.alone(Side::A),
            instances: instances::changes(self, pairs),
            partners_of_b: self.partners_of_b(),
            ..LabelChanges::default()
        };
        (changes.renumbered, changes.other_room) = instances::renamed(self, pairs);

        let mut matrix: BTreeMap<(&'static str, &'static str), LabelCounts> = BTreeMap::new();
        for (&(a, b), &counts) in pairs {
            let change = self.change(a, b);
            if change.is_true() {
                changes.changed += counts;
                let classes = (self.class(Side::A, a), self.class(Side::B, b));
                *matrix.entry(classes).or_default() += counts;
            }
            if change == Change::Class {
                changes.class_changed += counts;
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
            by_color: HashMap::new(),
        };
        for (index, name) in (0..).zip(names_of(table)) {
            let number = number_of[&name];
            numbered.numbers.push(number);
            numbered.indices[number as usize] = index;
            let class = table.and_then(|table| table.class_of(LabelId(index)));
            numbered.classes[number as usize] = class.map(|class| class.name());
            let of_color = numbered.by_color.entry(pretty_color(index));
            of_color.and_modify(|of| *of = None).or_insert(Some(number));
        }
        numbered
    }

    fn has(&self, number: u32) -> bool {
        number == NULL || self.classes.get(number as usize).is_some_and(Option::is_some)
    }

    fn class(&self, number: u32) -> &'static str {
        match number {
            MISSING => NOTHING,
            _ => self
                .classes
                .get(number as usize)
                .copied()
                .flatten()
                .unwrap_or(UNLABELLED),
        }
    }
}

/// A key to sort counts by surface, then by pixels. Areas are finite and not negative, so their bits have the
/// same order.
pub(crate) fn size(counts: &LabelCounts) -> (u64, u64, u64) {
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
    }

    #[test]
    fn one_without_labels_has_the_null_label_alone() {
        let a = table(&["chair_1_office_1_1"]);
        let names = Names::of_tables(Some(&a), None);
        assert_eq!(names.changes(&LabelPairs::new()).gone, ["chair_1_office_1_1"]);
        assert_eq!((names.at(Side::B, 0), names.count(Side::B)), (None, 0));
    }
}
