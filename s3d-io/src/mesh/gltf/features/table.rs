//! Reads the classes and numbers of features in the property tables of EXT_structural_metadata.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::fs::quote::quote;
use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::packed::unpack::whole;
use crate::mesh::gltf::words::{CLASS_KEYS, INSTANCE_KEYS, ROOM_KEYS, index_of};
use gltf::json::Index;
use serde_json::{Map, Value};
use std::collections::HashMap;

/// The error is a sentence that names the table and the property.
type SentenceResult<T> = Result<T, String>;

/// A property table that tells classes. Its values are read row by row.
#[derive(Debug)]
pub(crate) struct Table<'a> {
    pub(crate) rows: usize,
    class: Words<'a>,
    room: Option<Words<'a>>,
    instance: Option<Numbers<'a>>,
}

/// A property whose values are words.
#[derive(Debug)]
struct Words<'a> {
    /// The name in messages.
    who: String,
    stored: Stored<'a>,
    /// The word that stands for a missing one.
    no_data: Option<&'a str>,
    /// The word of features that have none.
    default: Option<&'a str>,
}

/// How words are stored.
#[derive(Debug)]
enum Stored<'a> {
    /// Not at all: all features have the default.
    Nowhere,
    /// As texts, one after the other, and the offsets at which they start and end.
    Texts { texts: &'a [u8], offsets: Numbers<'a> },
    /// As the numbers of an enum.
    Enum { numbers: Numbers<'a>, names: HashMap<i128, &'a str> },
}

/// Numbers without gaps.
#[derive(Debug)]
struct Numbers<'a> {
    bytes: &'a [u8],
    kind: Integer,
    /// The number that stands for a missing one.
    no_data: Option<i128>,
}

/// A kind of whole numbers.
#[derive(Clone, Copy, Debug)]
enum Integer {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
}

impl Integer {
    /// Returns the kind that the schema calls `name`.
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "INT8" => Self::I8,
            "UINT8" => Self::U8,
            "INT16" => Self::I16,
            "UINT16" => Self::U16,
            "INT32" => Self::I32,
            "UINT32" => Self::U32,
            "INT64" => Self::I64,
            "UINT64" => Self::U64,
            _ => return None,
        })
    }

    /// Returns how many bytes a number has.
    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 => 4,
            Self::I64 | Self::U64 => 8,
        }
    }

    /// Reads the number at the start of `bytes`.
    fn read(self, bytes: &[u8]) -> Option<i128> {
        Some(match self {
            Self::I8 => i8::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U8 => u8::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::I16 => i16::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U16 => u16::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::I32 => i32::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U32 => u32::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::I64 => i64::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U64 => u64::from_le_bytes(*bytes.first_chunk()?).into(),
        })
    }
}

impl Numbers<'_> {
    /// Returns a number, or `None` beyond the last one.
    fn get(&self, index: usize) -> Option<i128> {
        let start = index.checked_mul(self.kind.size())?;
        self.kind.read(self.bytes.get(start..)?)
    }

    /// Returns a number as the offset of a text.
    fn offset(&self, index: usize) -> Option<usize> {
        usize::try_from(self.get(index)?).ok()
    }
}

impl<'a> Table<'a> {
    /// Finds the columns of a table. Returns `None` if it tells no classes.
    ///
    /// # Errors
    /// The columns that are needed do not fit the schema or their buffer views.
    pub(crate) fn new(
        document: &'a GltfDocument,
        schema: &'a Value,
        table: &'a Value,
        who: &str,
    ) -> SentenceResult<Option<Self>> {
        let properties = properties_of(schema, table).ok_or_else(|| {
            let class = table.get("class").and_then(Value::as_str).unwrap_or_default();
            let class = quote(class.as_bytes());
            format!("{who} is of the class {class}, which the schema does not have")
        })?;
        let stored = |id: &str| table.get("properties").and_then(|all| all.get(id));
        let words = |keys| {
            find(properties, keys, |id, property| {
                is_word(property) && (stored(id).is_some() || property.get("default").is_some())
            })
        };
        let Some(class) = words(&CLASS_KEYS) else { return Ok(None) };

        let rows = table.get("count").and_then(whole);
        let rows = rows.ok_or_else(|| format!("{who} has no count"))?;
        let column = |(id, property): (&str, &'a Value)| {
            let who = format!("{who}, property {}", quote(id.as_bytes()));
            Column { document, rows, who }.words(schema, property, stored(id))
        };
        let room = words(&ROOM_KEYS).map(column).transpose()?;
        let class = column(class)?;

        let instance = find(properties, &INSTANCE_KEYS, |id, property| {
            integer_of(property).is_some() && stored(id).is_some()
        });
        let instance = instance.and_then(|(id, property)| {
            let who = format!("{who}, property {}", quote(id.as_bytes()));
            let kind = integer_of(property)?;
            let no_data = property.get("noData").and_then(Value::as_i64).map(i128::from);
            let numbers = Column { document, rows, who }.numbers(stored(id)?, "values", kind, rows);
            Some(numbers.map(|numbers| Numbers { no_data, ..numbers }))
        });
        Ok(Some(Self { rows, class, room, instance: instance.transpose()? }))
    }

    /// Returns the word for the class of a feature, if it has one.
    ///
    /// # Errors
    /// The bytes of the word are damaged.
    pub(crate) fn class(&self, row: usize) -> SentenceResult<Option<&'a str>> {
        self.class.get(row)
    }

    /// Returns the word for the room of a feature, if it has one.
    ///
    /// # Errors
    /// The bytes of the word are damaged.
    pub(crate) fn room(&self, row: usize) -> SentenceResult<Option<&'a str>> {
        self.room.as_ref().map_or(Ok(None), |words| words.get(row))
    }

    /// Returns the number of a feature's object, if it has one from 0 on.
    pub(crate) fn instance(&self, row: usize) -> Option<i64> {
        let numbers = self.instance.as_ref()?;
        let number = numbers.get(row).filter(|number| numbers.no_data != Some(*number))?;
        i64::try_from(number).ok().filter(|number| *number >= 0)
    }
}

impl<'a> Words<'a> {
    fn get(&self, row: usize) -> SentenceResult<Option<&'a str>> {
        let word = match &self.stored {
            Stored::Nowhere => None,
            Stored::Texts { texts, offsets } => Some(self.text(texts, offsets, row)?),
            Stored::Enum { numbers, names } => {
                let number = numbers.get(row).unwrap_or_default();
                let name = names.get(&number).copied();
                let who = &self.who;
                Some(name.ok_or_else(|| format!("{who}: the enum has no value {number}, as row {row} has"))?)
            }
        };
        let word = word.filter(|word| self.no_data != Some(*word)).or(self.default);
        Ok(word.map(str::trim).filter(|word| !word.is_empty()))
    }

    /// Returns the text of a row.
    fn text(&self, texts: &'a [u8], offsets: &Numbers<'_>, row: usize) -> SentenceResult<&'a str> {
        let who = &self.who;
        let [start, end] = [row, row.saturating_add(1)].map(|at| offsets.offset(at).unwrap_or(usize::MAX));
        let bytes = texts.get(start..end).ok_or_else(|| {
            let has = texts.len();
            format!("{who}: the text of row {row} goes from byte {start} to {end}, but there are {has}")
        })?;
        std::str::from_utf8(bytes)
            .map_err(|_| format!("{who}: the text of row {row} is {}, which is no UTF-8", quote(bytes)))
    }
}

/// A column of a table that is to be found.
struct Column<'a> {
    document: &'a GltfDocument,
    rows: usize,
    /// The name in messages.
    who: String,
}

impl<'a> Column<'a> {
    /// Finds the words of a property. `stored` tells where they are, if they are in the table.
    fn words(
        self,
        schema: &'a Value,
        property: &'a Value,
        stored: Option<&Value>,
    ) -> SentenceResult<Words<'a>> {
        let word = |key: &str| property.get(key).and_then(Value::as_str);
        let rows = self.rows;
        let stored = match stored {
            None => Stored::Nowhere,
            Some(stored) if word("type") == Some("ENUM") => {
                let (names, kind) = self.names(schema, word("enumType").unwrap_or_default())?;
                Stored::Enum { numbers: self.numbers(stored, "values", kind, rows)?, names }
            }
            Some(stored) => {
                let kind = stored
                    .get("stringOffsetType")
                    .map_or("UINT32", |kind| kind.as_str().unwrap_or(""));
                let who = &self.who;
                let kind = Integer::of(kind).ok_or_else(|| {
                    format!("{who}: offsets of the type {} are not read", quote(kind.as_bytes()))
                })?;
                // The last offset is the end of the last text.
                let offsets = self.numbers(stored, "stringOffsets", kind, rows.saturating_add(1))?;
                Stored::Texts { texts: self.bytes(stored, "values")?, offsets }
            }
        };
        Ok(Words { who: self.who, stored, no_data: word("noData"), default: word("default") })
    }

    /// Returns the names of an enum by their numbers, and the kind of these numbers.
    fn names(&self, schema: &'a Value, id: &str) -> SentenceResult<(HashMap<i128, &'a str>, Integer)> {
        let who = &self.who;
        let quoted = || quote(id.as_bytes());
        let found = schema.get("enums").and_then(|enums| enums.get(id));
        let found = found.ok_or_else(|| format!("{who}: the schema has no enum {}", quoted()))?;
        let kind = found
            .get("valueType")
            .map_or("UINT16", |kind| kind.as_str().unwrap_or(""));
        let kind = Integer::of(kind).ok_or_else(|| {
            format!("{who}: the enum {} is of the type {}, which is none", quoted(), quote(kind.as_bytes()))
        })?;

        let values = found.get("values").and_then(Value::as_array);
        let names = values.into_iter().flatten().filter_map(|value| {
            let number = value.get("value")?;
            let number = number
                .as_i64()
                .map(i128::from)
                .or_else(|| number.as_u64().map(i128::from))?;
            Some((number, value.get("name")?.as_str()?))
        });
        Ok((names.collect(), kind))
    }

    /// Returns `length` numbers of the buffer view that `key` names.
    fn numbers(
        &self,
        stored: &Value,
        key: &str,
        kind: Integer,
        length: usize,
    ) -> SentenceResult<Numbers<'a>> {
        let bytes = self.bytes(stored, key)?;
        let needed = length.checked_mul(kind.size());
        if needed.is_none_or(|needed| needed > bytes.len()) {
            let who = &self.who;
            let (size, has) = (kind.size(), bytes.len());
            return Err(format!(
                "{who}: its {key} are {length} numbers of {size} bytes, but there are {has} bytes"
            ));
        }
        Ok(Numbers { bytes, kind, no_data: None })
    }

    /// Returns the bytes of the buffer view that `key` names.
    fn bytes(&self, stored: &Value, key: &str) -> SentenceResult<&'a [u8]> {
        let who = &self.who;
        let view = stored.get(key).and_then(index_of);
        let view = view.ok_or_else(|| format!("{who} names no buffer view for its {key}"))?;
        self.document.view(Index::new(view), who).map_err(|e| e.to_string())
    }
}

/// Returns the properties of the class that a table, or anything else with values, is of.
fn properties_of<'a>(schema: &'a Value, table: &Value) -> Option<&'a Map<String, Value>> {
    let class = table.get("class")?.as_str()?;
    schema.get("classes")?.get(class)?.get("properties")?.as_object()
}

/// Returns the names of the properties that a table has.
pub(crate) fn names_of<'a>(schema: &'a Value, table: &Value) -> impl Iterator<Item = &'a str> {
    let properties = properties_of(schema, table);
    properties
        .into_iter()
        .flat_map(|properties| properties.keys().map(String::as_str))
}

/// Returns whether anything with values, such as a property texture, has a property that tells classes.
pub(crate) fn tells_classes(schema: &Value, table: &Value) -> bool {
    properties_of(schema, table)
        .and_then(|properties| find(properties, &CLASS_KEYS, |_, property| is_word(property)))
        .is_some()
}

/// Finds the property that one of the keys names: by its semantic, or by its id.
fn find<'a>(
    properties: &'a Map<String, Value>,
    keys: &[&str],
    fits: impl Fn(&str, &Value) -> bool,
) -> Option<(&'a str, &'a Value)> {
    keys.iter().find_map(|key| {
        let is_named = |id: &str, property: &Value| {
            let semantic = property.get("semantic").and_then(Value::as_str);
            semantic.is_some_and(|semantic| semantic.eq_ignore_ascii_case(key))
                || id.eq_ignore_ascii_case(key)
        };
        let found = properties
            .iter()
            .find(|(id, property)| is_named(id, property) && fits(id, property));
        found.map(|(id, property)| (id.as_str(), property))
    })
}

/// Returns whether each value of a property is a word.
fn is_word(property: &Value) -> bool {
    let kind = property.get("type").and_then(Value::as_str);
    matches!(kind, Some("STRING" | "ENUM")) && !is_array(property)
}

/// Returns the kind of a property whose values are whole numbers.
fn integer_of(property: &Value) -> Option<Integer> {
    let word = |key: &str| property.get(key).and_then(Value::as_str);
    let is_normalized = property.get("normalized") == Some(&Value::Bool(true));
    let is_plain = word("type") == Some("SCALAR") && !is_array(property) && !is_normalized;
    Integer::of(word("componentType")?).filter(|_| is_plain)
}

fn is_array(property: &Value) -> bool {
    property.get("array") == Some(&Value::Bool(true))
}
