//! Room types and rooms.

use std::cmp::Ordering;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A room type: its place in a [`Taxonomy`](crate::Taxonomy), and its name. The constants are the 11 room
/// types of S3DIS. [`Taxonomy::room_type`](crate::Taxonomy::room_type) finds the room types of other
/// taxonomies.
///
/// `Ord` is alphabetical and ignores case, so `WC` is last. The published instance numbers run in this order.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct RoomType {
    index: u8,
    /// The place in [`RoomType::S3DIS`] of the type that it counts as. A larger number means none.
    s3dis: u8,
    /// A reference of one word, since there are many labels, and errors contain them.
    name: &'static &'static str,
}

/// The room in names if no room is known.
pub const UNKNOWN_ROOM: &str = "unknown_1";

/// A room of an area: its type, and its number among the rooms of that type in the area. Written `office_3`.
///
/// `Ord`: by type (see [`RoomType`]), then by number.
///
/// ```
/// use s3d_label::{Room, RoomError, RoomType};
///
/// let room: Room = "copyRoom_1".parse()?;
/// assert_eq!(room, Room { room_type: RoomType::COPY_ROOM, number: 1 });
/// assert!(matches!("kitchen_1".parse::<Room>(), Err(RoomError::Type { .. })));
/// # Ok::<(), RoomError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Room {
    /// The type of the room.
    pub room_type: RoomType,
    /// The number of the room, from 1.
    pub number: u32,
}

/// A word that is not a room type of the taxonomy.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{word:?} is no type of room; the types are {types}")]
pub struct UnknownRoomType {
    /// The word.
    pub word: String,
    /// The room types of the taxonomy, separated by blanks.
    pub types: String,
}

/// The reason why a word is not a room.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum RoomError {
    /// The word does not have two parts, joined by one underscore.
    #[error("{word:?} is no room: a room is a type and a number, as in \"office_3\"")]
    Form {
        /// The word.
        word: String,
    },
    /// The first part is not a room type.
    #[error("{word:?} is no room: {source}")]
    Type {
        /// The word.
        word: String,
        /// The error of the first part.
        source: UnknownRoomType,
    },
    /// The second part is not a number from 1.
    #[error("{word:?} is no room: {number:?} is no number from 1 without leading zeros")]
    Number {
        /// The word.
        word: String,
        /// The second part.
        number: String,
    },
}

macro_rules! s3dis {
    ($($constant:ident $index:literal $name:literal;)*) => {
        impl RoomType {
            $(
                #[doc = concat!("`", $name, "` of S3DIS.")]
                pub const $constant: Self = Self { index: $index, s3dis: $index, name: &$name };
            )*

            /// The types of S3DIS, each at its [`RoomType::index`].
            pub const S3DIS: [Self; 11] = [$(Self::$constant),*];
        }
    };
}

s3dis! {
    OFFICE 0 "office";
    CONFERENCE_ROOM 1 "conferenceRoom";
    HALLWAY 2 "hallway";
    AUDITORIUM 3 "auditorium";
    OPENSPACE 4 "openspace";
    LOBBY 5 "lobby";
    LOUNGE 6 "lounge";
    PANTRY 7 "pantry";
    COPY_ROOM 8 "copyRoom";
    STORAGE 9 "storage";
    WC 10 "WC";
}

impl RoomType {
    /// Makes the type at `index` of a taxonomy, which counts as the type of S3DIS at `s3dis`.
    pub(crate) const fn new(index: u8, s3dis: u8, name: &'static &'static str) -> Self {
        Self { index, s3dis, name }
    }

    /// Returns the spelling of the type in names of rooms: letters.
    pub const fn name(self) -> &'static str {
        self.name
    }

    /// Returns the place in the taxonomy, from 0.
    pub const fn index(self) -> usize {
        self.index as usize
    }

    /// Returns the type of S3DIS that it counts as, or `None` if none fits.
    pub fn s3dis(self) -> Option<Self> {
        Self::S3DIS.get(usize::from(self.s3dis)).copied()
    }
}

impl Ord for RoomType {
    fn cmp(&self, other: &Self) -> Ordering {
        letters(self)
            .cmp(letters(other))
            .then_with(|| rest(self).cmp(&rest(other)))
    }
}

fn letters(t: &RoomType) -> impl Iterator<Item = u8> {
    t.name.bytes().map(|b| b.to_ascii_lowercase())
}

fn rest(t: &RoomType) -> (&'static &'static str, u8, u8) {
    (t.name, t.index, t.s3dis)
}

impl PartialOrd for RoomType {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Debug for RoomType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl fmt::Display for RoomType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name)
    }
}

impl FromStr for RoomType {
    type Err = UnknownRoomType;

    /// Finds the type of S3DIS with exactly the name `word`.
    fn from_str(word: &str) -> Result<Self, UnknownRoomType> {
        find_type(&Self::S3DIS, word)
    }
}

/// Finds the type in `types` with exactly the name `word`.
pub(crate) fn find_type(types: &[RoomType], word: &str) -> Result<RoomType, UnknownRoomType> {
    types
        .iter()
        .copied()
        .find(|t| *t.name == word)
        .ok_or_else(|| UnknownRoomType {
            word: word.to_owned(),
            types: types.iter().map(|t| *t.name).collect::<Vec<_>>().join(" "),
        })
}

impl fmt::Display for Room {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}_{}", self.room_type, self.number)
    }
}

impl FromStr for Room {
    type Err = RoomError;

    /// Parses a room with a type of S3DIS.
    fn from_str(word: &str) -> Result<Self, RoomError> {
        parse_room(&RoomType::S3DIS, word)
    }
}

/// Parses a room with one of these types.
pub(crate) fn parse_room(types: &[RoomType], word: &str) -> Result<Room, RoomError> {
    let (room_type, number) = match word.split_once('_') {
        Some((room_type, number)) if !number.contains('_') => (room_type, number),
        _ => return Err(RoomError::Form { word: word.to_owned() }),
    };
    let room_type =
        find_type(types, room_type).map_err(|source| RoomError::Type { word: word.to_owned(), source })?;
    let number = number_from_digits(number)
        .ok_or_else(|| RoomError::Number { word: word.to_owned(), number: number.to_owned() })?;
    Ok(Room { room_type, number })
}

/// Parses a number in the only form that names allow: decimal, from 1, without sign and leading zeros.
pub(crate) fn number_from_digits(digits: &str) -> Option<u32> {
    let plain = digits.bytes().all(|b| b.is_ascii_digit()) && !digits.starts_with('0');
    if plain { digits.parse().ok() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_go_both_ways() {
        let names =
            "office conferenceRoom hallway auditorium openspace lobby lounge pantry copyRoom storage WC";
        assert_eq!(RoomType::S3DIS.map(RoomType::name).join(" "), names);
        for (i, room_type) in RoomType::S3DIS.into_iter().enumerate() {
            assert_eq!(room_type.index(), i);
            assert_eq!(room_type.to_string().parse(), Ok(room_type));
        }
        let message = "kitchen".parse::<RoomType>().unwrap_err().to_string();
        assert!(
            message.starts_with("\"kitchen\" is no type") && message.ends_with("storage WC"),
            "{message}"
        );
    }

    #[test]
    fn rooms_are_in_the_order_of_the_published_numbers() {
        let mut rooms: Vec<Room> =
            ["WC_1", "storage_2", "office_10", "office_9", "copyRoom_1", "conferenceRoom_3", "auditorium_1"]
                .iter()
                .map(|name| name.parse().unwrap())
                .collect();
        rooms.sort();
        let names: Vec<String> = rooms.iter().map(Room::to_string).collect();
        assert_eq!(
            names,
            ["auditorium_1", "conferenceRoom_3", "copyRoom_1", "office_9", "office_10", "storage_2", "WC_1"]
        );
    }

    #[test]
    fn only_one_spelling_is_a_room() {
        assert_eq!("WC_4294967295".parse(), Ok(Room { room_type: RoomType::WC, number: u32::MAX }));
        for (word, part) in [
            ("office", "as in"),
            ("office_3_5", "as in"),
            ("", "as in"),
            ("Office_3", "\"Office\""),
            ("office_0", "\"0\""),
            ("office_03", "\"03\""),
            ("office_+3", "\"+3\""),
            ("office_", "\"\""),
            ("office_3a", "\"3a\""),
            ("office_٣", "\"٣\""),
            ("office_4294967296", "\"4294967296\""),
        ] {
            let message = word.parse::<Room>().unwrap_err().to_string();
            assert!(message.contains(part) && message.contains(&format!("{word:?}")), "{message}");
        }
    }
}
