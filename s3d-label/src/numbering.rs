//! Numbers instances per area. An annotated tree numbers them per room.

use crate::{Class, Label, Room};
use std::collections::BTreeMap;
use thiserror::Error;

/// An annotated instance with its label.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NumberedInstance {
    /// The room of the instance.
    pub room: Room,
    /// The class of the instance.
    pub class: Class,
    /// The number among the instances of this class in the room: the 3 of `chair_3.txt`.
    pub number_in_room: u32,
    /// The label, with the number among the instances of this class in the area.
    pub label: Label,
}

/// The reason why instances cannot be numbered.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum NumberingError {
    /// Two instances of a room have the same class and number.
    #[error("area {area}, room {room}: {class}_{number_in_room} is there twice")]
    Duplicate {
        /// The area.
        area: u32,
        /// The room.
        room: Room,
        /// The class of both.
        class: Class,
        /// The number of both.
        number_in_room: u32,
    },
}

/// Gives a label to each instance of an area. An instance is its room, its class and its number in the room.
///
/// Instance numbers run per class over the area, from 1 without gaps. They follow the order of the rooms (by
/// type, then by number; see [`RoomType`](crate::RoomType)), and within a room the number there. Areas 1 to 4
/// of the published table are numbered exactly so. In area 5, which was joined from 5a and 5b, and in area 6,
/// a few rooms are at other places.
///
/// The result is sorted by room, class and number in the room, whatever the order of the input. Source:
/// `s3d_io::formats`, "What is written".
///
/// # Errors
/// [`NumberingError::Duplicate`] if an instance is there twice.
///
/// ```
/// use s3d_label::{Class, number_area};
///
/// let room = |name: &str| name.parse().unwrap();
/// let found = [(room("office_2"), Class::CHAIR, 1), (room("lobby_1"), Class::CHAIR, 4)];
/// let labels = number_area(3, found)?.iter().map(|i| i.label.to_string()).collect::<Vec<_>>();
/// assert_eq!(labels, ["chair_1_lobby_1_3", "chair_2_office_2_3"]);
/// # Ok::<(), s3d_label::NumberingError>(())
/// ```
pub fn number_area(
    area: u32,
    instances: impl IntoIterator<Item = (Room, Class, u32)>,
) -> Result<Vec<NumberedInstance>, NumberingError> {
    let mut instances: Vec<(Room, Class, u32)> = instances.into_iter().collect();
    instances.sort_unstable();
    if let Some(&[(room, class, number_in_room), _]) = instances.array_windows().find(|[a, b]| a == b) {
        return Err(NumberingError::Duplicate { area, room, class, number_in_room });
    }

    let mut last: BTreeMap<Class, u32> = BTreeMap::new();
    Ok(instances
        .into_iter()
        .map(|(room, class, number_in_room)| {
            let instance = last.entry(class).or_default();
            *instance += 1;
            let label = Label { class, instance: *instance, room, area };
            NumberedInstance { room, class, number_in_room, label }
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RoomType;
    use proptest::prelude::*;

    fn room(name: &str) -> Room {
        name.parse().unwrap()
    }

    #[test]
    fn numbers_run_through_the_rooms() {
        let found = number_area(
            3,
            [
                (room("WC_1"), Class::WALL, 1),
                (room("office_10"), Class::WALL, 2),
                (room("office_10"), Class::CHAIR, 7),
                (room("office_2"), Class::WALL, 12),
                (room("office_2"), Class::WALL, 4),
            ],
        )
        .unwrap();
        let names: Vec<(u32, String)> =
            found.iter().map(|i| (i.number_in_room, i.label.to_string())).collect();
        let expected = [
            (4, "wall_1_office_2_3"),
            (12, "wall_2_office_2_3"),
            (2, "wall_3_office_10_3"),
            (7, "chair_1_office_10_3"),
            (1, "wall_4_WC_1_3"),
        ];
        assert_eq!(names, expected.map(|(number, name)| (number, name.to_owned())));
    }

    #[test]
    fn an_instance_twice_is_an_error() {
        let chair = (room("office_2"), Class::CHAIR, 3);
        let message = number_area(6, [chair, (room("office_2"), Class::WALL, 3), chair]).unwrap_err();
        assert_eq!(message.to_string(), "area 6, room office_2: chair_3 is there twice");
        assert_eq!(number_area(6, []), Ok(vec![]));
    }

    proptest! {
        #[test]
        fn no_gaps_and_no_dependence_on_order(
            raw in prop::collection::btree_set((0usize..11, 1u32..4, 0usize..13, 1u32..20), 0..60),
            turn in 0usize..60,
        ) {
            let mut input: Vec<(Room, Class, u32)> = raw
                .into_iter()
                .map(|(t, number, c, n)| (Room { room_type: RoomType::S3DIS[t], number }, Class::S3DIS[c], n))
                .collect();
            let found = number_area(1, input.iter().copied()).unwrap();
            let turn = turn % input.len().max(1);
            input.rotate_left(turn);
            input.reverse();
            prop_assert_eq!(&number_area(1, input.iter().copied()).unwrap(), &found);

            prop_assert_eq!(found.len(), input.len());
            let mut by_class: BTreeMap<Class, Vec<u32>> = BTreeMap::new();
            for i in &found {
                prop_assert!(input.contains(&(i.room, i.class, i.number_in_room)));
                prop_assert_eq!((i.label.room, i.label.class, i.label.area), (i.room, i.class, 1));
                by_class.entry(i.class).or_default().push(i.label.instance);
            }
            for numbers in by_class.values() {
                prop_assert!(numbers.iter().copied().eq(1..=numbers.len() as u32));
            }
        }
    }
}
