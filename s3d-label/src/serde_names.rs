//! Names as data: what is written as a word, and read back from it.

use crate::{Class, Label, LabelTable, Room, RoomType, Taxonomy};
use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};
use std::cell::RefCell;
use std::fmt;

thread_local! {
    /// What names are read by in this thread; the last is the innermost call's.
    static TAXONOMIES: RefCell<Vec<Taxonomy>> = const { RefCell::new(Vec::new()) };
}

/// Takes the last taxonomy away again, also if reading panics.
struct Scope;

impl Drop for Scope {
    fn drop(&mut self) {
        TAXONOMIES.with_borrow_mut(Vec::pop);
    }
}

impl Taxonomy {
    /// Reads data with `serde`, in which names of classes, rooms and labels are this taxonomy's. Outside of
    /// such a call they are S3DIS's: data formats hand a reader nothing but the data.
    pub fn reading<T>(&self, read: impl FnOnce() -> T) -> T {
        TAXONOMIES.with_borrow_mut(|all| all.push(self.clone()));
        let _scope = Scope;
        read()
    }
}

/// What names are read by.
pub(crate) fn taxonomy() -> Taxonomy {
    TAXONOMIES.with_borrow(|all| all.last().cloned()).unwrap_or_default()
}

/// Reads a word that a `T` is parsed from.
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
