//! Parses the messages of object headers. A damaged message gives `None`.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::UNDEFINED;
use super::file::{Cursor, Filter, Kind, Layout};

/// The most axes of an array: the HDF5 library's own limit.
const MAX_AXES: usize = 32;

/// The value of an attribute.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum AttributeValue {
    Text(String),
    Number(u64),
}

/// The extents of an array.
pub(super) fn dataspace(m: &mut Cursor<'_>) -> Option<Vec<u64>> {
    let version = m.byte()?;
    let axes = usize::from(m.byte()?);
    let _flags = m.byte()?;
    let reserved = match version {
        1 => 5,
        2 => 1,
        _ => return None,
    };
    m.take(reserved)?;
    if axes > MAX_AXES {
        return None;
    }
    (0..axes).map(|_| m.number(8)).collect()
}

/// The type of an array's elements.
pub(super) fn datatype(m: &mut Cursor<'_>) -> Option<Kind> {
    let class = m.byte()? & 0x0f;
    let bits = m.number(3)?;
    let size = m.size(4)?;
    let big_endian = bits & 1 != 0;
    let other = Kind::Other { size };
    // Every bit of the element must count; MATLAB writes no other types.
    let is_whole = |m: &mut Cursor<'_>| Some(m.size(2)? == 0 && Some(m.size(2)?) == size.checked_mul(8));

    Some(match class {
        0 if is_whole(m)? && (1..=8).contains(&size) => {
            Kind::Integer { size, signed: bits & 8 != 0, big_endian }
        }
        1 if is_whole(m)? && bits & 0x40 == 0 => match (size, m.number(4)?) {
            (4, 0x1700_0817) | (8, 0x3400_0b34) => Kind::Float { size, big_endian },
            _ => other,
        },
        3 => Kind::Text { size },
        7 if size == 8 && bits & 0x0f == 0 => Kind::Reference,
        _ if size > 0 => other,
        _ => return None,
    })
}

/// The place of an array's data.
pub(super) fn layout(body: &[u8]) -> Option<Layout> {
    let mut m = Cursor::new(body);
    let version = m.byte()?;
    if !(3..=4).contains(&version) {
        return Some(Layout::Unsupported("a data layout of version 1 or 2, of before HDF5 1.6.3"));
    }
    Some(match m.byte()? {
        0 => {
            let size = m.size(2)?;
            Layout::Compact(m.take(size)?.to_vec())
        }
        1 => Layout::Contiguous { address: m.number(8)?, size: m.number(8)? },
        2 if version == 3 => {
            let axes = usize::from(m.byte()?).checked_sub(1).filter(|n| *n <= MAX_AXES)?;
            let tree = m.number(8)?;
            let dims = (0..axes).map(|_| m.number(4)).collect::<Option<Vec<u64>>>()?;
            Layout::Chunked { tree, dims }
        }
        2 => Layout::Unsupported("an array whose chunks have an index of the newer form (HDF5 1.10)"),
        _ => Layout::Unsupported("a virtual array"),
    })
}

/// The filters of an array's chunks, in the order in which they were applied.
pub(super) fn filters(body: &[u8]) -> Option<Vec<Filter>> {
    let mut m = Cursor::new(body);
    let version = m.byte()?;
    let count = m.byte()?;
    if version == 1 {
        m.take(6)?;
    }

    let mut filters = Vec::new();
    for _ in 0..count {
        let id = u16::from_le_bytes(m.array()?);
        let name = if version == 1 || id >= 256 { m.size(2)? } else { 0 };
        let _flags = m.number(2)?;
        let values = m.size(2)?.checked_mul(4)?;
        for bytes in [name, values] {
            m.take(if version == 1 {
                bytes.checked_next_multiple_of(8)?
            } else {
                bytes
            })?;
        }

        filters.push(match id {
            1 => Filter::Deflate,
            2 => Filter::Shuffle,
            3 => Filter::Fletcher32,
            other => Filter::Other(other),
        });
    }
    Some(filters)
}

/// A member of a group in the new form. Returns `Some(None)` if it is not in this file.
pub(super) fn link(body: &[u8]) -> Option<Option<(String, u64)>> {
    let mut m = Cursor::new(body);
    let _version = m.byte()?;
    let flags = m.byte()?;
    let is_hard = if flags & 8 != 0 { m.byte()? == 0 } else { true };
    m.take(if flags & 4 != 0 { 8 } else { 0 })?;
    m.take(if flags & 0x10 != 0 { 1 } else { 0 })?;
    let length = m.size(1 << (flags & 3))?;
    let name = String::from_utf8_lossy(m.take(length)?).into_owned();
    if is_hard {
        Some(Some((name, m.number(8)?)))
    } else {
        Some(None)
    }
}

/// Whether a group in the new form has its members in a heap.
pub(super) fn link_info_is_dense(body: &[u8]) -> Option<bool> {
    let mut m = Cursor::new(body);
    let _version = m.byte()?;
    let flags = m.byte()?;
    m.take(if flags & 1 != 0 { 8 } else { 0 })?;
    Some(m.number(8)? != UNDEFINED)
}

/// An attribute, if its value is one text or one integer. Other attributes are left out, and so are damaged
/// ones: none of them is needed.
pub(super) fn attribute(body: &[u8]) -> Option<(String, AttributeValue)> {
    let mut m = Cursor::new(body);
    let version = m.byte()?;
    let flags = m.byte()?;
    let sizes = [m.size(2)?, m.size(2)?, m.size(2)?];
    if !(1..=3).contains(&version) || version > 1 && flags & 3 != 0 {
        return None;
    }

    m.take(usize::from(version == 3))?;

    // The parts are padded to eight bytes in version 1.
    let mut part = |size: usize| {
        let padded = if version == 1 {
            size.checked_next_multiple_of(8)?
        } else {
            size
        };
        m.take(padded)?.get(..size)
    };
    let name = part(sizes[0])?;
    let kind = part(sizes[1])?;
    let space = part(sizes[2])?;
    let name = String::from_utf8_lossy(until_zero(name)).into_owned();
    let kind = datatype(&mut Cursor::new(kind))?;
    if dataspace(&mut Cursor::new(space))?.iter().any(|d| *d != 1) {
        return None;
    }

    let value = match kind {
        Kind::Text { size } => {
            AttributeValue::Text(String::from_utf8_lossy(until_zero(m.take(size)?)).into_owned())
        }
        Kind::Integer { size, .. } => AttributeValue::Number(m.number(size)?),
        _ => return None,
    };
    Some((name, value))
}

/// The bytes before the first zero.
pub(super) fn until_zero(bytes: &[u8]) -> &[u8] {
    bytes.split(|b| *b == 0).next().unwrap_or_default()
}
