//! The statistics tables of the paper: instances of each class and rooms of each type, by area.

use crate::{Class, LabelTable, Room, RoomType};
use std::collections::{BTreeMap, BTreeSet};

/// The number of instances of each class, by area.
///
/// This is the paper's table of object classes. The paper counts every cell one higher than the published
/// labels do (the book's page on the paper, "Objects by class").
///
/// ```
/// use s3d_label::{Class, ClassCounts, LabelTable};
///
/// let names = ["chair_1_office_1_1", "chair_2_office_1_1", "chair_1_office_1_2"];
/// let table = LabelTable::from_labels(names.map(|name| name.parse().unwrap()))?;
/// let counts = ClassCounts::from_table(&table);
/// assert_eq!((counts.of(1, Class::CHAIR), counts.total()[Class::CHAIR.index()]), (2, 3));
/// # Ok::<(), s3d_label::TableError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ClassCounts {
    /// The areas with their counts, ascending by area. The counts have one entry per class of the taxonomy,
    /// at [`Class::index`].
    pub areas: Vec<(u32, Vec<u64>)>,
}

impl ClassCounts {
    /// Counts the labels of `table`.
    pub fn from_table(table: &LabelTable) -> Self {
        let classes = table.taxonomy().classes().len();
        let mut areas: BTreeMap<u32, Vec<u64>> = BTreeMap::new();
        for (_, label) in table.iter() {
            #[expect(clippy::indexing_slicing, reason = "there is a column for each class")]
            let count = &mut areas.entry(label.area).or_insert_with(|| vec![0; classes])[label.class.index()];
            *count += 1;
        }
        Self { areas: areas.into_iter().collect() }
    }

    /// Returns the number of instances of `class` in `area`, 0 for an area that is not in the table.
    pub fn of(&self, area: u32, class: Class) -> u64 {
        of(&self.areas, area, class.index())
    }

    /// Returns the number of instances of each class over all areas; empty if there is no area.
    pub fn total(&self) -> Vec<u64> {
        total(&self.areas)
    }
}

/// The number of rooms of each type, by area. Only rooms with at least one instance count.
///
/// This is the paper's table of rooms. The paper's total of area 5 (55) is not the sum of its row (68;
/// the book's page on the paper, "Rooms by type").
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RoomCounts {
    /// The areas with their counts, ascending by area. The counts have one entry per room type of the
    /// taxonomy, at [`RoomType::index`].
    pub areas: Vec<(u32, Vec<u64>)>,
}

impl RoomCounts {
    /// Counts the rooms of `table`.
    pub fn from_table(table: &LabelTable) -> Self {
        let rooms: BTreeSet<(u32, Room)> = table.iter().map(|(_, label)| (label.area, label.room)).collect();
        let types = table.taxonomy().room_types().len();
        let mut areas: BTreeMap<u32, Vec<u64>> = BTreeMap::new();
        for (area, room) in rooms {
            #[expect(clippy::indexing_slicing, reason = "there is a column for each type")]
            let count = &mut areas.entry(area).or_insert_with(|| vec![0; types])[room.room_type.index()];
            *count += 1;
        }
        Self { areas: areas.into_iter().collect() }
    }

    /// Returns the number of rooms of `room_type` in `area`, 0 for an area that is not in the table.
    pub fn of(&self, area: u32, room_type: RoomType) -> u64 {
        of(&self.areas, area, room_type.index())
    }

    /// Returns the number of rooms of each type over all areas; empty if there is no area.
    pub fn total(&self) -> Vec<u64> {
        total(&self.areas)
    }
}

fn of(areas: &[(u32, Vec<u64>)], area: u32, column: usize) -> u64 {
    areas
        .iter()
        .find(|(a, _)| *a == area)
        .and_then(|(_, counts)| counts.get(column))
        .copied()
        .unwrap_or(0)
}

fn total(areas: &[(u32, Vec<u64>)]) -> Vec<u64> {
    let mut total = vec![0; areas.first().map_or(0, |(_, counts)| counts.len())];
    for (_, counts) in areas {
        total.iter_mut().zip(counts).for_each(|(sum, n)| *sum += n);
    }
    total
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
        assert_eq!((classes.of(1, Class::CHAIR), classes.of(1, Class::WALL)), (2, 2));
        assert_eq!(
            (classes.of(5, Class::CHAIR), classes.of(5, Class::SOFA), classes.of(2, Class::WALL)),
            (1, 0, 0)
        );
        assert_eq!((classes.total()[Class::CHAIR.index()], classes.total().iter().sum::<u64>()), (3, 6));

        let rooms = RoomCounts::from_table(&table);
        assert_eq!((rooms.of(1, RoomType::OFFICE), rooms.of(5, RoomType::OFFICE)), (2, 1));
        assert_eq!((rooms.of(5, RoomType::WC), rooms.of(9, RoomType::WC)), (1, 0));
        assert_eq!((rooms.total()[RoomType::OFFICE.index()], rooms.total().iter().sum::<u64>()), (3, 4));
    }

    #[test]
    fn an_empty_table_has_no_areas() {
        assert_eq!(ClassCounts::from_table(&LabelTable::default()), ClassCounts::default());
        assert!(RoomCounts::from_table(&LabelTable::default()).total().is_empty());
    }
}
