//! The header of an NPY file: what numpy says of an array, written as a Python dictionary. Source: numpy's
//! "NPY format", versions 1.0 to 3.0.
//!
//! npyz reads it; here it becomes the fields of a table. npyz takes the length of a header at its word,
//! overflows the stack or runs for minutes on brackets in brackets, and refuses Python 2's `7L`: see [`tame`]
//! and `headers_that_npyz_would_choke_on_are_refused`.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::records::{Field, Kind};
use crate::error::{Error, Result};
use crate::guarded::guarded;
use npyz::{DType, Endianness, Order, TypeChar, TypeStr};
use std::io::Read;
use std::path::Path;

/// The longest header that is read: numpy's own are aligned to 64 bytes and rarely longer than a few hundred.
const LONGEST_HEADER: usize = 1 << 17;
/// How deep lists may be in lists: numpy's are four deep, and two more for each structure in a field.
const DEEPEST_LIST: u32 = 8;
/// The most columns of a table.
const MOST_COLUMNS: usize = 4096;

/// An array's header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NpyHeader {
    /// Rows: the first number of its shape, 1 for none.
    pub(crate) rows: u64,
    /// Bytes of a row.
    pub(crate) stride: usize,
    /// What a row holds. An array that is not structured has fields `[0]`, `[1]`…, or one without a name.
    pub(crate) fields: Vec<Field>,
    /// Whether the fields have names of their own.
    pub(crate) is_structured: bool,
}

impl NpyHeader {
    /// Reads the header and leaves `source` at the first row.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] and [`Error::Unsupported`] for what is no table of numbers and texts.
    pub(crate) fn read(path: &Path, source: &mut impl Read) -> Result<Self> {
        Self::parse(&read_text(path, source)?).map_err(|why| why.of(path))
    }

    fn parse(text: &str) -> std::result::Result<Self, Refused> {
        let header = parse(text)?;
        let (rows, columns) = match *header.shape() {
            [] => (1, None),
            [n] => (n, None),
            [n, k] => (n, Some(k)),
            ref shape => {
                let why = format!("is an array of {} dimensions: save one of rows and columns", shape.len());
                return Err(Refused::Unsupported(why));
            }
        };
        if header.order() == Order::Fortran && columns.is_some_and(|k| k > 1) && rows > 1 {
            let why = "is stored column by column: save numpy.ascontiguousarray(array)".to_owned();
            return Err(Refused::Unsupported(why));
        }
        if header.uses_pickled_array() {
            let why = "holds pickled Python objects: save an array of numbers or texts";
            return Err(Refused::Unsupported(why.to_owned()));
        }
        let (mut fields, mut at) = (Vec::new(), 0);
        let kind = header.dtype();
        let is_structured = matches!(kind, DType::Record(_));
        match kind {
            DType::Record(_) if columns.is_some_and(|k| k != 1) => {
                return Err(Refused::Unsupported("is a structured array of two dimensions".to_owned()));
            }
            DType::Record(record) => {
                for npyz::Field { name, dtype } in record {
                    let (n, kind) = elements(&name, &dtype)?;
                    let names: Vec<String> = match n {
                        None => vec![name],
                        Some(n) => (0..n).map(|i| format!("{name}[{i}]")).collect(),
                    };
                    push_fields(&mut fields, &mut at, names, kind)?;
                }
            }
            kind => {
                let names = match columns {
                    None => vec![String::new()],
                    Some(k) if k <= MOST_COLUMNS as u64 => (0..k).map(|i| format!("[{i}]")).collect(),
                    Some(k) => return Err(bad(&format!("{k} columns"))),
                };
                push_fields(&mut fields, &mut at, names, elements("", &kind)?.1)?;
            }
        }
        Ok(Self { rows, stride: at, fields, is_structured })
    }
}

/// The text of a header; `source` is left at the first number.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] for what is no NPY file.
pub(super) fn read_text(path: &Path, source: &mut impl Read) -> Result<String> {
    let mut start = [0; 8];
    let short = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::UnexpectedEof => Error::format(path, "is no NPY array: it ends in its header"),
        std::io::ErrorKind::InvalidData => Error::format(path, format!("cannot be unpacked: {e}")),
        _ => Error::io(path, "read", e),
    };
    source.read_exact(&mut start).map_err(short)?;
    if &start[..6] != b"\x93NUMPY" {
        return Err(Error::format(path, "is no NPY array: it does not begin with \\x93NUMPY"));
    }
    let mut length = [0; 4];
    let digits = match start[6] {
        1 => 2,
        2 | 3 => 4,
        other => return Err(Error::format(path, format!("is of NPY version {other}; 1 to 3 are read"))),
    };
    source.read_exact(length.get_mut(..digits).unwrap_or_default()).map_err(short)?;
    let length = u32::from_le_bytes(length) as usize;
    if length > LONGEST_HEADER {
        return Err(Error::format(path, format!("claims a header of {length} bytes")));
    }
    let mut text = vec![0; length];
    source.read_exact(&mut text).map_err(short)?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

/// What a header says, of a shape whose numbers can be counted.
pub(super) fn parse(text: &str) -> std::result::Result<npyz::NpyHeader, Refused> {
    let text = tame(text)?;
    let mut bytes = b"\x93NUMPY\x03\x00".to_vec();
    // It is longer than it was by at most twice: see `String::from_utf8_lossy`.
    bytes.extend(u32::try_from(text.len()).unwrap_or(u32::MAX).to_le_bytes());
    bytes.extend(text);
    // npyz multiplies the numbers of the shape.
    let header = guarded(|| npyz::NpyHeader::from_reader(&bytes[..]))
        .ok_or_else(|| bad("its shape is too large"))?
        // The parser draws an arrow below its place, on lines of their own.
        .map_err(|e| bad(e.to_string().split(" -->").next().unwrap_or_default()))?;
    let count = header.shape().iter().try_fold(1u64, |count, side| count.checked_mul(*side));
    count.ok_or_else(|| bad("its shape is too large"))?;
    Ok(header)
}

/// A header's text without the `L` of Python 2's numbers, if npyz reads it in little time and stack.
fn tame(text: &str) -> std::result::Result<Vec<u8>, Refused> {
    let mut bytes = text.as_bytes().to_vec();
    let (mut quote, mut depth, mut dictionaries, mut before) = (None, 0u32, 0u32, 0u8);
    let mut escaped = false;
    for byte in &mut bytes {
        match (*byte, quote) {
            (_, Some(_)) if escaped => escaped = false,
            (b'\\', Some(_)) => escaped = true,
            (end, Some(start)) if end == start => quote = None,
            (_, Some(_)) => {}
            (start @ (b'\'' | b'"'), None) => quote = Some(start),
            (b'L', None) if before.is_ascii_digit() => *byte = b' ',
            (open @ (b'(' | b'[' | b'{'), None) => {
                depth = depth.saturating_add(1);
                dictionaries = dictionaries.saturating_add(u32::from(open == b'{'));
            }
            (b')' | b']' | b'}', None) => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEEPEST_LIST || dictionaries > 1 {
            return Err(bad("its lists are too deep"));
        }
        before = *byte;
    }
    Ok(bytes)
}

/// The type of a field's elements, and their number if there are several.
fn elements<'a>(name: &str, mut kind: &'a DType) -> std::result::Result<(Option<u64>, &'a TypeStr), Refused> {
    let mut n = None;
    loop {
        match kind {
            DType::Plain(kind) => return Ok((n, kind)),
            DType::Array(side, inner) => {
                n = n.unwrap_or(1u64).checked_mul(*side).filter(|n| *n <= MOST_COLUMNS as u64);
                if n.is_none() {
                    return Err(bad("a huge field"));
                }
                kind = &**inner;
            }
            DType::Record(_) => {
                return Err(Refused::Unsupported(format!("has a structure in the field {name:?}")));
            }
        }
    }
}

/// Adds fields of one type; those that are padding or of a type that holds no label are passed over.
fn push_fields(
    fields: &mut Vec<Field>,
    at: &mut usize,
    names: Vec<String>,
    kind: &TypeStr,
) -> std::result::Result<(), Refused> {
    let big_endian = kind.endianness() == Endianness::Big;
    let bytes = kind
        .num_bytes()
        .filter(|_| kind.size_field() <= 1 << 16)
        .ok_or_else(|| bad(&format!("the type {kind}")))?;
    let kind = kind_of(kind);
    for name in names {
        if let Some(kind) = kind {
            fields.push(Field { name, at: *at, kind, big_endian });
        }
        *at = at.saturating_add(bytes);
    }
    if fields.len() > MOST_COLUMNS || *at > 1 << 24 {
        return Err(bad("a huge row"));
    }
    Ok(())
}

/// How a type's values are stored; `None` if it holds no label.
pub(super) fn kind_of(kind: &TypeStr) -> Option<Kind> {
    Some(match (kind.type_char(), usize::try_from(kind.size_field()).ok()?) {
        (TypeChar::Int, 1) => Kind::I8,
        (TypeChar::Uint | TypeChar::Bool, 1) => Kind::U8,
        (TypeChar::Int, 2) => Kind::I16,
        (TypeChar::Uint, 2) => Kind::U16,
        (TypeChar::Float, 2) => Kind::F16,
        (TypeChar::Int, 4) => Kind::I32,
        (TypeChar::Uint, 4) => Kind::U32,
        (TypeChar::Float, 4) => Kind::F32,
        (TypeChar::Int, 8) => Kind::I64,
        (TypeChar::Uint, 8) => Kind::U64,
        (TypeChar::Float, 8) => Kind::F64,
        (TypeChar::ByteStr, n) => Kind::Bytes(n),
        (TypeChar::UnicodeStr, n) => Kind::Utf32(n),
        _ => return None,
    })
}

/// Why a header is not read.
#[derive(Debug)]
pub(super) enum Refused {
    Bad(String),
    Unsupported(String),
}

impl Refused {
    pub(super) fn of(self, path: &Path) -> Error {
        match self {
            Self::Bad(why) => Error::format(path, format!("has a header that is none of numpy: {why}")),
            Self::Unsupported(why) => Error::unsupported(path, why),
        }
    }
}

pub(super) fn bad(why: &str) -> Refused {
    Refused::Bad(why.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn header(text: &str) -> std::result::Result<NpyHeader, Refused> {
        NpyHeader::parse(text)
    }

    #[test]
    fn structured_and_plain_arrays() {
        let h = header(
            "{'descr': [('x', '<f4'), ('rgb', '|u1', (3,)), ('pad', '|V2'), ('name', '>U4')], \
             'fortran_order': False, 'shape': (7,), }   \n",
        )
        .unwrap();
        let fields: Vec<_> = h.fields.iter().map(|f| (f.name.as_str(), f.at, f.kind, f.big_endian)).collect();
        assert_eq!(
            fields,
            [
                ("x", 0, Kind::F32, false),
                ("rgb[0]", 4, Kind::U8, false),
                ("rgb[1]", 5, Kind::U8, false),
                ("rgb[2]", 6, Kind::U8, false),
                ("name", 9, Kind::Utf32(4), true),
            ]
        );
        assert_eq!((h.rows, h.stride, h.is_structured), (7, 25, true));
        let h = header("{'descr': '>f8', 'fortran_order': False, 'shape': (5L, 7L)}").unwrap();
        assert_eq!((h.rows, h.stride, h.fields.len(), h.is_structured), (5, 56, 7, false));
        assert_eq!((h.fields[6].at, h.fields[6].kind, h.fields[6].big_endian), (48, Kind::F64, true));
        let h = header("{'descr': '|b1', 'fortran_order': True, 'shape': (5,)}").unwrap();
        assert_eq!((h.rows, h.stride, h.fields[0].name.as_str()), (5, 1, ""));
    }

    #[test]
    fn what_is_no_table_is_refused() {
        for (text, words) in [
            ("{'descr': '|O', 'fortran_order': False, 'shape': (5,)}", "pickled"),
            ("{'descr': '<f4', 'fortran_order': True, 'shape': (5, 7)}", "ascontiguousarray"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (5, 7, 2)}", "3 dimensions"),
            ("{'descr': '<f4', 'fortran_order': False}", "missing key 'shape'"),
            ("{'descr': '<q4', 'fortran_order': False, 'shape': (5,)}", "type string"),
            (
                "{'descr': [('a', [('b', '<f4')])], 'fortran_order': False, 'shape': (5,)}",
                "a structure in the field",
            ),
            ("{'descr': [('a', '<f4', (5000,))], 'fortran_order': False, 'shape': (5,)}", "a huge field"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (5, 99999999999)}", "columns"),
            ("{'descr': '<S99999999', 'fortran_order': False, 'shape': (5,)}", "<S99999999"),
            ("[1, 2]", "dict"),
            ("{'descr'", "could not parse"),
        ] {
            let message = format!("{:?}", header(text).unwrap_err());
            assert!(
                message.contains(words) || message.replace('\\', "").contains(words),
                "{text}: {message}"
            );
        }
    }

    #[test]
    fn headers_that_npyz_would_choke_on_are_refused() {
        for (text, words) in [
            (format!("{{'a': {}", "(".repeat(100_000)), "deep"),
            (format!("{{'a': {}", "{".repeat(40)), "deep"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (9223372036854775807, 3)}".into(), "large"),
        ] {
            let message = format!("{:?}", header(&text).unwrap_err());
            assert!(message.contains(words), "{message}");
        }
        let name = "(".repeat(40);
        let text = format!("{{'descr': [('{name}', '<f4')], 'fortran_order': False, 'shape': (3,)}}");
        assert_eq!(header(&text).unwrap().fields[0].name, name);
        let claims = b"\x93NUMPY\x02\x00\xff\xff\xff\xff";
        let e = NpyHeader::read(Path::new("a.npy"), &mut &claims[..]).unwrap_err().to_string();
        assert!(e.contains("claims a header of 4294967295 bytes"), "{e}");
    }

    proptest! {
        #[test]
        fn any_text_gives_a_header_or_an_error(text in "[{}()\\[\\]',:0-9a-zTF<> ]{0,60}") {
            let _ = header(&text);
        }
    }
}
