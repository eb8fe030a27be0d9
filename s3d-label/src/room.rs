//! The 11 types of rooms, and rooms.

use std::cmp::Ordering;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A type of room.
///
/// [`RoomType::ALL`] and [`RoomType::index`] follow the list of formats.md, "What is written". `Ord` follows
/// the names in the alphabet, whatever their case, so that `WC` is last: the order in which the published
/// instance numbers run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum RoomType {
    /// `office`
    Office,
    /// `conferenceRoom`
    ConferenceRoom,
    /// `hallway`
    Hallway,
    /// `auditorium`
    Auditorium,
    /// `openspace`
    Openspace,
    /// `lobby`
    Lobby,
    /// `lounge`
    Lounge,
    /// `pantry`
    Pantry,
    /// `copyRoom`
    CopyRoom,
    /// `storage`
    Storage,
    /// `WC`
    Wc,
}

/// A room of an area: its type and its number among the area's rooms of that type. Written `office_3`.
///
/// `Ord`: by type (see [`RoomType`]), then by number.
///
/// ```
/// use s3d_label::{Room, RoomError, RoomType};
///
/// let room: Room = "copyRoom_1".parse()?;
/// assert_eq!(room, Room { room_type: RoomType::CopyRoom, number: 1 });
/// assert!(matches!("kitchen_1".parse::<Room>(), Err(RoomError::Type { .. })));
/// # Ok::<(), RoomError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Room {
    /// What kind of room it is.
    pub room_type: RoomType,
    /// Its number, from 1.
    pub number: u32,
}

/// A word that should be a type of room and is none of the 11.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{word:?} is no type of room; the types are {valid}", valid = RoomType::ALL.map(RoomType::name).join(" "))]
pub struct UnknownRoomType {
    /// The word.
    pub word: String,
}

/// Why a word names no room.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum RoomError {
    /// It is not two words joined by one underscore.
    #[error("{word:?} is no room: a room is a type and a number, as in \"office_3\"")]
    Form {
        /// The word.
        word: String,
    },
    /// Its first half is no type of room.
    #[error("{word:?} is no room: {source}")]
    Type {
        /// The word.
        word: String,
        /// What is wrong with its first half.
        source: UnknownRoomType,
    },
    /// Its second half is no number from 1.
    #[error("{word:?} is no room: {number:?} is no number from 1 without leading zeros")]
    Number {
        /// The word.
        word: String,
        /// Its second half.
        number: String,
    },
}

impl RoomType {
    /// All types, each at its [`RoomType::index`].
    pub const ALL: [Self; 11] = [
        Self::Office,
        Self::ConferenceRoom,
        Self::Hallway,
        Self::Auditorium,
        Self::Openspace,
        Self::Lobby,
        Self::Lounge,
        Self::Pantry,
        Self::CopyRoom,
        Self::Storage,
        Self::Wc,
    ];

    /// The type as it is spelled in names.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Office => "office",
            Self::ConferenceRoom => "conferenceRoom",
            Self::Hallway => "hallway",
            Self::Auditorium => "auditorium",
            Self::Openspace => "openspace",
            Self::Lobby => "lobby",
            Self::Lounge => "lounge",
            Self::Pantry => "pantry",
            Self::CopyRoom => "copyRoom",
            Self::Storage => "storage",
            Self::Wc => "WC",
        }
    }

    /// The type that is spelled `word`, to the letter.
    pub fn from_name(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|room_type| room_type.name() == word)
    }

    /// Its place in [`RoomType::ALL`], 0 to 10.
    pub const fn index(self) -> usize {
        self as usize
    }
}

impl Ord for RoomType {
    fn cmp(&self, other: &Self) -> Ordering {
        let letters = |t: &Self| t.name().bytes().map(|b| b.to_ascii_lowercase());
        letters(self).cmp(letters(other))
    }
}

impl PartialOrd for RoomType {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Display for RoomType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for RoomType {
    type Err = UnknownRoomType;

    fn from_str(word: &str) -> Result<Self, UnknownRoomType> {
        Self::from_name(word).ok_or_else(|| UnknownRoomType { word: word.to_owned() })
    }
}

impl fmt::Display for Room {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}_{}", self.room_type, self.number)
    }
}

impl FromStr for Room {
    type Err = RoomError;

    fn from_str(word: &str) -> Result<Self, RoomError> {
        let (room_type, number) = match word.split_once('_') {
            Some((room_type, number)) if !number.contains('_') => (room_type, number),
            _ => return Err(RoomError::Form { word: word.to_owned() }),
        };
        let room_type =
            room_type.parse().map_err(|source| RoomError::Type { word: word.to_owned(), source })?;
        let number = number_from_digits(number)
            .ok_or_else(|| RoomError::Number { word: word.to_owned(), number: number.to_owned() })?;
        Ok(Self { room_type, number })
    }
}

/// The number that `digits` spell in the only way that names allow: from 1, decimal, no sign, no leading
/// zero.
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
        assert_eq!(RoomType::ALL.map(RoomType::name).join(" "), names);
        for (i, room_type) in RoomType::ALL.into_iter().enumerate() {
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
        assert_eq!("WC_4294967295".parse(), Ok(Room { room_type: RoomType::Wc, number: u32::MAX }));
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
