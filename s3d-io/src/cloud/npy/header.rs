//! The header of an NPY file: what numpy says of an array, written as a Python dictionary. Source: numpy's
//! "NPY format", versions 1.0 to 3.0.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::records::{Field, Kind};
use crate::error::{Error, Result};
use std::io::Read;
use std::path::Path;

/// The longest header that is read: numpy's own are aligned to 64 bytes and rarely longer than a few hundred.
const LONGEST_HEADER: usize = 1 << 20;
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
        let mut start = [0; 8];
        let short = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => {
                Error::format(path, "is no NPY array: it ends in its header")
            }
            std::io::ErrorKind::InvalidData => Error::format(path, format!("cannot be unpacked: {e}")),
            _ => Error::io(path, "read", e),
        };
        source.read_exact(&mut start).map_err(short)?;
        if &start[..6] != b"\x93NUMPY" {
            return Err(Error::format(path, "is no NPY array: it does not begin with \\x93NUMPY"));
        }
        let length = match start[6] {
            1 => {
                let mut bytes = [0; 2];
                source.read_exact(&mut bytes).map_err(short)?;
                usize::from(u16::from_le_bytes(bytes))
            }
            2 | 3 => {
                let mut bytes = [0; 4];
                source.read_exact(&mut bytes).map_err(short)?;
                u32::from_le_bytes(bytes) as usize
            }
            other => return Err(Error::format(path, format!("is of NPY version {other}; 1 to 3 are read"))),
        };
        if length > LONGEST_HEADER {
            return Err(Error::format(path, format!("claims a header of {length} bytes")));
        }
        let mut text = vec![0; length];
        source.read_exact(&mut text).map_err(short)?;
        let text = String::from_utf8_lossy(&text);
        Self::parse(&text).map_err(|why| match why {
            Refused::Bad(why) => Error::format(path, format!("has a header that is none of numpy: {why}")),
            Refused::Unsupported(why) => Error::unsupported(path, why),
        })
    }

    fn parse(text: &str) -> std::result::Result<Self, Refused> {
        let mut parser = Parser { rest: text.trim(), levels_left: 16 };
        let Literal::Dict(entries) = parser.literal()? else { return Err(bad("no dictionary")) };
        let get = |key: &str| {
            let found = entries.iter().find(|(k, _)| *k == Literal::Text(key.to_owned())).map(|(_, v)| v);
            found.ok_or_else(|| bad(&format!("no {key:?}")))
        };
        let Literal::List(shape) = get("shape")? else { return Err(bad("its shape is no tuple")) };
        let shape = numbers(shape)?;
        let (rows, columns) = match shape[..] {
            [] => (1, None),
            [n] => (n, None),
            [n, k] => (n, Some(k)),
            _ => {
                let why = format!("is an array of {} dimensions: save one of rows and columns", shape.len());
                return Err(Refused::Unsupported(why));
            }
        };
        if *get("fortran_order")? == Literal::Bool(true) && columns.is_some_and(|k| k > 1) && rows > 1 {
            let why = "is stored column by column: save numpy.ascontiguousarray(array)".to_owned();
            return Err(Refused::Unsupported(why));
        }
        let mut fields = Vec::new();
        let descr = get("descr")?;
        let (mut at, is_structured) = (0, matches!(descr, Literal::List(_)));
        match descr {
            Literal::List(list) => {
                if columns.is_some_and(|k| k != 1) {
                    return Err(Refused::Unsupported("is a structured array of two dimensions".to_owned()));
                }
                for item in list {
                    let Literal::List(item) = item else { return Err(bad("a field is no tuple")) };
                    let (name, kind, shape) = match &item[..] {
                        [Literal::Text(name), kind] => (name, kind, &[][..]),
                        [Literal::Text(name), kind, Literal::List(shape)] => (name, kind, &shape[..]),
                        [Literal::List(_), ..] => {
                            return Err(Refused::Unsupported("has fields with titles".into()));
                        }
                        _ => return Err(bad("a field is no name and type")),
                    };
                    let Literal::Text(kind) = kind else {
                        return Err(Refused::Unsupported(format!("has a structure in the field {name:?}")));
                    };
                    let n = numbers(shape)?.iter().try_fold(1u64, |n, k| n.checked_mul(*k));
                    let n = n.filter(|n| *n <= MOST_COLUMNS as u64).ok_or_else(|| bad("a huge field"))?;
                    let names: Vec<String> = if shape.is_empty() {
                        vec![name.clone()]
                    } else {
                        (0..n).map(|i| format!("{name}[{i}]")).collect()
                    };
                    push_fields(&mut fields, &mut at, names, kind)?;
                }
            }
            Literal::Text(kind) => {
                let names = match columns {
                    None => vec![String::new()],
                    Some(k) if k <= MOST_COLUMNS as u64 => (0..k).map(|i| format!("[{i}]")).collect(),
                    Some(k) => return Err(bad(&format!("{k} columns"))),
                };
                push_fields(&mut fields, &mut at, names, kind)?;
            }
            _ => return Err(bad("its descr is no type")),
        }
        Ok(Self { rows, stride: at, fields, is_structured })
    }
}

/// Adds fields of one type; those that are padding or of a type that holds no label are passed over.
fn push_fields(
    fields: &mut Vec<Field>,
    at: &mut usize,
    names: Vec<String>,
    kind: &str,
) -> std::result::Result<(), Refused> {
    let (order, code) = kind.split_at_checked(1).ok_or_else(|| bad("an empty type"))?;
    let (letter, size) = code.split_at_checked(1).ok_or_else(|| bad(&format!("the type {kind:?}")))?;
    let big_endian = match order {
        "<" | "|" | "=" => false,
        ">" => true,
        _ => return Err(bad(&format!("the type {kind:?}"))),
    };
    if letter == "O" {
        let why = "holds pickled Python objects: save an array of numbers or texts";
        return Err(Refused::Unsupported(why.to_owned()));
    }
    // A time has its unit behind its size.
    let digits: String = size.chars().take_while(char::is_ascii_digit).collect();
    let size: usize = match digits.parse() {
        Ok(size) if size <= 1 << 16 => size,
        _ => return Err(bad(&format!("the type {kind:?}"))),
    };
    let (kind, bytes) = match (letter, size) {
        ("i", 1) => (Some(Kind::I8), 1),
        ("u" | "b", 1) => (Some(Kind::U8), 1),
        ("i", 2) => (Some(Kind::I16), 2),
        ("u", 2) => (Some(Kind::U16), 2),
        ("f", 2) => (Some(Kind::F16), 2),
        ("i", 4) => (Some(Kind::I32), 4),
        ("u", 4) => (Some(Kind::U32), 4),
        ("f", 4) => (Some(Kind::F32), 4),
        ("i", 8) => (Some(Kind::I64), 8),
        ("u", 8) => (Some(Kind::U64), 8),
        ("f", 8) => (Some(Kind::F64), 8),
        ("S", n) => (Some(Kind::Bytes(n)), n),
        ("U", n) => (Some(Kind::Utf32(n)), n.saturating_mul(4)),
        ("V" | "m" | "M" | "c" | "f", n) => (None, n),
        _ => return Err(bad(&format!("the type {kind:?}"))),
    };
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

fn numbers(list: &[Literal]) -> std::result::Result<Vec<u64>, Refused> {
    let number = |l: &Literal| match l {
        Literal::Number(n) => Ok(*n),
        _ => Err(bad("a shape that is no number")),
    };
    list.iter().map(number).collect()
}

/// Why a header is not read.
#[derive(Debug)]
enum Refused {
    Bad(String),
    Unsupported(String),
}

fn bad(why: &str) -> Refused {
    Refused::Bad(why.to_owned())
}

/// As much of Python's literals as numpy writes.
#[derive(Debug, PartialEq)]
enum Literal {
    Text(String),
    Number(u64),
    Bool(bool),
    /// A tuple or a list.
    List(Vec<Literal>),
    Dict(Vec<(Literal, Literal)>),
}

struct Parser<'a> {
    rest: &'a str,
    /// How much deeper lists may be in lists.
    levels_left: u32,
}

impl Parser<'_> {
    fn eat(&mut self, token: &str) -> bool {
        self.rest = self.rest.trim_start();
        let found = self.rest.strip_prefix(token);
        self.rest = found.unwrap_or(self.rest);
        found.is_some()
    }

    fn literal(&mut self) -> std::result::Result<Literal, Refused> {
        self.levels_left = self.levels_left.checked_sub(1).ok_or_else(|| bad("too deep"))?;
        let literal = self.inner();
        self.levels_left = self.levels_left.saturating_add(1);
        literal
    }

    fn inner(&mut self) -> std::result::Result<Literal, Refused> {
        for (open, close) in [("(", ")"), ("[", "]")] {
            if self.eat(open) {
                let mut list = Vec::new();
                while !self.eat(close) {
                    list.push(self.literal()?);
                    if !self.eat(",") && !self.rest.starts_with(close) {
                        return Err(bad("no comma in a list"));
                    }
                }
                return Ok(Literal::List(list));
            }
        }
        if self.eat("{") {
            let mut entries = Vec::new();
            while !self.eat("}") {
                let key = self.literal()?;
                if !self.eat(":") {
                    return Err(bad("no colon in a dictionary"));
                }
                entries.push((key, self.literal()?));
                if !self.eat(",") && !self.rest.starts_with('}') {
                    return Err(bad("no comma in a dictionary"));
                }
            }
            return Ok(Literal::Dict(entries));
        }
        for (word, value) in [("True", true), ("False", false)] {
            if self.eat(word) {
                return Ok(Literal::Bool(value));
            }
        }
        for quote in ['\'', '"'] {
            if let Some(rest) = self.rest.strip_prefix(quote) {
                let (text, rest) = rest.split_once(quote).ok_or_else(|| bad("a text without end"))?;
                self.rest = rest;
                return Ok(Literal::Text(text.to_owned()));
            }
        }
        let digits = self.rest.bytes().take_while(u8::is_ascii_digit).count();
        let none = || bad("neither number nor text");
        let (written, rest) = self.rest.split_at_checked(digits).ok_or_else(none)?;
        let number = written.parse().map_err(|_| none())?;
        // Old versions wrote 3L.
        self.rest = rest.trim_start_matches('L');
        Ok(Literal::Number(number))
    }
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
            "{'descr': [('x', '<f4'), ('rgb', '|u1', (3,)), ('pad', '|V2'), ('name', '>U4')], 'fortran_order': False, \
             'shape': (7,), }   \n",
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
            ("{'descr': '<f4', 'fortran_order': False}", "no \"shape\""),
            ("{'descr': '<q4', 'fortran_order': False, 'shape': (5,)}", "<q4"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (5, 99999999999)}", "columns"),
            ("{'descr': '<S99999999', 'fortran_order': False, 'shape': (5,)}", "<S99999999"),
            ("[1, 2]", "no dictionary"),
            ("{'descr'", "colon"),
            ("{'a': ((((((((((((((((((((1))))))))))))))))))))}", "deep"),
        ] {
            let message = format!("{:?}", header(text).unwrap_err());
            assert!(
                message.contains(words) || message.replace('\\', "").contains(words),
                "{text}: {message}"
            );
        }
    }

    proptest! {
        #[test]
        fn any_text_gives_a_header_or_an_error(text in "[{}()\\[\\]',:0-9a-zTF<> ]{0,60}") {
            let _ = header(&text);
        }
    }
}
