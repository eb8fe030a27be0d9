//! OBJ as it is found, brought to the plain dialect that tobj reads without surprises.
//!
//! tobj 4 silently takes `l` elements of three and more points for faces, gives a corner without a texture coordinate
//! the one of the corner before, lets the colours of a file that colours only some vertices slip to others, counts the
//! index 0 as none, wraps a relative index that points before the start, and stops at a byte that is not UTF-8 even
//! in a comment. Its errors name no line. So everything but the numbers of `v`, `vt` and `vn` is understood here: what
//! reaches tobj are those lines and faces whose indices are known to be in range, as one object without materials.

use crate::obj_lines::{logical_lines, parse_f32, text, without_comment, words};
use crate::quote::quote;
use crate::{Error, Result};
use s3d_geom::NO_INDEX;
use std::collections::HashMap;
use std::io::{BufRead, Read};
use std::path::Path;

/// What a face is beyond its indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PlainFace {
    pub(crate) line: u64,
    /// Into [`PlainObj::materials`], or [`NO_INDEX`].
    pub(crate) material: u32,
    /// At least 3.
    pub(crate) corners: u32,
    /// Whether every corner has a texture coordinate.
    pub(crate) has_uv: bool,
    /// Whether every corner has a normal.
    pub(crate) has_normal: bool,
}

/// A plain OBJ file and what was taken out of it.
#[derive(Debug, Default)]
pub(crate) struct PlainObj {
    /// The `v`, `vt` and `vn` lines.
    columns: Vec<u8>,
    /// One `f` line a face, relative indices made absolute.
    face_lines: Vec<u8>,
    /// Number of `v` lines.
    pub(crate) vertices: usize,
    pub(crate) faces: Vec<PlainFace>,
    /// Vertex, from 0, and colour as written, of the vertices that have one.
    pub(crate) colors: Vec<(u32, [f32; 3])>,
    /// The names that `usemtl` gives, in the order of their first use.
    pub(crate) materials: Vec<String>,
    /// The lines and names of `mtllib`.
    pub(crate) libraries: Vec<(u64, String)>,
    /// Lines of `f` elements with fewer than three corners.
    pub(crate) short_faces: Vec<u64>,
    /// Number of `p` and `l` elements.
    pub(crate) points_and_lines: usize,
    /// Faces may come before their vertices: line, column and index of those wait here for the file's end, if the index
    /// is larger than all before in its column. (No smaller one is out of range before a larger one is.)
    forward: Vec<(u64, usize, u64)>,
}

/// The columns that a corner of a face points into.
const COLUMNS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl PlainObj {
    /// Understands `bytes`, the content of `path`.
    ///
    /// # Errors
    /// With the line: too few numbers, an index that is no number, 0 or out of range, a malformed colour. For the file:
    /// it is UTF-16 or binary.
    pub(crate) fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        refuse_other_files(path, bytes)?;
        let mut plain = Self::default();
        let counts = match plain.add_lines(path, bytes) {
            Ok(counts) => counts,
            // The fault may lie behind an index that points beyond the file's end: the first is told.
            Err(later) => {
                let first = plain.forward_fault(path, bytes, count_columns(bytes));
                return Err(first.unwrap_or(later));
            }
        };
        if let Some(fault) = plain.forward_fault(path, bytes, counts) {
            return Err(fault);
        }
        if counts.iter().any(|&n| n >= u64::from(NO_INDEX)) {
            return Err(Error::unsupported(
                path,
                "has more vertices than 32 bits count; cut the scan into parts",
            ));
        }
        plain.vertices = counts[0] as usize;
        Ok(plain)
    }

    /// Adds all lines, and gives the number of those of each column.
    fn add_lines(&mut self, path: &Path, bytes: &[u8]) -> Result<[u64; 3]> {
        let mut known: HashMap<String, u32> = HashMap::new();
        let mut material = NO_INDEX;
        let (mut counts, mut furthest) = ([0u64; 3], [0u64; 3]);
        for (number, line) in logical_lines(bytes) {
            let fail = |message: String| Error::line(path, number, format!("{message}: {}", quote(&line)));
            let keyword = words(&line).next().unwrap_or_default();
            let rest = &line[keyword.len()..];
            match keyword {
                b"v" => {
                    self.add_vertex(counts[0], rest).map_err(fail)?;
                    counts[0] += 1;
                }
                b"vt" => {
                    // A texture of one dimension has no second coordinate.
                    let mut numbers = words(without_comment(rest));
                    let u =
                        numbers.next().ok_or_else(|| fail("a texture coordinate without a number".into()))?;
                    self.add_column(b"vt", &[u, numbers.next().unwrap_or(b"0")]);
                    counts[1] += 1;
                }
                b"vn" => {
                    let numbers: Vec<&[u8]> = words(without_comment(rest)).take(3).collect();
                    if numbers.len() < 3 {
                        return Err(fail("a normal needs three numbers".into()));
                    }
                    self.add_column(b"vn", &numbers);
                    counts[2] += 1;
                }
                b"f" => {
                    let beyond =
                        self.add_face(number, material, counts, without_comment(rest)).map_err(fail)?;
                    for (column, index) in beyond {
                        if index > furthest[column] {
                            furthest[column] = index;
                            self.forward.push((number, column, index));
                        }
                    }
                }
                b"usemtl" => {
                    let name = text(rest.trim_ascii());
                    material = *known.entry(name).or_insert_with_key(|name| {
                        self.materials.push(name.clone());
                        (self.materials.len() - 1) as u32
                    });
                }
                b"mtllib" => self.libraries.push((number, text(rest.trim_ascii()))),
                b"p" | b"l" => self.points_and_lines += 1,
                // Objects, groups, smoothing and curves say nothing about faces; comments and unknown words neither.
                _ => {}
            }
        }
        Ok(counts)
    }

    fn forward_fault(&self, path: &Path, bytes: &[u8], counts: [u64; 3]) -> Option<Error> {
        let &(line, column, index) = self.forward.iter().find(|f| f.2 > counts[f.1])?;
        let text = logical_lines(bytes).find(|(number, _)| *number == line).map(|(_, text)| quote(&text));
        let message = out_of_range(column, index as i64, counts[column]);
        Some(Error::line(path, line, format!("{message}: {}", text.unwrap_or_default())))
    }

    fn add_column(&mut self, keyword: &[u8], numbers: &[&[u8]]) {
        self.columns.extend_from_slice(keyword);
        for number in numbers {
            self.columns.push(b' ');
            self.columns.extend_from_slice(number);
        }
        self.columns.push(b'\n');
    }

    fn add_vertex(&mut self, vertex: u64, rest: &[u8]) -> std::result::Result<(), String> {
        let numbers: Vec<&[u8]> = words(without_comment(rest)).take(8).collect();
        match numbers.len() {
            // The fourth is a weight, which tobj divides by.
            3 | 4 => self.add_column(b"v", &numbers),
            // A seventh is the colour's alpha.
            6 | 7 => {
                self.add_column(b"v", &numbers[..3]);
                let mut color = [0.0; 3];
                for (value, word) in color.iter_mut().zip(&numbers[3..]) {
                    *value = parse_f32(word)
                        .ok_or_else(|| format!("the colour {} is no finite number", quote(word)))?;
                }
                // More vertices than u32 counts are refused at the end.
                self.colors.push((vertex as u32, color));
            }
            n => {
                return Err(format!(
                    "a vertex has three coordinates, and a colour has three numbers; here are {n}"
                ));
            }
        }
        Ok(())
    }

    /// Adds a face, and gives back the columns and indices, from 1, that lie beyond `counts`.
    fn add_face(
        &mut self,
        line: u64,
        material: u32,
        counts: [u64; 3],
        rest: &[u8],
    ) -> std::result::Result<Vec<(usize, u64)>, String> {
        let mut beyond = Vec::new();
        let (start, mut corners) = (self.face_lines.len(), 0);
        let mut has = [true; 3];
        self.face_lines.push(b'f');
        for corner in words(rest) {
            self.face_lines.push(b' ');
            let mut parts = corner.split(|&b| b == b'/');
            for column in 0..3 {
                let part = parts.next().unwrap_or_default();
                if column > 0 {
                    self.face_lines.push(b'/');
                }
                if part.is_empty() {
                    has[column] = false;
                    continue;
                }
                let index: i64 = std::str::from_utf8(part)
                    .ok()
                    .and_then(|p| p.parse().ok())
                    .ok_or_else(|| format!("the index {} is no whole number", quote(part)))?;
                let count = counts[column];
                let absolute = if index < 0 { count as i64 + index + 1 } else { index };
                if index == 0 || absolute < 1 {
                    return Err(out_of_range(column, index, count));
                }
                if absolute as u64 > count {
                    beyond.push((column, absolute as u64));
                }
                if index > 0 {
                    self.face_lines.extend_from_slice(part);
                } else {
                    self.face_lines.extend_from_slice(absolute.to_string().as_bytes());
                }
            }
            if parts.next().is_some() {
                return Err(format!("the corner {} has more than three indices", quote(corner)));
            }
            if !has[0] {
                return Err(format!("the corner {} has no vertex", quote(corner)));
            }
            corners += 1;
        }
        if corners < 3 {
            self.face_lines.truncate(start);
            self.short_faces.push(line);
        } else {
            self.face_lines.push(b'\n');
            self.faces.push(PlainFace { line, material, corners, has_uv: has[1], has_normal: has[2] });
        }
        Ok(beyond)
    }

    /// The plain file. Its first face has every vertex for a corner, in order: so tobj, which numbers vertices by their
    /// first use, keeps all of them and the file's numbers.
    pub(crate) fn reader(&self) -> impl BufRead {
        let mut all_vertices = vec![b'f'];
        for vertex in 1..=self.vertices {
            all_vertices.push(b' ');
            all_vertices.extend_from_slice(vertex.to_string().as_bytes());
        }
        all_vertices.push(b'\n');
        self.columns.as_slice().chain(std::io::Cursor::new(all_vertices)).chain(self.face_lines.as_slice())
    }
}

fn count_columns(bytes: &[u8]) -> [u64; 3] {
    let mut counts = [0; 3];
    for (_, line) in logical_lines(bytes) {
        let column =
            words(&line).next().and_then(|word| [&b"v"[..], b"vt", b"vn"].iter().position(|k| *k == word));
        if let Some(column) = column {
            counts[column] += 1;
        }
    }
    counts
}

fn out_of_range(column: usize, index: i64, count: u64) -> String {
    let what = COLUMNS[column];
    match index {
        0 => format!("{what} 0: indices count from 1"),
        _ => format!("{what} {index} is not there, {count} are"),
    }
}

fn refuse_other_files(path: &Path, bytes: &[u8]) -> Result<()> {
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(Error::unsupported(
            path,
            "is UTF-16 text; save it as UTF-8, or convert it with `iconv -t UTF-8`",
        ));
    }
    if bytes[..bytes.len().min(4096)].contains(&0) {
        return Err(Error::format(path, "is binary; a Wavefront OBJ file is text"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<PlainObj> {
        PlainObj::parse(Path::new("a.obj"), text.as_bytes())
    }

    fn plain_text(plain: &PlainObj) -> String {
        let mut text = String::new();
        plain.reader().read_to_string(&mut text).unwrap();
        text
    }

    const THREE: &str = "v 0 0 0\nv 1 0 0 # x\nv\t0 1 0\n";

    #[test]
    fn dialects_become_plain() {
        let plain = parse(&format!(
            "{THREE}vt 0.5\nvn 0 0 1 7\nusemtl a b \nf 1/1/1 2/1/1 \\\n 3/1/1 # c\nusemtl c\nf -3//-1 -2//-1 -1//-1\nusemtl a b\nl 1 2 3\np 1\nf 1 2\nf\nf 1/1 2 3"
        ))
        .unwrap();
        assert_eq!(
            plain_text(&plain),
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0\nvn 0 0 1\nf 1 2 3\nf 1/1/1 2/1/1 3/1/1\nf 1//1 2//1 3//1\nf 1/1/ 2// 3//\n"
        );
        assert_eq!(plain.materials, ["a b", "c"]);
        let face =
            |line, material, has_uv, has_normal| PlainFace { line, material, corners: 3, has_uv, has_normal };
        assert_eq!(
            plain.faces,
            [face(7, 0, true, true), face(10, 1, false, true), face(16, 0, false, false)]
        );
        assert_eq!((plain.short_faces, plain.points_and_lines), (vec![14, 15], 2));
    }

    #[test]
    fn a_face_may_come_before_its_vertices() {
        assert_eq!(parse(&format!("f 1 2 3\n{THREE}")).unwrap().faces.len(), 1);
    }

    #[test]
    fn colours_stay_with_their_vertices() {
        let plain = parse("v 0 0 0\nv 1 0 0 0.5 1 0\nv 0 1 0 1 1 1 1\n").unwrap();
        assert_eq!(plain.colors, [(1, [0.5, 1.0, 0.0]), (2, [1.0; 3])]);
        assert!(plain_text(&plain).starts_with("v 0 0 0\nv 1 0 0\nv 0 1 0\n"));
    }

    #[test]
    fn every_fault_has_its_line() {
        for (text, place, words) in [
            ("f 1 2 4", 4, "vertex 4 is not there, 3 are: `f 1 2 4`"),
            ("f 1 2 -4", 4, "vertex -4 is not there"),
            ("f 1 2 0", 4, "vertex 0: indices count from 1"),
            ("f 1/1 2/1 3/1", 4, "texture coordinate 1 is not there, 0 are"),
            ("f 1//9 2//9 3//9", 4, "normal 9"),
            ("f 1 2 x", 4, "`x` is no whole number"),
            ("f 1 2 3.5", 4, "`3.5` is no whole number"),
            ("f 1/ 2/ /3", 4, "`/3` has no vertex"),
            ("vt 0\nvn 0 0 1\nf 1/1/1/1 2 3", 6, "`1/1/1/1` has more than three indices"),
            ("\nv 1 2", 5, "here are 2: `v 1 2`"),
            ("v 1 2 3 4 5", 4, "here are 5"),
            ("v 1 2 3 nan 5 6", 4, "colour `nan`"),
            ("vn 1 2", 4, "three numbers"),
            ("vt", 4, "without a number"),
            ("f 99999999999999999999 1 2", 4, "no whole number"),
            ("f 1 2 5\nv 0 0 1\nf 0 1 2", 4, "vertex 5 is not there, 4 are"),
            ("f 1 2 4\nf 0 1 2\nv 0 0 1", 5, "vertex 0"),
        ] {
            let message = parse(&format!("{THREE}{text}")).unwrap_err().to_string();
            assert!(
                message.starts_with(&format!("a.obj, line {place}: ")) && message.contains(words),
                "{message}"
            );
        }
    }

    #[test]
    fn other_files_are_told_apart() {
        let error = |bytes: &[u8]| PlainObj::parse(Path::new("a.obj"), bytes).unwrap_err().to_string();
        assert!(error(b"\xfe\xff\0v").contains("UTF-16"));
        assert!(error(b"L\x01\x02\0").contains("binary"));
    }
}
