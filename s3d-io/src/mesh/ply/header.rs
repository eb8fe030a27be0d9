//! The header of a PLY file: its encoding, its elements and their properties.
//!
//! PLY has no standard beyond Greg Turk's description of 1994. This reader accepts what files hold: both
//! families of type names (`uchar` and `uint8`), lines that end in LF, CR LF or CR, comments anywhere, and
//! any elements in any order.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::{Error, Result};
use crate::fs::quote::quote;
use std::path::Path;

/// The largest size of a header in bytes. Headers with hundreds of properties and long comments stay far
/// below it.
pub(crate) const MAX_HEADER: usize = 1 << 20;

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlyEncoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlyType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl PlyType {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Returns the size of a number in bytes.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(crate) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Returns the smallest and the largest number of an integer type. Other types have infinite bounds.
    pub(crate) fn range(self) -> (f64, f64) {
        match self {
            Self::I8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
            Self::U8 => (0.0, f64::from(u8::MAX)),
            Self::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
            Self::U16 => (0.0, f64::from(u16::MAX)),
            Self::I32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
            Self::U32 => (0.0, f64::from(u32::MAX)),
            Self::F32 | Self::F64 => (f64::NEG_INFINITY, f64::INFINITY),
        }
    }

    /// Returns its older name, for messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::I8 => "char",
            Self::U8 => "uchar",
            Self::I16 => "short",
            Self::U16 => "ushort",
            Self::I32 => "int",
            Self::U32 => "uint",
            Self::F32 => "float",
            Self::F64 => "double",
        }
    }
}

/// A property of an element: one number in each row, or a list of numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PlyProperty {
    pub(crate) name: String,
    pub(crate) kind: PlyType,
    /// The type of the list's length; `None` for a single number.
    pub(crate) list: Option<PlyType>,
}

impl PlyProperty {
    pub(crate) fn is_list(&self) -> bool {
        self.list.is_some()
    }

    /// Returns the fewest bytes of the property in a row.
    fn min_bytes(&self, encoding: PlyEncoding) -> usize {
        match encoding {
            // One digit and a space.
            PlyEncoding::Ascii => 2,
            _ => self.list.unwrap_or(self.kind).size(),
        }
    }
}

/// An element of the header: a number of rows, all of the same properties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PlyElement {
    pub(crate) name: String,
    /// The number of rows that the header claims. The file may hold fewer.
    pub(crate) count: u64,
    pub(crate) properties: Vec<PlyProperty>,
}

impl PlyElement {
    /// Finds like [`PlyElement::find`], among the properties that are single numbers.
    pub(crate) fn find_scalar(&self, names: &[&str]) -> Option<usize> {
        self.find_where(names, |property| !property.is_list())
    }

    /// Finds like [`PlyElement::find`], among the properties that are lists.
    pub(crate) fn find_list(&self, names: &[&str]) -> Option<usize> {
        self.find_where(names, PlyProperty::is_list)
    }

    fn find_where(&self, names: &[&str], fits: impl Fn(&PlyProperty) -> bool) -> Option<usize> {
        names.iter().find_map(|name| {
            self.properties
                .iter()
                .position(|property| fits(property) && property.name.eq_ignore_ascii_case(name))
        })
    }

    /// Returns the fewest bytes of a row.
    pub(crate) fn min_row_bytes(&self, encoding: PlyEncoding) -> usize {
        self.properties.iter().map(|p| p.min_bytes(encoding)).sum()
    }
}

/// The content of a PLY header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PlyHeader {
    pub(crate) encoding: PlyEncoding,
    /// The text of each `comment` and `obj_info` line, in the order of the file.
    pub(crate) comments: Vec<String>,
    pub(crate) elements: Vec<PlyElement>,
    /// The length of the header in bytes. The rows follow it.
    pub(crate) bytes: usize,
    /// The number of its lines. The first row of an ASCII file is on the next line.
    pub(crate) lines: u64,
    /// The byte that ends a line: LF, or CR in a file without LF.
    pub(crate) line_end: u8,
}

impl PlyHeader {
    /// Reads the header at the front of `bytes`, which are the whole file or at least its first
    /// [`MAX_HEADER`] bytes.
    ///
    /// # Errors
    /// [`Error::Format`] with the line.
    pub(crate) fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        let head = bytes.get(..MAX_HEADER).unwrap_or(bytes);
        let mut lines = head.split(|b| matches!(b, b'\n' | b'\r'));
        let first = lines.next().unwrap_or_default();
        if first.trim_ascii_end() != b"ply" {
            return Err(Error::format(path, "is no PLY file: it does not start with the line \"ply\""));
        }
        let line_end = match head.get(first.len()..) {
            Some([b'\r', rest @ ..]) if rest.first() != Some(&b'\n') => b'\r',
            _ => b'\n',
        };

        let mut header = Self {
            encoding: PlyEncoding::Ascii,
            comments: Vec::new(),
            elements: Vec::new(),
            bytes: 0,
            lines: 0,
            line_end,
        };

        let mut encoding = None;
        // The last piece is cut off: it has no line end.
        let pieces = head
            .split_inclusive(|&b| b == line_end)
            .filter(|piece| piece.ends_with(&[line_end]));

        for piece in pieces {
            let line = piece.trim_ascii();
            header.bytes = header.bytes.saturating_add(piece.len());
            header.lines = header.lines.saturating_add(1);
            let fail = |message: String| {
                let shown = quote(line);
                Error::line(path, header.lines, format!("{message}: {shown}"))
            };
            let text = String::from_utf8_lossy(line);
            let mut words = text.split_ascii_whitespace();
            let keyword = words.next().unwrap_or_default();
            let rest: Vec<&str> = words.collect();

            match (keyword, rest.as_slice()) {
                ("", _) => {}
                ("ply", []) if header.lines == 1 => {}
                ("comment" | "obj_info", _) => {
                    header
                        .comments
                        .push(text.strip_prefix(keyword).unwrap_or(&text).trim().to_owned());
                }
                ("format", [name, ..]) => {
                    encoding = Some(match *name {
                        "ascii" => PlyEncoding::Ascii,
                        "binary_little_endian" => PlyEncoding::LittleEndian,
                        "binary_big_endian" => PlyEncoding::BigEndian,
                        _ => return Err(fail("an unknown format".into())),
                    });
                }
                ("element", [name, count]) => {
                    let count = count.parse().map_err(|_| fail("not a number of rows".into()))?;
                    header.elements.push(PlyElement {
                        name: (*name).to_owned(),
                        count,
                        properties: Vec::new(),
                    });
                }
                ("property", words) => {
                    let property = property(words).map_err(fail)?;
                    match header.elements.last_mut() {
                        Some(element) => element.properties.push(property),
                        None => return Err(fail("a property before the first element".into())),
                    }
                }
                ("end_header", _) => {
                    let Some(encoding) = encoding else {
                        return Err(fail("the header names no format".into()));
                    };
                    header.encoding = encoding;
                    return Ok(header);
                }
                _ => return Err(fail("no line of a PLY header".into())),
            }
        }

        Err(Error::format(
            path,
            if head.len() < MAX_HEADER {
                format!("is cut off in its header, after line {}: there is no \"end_header\"", header.lines)
            } else {
                "has no \"end_header\" in its first 1,048,576 bytes".to_owned()
            },
        ))
    }

    /// Finds an element by its name. Returns its index too.
    pub(crate) fn element(&self, name: &str) -> Option<(usize, &PlyElement)> {
        self.elements
            .iter()
            .enumerate()
            .find(|(_, e)| e.name.eq_ignore_ascii_case(name))
    }
}

/// Reads a property from the words after `property`.
fn property(words: &[&str]) -> std::result::Result<PlyProperty, String> {
    match words {
        ["list", length, value, name] => {
            let length = type_of(length)?;
            if !length.is_integer() {
                return Err("the length of a list is an integer".into());
            }
            Ok(PlyProperty { name: (*name).to_owned(), kind: type_of(value)?, list: Some(length) })
        }
        ["list", ..] => Err("a list property has two types and a name".into()),
        [value, name] => Ok(PlyProperty { name: (*name).to_owned(), kind: type_of(value)?, list: None }),
        _ => Err("a property has a type and a name".into()),
    }
}

fn type_of(name: &str) -> std::result::Result<PlyType, String> {
    PlyType::parse(name).ok_or_else(|| format!("`{name}` is no type of PLY"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> std::result::Result<PlyHeader, String> {
        PlyHeader::parse(Path::new("a.ply"), text.as_bytes()).map_err(|e| e.to_string())
    }

    #[test]
    fn both_families_of_type_names_and_every_part() {
        let text = "ply\nformat binary_big_endian 1.0\ncomment  made by hand \nobj_info n 1\n\
                    element vertex 3\n\
            property char a\nproperty uint8 b\nproperty short c\nproperty uint16 d\nproperty int e\n\
            property uint32 f\n\
            comment between\nproperty float g\nproperty float64 h\nelement face 18446744073709551615\n\
            property list uchar int Vertex_Indices\nelement none 0\nend_header\nrest";
        let header = parse(text).unwrap();
        assert_eq!(header.encoding, PlyEncoding::BigEndian);
        assert_eq!(header.comments, ["made by hand", "n 1", "between"]);
        assert_eq!((header.bytes, header.lines), (text.len() - 4, 18));
        let kinds: Vec<PlyType> = header.elements[0].properties.iter().map(|p| p.kind).collect();
        use PlyType::*;
        assert_eq!(kinds, [I8, U8, I16, U16, I32, U32, F32, F64]);
        assert_eq!(header.elements[0].min_row_bytes(PlyEncoding::BigEndian), 1 + 1 + 2 + 2 + 4 + 4 + 4 + 8);
        let (place, face) = header.element("face").unwrap();
        assert_eq!((place, face.count), (1, u64::MAX));
        assert_eq!(face.find_list(&["vertex_index", "vertex_indices"]), Some(0));
        assert_eq!(
            (face.find_scalar(&["vertex_indices"]), face.find_list(&["vertex_indices"])),
            (None, Some(0))
        );
        assert_eq!(header.element("none").unwrap().1.properties, []);
    }

    #[test]
    fn lines_end_in_three_ways() {
        let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n";
        for (end, mark) in [("\n", b'\n'), ("\r\n", b'\n'), ("\r", b'\r'), (" \t\n", b'\n')] {
            let header = parse(&text.replace('\n', end)).unwrap();
            assert_eq!((header.line_end, header.lines, header.elements.len()), (mark, 5, 1), "{end:?}");
        }
        // The rows of a binary file may start with the byte of a line end.
        let header = parse("ply\nformat binary_little_endian 1.0\nend_header\n\n\n").unwrap();
        assert_eq!(header.bytes, 47);
    }

    #[test]
    fn faults_have_their_line() {
        for (text, words) in [
            ("", "is no PLY file"),
            ("plywood\n", "is no PLY file"),
            ("ply\nformat ascii 1.0\nelement vertex 1\n", "cut off in its header, after line 3"),
            ("ply\nend_header\n", "line 2: the header names no format"),
            ("ply\nformat text 1.0\n", "line 2: an unknown format: `format text 1.0`"),
            ("ply\nelement vertex -1\n", "line 2: not a number of rows"),
            ("ply\nelement vertex\n", "line 2: no line of a PLY header: `element vertex`"),
            ("ply\nproperty float x\n", "line 2: a property before the first element"),
            ("ply\nelement v 1\nproperty int64 x\n", "line 3: `int64` is no type of PLY"),
            ("ply\nelement v 1\nproperty list float int x\n", "line 3: the length of a list is an integer"),
            ("ply\nelement v 1\nproperty list uchar x\n", "line 3: a list property has two types and a name"),
            ("ply\nelement v 1\nproperty float\n", "line 3: a property has a type and a name"),
            ("ply\nhello\u{1}\n", "line 2: no line of a PLY header: `hello\u{fffd}`"),
        ] {
            let message = parse(text).unwrap_err();
            assert!(message.starts_with("a.ply") && message.contains(words), "{text:?}: {message}");
        }
        let endless = format!("ply\ncomment {}\n", "x".repeat(MAX_HEADER));
        assert!(parse(&endless).unwrap_err().contains("in its first 1,048,576 bytes"));
    }
}
