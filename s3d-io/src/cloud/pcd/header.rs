//! The header of a PCD file: a key and its words a line, up to the key DATA.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::records::Kind;
use crate::cloud::table::words::Lines;
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use crate::fs::text::words;
use std::io::BufRead;
use std::path::Path;

/// The most lines of a header.
const MOST_LINES: u64 = 1000;
/// The most numbers of a point.
const MOST_COLUMNS: usize = 4096;

/// How the points are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Data {
    Ascii,
    Binary,
    Compressed,
}

/// A field of every point: one number, or several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PcdField {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) count: usize,
}

impl PcdField {
    /// Whether it only fills a gap.
    pub(super) fn is_padding(&self) -> bool {
        self.name == "_"
    }

    /// The bytes of the field in a point.
    pub(super) fn size(&self) -> usize {
        self.kind.size().saturating_mul(self.count)
    }

    /// The name of one of its numbers: `name`, or `name[i]` if there are several.
    pub(super) fn column(&self, i: usize) -> String {
        if self.count == 1 {
            self.name.clone()
        } else {
            format!("{}[{i}]", self.name)
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PcdHeader {
    pub(super) fields: Vec<PcdField>,
    pub(super) points: u64,
    pub(super) data: Data,
}

/// The words after each key.
#[derive(Default)]
struct Keys {
    fields: Vec<String>,
    sizes: Vec<String>,
    types: Vec<String>,
    counts: Vec<String>,
    width: Option<u64>,
    height: Option<u64>,
    points: Option<u64>,
}

impl PcdHeader {
    /// Reads the header, and leaves `lines` behind it.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] and [`Error::Unsupported`] if it is no header that can be read.
    pub(super) fn read(path: &Path, lines: &mut Lines<impl BufRead>) -> Result<Self> {
        let mut keys = Keys::default();
        let mut is_pcd = false;
        while let Some(line) = lines.next()? {
            let mut all = words(line);
            let Some(key) = all.next().filter(|key| !key.starts_with(b"#")) else { continue };
            let key = key.to_ascii_uppercase();
            let rest: Vec<String> = all.map(|w| String::from_utf8_lossy(w).into_owned()).collect();
            let value = rest.first().map(String::as_str).unwrap_or_default();

            match key.as_slice() {
                b"VERSION" | b"VIEWPOINT" => {}
                b"FIELDS" | b"COLUMNS" => keys.fields = rest,
                b"SIZE" => keys.sizes = rest,
                b"TYPE" => keys.types = rest,
                b"COUNT" => keys.counts = rest,
                b"WIDTH" => keys.width = Some(number(path, lines, value)?),
                b"HEIGHT" => keys.height = Some(number(path, lines, value)?),
                b"POINTS" => keys.points = Some(number(path, lines, value)?),
                b"DATA" => {
                    let data = match value.to_ascii_lowercase().as_str() {
                        "ascii" => Data::Ascii,
                        "binary" => Data::Binary,
                        "binary_compressed" => Data::Compressed,
                        _ => {
                            let message = format!(
                                "DATA {} is unknown: ascii, binary and binary_compressed are read",
                                quote(value.as_bytes())
                            );
                            return Err(Error::unsupported(path, message));
                        }
                    };
                    return keys.header(path, data);
                }
                _ if !is_pcd => break,
                _ => {}
            }

            is_pcd = true;
            if lines.number() > MOST_LINES {
                break;
            }
        }

        if is_pcd {
            return Err(Error::format(path, "ends in its header: no line begins with DATA"));
        }
        let message = "is no PCD: it does not begin with a header such as VERSION 0.7, FIELDS x y z…";
        Err(Error::format(path, message))
    }
}

fn number(path: &Path, lines: &Lines<impl BufRead>, word: &str) -> Result<u64> {
    word.parse().map_err(|_| {
        let message = format!("{} is no number of points", quote(word.as_bytes()));
        Error::line(path, lines.number(), message)
    })
}

impl Keys {
    fn header(self, path: &Path, data: Data) -> Result<PcdHeader> {
        let n = self.fields.len();
        for (key, given) in [("SIZE", &self.sizes), ("TYPE", &self.types), ("COUNT", &self.counts)] {
            if !given.is_empty() && given.len() != n {
                let message = format!("has {n} FIELDS, and {} words after {key}", given.len());
                return Err(Error::format(path, message));
            }
        }

        let mut fields = Vec::new();
        let mut columns = 0usize;
        for (i, name) in self.fields.into_iter().enumerate() {
            // Files before 0.7 may leave out the three lines.
            let word = |list: &[String], usual: &str| list.get(i).map_or(usual.to_owned(), String::clone);
            let size = word(&self.sizes, "4");
            let kind = kind_of(&word(&self.types, "F"), &size).ok_or_else(|| {
                let kind = word(&self.types, "F");
                Error::unsupported(
                    path,
                    format!("the field {name} of TYPE {kind} and SIZE {size} is unknown"),
                )
            })?;
            let count = word(&self.counts, "1");
            let count = count.parse().ok().filter(|c| *c <= MOST_COLUMNS).ok_or_else(|| {
                let message = format!("the field {name} has COUNT {count}: 0 to {MOST_COLUMNS} are read");
                Error::format(path, message)
            })?;
            columns = columns.saturating_add(count);
            fields.push(PcdField { name, kind, count });
        }
        if columns > MOST_COLUMNS {
            return Err(Error::format(path, format!("has {columns} numbers a point")));
        }

        let points = match (self.points, self.width) {
            (Some(points), _) => points,
            (None, Some(width)) => width.saturating_mul(self.height.unwrap_or(1)),
            (None, None) => return Err(Error::format(path, "does not say how many POINTS it has")),
        };
        Ok(PcdHeader { fields, points, data })
    }
}

/// How a number of this TYPE and SIZE is stored.
fn kind_of(letter: &str, size: &str) -> Option<Kind> {
    Some(match (letter.to_ascii_uppercase().as_str(), size) {
        ("I", "1") => Kind::I8,
        ("I", "2") => Kind::I16,
        ("I", "4") => Kind::I32,
        ("I", "8") => Kind::I64,
        ("U", "1") => Kind::U8,
        ("U", "2") => Kind::U16,
        ("U", "4") => Kind::U32,
        ("U", "8") => Kind::U64,
        ("F", "4") => Kind::F32,
        ("F", "8") => Kind::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<(PcdHeader, u64)> {
        let mut lines = Lines::new(Path::new("a.pcd"), text.as_bytes());
        let header = PcdHeader::read(Path::new("a.pcd"), &mut lines)?;
        Ok((header, lines.bytes()))
    }

    #[test]
    fn headers_of_both_versions() {
        let text = "# .PCD v.7\nVERSION .7\nFIELDS x y z _ fpfh rgb\nSIZE 4 4 8 1 4 4\nTYPE F F F U F U\n\
                    COUNT 1 1 1 4 33 1\nWIDTH 3\nHEIGHT 2\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS 6\n\
                    DATA Binary_Compressed\n";
        let (header, bytes) = read(&format!("{text}\x01\x02")).unwrap();
        assert_eq!((header.points, header.data, bytes), (6, Data::Compressed, text.len() as u64));
        let sizes: Vec<usize> = header.fields.iter().map(PcdField::size).collect();
        assert_eq!(sizes, [4, 4, 8, 4, 132, 4]);
        assert_eq!(header.fields[4].column(32), "fpfh[32]");
        assert!(header.fields[3].is_padding() && header.fields[2].kind == Kind::F64);

        let (old, _) = read("COLUMNS x y z\nWIDTH 5\nDATA ascii\n").unwrap();
        assert_eq!((old.points, old.data), (5, Data::Ascii));
        assert!(old.fields.iter().all(|f| (f.kind, f.count) == (Kind::F32, 1)));
    }

    #[test]
    fn headers_that_cannot_be_read_say_why() {
        for (text, words) in [
            ("", "is no PCD"),
            ("solid cube\n", "is no PCD"),
            ("VERSION 0.7\nFIELDS x y z\n", "no line begins with DATA"),
            ("FIELDS x y z\nDATA ascii\n", "how many POINTS"),
            ("FIELDS x y z\nPOINTS many\n", "line 2: `many` is no number of points"),
            ("FIELDS x y z\nSIZE 4 4\nPOINTS 1\nDATA ascii\n", "3 FIELDS, and 2 words after SIZE"),
            ("FIELDS x\nTYPE F\nSIZE 2\nPOINTS 1\nDATA ascii\n", "the field x of TYPE F and SIZE 2"),
            ("FIELDS x\nCOUNT 99999\nPOINTS 1\nDATA ascii\n", "COUNT 99999"),
            ("FIELDS x\nPOINTS 1\nDATA zip\n", "DATA `zip` is unknown"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.starts_with("a.pcd") && message.contains(words), "{message}");
        }
    }
}
