//! The statements of an OBJ file, in all dialects in which they are found.
//!
//! Faces may count their corners from the end; a line may go on on the next; only some vertices may have a colour, and only
//! some corners a texture coordinate. Elements that are no faces are left out. Indices are known to be in range.

use crate::error::{Error, Result};
use crate::mesh::obj::lines::{after, logical_lines, next_word, number, parse_f32, text};
use crate::quote::quote;
use s3d_geom::NO_INDEX;
use s3d_geom::glam::{Vec2, Vec3, vec2};
use std::collections::HashMap;
use std::path::Path;

/// What a face is beyond its indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PlainFace {
    pub(crate) line: u64,
    /// Into [`crate::mesh::obj::looks::ObjNames::materials`], or [`NO_INDEX`].
    pub(crate) material: u32,
    /// At least 3.
    pub(crate) corners: u32,
    /// Whether every corner has a texture coordinate.
    pub(crate) has_uv: bool,
    /// Whether every corner has a normal.
    pub(crate) has_normal: bool,
}

/// An OBJ file, understood.
#[derive(Debug)]
pub(crate) struct PlainObj {
    pub(crate) values: Values,
    pub(crate) elements: Elements,
}

/// What elements are made of.
#[derive(Debug, Default)]
pub(crate) struct Values {
    /// The columns of `v`, `vt` and `vn`, as written but for a vertex's weight, by which it is divided.
    pub(crate) positions: Vec<Vec3>,
    pub(crate) uvs: Vec<Vec2>,
    pub(crate) normals: Vec<Vec3>,
    /// Whether one of these is no number, or a weight 0. Which one is for [`crate::mesh::obj::diagnose`] to find.
    pub(crate) has_bad_number: bool,
    /// Vertex, from 0, and colour as written, of the vertices that have one.
    pub(crate) colors: Vec<(u32, [f32; 3])>,
}

/// Faces, and what is left out.
#[derive(Debug, Default)]
pub(crate) struct Elements {
    pub(crate) faces: Vec<PlainFace>,
    /// The indices of all faces' corners into the three columns, from 0, [`NO_INDEX`] for none.
    pub(crate) corners: [Vec<u32>; 3],
    /// Whether there is a `usemtl`.
    pub(crate) has_materials: bool,
    /// Lines of `f` elements with fewer than three corners.
    pub(crate) short_faces: Vec<u64>,
    /// Number of `p` and `l` elements.
    pub(crate) points_and_lines: usize,
    /// How many values each column has had so far: in the end, all.
    counts: [u64; 3],
    /// Faces may come before their vertices: line, column and index of those wait here for the file's end, if the index
    /// is larger than all before in its column. (No smaller one is out of range before a larger one is.)
    forward: Vec<(u64, usize, u64)>,
}

/// What is wrong with a line.
type Fault = (u64, String);

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
        // Faces need of the values no more than their number; each takes half of the time.
        let ((values, bad_value), (elements, bad_element)) =
            rayon::join(|| Values::read(bytes), || Elements::read(bytes));
        // Of several faults the first is told; an index that no value comes to have is one of its own line.
        let counts = if bad_element.is_some() { count_columns(bytes) } else { elements.counts };
        let faults = [bad_value, bad_element, elements.forward_fault(bytes, counts)];
        if let Some((line, message)) = faults.into_iter().flatten().min_by_key(|(line, _)| *line) {
            return Err(Error::line(path, line, message));
        }
        if elements.counts.iter().any(|&n| n >= u64::from(NO_INDEX)) {
            return Err(Error::unsupported(
                path,
                "has more vertices than 32 bits count; cut the scan into parts",
            ));
        }
        Ok(Self { values, elements })
    }
}

/// A line's keyword, with which it starts, and what follows.
#[inline]
fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let keyword = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    (keyword, after(line, keyword))
}

fn fault(number: u64, line: &[u8], message: String) -> Fault {
    (number, format!("{message}: {}", quote(line)))
}

impl Values {
    /// Reads up to the first fault.
    fn read(bytes: &[u8]) -> (Self, Option<Fault>) {
        let mut values = Self::default();
        let mut lines = logical_lines(bytes).filter(|(_, line)| line.first() == Some(&b'v'));
        let fault = lines.find_map(|(number, line)| values.add(&line).err().map(|m| fault(number, &line, m)));
        (values, fault)
    }

    fn add(&mut self, line: &[u8]) -> std::result::Result<(), String> {
        let (keyword, mut rest) = keyword(line);
        match keyword {
            b"v" => self.add_vertex(rest)?,
            b"vt" => {
                // A texture of one dimension has no second coordinate.
                let u = next_word(&mut rest).ok_or("a texture coordinate without a number")?;
                let uv = [u, next_word(&mut rest).unwrap_or(b"0")].map(|word| self.number(word));
                self.uvs.push(vec2(uv[0], uv[1]));
            }
            b"vn" => {
                let mut normal = [0.0; 3];
                for value in &mut normal {
                    let word = next_word(&mut rest).ok_or("a normal needs three numbers")?;
                    *value = self.number(word);
                }
                self.normals.push(Vec3::from_array(normal));
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads a number of a column.
    #[inline]
    fn number(&mut self, word: &[u8]) -> f32 {
        number(word).unwrap_or_else(|| {
            self.has_bad_number = true;
            0.0
        })
    }

    fn add_vertex(&mut self, mut rest: &[u8]) -> std::result::Result<(), String> {
        let mut numbers = [&b""[..]; 8];
        let mut n = 0;
        for slot in &mut numbers {
            let Some(word) = next_word(&mut rest) else { break };
            *slot = word;
            n += 1;
        }
        if !matches!(n, 3 | 4 | 6 | 7) {
            return Err(format!(
                "a vertex has three coordinates, and a colour has three numbers; here are {n}"
            ));
        }
        let mut position =
            Vec3::from_array([numbers[0], numbers[1], numbers[2]].map(|word| self.number(word)));
        if n == 4 {
            let weight = self.number(numbers[3]);
            self.has_bad_number |= weight == 0.0;
            position /= weight;
        }
        // A seventh is the colour's alpha.
        if n >= 6 {
            let mut color = [0.0; 3];
            for (value, word) in color.iter_mut().zip(&numbers[3..]) {
                *value = parse_f32(word)
                    .ok_or_else(|| format!("the colour {} is no finite number", quote(word)))?;
            }
            // More vertices than u32 counts are refused at the end.
            self.colors.push((self.positions.len() as u32, color));
        }
        self.positions.push(position);
        Ok(())
    }
}

impl Elements {
    /// Reads up to the first fault.
    fn read(bytes: &[u8]) -> (Self, Option<Fault>) {
        let mut elements = Self::default();
        let fault = elements.add_lines(bytes).err();
        (elements, fault)
    }

    fn add_lines(&mut self, bytes: &[u8]) -> std::result::Result<(), Fault> {
        let mut materials: HashMap<String, u32> = HashMap::new();
        let mut material = NO_INDEX;
        let mut furthest = [0u64; 3];
        for (number, line) in logical_lines(bytes) {
            let (keyword, rest) = keyword(&line);
            match keyword {
                b"v" => self.counts[0] += 1,
                b"vt" => self.counts[1] += 1,
                b"vn" => self.counts[2] += 1,
                b"f" => {
                    let beyond = self
                        .add_face(number, material, rest)
                        .map_err(|message| fault(number, &line, message))?;
                    for (column, index) in beyond {
                        if let Some(furthest) = furthest.get_mut(column).filter(|f| index > **f) {
                            *furthest = index;
                            self.forward.push((number, column, index));
                        }
                    }
                }
                b"usemtl" => {
                    self.has_materials = true;
                    let next = materials.len() as u32;
                    material = *materials.entry(text(rest.trim_ascii())).or_insert(next);
                }
                b"p" | b"l" => self.points_and_lines += 1,
                // Objects, groups, smoothing and curves say nothing about faces; comments and unknown words neither. For
                // libraries see `ObjNames`.
                _ => {}
            }
        }
        Ok(())
    }

    /// The first face with a corner beyond columns of so many values.
    fn forward_fault(&self, bytes: &[u8], counts: [u64; 3]) -> Option<Fault> {
        let count_of = |column: usize| counts.get(column).copied().unwrap_or(0);
        let &(line, column, index) = self.forward.iter().find(|f| f.2 > count_of(f.1))?;
        let text = logical_lines(bytes).find(|(number, _)| *number == line);
        let message = out_of_range(column, index as i64, count_of(column));
        Some(fault(line, &text.map_or_else(Vec::new, |(_, text)| text.into_owned()), message))
    }

    /// The indices of a corner, from 1 and 0 for none, however it is written.
    fn any_corner(&self, corner: &[u8]) -> std::result::Result<[u64; 3], String> {
        let mut indices = [0; 3];
        let mut parts = corner.split(|&b| b == b'/');
        for (column, (index, count)) in indices.iter_mut().zip(self.counts).enumerate() {
            let part = parts.next().unwrap_or_default();
            if part.is_empty() {
                continue;
            }
            let written =
                whole_number(part).ok_or_else(|| format!("the index {} is no whole number", quote(part)))?;
            let absolute = if written < 0 { count as i64 + written + 1 } else { written };
            if absolute < 1 {
                return Err(out_of_range(column, written, count));
            }
            *index = absolute as u64;
        }
        if parts.next().is_some() {
            return Err(format!("the corner {} has more than three indices", quote(corner)));
        }
        if indices[0] == 0 {
            return Err(format!("the corner {} has no vertex", quote(corner)));
        }
        Ok(indices)
    }

    /// Adds a face, and gives back the columns and indices, from 1, that lie beyond the columns so far.
    fn add_face(
        &mut self,
        line: u64,
        material: u32,
        mut rest: &[u8],
    ) -> std::result::Result<Vec<(usize, u64)>, String> {
        let mut beyond = Vec::new();
        let (start, mut corners) = (self.corners[0].len(), 0);
        let mut has = [true; 3];
        while let Some(corner) = next_word(&mut rest) {
            let indices = match plain_corner(corner) {
                Some(indices) => indices,
                None => self.any_corner(corner)?,
            };
            let columns = self.corners.iter_mut().zip(self.counts).zip(&mut has).zip(indices);
            for (column, (((column_indices, count), has), index)) in columns.enumerate() {
                // What u32 does not hold is beyond every column that is not refused for its length.
                let from_0 = index.checked_sub(1).map_or(NO_INDEX, |i| i.min(u64::from(NO_INDEX - 1)) as u32);
                column_indices.push(from_0);
                *has &= index > 0;
                if index > count {
                    beyond.push((column, index));
                }
            }
            corners += 1;
        }
        if corners < 3 {
            self.corners.iter_mut().for_each(|column| column.truncate(start));
            self.short_faces.push(line);
        } else {
            self.faces.push(PlainFace { line, material, corners, has_uv: has[1], has_normal: has[2] });
        }
        Ok(beyond)
    }
}

/// The indices of a corner, from 1 and 0 for none, if it is written as nearly all are: digits, and a vertex at least.
#[inline]
fn plain_corner(corner: &[u8]) -> Option<[u64; 3]> {
    // So many digits cannot overflow.
    if corner.len() > 18 {
        return None;
    }
    let mut indices = [0; 3];
    let mut columns = indices.iter_mut();
    let mut index: &mut u64 = columns.next()?;
    for &byte in corner {
        match byte {
            b'0' if *index == 0 => return None,
            b'0'..=b'9' => *index = *index * 10 + u64::from(byte - b'0'),
            b'/' => index = columns.next()?,
            _ => return None,
        }
    }
    (indices[0] > 0).then_some(indices)
}

/// The whole number that a word spells, if 64 bits hold it.
#[inline]
fn whole_number(word: &[u8]) -> Option<i64> {
    // Up to 18 digits cannot overflow.
    if word.len() <= 18 && word.iter().all(u8::is_ascii_digit) {
        return Some(word.iter().fold(0, |n, b| n * 10 + i64::from(b - b'0')));
    }
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn count_columns(bytes: &[u8]) -> [u64; 3] {
    let mut counts = [0; 3];
    for (_, line) in logical_lines(bytes) {
        let column = [&b"v"[..], b"vt", b"vn"].iter().position(|k| *k == keyword(&line).0);
        if let Some(count) = column.and_then(|column| counts.get_mut(column)) {
            *count += 1;
        }
    }
    counts
}

fn out_of_range(column: usize, index: i64, count: u64) -> String {
    let what = COLUMNS.get(column).copied().unwrap_or_default();
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
    if bytes.iter().take(4096).any(|b| *b == 0) {
        return Err(Error::format(path, "is binary; a Wavefront OBJ file is text"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::obj::looks::ObjNames;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<PlainObj> {
        PlainObj::parse(Path::new("a.obj"), text.as_bytes())
    }

    const THREE: &str = "v 0 0 0\nv 1 0 0 # x\nv\t0 1 0\n";

    proptest! {
        #[test]
        fn a_plain_corner_is_any_corner(corner in "[0-9/-]{0,20}") {
            let elements = Elements { counts: [9; 3], ..Elements::default() };
            if let Some(indices) = plain_corner(corner.as_bytes()) {
                prop_assert_eq!(elements.any_corner(corner.as_bytes()), Ok(indices));
            }
        }
    }

    #[test]
    fn corners_are_plain_as_nearly_all_files_write_them() {
        for (corner, indices) in
            [("7", [7, 0, 0]), ("10/20", [10, 20, 0]), ("1//3", [1, 0, 3]), ("12/34/50", [12, 34, 50])]
        {
            assert_eq!(plain_corner(corner.as_bytes()), Some(indices));
        }
        for corner in ["", "/1", "0", "1/0", "-1", "+1", "01", "1/2/3/4", "1234567890123456789"] {
            assert_eq!(plain_corner(corner.as_bytes()), None, "{corner}");
        }
    }

    #[test]
    fn dialects_become_plain() {
        let text = format!(
            "{THREE}vt 0.5\nvn 0 0 1 7\nusemtl a b \nf 1/1/1 2/1/1 \\\n 3/1/1 # c\nusemtl c\nf -3//-1 -2//-1 -1//-1\nusemtl a b\nl 1 2 3\np 1\nf 1 2\nf\nf 1/1 2 3"
        );
        let plain = parse(&text).unwrap();
        assert_eq!(plain.values.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!((plain.values.uvs, plain.values.normals), (vec![vec2(0.5, 0.0)], vec![Vec3::Z]));
        let none = NO_INDEX;
        assert_eq!(plain.elements.corners[0], [0, 1, 2, 0, 1, 2, 0, 1, 2]);
        assert_eq!(plain.elements.corners[1], [0, 0, 0, none, none, none, 0, none, none]);
        assert_eq!(plain.elements.corners[2], [0, 0, 0, 0, 0, 0, none, none, none]);
        assert!(plain.elements.has_materials);
        assert_eq!(ObjNames::find(text.as_bytes()).materials, ["a b", "c"]);
        let face =
            |line, material, has_uv, has_normal| PlainFace { line, material, corners: 3, has_uv, has_normal };
        assert_eq!(
            plain.elements.faces,
            [face(7, 0, true, true), face(10, 1, false, true), face(16, 0, false, false)]
        );
        assert_eq!((plain.elements.short_faces, plain.elements.points_and_lines), (vec![14, 15], 2));
    }

    #[test]
    fn numbers_are_read_or_remembered_as_bad() {
        let plain = parse("v 1 2 4 2\nv 1 nan 3\nvt -0.25\nvn 0 0 2 x").unwrap();
        assert_eq!(plain.values.positions[0], Vec3::new(0.5, 1.0, 2.0));
        assert!(plain.values.positions[1].y.is_nan() && !plain.values.has_bad_number);
        assert_eq!((plain.values.uvs[0], plain.values.normals[0]), (vec2(-0.25, 0.0), Vec3::Z * 2.0));
        for text in ["v 1 2 x", "v 1 2 3 0", "v 1 2 3 z", "vt 0 x", "vn 0 0 1-"] {
            assert!(parse(text).unwrap().values.has_bad_number, "{text}");
        }
    }

    #[test]
    fn a_face_may_come_before_its_vertices() {
        assert_eq!(parse(&format!("f 1 2 3\n{THREE}")).unwrap().elements.faces.len(), 1);
    }

    #[test]
    fn colours_stay_with_their_vertices() {
        let plain = parse("v 0 0 0\nv 1 0 0 0.5 1 0\nv 0 1 0 1 1 1 1\n").unwrap();
        assert_eq!(plain.values.colors, [(1, [0.5, 1.0, 0.0]), (2, [1.0; 3])]);
        assert_eq!(plain.values.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
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
