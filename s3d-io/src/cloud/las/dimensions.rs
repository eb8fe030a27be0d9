//! The dimensions of a LAS point that can hold classes, instances or rooms.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::number_at;
use crate::cloud::table::records::{Field, Kind};
use crate::cloud::table::rows::Value;
use crate::error::{Error, Result};
use las::point::Format;
use std::path::Path;

/// Where a point holds the value of a dimension.
#[derive(Clone, Debug)]
pub(super) enum Dimension {
    /// Bits of a byte that other flags share.
    Classification { at: usize, mask: u8 },
    /// A number of its own, times a scale, plus an offset.
    Plain { field: Field, scale: f64, offset: f64 },
}

impl Dimension {
    pub(super) fn classification(format: &Format) -> Self {
        let (at, mask) = if format.is_extended { (16, 0xff) } else { (15, 0x1f) };
        Self::Classification { at, mask }
    }

    /// Whether it is a class of five bits, and the largest of these: a larger class may have been cut to it.
    pub(super) fn is_cut(&self, record: &[u8]) -> bool {
        matches!(self, Self::Classification { mask: 0x1f, .. }) && self.value(record) == Value::Whole(0x1f)
    }

    fn plain(name: &str, at: usize, kind: Kind) -> (String, Self) {
        let field = Field { name: name.to_owned(), at, kind, big_endian: false };
        (name.to_owned(), Self::Plain { field, scale: 1.0, offset: 0.0 })
    }

    pub(super) fn value(&self, record: &[u8]) -> Value<'static> {
        match self {
            Self::Classification { at, mask } => record
                .get(*at)
                .map_or(Value::None, |byte| Value::Whole(i64::from(byte & mask))),
            Self::Plain { field, scale, offset } => {
                let mut text = String::new();
                match field.value(record, &mut text) {
                    Value::Whole(n) if (*scale, *offset) == (1.0, 0.0) => Value::Whole(n),
                    Value::Whole(n) => Value::Float(n as f64 * scale + offset),
                    Value::Float(v) => Value::Float(v * scale + offset),
                    Value::Name(_) | Value::None => Value::None,
                }
            }
        }
    }
}

/// Returns the dimensions that can hold classes, instances or rooms, with their usual names.
pub(super) fn dimensions(header: &las::Header) -> Vec<(String, Dimension)> {
    let format = header.point_format();
    let source_at = if format.is_extended { 20 } else { 18 };
    let mut all = vec![
        ("classification".to_owned(), Dimension::classification(format)),
        Dimension::plain("user_data", 17, Kind::U8),
        Dimension::plain("point_source_id", source_at, Kind::U16),
        Dimension::plain("intensity", 12, Kind::U16),
    ];

    // The extra bytes of a point follow its standard fields; records describe them, 192 bytes a dimension.
    let mut at = usize::from(format.len().saturating_sub(format.extra_bytes));
    let end = usize::from(format.len());
    for vlr in header
        .all_vlrs()
        .filter(|v| v.user_id.starts_with("LASF_Spec") && v.record_id == 4)
    {
        for description in vlr.data.as_chunks::<192>().0 {
            let Some((bytes, dimension)) = extra_dimension(description, at) else { break };
            let behind = at.saturating_add(bytes);
            if behind > end {
                break;
            }
            all.extend(dimension);
            at = behind;
        }
    }
    all
}

/// Reads the description of an extra dimension that stands at byte `at` of a point. Returns the bytes that it
/// takes, and the dimension if it is a single number. Returns `None` for an unknown type.
fn extra_dimension(description: &[u8; 192], at: usize) -> Option<(usize, Option<(String, Dimension)>)> {
    let data_type = description[2];
    let options = description[3];
    let kind = match data_type % 10 {
        1 => Kind::U8,
        2 => Kind::I8,
        3 => Kind::U16,
        4 => Kind::I16,
        5 => Kind::U32,
        6 => Kind::I32,
        7 => Kind::U64,
        8 => Kind::I64,
        9 => Kind::F32,
        _ => Kind::F64,
    };
    // 11 to 20 are pairs of the types 1 to 10, and 21 to 30 triples, both no longer used. 0 is a number of
    // bytes that only its writer understands.
    match data_type {
        0 => return Some((usize::from(options), None)),
        1..=10 => {}
        11..=20 => return Some((kind.size().saturating_mul(2), None)),
        21..=30 => return Some((kind.size().saturating_mul(3), None)),
        _ => return None,
    }

    let name = description[4..36].split(|b| *b == 0).next().unwrap_or_default();
    let name = String::from_utf8_lossy(name).into_owned();
    let double = |at: usize| number_at(description, at).map_or(f64::NAN, f64::from_le_bytes);
    let scale = if options & 8 != 0 { double(112) } else { 1.0 };
    let offset = if options & 16 != 0 { double(136) } else { 0.0 };
    let field = Field { name: name.clone(), at, kind, big_endian: false };
    Some((kind.size(), Some((name, Dimension::Plain { field, scale, offset }))))
}

/// Finds the dimension called `asked`, or else the first of the `usual` names, in capitals or not. `key` is
/// the user's word for it.
///
/// # Errors
/// [`Error::Format`] if there is no dimension called `asked`.
pub(super) fn find_dimension(
    path: &Path,
    all: &[(String, Dimension)],
    key: &str,
    asked: Option<&String>,
    usual: &[&str],
) -> Result<Option<Dimension>> {
    let Some(name) = asked else {
        let found = usual
            .iter()
            .find_map(|u| all.iter().find(|(n, _)| n.eq_ignore_ascii_case(u)));
        return Ok(found.map(|(_, d)| d.clone()));
    };
    match all.iter().find(|(n, _)| n == name) {
        Some((_, dimension)) => Ok(Some(dimension.clone())),
        None => {
            let names: Vec<&str> = all.iter().map(|(n, _)| n.as_str()).collect();
            let message =
                format!("has no dimension {name:?} ({key} in [annotations]); it has {}", names.join(" "));
            Err(Error::format(path, message))
        }
    }
}
