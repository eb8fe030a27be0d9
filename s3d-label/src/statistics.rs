//! The paper's tables of what a data set holds: instances of each class and rooms of each type, by area.

use crate::{Class, LabelTable, Room, RoomType};
use std::collections::{BTreeMap, BTreeSet};

/// How many instances of each class each area holds.
///
/// The paper's table of object classes; it counts every cell one higher than the published labels do
/// (formats.md, "What is written").
///
/// ```
/// use s3d_label::{Class, ClassCounts, LabelTable};
///
/// let names = ["chair_1_office_1_1", "chair_2_office_1_1", "chair_1_office_1_2"];
/// let table = LabelTable::from_labels(names.map(|name| name.parse().unwrap()))?;
/// let counts = ClassCounts::from_table(&table);
/// assert_eq!((counts.of(1, Class::Chair), counts.total()[Class::Chair.index()]), (2, 3));
/// # Ok::<(), s3d_label::TableError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ClassCounts {
    /// Each area with its counts, by area; a count stands at its class's [`Class::index`].
    pub areas: Vec<(u32, [u64; 13])>,
}

impl ClassCounts {
    /// Counts the labels of `table`.
    pub fn from_table(table: &LabelTable) -> Self {
        let mut areas: BTreeMap<u32, [u64; 13]> = BTreeMap::new();
        for (_, label) in table.iter() {
            #[expect(clippy::indexing_slicing, reason = "there is a column for each class")]
            let count = &mut areas.entry(label.area).or_default()[label.class.index()];
            *count += 1;
        }
        Self { areas: areas.into_iter().collect() }
    }

    /// The instances of `class` in `area`, 0 in an area that the table does not know.
    pub fn of(&self, area: u32, class: Class) -> u64 {
        of(&self.areas, area, class.index())
    }

    /// The instances of each class over all areas.
    pub fn total(&self) -> [u64; 13] {
        total(&self.areas)
    }
}

/// How many rooms of each type each area holds: the rooms that have at least one instance.
///
/// The paper's table of rooms; its total of area 5 (55) is not the sum of its row (68; formats.md, "What is
/// written").
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RoomCounts {
    /// Each area with its counts, by area; a count stands at its type's [`RoomType::index`].
    pub areas: Vec<(u32, [u64; 11])>,
}

impl RoomCounts {
    /// Counts the rooms of `table`.
    pub fn from_table(table: &LabelTable) -> Self {
        let rooms: BTreeSet<(u32, Room)> = table.iter().map(|(_, label)| (label.area, label.room)).collect();
        let mut areas: BTreeMap<u32, [u64; 11]> = BTreeMap::new();
        for (area, room) in rooms {
            #[expect(clippy::indexing_slicing, reason = "there is a column for each type")]
            let count = &mut areas.entry(area).or_default()[room.room_type.index()];
            *count += 1;
        }
        Self { areas: areas.into_iter().collect() }
    }

    /// The rooms of `room_type` in `area`, 0 in an area that the table does not know.
    pub fn of(&self, area: u32, room_type: RoomType) -> u64 {
        of(&self.areas, area, room_type.index())
    }

    /// The rooms of each type over all areas.
    pub fn total(&self) -> [u64; 11] {
        total(&self.areas)
    }
}

fn of<const N: usize>(areas: &[(u32, [u64; N])], area: u32, column: usize) -> u64 {
    areas.iter().find(|(a, _)| *a == area).and_then(|(_, counts)| counts.get(column)).copied().unwrap_or(0)
}

fn total<const N: usize>(areas: &[(u32, [u64; N])]) -> [u64; N] {
    areas.iter().fold([0; N], |mut sum, (_, counts)| {
        sum.iter_mut().zip(counts).for_each(|(sum, n)| *sum += n);
        sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instances_and_rooms_are_counted_by_area() {
        let names = [
            "chair_1_office_2_1",
            "chair_2_office_2_1",
            "wall_1_office_2_1",
            "wall_2_office_3_1",
            "wall_1_WC_1_5",
            "chair_1_office_2_5",
        ];
        let table = LabelTable::from_labels(names.map(|name| name.parse().unwrap())).unwrap();
        let classes = ClassCounts::from_table(&table);
        assert_eq!(classes.areas.iter().map(|(area, _)| *area).collect::<Vec<_>>(), [1, 5]);
        assert_eq!((classes.of(1, Class::Chair), classes.of(1, Class::Wall)), (2, 2));
        assert_eq!(
            (classes.of(5, Class::Chair), classes.of(5, Class::Sofa), classes.of(2, Class::Wall)),
            (1, 0, 0)
        );
        assert_eq!((classes.total()[Class::Chair.index()], classes.total().iter().sum::<u64>()), (3, 6));
        let rooms = RoomCounts::from_table(&table);
        assert_eq!((rooms.of(1, RoomType::Office), rooms.of(5, RoomType::Office)), (2, 1));
        assert_eq!((rooms.of(5, RoomType::Wc), rooms.of(9, RoomType::Wc)), (1, 0));
        assert_eq!((rooms.total()[RoomType::Office.index()], rooms.total().iter().sum::<u64>()), (3, 4));
    }

    #[test]
    fn an_empty_table_has_no_areas() {
        assert_eq!(ClassCounts::from_table(&LabelTable::default()), ClassCounts::default());
        assert_eq!(RoomCounts::from_table(&LabelTable::default()).total(), [0; 11]);
    }
}
