//! Rewrites OBJ text so that tobj 4 reads it right.
//!
//! Plain statements go to tobj unchanged. These are left out or rewritten, each with its test:
//! * `o`, `g` and `usemtl` start new models in tobj, each with its own vertices; our mesh keeps the vertices
//!   of the file (`vertices_and_faces_keep_the_files_order`, `polygons_are_cut_with_their_attributes`);
//! * `l` with three points becomes a triangle, and `f` with fewer than three corners stays
//!   (`what_is_left_out_is_told`);
//! * a corner without a texture coordinate or normal takes the previous corner's (`dialects_become_plain`),
//!   and so does a corner whose index is 0, out of range or too large (`every_fault_has_its_line`);
//! * continued lines, comments after numbers, a `vt` of one number, a colour with alpha, lines that end in CR
//!   alone and a UTF-8 byte order mark are refused (`dialects_become_plain`, `obj_files_of_every_dialect`);
//! * bytes that are not UTF-8 are refused, even in comments and names (`names_need_not_be_utf_8`);
//! * if only some vertices have colours, they go to the first vertices
//!   (`vertex_colours_of_both_scales_and_of_some_vertices`).

use crate::mesh::obj::lines::{logical_lines, next_word, text};
use crate::mesh::obj::statement::{self, Other};
use s3d_geom::NO_INDEX;
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{BufRead, Read};
use std::ops::Range;

/// What faces have beside their corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FaceKind {
    /// An index into [`ObjNames::materials`], or [`NO_INDEX`].
    pub(crate) material: u32,
    /// Whether every corner has a texture coordinate.
    pub(crate) has_uv: bool,
    /// Whether every corner has a normal.
    pub(crate) has_normal: bool,
}

/// The names in an OBJ file.
#[derive(Debug, Default)]
pub(crate) struct ObjNames {
    /// The names of `usemtl`, in the order of their first use.
    pub(crate) materials: Vec<String>,
    /// The lines and names of `mtllib`.
    pub(crate) libraries: Vec<(u64, String)>,
}

/// An OBJ file for tobj, with everything that tobj does not report.
#[derive(Debug, Default)]
pub(crate) struct NormalObj<'a> {
    bytes: &'a [u8],
    /// What tobj reads, in order: ranges of the file or of `rewritten`.
    pieces: Vec<Piece>,
    rewritten: Vec<u8>,
    /// How many values the columns `v`, `vt` and `vn` have.
    pub(crate) counts: [u64; 3],
    /// Whether any corner has an index into them.
    used: [bool; 3],
    /// The columns whose indices are passed over: faces index them, and the file does not have them.
    pub(crate) left_out: [bool; 3],
    /// How many vertices have a colour. If only some have one, the others get a colour that is not finite.
    pub(crate) colored: u64,
    /// The number of faces with three or more corners.
    pub(crate) faces: usize,
    /// The kind of all faces from this number on, up to the next entry.
    pub(crate) kinds: Vec<(usize, FaceKind)>,
    pub(crate) names: ObjNames,
    /// The lines of `f` elements with fewer than three corners.
    pub(crate) short_faces: Vec<u64>,
    /// The number of `p` and `l` elements.
    pub(crate) points_and_lines: usize,
    /// Statements that bring other shapes: line and word of the first, and how many there are.
    pub(crate) other_geometry: Option<(u64, String, usize)>,
}

#[derive(Debug)]
enum Piece {
    File(Range<usize>),
    Rewritten(Range<usize>),
}

/// A line for tobj: rewritten, or `None` if it stays as it is.
type Line = Option<String>;

impl<'a> NormalObj<'a> {
    /// Returns `None` if a statement has a fault. tobj finds other faults.
    pub(crate) fn new(bytes: &'a [u8]) -> Option<Self> {
        let obj = Self::scan(bytes, false, [false; 3])?;
        // tobj does not check indices into an empty column. Only vertices are needed.
        let [no_vertices, no_uvs, no_normals] = obj.empty_columns();
        if no_vertices {
            return None;
        }

        let every_or_none = obj.colored == 0 || obj.colored == obj.counts[0];
        if every_or_none && !no_uvs && !no_normals {
            return Some(obj);
        }
        Self::scan(bytes, !every_or_none, [false, no_uvs, no_normals])
    }

    /// Returns whether faces index each column although it is empty.
    fn empty_columns(&self) -> [bool; 3] {
        let [v, vt, vn] = self.counts.map(|count| count == 0);
        let [of_v, of_vt, of_vn] = self.used;
        [v && of_v, vt && of_vt, vn && of_vn]
    }

    /// Scans all statements. Vertices without a colour get one that is not finite if `fill_colors` is set.
    /// Indices into the columns of `left_out` are passed over.
    fn scan(bytes: &'a [u8], fill_colors: bool, left_out: [bool; 3]) -> Option<Self> {
        let mut obj = Self { bytes, left_out, ..Self::default() };

        let mut materials: HashMap<String, u32> = HashMap::new();
        let mut material = NO_INDEX;

        for line in logical_lines(bytes) {
            let (keyword, rest) = line.keyword();
            let read = match keyword {
                b"v" => obj.vertex(rest, fill_colors)?,
                b"vt" => obj.uv(rest)?,
                b"vn" => obj.normal(rest)?,
                // Wavefront reads `fo`, a face with its outline, as `f`.
                b"f" | b"fo" => match obj.face(rest, material, keyword == b"f")? {
                    Some(read) => read,
                    None => {
                        obj.short_faces.push(line.number);
                        continue;
                    }
                },
                b"usemtl" => {
                    let next = materials.len() as u32;
                    let name = text(rest.trim_ascii());
                    material = *materials.entry(name).or_insert_with_key(|name| {
                        obj.names.materials.push(name.clone());
                        next
                    });
                    continue;
                }
                b"mtllib" => {
                    obj.names.libraries.push((line.number, text(rest.trim_ascii())));
                    continue;
                }
                b"p" | b"l" => {
                    obj.points_and_lines += 1;
                    continue;
                }
                _ => {
                    if statement::other(keyword).ok()? == Other::Geometry {
                        let word = || (line.number, text(keyword), 0);
                        obj.other_geometry.get_or_insert_with(word).2 += 1;
                    }
                    continue;
                }
            };

            match (read, line.text) {
                (None, Cow::Borrowed(_)) => obj.keep(line.place),
                (None, Cow::Owned(joined)) => obj.rewrite(&joined),
                (Some(anew), _) => obj.rewrite(anew.as_bytes()),
            }
        }
        Some(obj)
    }

    /// Hands a range of the file to tobj.
    fn keep(&mut self, place: Range<usize>) {
        match self.pieces.last_mut() {
            Some(Piece::File(last)) if last.end == place.start => last.end = place.end,
            _ => self.pieces.push(Piece::File(place)),
        }
    }

    /// Hands a rewritten line to tobj.
    fn rewrite(&mut self, line: &[u8]) {
        let start = self.rewritten.len();
        self.rewritten.extend_from_slice(line);
        self.rewritten.push(b'\n');
        let end = self.rewritten.len();
        match self.pieces.last_mut() {
            Some(Piece::Rewritten(last)) => last.end = end,
            _ => self.pieces.push(Piece::Rewritten(start..end)),
        }
    }

    fn vertex(&mut self, rest: &[u8], fill_colors: bool) -> Option<Line> {
        self.counts[0] += 1;
        let plain = plain_numbers(rest);
        let is_colored = plain == Some(6) && are_finite(rest);
        if is_colored || !fill_colors && matches!(plain, Some(3 | 4)) {
            self.colored += u64::from(is_colored);
            return Some(None);
        }

        let (p, color) = statement::vertex(rest).ok()?;
        self.colored += u64::from(color.is_some());
        let color = match color.or_else(|| fill_colors.then_some([f32::NAN; 3])) {
            Some([r, g, b]) => format!(" {r} {g} {b}"),
            None => String::new(),
        };
        Some(Some(format!("v {} {} {}{color}", p.x, p.y, p.z)))
    }

    fn uv(&mut self, rest: &[u8]) -> Option<Line> {
        self.counts[1] += 1;
        if plain_numbers(rest).is_some_and(|n| n >= 2) {
            return Some(None);
        }
        let [u, v] = statement::uv(rest).ok()?;
        Some(Some(format!("vt {u} {v}")))
    }

    fn normal(&mut self, rest: &[u8]) -> Option<Line> {
        self.counts[2] += 1;
        if plain_numbers(rest).is_some_and(|n| n >= 3) {
            return Some(None);
        }
        let [x, y, z] = statement::normal(rest).ok()?;
        Some(Some(format!("vn {x} {y} {z}")))
    }

    /// Returns `Some(None)` for a face of fewer than three corners. `is_known` if tobj knows its keyword.
    fn face(&mut self, rest: &[u8], material: u32, is_known: bool) -> Option<Option<Line>> {
        let plain = Corners::plain(rest).filter(|_| is_known && self.left_out == [false; 3]);
        let (corners, line) = match plain {
            Some(corners) => (corners, None),
            None => self.any_face(rest)?,
        };
        if corners.n < 3 {
            return Some(None);
        }

        for (used, has) in self.used.iter_mut().zip(corners.any_has) {
            *used |= has;
        }
        let [_, has_uv, has_normal] = corners.all_have;
        let kind = FaceKind { material, has_uv, has_normal };
        if self.kinds.last().is_none_or(|(_, last)| *last != kind) {
            self.kinds.push((self.faces, kind));
        }
        self.faces += 1;
        Some(Some(line))
    }

    /// Reads corners in any notation, and rewrites them plainly.
    fn any_face(&self, mut rest: &[u8]) -> Option<(Corners, Line)> {
        let mut line = String::from("f");
        while let Some(word) = next_word(&mut rest) {
            let mut indices = statement::corner(word, self.counts).ok()?;
            for (index, left_out) in indices.iter_mut().zip(self.left_out) {
                if left_out {
                    *index = 0;
                }
            }
            let [v, vt, vn] = indices;
            let [vt, vn] = [vt, vn].map(|index| if index == 0 { String::new() } else { index.to_string() });
            line += &format!(" {v}/{}/{}", vt, vn);
        }
        let corners = line
            .strip_prefix('f')
            .and_then(|rest| Corners::plain(rest.as_bytes()))?;
        Some((corners, Some(line)))
    }

    /// Returns the text for tobj. tobj numbers vertices by their first use, so the text begins with
    /// [`Self::vertex_faces`] faces that use all vertices in order.
    pub(crate) fn reader(&self) -> impl BufRead {
        // A corner without further indices takes the previous corner's: here the first of each column.
        let mut vertex_faces = String::from("f 1/1/1");
        for vertex in 2..=self.counts[0] {
            vertex_faces += if vertex % 4 == 1 { "\nf " } else { " " };
            vertex_faces += &vertex.to_string();
        }
        vertex_faces.push('\n');

        std::io::Cursor::new(vertex_faces).chain(Pieces { obj: self, next: 0, rest: &[] })
    }

    /// Returns how many such faces come before the faces of the file.
    pub(crate) fn vertex_faces(&self) -> usize {
        self.counts[0].div_ceil(4).max(1) as usize
    }
}

/// The pieces of an OBJ file, read as one text.
struct Pieces<'a> {
    obj: &'a NormalObj<'a>,
    next: usize,
    rest: &'a [u8],
}

impl BufRead for Pieces<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        while self.rest.is_empty()
            && let Some(piece) = self.obj.pieces.get(self.next)
        {
            self.next += 1;
            let piece = match piece {
                Piece::File(place) => self.obj.bytes.get(place.clone()),
                Piece::Rewritten(place) => self.obj.rewritten.get(place.clone()),
            };
            self.rest = piece.unwrap_or_default();
        }
        Ok(self.rest)
    }

    fn consume(&mut self, n: usize) {
        self.rest = self.rest.get(n..).unwrap_or_default();
    }
}

impl Read for Pieces<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let n = self.fill_buf()?.read(into)?;
        self.consume(n);
        Ok(n)
    }
}

/// The corners of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Corners {
    /// How many corners there are.
    n: usize,
    /// Whether every corner has a vertex, a texture coordinate, a normal.
    all_have: [bool; 3],
    /// Whether any corner has one.
    any_has: [bool; 3],
}

impl Corners {
    /// Reads an `f` line without its keyword, if tobj reads it right: digits and slashes, a vertex at each
    /// corner, no index that is 0 or too large for tobj's arithmetic.
    fn plain(rest: &[u8]) -> Option<Self> {
        let mut corners = Self { n: 0, all_have: [true; 3], any_has: [false; 3] };
        // For the current corner: which indices it has, which one is being read, and its digits so far.
        let mut has = [false; 3];
        let mut part = 0;
        let mut digits = 0;

        for &byte in rest.iter().chain(b" ") {
            match byte {
                b'0' if digits == 0 => return None,
                b'0'..=b'9' if digits < 18 => {
                    digits += 1;
                    *has.get_mut(part)? = true;
                }
                b'/' => {
                    part += 1;
                    digits = 0;
                }
                b' ' | b'\t' if digits > 0 || part > 0 => {
                    if !has[0] || part > 2 {
                        return None;
                    }
                    corners.n += 1;
                    for ((all, any), has) in corners.all_have.iter_mut().zip(&mut corners.any_has).zip(has) {
                        *all &= has;
                        *any |= has;
                    }
                    has = [false; 3];
                    part = 0;
                    digits = 0;
                }
                b' ' | b'\t' => {}
                _ => return None,
            }
        }

        Some(corners)
    }
}

/// Counts the words of the rest of a line. Returns `None` if any byte does not belong to a decimal number.
fn plain_numbers(rest: &[u8]) -> Option<usize> {
    let mut words = 0;
    let mut in_word = false;
    for &byte in rest {
        match byte {
            b'0'..=b'9' | b'.' | b'-' | b'+' | b'e' | b'E' => {
                words += usize::from(!in_word);
                in_word = true;
            }
            b' ' | b'\t' => in_word = false,
            _ => return None,
        }
    }
    Some(words)
}

/// Returns whether it is plain that all decimal numbers of a line are finite as `f32`: none has an exponent
/// or 39 digits.
fn are_finite(numbers: &[u8]) -> bool {
    numbers
        .split(|byte| matches!(byte, b' ' | b'\t'))
        .all(|word| word.len() < 39 && !word.iter().any(|byte| matches!(byte, b'e' | b'E')))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns what tobj reads of a file, without the faces in front, and the rest of what was found.
    fn normal(text: &str) -> Option<(String, NormalObj<'_>)> {
        let obj = NormalObj::new(text.as_bytes())?;
        let mut all = String::new();
        obj.reader().read_to_string(&mut all).unwrap();
        let rest = all.split_inclusive('\n').skip(obj.vertex_faces()).collect();
        Some((rest, obj))
    }

    const THREE: &str = "v 0 0 0\nv 1 0 0 # x\nv\t0 1 0\n";

    #[test]
    fn plain_text_stays() {
        let text = "v 0 0 0\nv 1 0 0 2\nv\t0 1e-3 -.5\r\nvt 0 1\nvt 0 1 0\nvn 0 +1 0\nf 1/1/1 2/2/1 3/1/1\n\
                    f 1 2 3 2\nf 1// 2//1 3";
        let (rest, obj) = normal(text).unwrap();
        assert_eq!(rest, text);
        assert_eq!((obj.pieces.len(), obj.faces), (1, 3));
        assert_eq!((obj.counts, obj.colored), ([3, 2, 1], 0));
    }

    fn kind(material: u32, has_uv: bool, has_normal: bool) -> FaceKind {
        FaceKind { material, has_uv, has_normal }
    }

    #[test]
    fn dialects_become_plain() {
        let text = format!(
            "\u{feff}{THREE}vt 0.5\nvn 0 0 1 x\nusemtl a b \nf 1/1/1 2/1/1 \\\n 3/1/1 # c\nusemtl c\n\
             f -3//-1 -2//-1 -1//-1\n\
             usemtl a b\nl 1 2 3\np 1\nf 1 2\nf\ng x\nf 1/1 2 +3"
        );
        let (rest, obj) = normal(&text).unwrap();
        let expected = "v 0 0 0\nv 1 0 0\nv\t0 1 0\nvt 0.5 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n\
                        f 1//1 2//1 3//1\nf 1/1/ 2// 3//\n";
        assert_eq!(rest, expected);

        assert_eq!(
            obj.kinds,
            [(0, kind(0, true, true)), (1, kind(1, false, true)), (2, kind(0, false, false))]
        );
        assert_eq!(obj.names.materials, ["a b", "c"]);
        assert_eq!((obj.faces, obj.short_faces, obj.points_and_lines), (3, vec![14, 15], 2));
    }

    #[test]
    fn every_vertex_has_a_colour_or_none() {
        let (rest, obj) = normal("v 0 0 0 1 0 .5\nv 1 0 0 1 1 1 1\n").unwrap();
        assert_eq!((&*rest, obj.colored), ("v 0 0 0 1 0 .5\nv 1 0 0 1 1 1\n", 2));
        let (rest, obj) = normal("v 0 0 0 1 0 .5\nv 1 0 1e-1\nv 1 2 3 2\n").unwrap();
        assert_eq!(rest, "v 0 0 0 1 0 .5\nv 1 0 0.1 NaN NaN NaN\nv 0.5 1 1.5 NaN NaN NaN\n");
        assert_eq!(obj.colored, 1);
        // Numbers that no `f32` holds are no colour.
        let beyond = format!("v 0 0 0 {} 0 0\n", "9".repeat(39));
        for line in ["v 0 0 0 0 1.5 1e99\n", &beyond] {
            let text = format!("v 0 0 0 1 0 .5\n{line}");
            let (rest, obj) = normal(&text).unwrap();
            assert_eq!((&*rest, obj.colored), ("v 0 0 0 1 0 .5\nv 0 0 0 NaN NaN NaN\n", 1));
        }
    }

    #[test]
    fn corners_are_plain_as_nearly_all_files_write_them() {
        for (face, n, all_have, any_has) in [
            (" 1 2  3", 3, [true, false, false], [true, false, false]),
            ("1/2 10/20\t100/200 3/4", 4, [true, true, false], [true, true, false]),
            ("1//3 2/2/2 3/", 3, [true, false, false], [true; 3]),
            ("123456789012345678", 1, [true, false, false], [true, false, false]),
        ] {
            assert_eq!(Corners::plain(face.as_bytes()), Some(Corners { n, all_have, any_has }), "{face}");
        }
        for face in
            ["/1", "0", "1/0", "-1", "+1", "01", "1/2/3/4", "1/2/3/", "1234567890123456789", "1#", "1\r2"]
        {
            assert_eq!(Corners::plain(face.as_bytes()), None, "{face}");
        }
    }

    #[test]
    fn names_need_not_be_utf_8() {
        let bytes = b"# W\xe4nde\nv 0 0 0 # \xe4\nusemtl W\xe4nde\nf 1 1 1\n";
        let obj = NormalObj::new(bytes).unwrap();
        let mut all = String::new();
        obj.reader().read_to_string(&mut all).unwrap();
        assert_eq!((&*all, &*obj.names.materials[0]), ("f 1/1/1\nv 0 0 0\nf 1 1 1\n", "W\u{e4}nde"));
        let theirs = tobj::load_obj_buf(&mut &bytes[..], &tobj::LoadOptions::default(), |_| unreachable!());
        assert_eq!(theirs.unwrap_err(), tobj::LoadError::ReadError);
    }

    #[test]
    fn faults_are_not_passed_on() {
        for text in [
            "vt 0 0\nf 1/0 2/1 3/1",
            "vt 0 0\nf 1/-2 2/1 3/1",
            "vn 0 0 1\nf 1//6148914691236517206 2//1 3//1",
            "f 1/1/1/1 2 3",
            "v 1 2 3 1 2 x",
            "vt 0 1\u{a0}0",
        ] {
            assert!(normal(&format!("{THREE}{text}")).is_none(), "{text}");
        }
    }
}
