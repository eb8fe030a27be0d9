//! Names as data: classes, rooms and labels are written as words and read back.

use crate::{Class, Label, LabelTable, Room, RoomType, Taxonomy};
use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};
use std::cell::RefCell;
use std::fmt;

thread_local! {
    /// The taxonomies by which this thread reads names. The last one belongs to the innermost call.
    static TAXONOMIES: RefCell<Vec<Taxonomy>> = const { RefCell::new(Vec::new()) };
}

/// Removes the last taxonomy when it is dropped, also if reading panics.
struct Scope;

impl Drop for Scope {
    fn drop(&mut self) {
        TAXONOMIES.with_borrow_mut(Vec::pop);
    }
}

impl Taxonomy {
    /// Reads data with `serde` whose classes, rooms and labels belong to this taxonomy. Outside of such a
    /// call, they belong to S3DIS, since a data format gives a reader nothing but the data.
    pub fn reading<T>(&self, read: impl FnOnce() -> T) -> T {
        TAXONOMIES.with_borrow_mut(|all| all.push(self.clone()));
        let _scope = Scope;
        read()
    }
}

/// Returns the taxonomy by which names are read now.
pub(crate) fn taxonomy() -> Taxonomy {
    TAXONOMIES.with_borrow(|all| all.last().cloned()).unwrap_or_default()
}

/// A visitor that reads a word and parses it.
struct Word<F> {
    expecting: &'static str,
    parse: F,
}

impl<T, X: fmt::Display, F: FnOnce(&str) -> Result<T, X>> Visitor<'_> for Word<F> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.expecting)
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<T, E> {
        (self.parse)(word).map_err(E::custom)
    }
}

macro_rules! as_word {
    ($($name:ty, $expecting:literal, $parse:expr;)*) => {$(
        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let parse = |word: &str| $parse(&taxonomy(), word);
                deserializer.deserialize_str(Word { expecting: $expecting, parse })
            }
        }
    )*};
}

as_word! {
    Class, "a class such as \"chair\"", Taxonomy::class;
    RoomType, "a type of room such as \"office\"", Taxonomy::room_type;
    Room, "a room such as \"office_3\"", Taxonomy::room;
    Label, "a label such as \"chair_3_office_5_1\"", Taxonomy::label;
}

impl Serialize for LabelTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.names())
    }
}

impl<'de> Deserialize<'de> for LabelTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        taxonomy()
            .table_from_names(&Vec::<String>::deserialize(deserializer)?)
            .map_err(D::Error::custom)
    }
}
