//! Labels of instances and their names.

use crate::room::number_from_digits;
use crate::{Class, Room, Taxonomy, UnknownClass, UnknownRoomType};
use std::cmp::Ordering;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// The name of the null label, which stands for "no class". It has index 0 in every label table.
pub const NULL_NAME: &str = "<UNK>_0_<UNK>_0_0";

/// One instance of a class in an area, written `class_instanceNum_roomType_roomNum_areaNum`, as in
/// `board_3_hallway_4_6`. Source: `s3d_io::formats`, "What is written".
///
/// `Ord` is the published order: by (`class_instanceNum_`, `areaNum`) as strings, with the underscore, so
/// `beam_10_…` comes before `beam_1_…`. Then by room, which only matters for two labels of the same
/// instance.
///
/// ```
/// use s3d_label::{Class, Label, LabelError};
///
/// let label: Label = "board_3_hallway_4_6".parse()?;
/// assert_eq!((label.class, label.instance, label.area), (Class::BOARD, 3, 6));
/// assert_eq!(
///     (label.room.to_string(), label.to_string()), ("hallway_4".into(), "board_3_hallway_4_6".into())
/// );
/// assert!(matches!("board_3_hallway_4".parse::<Label>(), Err(LabelError::Fields { count: 4, .. })));
/// # Ok::<(), LabelError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Label {
    /// The class of the instance.
    pub class: Class,
    /// The number among the instances of this class in the area, from 1.
    pub instance: u32,
    /// The room of the instance.
    pub room: Room,
    /// The area, from 1. Areas 5a and 5b are both 5.
    pub area: u32,
}

/// The reason why a word is not a label.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum LabelError {
    /// The word does not have five fields.
    #[error(
        "{name:?} is no label: it has {count} fields between underscores, not the five of \
         class_instance_roomType_room_area"
    )]
    Fields {
        /// The word.
        name: String,
        /// The number of fields.
        count: usize,
    },
    /// The first field is not a class.
    #[error("{name:?} is no label: {source}")]
    Class {
        /// The word.
        name: String,
        /// The error of the field.
        source: UnknownClass,
    },
    /// The third field is not a room type.
    #[error("{name:?} is no label: {source}")]
    RoomType {
        /// The word.
        name: String,
        /// The error of the field.
        source: UnknownRoomType,
    },
    /// A field is not a number.
    #[error("{name:?} is no label: its {field} {word:?} is no number from 1 without leading zeros")]
    Number {
        /// The word.
        name: String,
        /// The field: "instance", "room" or "area".
        field: &'static str,
        /// The content of the field.
        word: String,
    },
    /// The word is the null label, but the label of an instance is needed.
    #[error("{NULL_NAME:?} is the null label: it names no instance")]
    Null,
}

/// Parses the name of a label of S3DIS. Returns `None` for the null label ([`NULL_NAME`]).
/// [`Taxonomy::parse_name`] is for other taxonomies.
///
/// # Errors
/// [`LabelError`] names the field that is wrong.
///
/// ```
/// use s3d_label::{Class, NULL_NAME, parse_name};
/// assert_eq!(parse_name("chair_3_office_5_1").unwrap().unwrap().class, Class::CHAIR);
/// assert_eq!(parse_name(NULL_NAME), Ok(None));
/// assert!(parse_name("chair_3_office_5").is_err());
/// ```
pub fn parse_name(name: &str) -> Result<Option<Label>, LabelError> {
    Taxonomy::s3dis().parse_name(name)
}

impl Taxonomy {
    /// Parses the name of a label with the classes and room types of this taxonomy. Returns `None` for the
    /// null label ([`NULL_NAME`]).
    ///
    /// # Errors
    /// [`LabelError`] names the field that is wrong.
    pub fn parse_name(&self, name: &str) -> Result<Option<Label>, LabelError> {
        if name == NULL_NAME {
            return Ok(None);
        }

        let fields: Vec<&str> = name.split('_').collect();
        let &[class, instance, room_type, room, area] = fields.as_slice() else {
            return Err(LabelError::Fields { name: name.to_owned(), count: fields.len() });
        };

        let number = |field, word: &str| {
            number_from_digits(word).ok_or_else(|| LabelError::Number {
                name: name.to_owned(),
                field,
                word: word.to_owned(),
            })
        };
        let class = self
            .class(class)
            .map_err(|source| LabelError::Class { name: name.to_owned(), source })?;
        let instance = number("instance", instance)?;
        let room_type = self
            .room_type(room_type)
            .map_err(|source| LabelError::RoomType { name: name.to_owned(), source })?;
        let room = Room { room_type, number: number("room", room)? };
        Ok(Some(Label { class, instance, room, area: number("area", area)? }))
    }
}

impl Label {
    /// Compares two instances by the published order. The result is equal for labels of the same instance,
    /// even if their rooms differ.
    pub(crate) fn cmp_key(&self, other: &Self) -> Ordering {
        (class_bytes(self).cmp(class_bytes(other)))
            .then_with(|| instance_digits(self).as_bytes().cmp(instance_digits(other).as_bytes()))
            .then_with(|| area_digits(self).as_bytes().cmp(area_digits(other).as_bytes()))
    }
}

fn instance_digits(label: &Label) -> Digits {
    Digits::new(label.instance, Some(b'_'))
}

fn area_digits(label: &Label) -> Digits {
    Digits::new(label.area, None)
}

/// Returns the name of the class and an underscore. The underscore matters if one name is the start of the
/// other: `shower_` and `showerCurtain_`.
fn class_bytes(label: &Label) -> impl Iterator<Item = u8> {
    label.class.name().bytes().chain([b'_'])
}

impl Ord for Label {
    fn cmp(&self, other: &Self) -> Ordering {
        self.cmp_key(other).then_with(|| self.room.cmp(&other.room))
    }
}

impl PartialOrd for Label {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}_{}_{}_{}", self.class, self.instance, self.room, self.area)
    }
}

impl FromStr for Label {
    type Err = LabelError;

    /// Parses like [`parse_name`], but the null label is an error.
    fn from_str(name: &str) -> Result<Self, LabelError> {
        parse_name(name)?.ok_or(LabelError::Null)
    }
}

/// The decimal digits of a number, without an allocation. Labels are compared as strings, and often.
struct Digits {
    bytes: [u8; 11],
    start: usize,
}

impl Digits {
    /// Writes the digits of `number`, then `last`.
    fn new(mut number: u32, last: Option<u8>) -> Self {
        let mut bytes = [0; 11];
        let mut start = bytes.len();
        let mut places = bytes.iter_mut().rev();
        // There is room for ten digits and the last byte.
        let mut put = |byte| {
            if let Some(place) = places.next() {
                *place = byte;
                start -= 1;
            }
        };
        if let Some(byte) = last {
            put(byte);
        }
        loop {
            put(b'0' + (number % 10) as u8);
            number /= 10;
            if number == 0 {
                break;
            }
        }
        Self { bytes, start }
    }

    fn as_bytes(&self) -> &[u8] {
        self.bytes.get(self.start..).unwrap_or_default()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::RoomType;
    use proptest::prelude::*;

    /// Makes mostly small numbers, so that strings share their starts and instances repeat.
    fn any_number() -> impl Strategy<Value = u32> {
        prop_oneof![4 => 1u32..130, 1 => 1u32..]
    }

    pub(crate) fn any_label() -> impl Strategy<Value = Label> {
        (0usize..13, any_number(), 0usize..11, any_number(), any_number()).prop_map(
            |(class, instance, room_type, number, area)| {
                let room = Room { room_type: RoomType::S3DIS[room_type], number };
                Label { class: Class::S3DIS[class], instance, room, area }
            },
        )
    }

    #[test]
    fn a_name_goes_both_ways() {
        let label = parse_name("board_3_hallway_4_6").unwrap().unwrap();
        let room = Room { room_type: RoomType::HALLWAY, number: 4 };
        assert_eq!(label, Label { class: Class::BOARD, instance: 3, room, area: 6 });
        assert_eq!(label.to_string(), "board_3_hallway_4_6");
    }

    #[test]
    fn the_null_label_is_no_instance() {
        assert_eq!(parse_name(NULL_NAME), Ok(None));
        assert_eq!(NULL_NAME.parse::<Label>(), Err(LabelError::Null));
    }

    #[test]
    fn each_field_can_be_wrong() {
        for (name, part) in [
            ("board_3_hallway_4", "4 fields"),
            ("board_3_conference_room_4_6", "6 fields"),
            ("", "1 fields"),
            ("stairs_3_hallway_4_6", "\"stairs\" is no class"),
            ("board_0_hallway_4_6", "instance \"0\""),
            ("board_03_hallway_4_6", "instance \"03\""),
            ("board_3_corridor_4_6", "\"corridor\" is no type of room"),
            ("board_3_hallway_x_6", "room \"x\""),
            ("board_3_hallway_4_5a", "area \"5a\""),
            ("board_3_hallway_4_", "area \"\""),
            ("<UNK>_1_<UNK>_0_0", "\"<UNK>\" is no class"),
        ] {
            let message = parse_name(name).unwrap_err().to_string();
            assert!(message.contains(part) && message.starts_with(&format!("{name:?}")), "{message}");
        }
    }

    fn key(l: &Label) -> (String, String, Room) {
        (format!("{}_{}_", l.class, l.instance), l.area.to_string(), l.room)
    }

    proptest! {
        #[test]
        fn every_label_survives_its_name(label in any_label()) {
            prop_assert_eq!(parse_name(&label.to_string()), Ok(Some(label)));
        }

        #[test]
        fn any_text_gives_a_label_or_an_error(text in "[a-z<>UNKW_0-9]{0,30}") {
            if let Ok(Some(label)) = parse_name(&text) {
                prop_assert_eq!(label.to_string(), text);
            }
        }

        #[test]
        fn order_is_that_of_the_strings(a in any_label(), b in any_label(), same in 0..3) {
            let b = if same > 0 { Label { class: a.class, ..b } } else { b };
            let b = if same > 1 { Label { instance: a.instance, ..b } } else { b };
            prop_assert_eq!(a.cmp(&b), key(&a).cmp(&key(&b)));
        }
    }
}
