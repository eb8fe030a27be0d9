//! The header of an NPY file: numpy's description of an array as a Python dictionary. Source: numpy's "NPY
//! format", versions 1.0 to 3.0.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::npy::literal::{self, Literal};
use crate::cloud::table::records::{Field, Kind};
use crate::error::{Error, Result};
use std::io::Read;
use std::path::Path;

/// The longest header that is read. numpy's own are aligned to 64 bytes and rarely exceed a few hundred.
const LONGEST_HEADER: usize = 1 << 17;
/// The most columns of a table.
const MOST_COLUMNS: usize = 4096;

/// The header of an array that is a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NpyHeader {
    /// The number of rows: the first number of the shape, or 1 if it is empty.
    pub(crate) rows: u64,
    /// The bytes of a row.
    pub(crate) stride: usize,
    /// The fields of a row. In an array that is not structured they are `[0]`, `[1]`…, or one without a
    /// name.
    pub(crate) fields: Vec<Field>,
    /// Whether the fields have names of their own.
    pub(crate) is_structured: bool,
}

impl NpyHeader {
    /// Reads the header, and leaves `source` at the first row.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] and [`Error::Unsupported`] if the array is no table of numbers and
    /// texts.
    pub(crate) fn read(path: &Path, source: &mut impl Read) -> Result<Self> {
        Self::parse(&read_text(path, source)?).map_err(|why| why.of(path))
    }

    fn parse(text: &str) -> std::result::Result<Self, Refused> {
        let header = parse(text)?;
        let (rows, columns) = match *header.shape {
            [] => (1, None),
            [n] => (n, None),
            [n, k] => (n, Some(k)),
            ref shape => {
                let why = format!("is an array of {} dimensions: save one of rows and columns", shape.len());
                return Err(Refused::Unsupported(why));
            }
        };

        if header.is_column_major && columns.is_some_and(|k| k > 1) && rows > 1 {
            let why = "is stored column by column: save numpy.ascontiguousarray(array)".to_owned();
            return Err(Refused::Unsupported(why));
        }
        let is_structured = matches!(header.elements, Elements::Structure(_));
        let (fields, stride) = fields_of(header.elements, columns)?;
        Ok(Self { rows, stride, fields, is_structured })
    }
}

/// The fields of a row and its bytes. `columns` is the second number of the shape.
fn fields_of(elements: Elements, columns: Option<u64>) -> std::result::Result<(Vec<Field>, usize), Refused> {
    let mut fields = Vec::new();
    let mut stride = 0;
    match elements {
        Elements::Structure(_) if columns.is_some_and(|k| k != 1) => {
            return Err(Refused::Unsupported("is a structured array of two dimensions".to_owned()));
        }
        Elements::Structure(structure) => {
            for (name, sides, stored) in structure {
                // An array in a field becomes columns `name[i]`.
                let count = sides.iter().try_fold(1u64, |count, side| count.checked_mul(*side));
                let names: Vec<String> = match count {
                    _ if sides.is_empty() => vec![name],
                    Some(n) if n <= MOST_COLUMNS as u64 => (0..n).map(|i| format!("{name}[{i}]")).collect(),
                    _ => return Err(bad("a huge field")),
                };
                push_fields(&mut fields, &mut stride, names, stored)?;
            }
        }

        Elements::Plain(stored) => {
            let names = match columns {
                None => vec![String::new()],
                Some(k) if k <= MOST_COLUMNS as u64 => (0..k).map(|i| format!("[{i}]")).collect(),
                Some(k) => return Err(bad(&format!("{k} columns"))),
            };
            push_fields(&mut fields, &mut stride, names, stored)?;
        }
    }
    Ok((fields, stride))
}

/// Reads the text of a header, and leaves `source` at the first number.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no NPY file.
pub(super) fn read_text(path: &Path, source: &mut impl Read) -> Result<String> {
    let short = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::UnexpectedEof => Error::format(path, "is no NPY array: it ends in its header"),
        std::io::ErrorKind::InvalidData => Error::format(path, format!("cannot be unpacked: {e}")),
        _ => Error::io(path, "read", e),
    };

    let mut start = [0; 8];
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
    source
        .read_exact(length.get_mut(..digits).unwrap_or_default())
        .map_err(short)?;
    let length = u32::from_le_bytes(length) as usize;
    if length > LONGEST_HEADER {
        return Err(Error::format(path, format!("claims a header of {length} bytes")));
    }

    let mut text = vec![0; length];
    source.read_exact(&mut text).map_err(short)?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

/// The contents of a header.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) shape: Vec<u64>,
    /// The number of elements.
    pub(super) count: u64,
    /// Whether the first index varies fastest (`fortran_order`).
    pub(super) is_column_major: bool,
    pub(super) elements: Elements,
}

/// The elements of an array.
#[derive(Debug)]
pub(super) enum Elements {
    Plain(Stored),
    /// Fields: the name, the sides if it is an array, and the type.
    Structure(Vec<(String, Vec<u64>, Stored)>),
}

/// The way numbers or texts of a type are stored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored {
    /// `None` for types that hold no label: padding, dates, complex numbers, floats of more than 64 bits.
    pub(super) kind: Option<Kind>,
    /// The bytes of an element.
    size: usize,
    pub(super) big_endian: bool,
}

/// Parses the text of a header.
pub(super) fn parse(text: &str) -> std::result::Result<Header, Refused> {
    let Literal::Dictionary(entries) = literal::parse(text).map_err(Refused::Bad)? else {
        return Err(bad("it is no dictionary"));
    };
    let value = |key: &str| {
        let entry = entries.iter().rfind(|(k, _)| k == key);
        entry
            .map(|(_, value)| value)
            .ok_or_else(|| bad(&format!("missing key '{key}'")))
    };

    let shape = sides(value("shape")?)?;
    let count = shape
        .iter()
        .try_fold(1u64, |count, side| count.checked_mul(*side))
        .ok_or_else(|| bad("its shape is too large"))?;
    let Literal::Bool(is_column_major) = *value("fortran_order")? else {
        return Err(bad("its fortran_order is neither True nor False"));
    };
    let elements = match value("descr")? {
        Literal::Text(kind) => Elements::Plain(stored(kind)?),
        Literal::List(fields) => {
            Elements::Structure(fields.iter().map(field).collect::<std::result::Result<_, _>>()?)
        }
        _ => return Err(bad("its descr is no type")),
    };
    Ok(Header { shape, count, is_column_major, elements })
}

/// The numbers of a tuple.
fn sides(tuple: &Literal) -> std::result::Result<Vec<u64>, Refused> {
    let Literal::List(sides) = tuple else { return Err(no_shape()) };
    sides
        .iter()
        .map(|side| {
            if let Literal::Number(n) = side {
                Ok(*n)
            } else {
                Err(no_shape())
            }
        })
        .collect()
}

fn no_field() -> Refused {
    bad("a field is no tuple of name, type and shape")
}

fn no_shape() -> Refused {
    bad("a shape is no tuple of whole numbers")
}

/// Parses a field: its name, or its title and name; its type; its sides if it is an array.
fn field(field: &Literal) -> std::result::Result<(String, Vec<u64>, Stored), Refused> {
    let Literal::List(field) = field else { return Err(no_field()) };
    let (name, kind, shape) = match &field[..] {
        [name, kind] => (name, kind, Vec::new()),
        [name, kind, shape] => (name, kind, sides(shape)?),
        _ => return Err(no_field()),
    };
    let name = if let Literal::List(titled) = name {
        titled.last()
    } else {
        Some(name)
    };
    match (name, kind) {
        (Some(Literal::Text(name)), Literal::Text(kind)) => Ok((name.clone(), shape, stored(kind)?)),
        (Some(Literal::Text(name)), Literal::List(_)) => {
            Err(Refused::Unsupported(format!("has a structure in the field {name:?}")))
        }
        _ => Err(no_field()),
    }
}

/// Parses a type string: byte order, kind, and size in bytes or characters.
fn stored(text: &str) -> std::result::Result<Stored, Refused> {
    let unknown = || bad(&format!("the type string {text:?}"));
    let mut chars = text.chars();
    let order = chars.next();
    let code = chars.next();
    if code == Some('O') {
        let why = "holds pickled Python objects: save an array of numbers or texts";
        return Err(Refused::Unsupported(why.to_owned()));
    }
    // A date's unit follows its size.
    let size = chars.as_str().split('[').next().and_then(|size| size.parse().ok());
    let size: usize = size.filter(|size| *size <= 1 << 16).ok_or_else(unknown)?;
    let big_endian = match order {
        Some('>') => true,
        Some('<' | '|') => false,
        _ => return Err(unknown()),
    };

    let kind = match (code, size) {
        (Some('i'), 1) => Kind::I8,
        (Some('u' | 'b'), 1) => Kind::U8,
        (Some('i'), 2) => Kind::I16,
        (Some('u'), 2) => Kind::U16,
        (Some('f'), 2) => Kind::F16,
        (Some('i'), 4) => Kind::I32,
        (Some('u'), 4) => Kind::U32,
        (Some('f'), 4) => Kind::F32,
        (Some('i'), 8) => Kind::I64,
        (Some('u'), 8) => Kind::U64,
        (Some('f'), 8) => Kind::F64,
        (Some('S'), n) => Kind::Bytes(n),
        (Some('U'), n) => Kind::Utf32(n),
        (Some('V'), _) | (Some('m' | 'M'), 8) | (Some('f'), 12 | 16) | (Some('c'), 8 | 16 | 24 | 32) => {
            return Ok(Stored { kind: None, size, big_endian });
        }
        _ => return Err(unknown()),
    };
    Ok(Stored { kind: Some(kind), size: kind.size(), big_endian })
}

/// Adds fields of one type. Fields of a type that holds no label only take up their bytes.
fn push_fields(
    fields: &mut Vec<Field>,
    at: &mut usize,
    names: Vec<String>,
    stored: Stored,
) -> std::result::Result<(), Refused> {
    for name in names {
        if let Some(kind) = stored.kind {
            fields.push(Field { name, at: *at, kind, big_endian: stored.big_endian });
        }
        *at = at.saturating_add(stored.size);
    }
    if fields.len() > MOST_COLUMNS || *at > 1 << 24 {
        return Err(bad("a huge row"));
    }
    Ok(())
}

/// The reason why a header is not read.
#[derive(Debug)]
pub(super) enum Refused {
    Bad(String),
    Unsupported(String),
}

impl Refused {
    pub(super) fn of(self, path: &Path) -> Error {
        match self {
            Self::Bad(why) => Error::format(path, format!("has a header that numpy would not write: {why}")),
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

    const TYPES: &[&str] = &[
        "|b1", "|i1", "|u1", "<i2", ">u2", "<f2", ">i4", "<u4", ">f4", "<i8", ">u8", "<f8", "<c8", ">c16",
        "|S3", "<U4", ">U4", "|V3",
    ];

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
        let fields: Vec<_> = h
            .fields
            .iter()
            .map(|f| (f.name.as_str(), f.at, f.kind, f.big_endian))
            .collect();
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
    fn titles_of_fields_and_units_of_dates() {
        let h = header(
            "{'descr': [(('metres', 'x'), '<f4'), ('t', '<M8[25s]'), ('y', '<f4', (1,))], \
             'fortran_order': False, 'shape': (7,)}",
        )
        .unwrap();
        let fields: Vec<_> = h.fields.iter().map(|f| (f.name.as_str(), f.at)).collect();
        assert_eq!((&fields[..], h.stride), (&[("x", 0), ("y[0]", 12)][..], 16));
    }

    #[test]
    fn headers_that_ask_too_much_are_refused() {
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
        let e = NpyHeader::read(Path::new("a.npy"), &mut &claims[..])
            .unwrap_err()
            .to_string();
        assert!(e.contains("claims a header of 4294967295 bytes"), "{e}");
    }

    proptest! {
        #[test]
        fn structures_as_npyz_reads_them(
            fields in prop::collection::vec(
                (
                    "[a-z_ ()\\\\'\"\u{e9}]{1,6}",
                    prop::sample::select(TYPES),
                    prop::collection::vec(1u64..4, 0..3),
                ),
                1..6,
            ),
            rows in 0u64..9,
        ) {
            let numbers = |sides: &[u64]| sides.iter().map(|n| format!("{n}, ")).collect::<String>();

            let mut descr = String::new();
            for (name, kind, sides) in &fields {
                let name = name.replace('\\', "\\\\").replace('\'', "\\'");
                descr += &format!("('{name}', '{kind}'");
                descr += &if sides.is_empty() { "), ".into() } else { format!(", ({})), ", numbers(sides)) };
            }
            let text = format!("{{'descr': [{descr}], 'fortran_order': False, 'shape': ({rows},), }}");
            let mut bytes = b"\x93NUMPY\x03\x00".to_vec();
            bytes.extend(u32::try_from(text.len()).unwrap().to_le_bytes());
            bytes.extend(text.bytes());

            let theirs = npyz::NpyHeader::from_reader(&bytes[..]).unwrap();
            prop_assert_eq!(theirs.shape(), &[rows]);
            let npyz::DType::Record(theirs) = theirs.dtype() else { panic!("{text}") };
            let Elements::Structure(ours) = parse(&text).unwrap().elements else { panic!("{text}") };
            prop_assert_eq!(ours.len(), theirs.len());
            for ((name, sides, stored), theirs) in ours.iter().zip(theirs) {
                prop_assert_eq!(name, &theirs.name);
                let mut kind = &theirs.dtype;
                for side in sides {
                    let npyz::DType::Array(n, inner) = kind else { panic!("{text}") };
                    prop_assert_eq!(side, n);
                    kind = &**inner;
                }
                let npyz::DType::Plain(kind) = kind else { panic!("{text}") };
                prop_assert_eq!(Some(stored.size), kind.num_bytes());
                prop_assert_eq!(stored.big_endian, kind.endianness() == npyz::Endianness::Big);
            }
        }

        #[test]
        fn any_text_gives_a_header_or_an_error(text in "[{}()\\[\\]',:0-9a-zTF<> ]{0,60}") {
            let _ = header(&text);
        }
    }
}
