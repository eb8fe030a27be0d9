//! Finds the line of a fault in an OBJ file, after the file is known to have one. A strict scan of the
//! statements is needed, since tobj reports no line and accepts indices that are out of range.

use crate::error::Error;
use crate::fs::quote::quote;
use crate::mesh::obj::lines::{Line, logical_lines, next_word};
use crate::mesh::obj::statement::{Why, corner, normal, other, out_of_range, uv, vertex};
use s3d_geom::glam::Vec3;
use std::path::Path;

/// Returns the error for the first fault of a file that tobj refuses with the words `said`.
pub(crate) fn fault(path: &Path, bytes: &[u8], said: &str) -> Error {
    // A face may come before its vertices.
    let mut counts = [0; 3];
    for line in logical_lines(bytes) {
        count(&line, &mut counts);
    }

    let mut so_far = [0; 3];
    for line in logical_lines(bytes) {
        count(&line, &mut so_far);
        if let Err(why) = check(&line, so_far, counts) {
            return Error::line(path, line.number, format!("{why}: {}", quote(&line.text)));
        }
    }
    Error::format(path, format!("cannot be read: {said}"))
}

fn count(line: &Line<'_>, counts: &mut [u64; 3]) {
    let column = [&b"v"[..], b"vt", b"vn"]
        .iter()
        .position(|keyword| *keyword == line.keyword().0);
    if let Some(count) = column.and_then(|column| counts.get_mut(column)) {
        *count += 1;
    }
}

/// Checks a statement. The columns have `so_far` values before it and `counts` values in the whole file.
fn check(line: &Line<'_>, so_far: [u64; 3], counts: [u64; 3]) -> Result<(), Why> {
    let (keyword, mut rest) = line.keyword();
    match keyword {
        b"v" => vertex(rest).map(|_| ()),
        b"vt" => uv(rest).map(|_| ()),
        b"vn" => normal(rest).map(|_| ()),
        b"f" | b"fo" => {
            while let Some(word) = next_word(&mut rest) {
                let indices = corner(word, so_far)?;
                for (column, (index, count)) in indices.into_iter().zip(counts).enumerate() {
                    if index > count {
                        return Err(out_of_range(column, index as i64, count));
                    }
                }
            }
            Ok(())
        }
        _ => other(keyword).map(drop),
    }
}

/// Returns the error for a vertex, counted from 0, whose position is not finite.
pub(crate) fn vertex_error(path: &Path, bytes: &[u8], vertex: u32, position: Vec3) -> Error {
    match logical_lines(bytes)
        .filter(|line| line.keyword().0 == b"v")
        .nth(vertex as usize)
    {
        Some(line) => {
            let message = format!("a face uses a vertex that is not finite: {}", quote(&line.text));
            Error::line(path, line.number, message)
        }
        None => Error::format(path, format!("vertex {} is not finite: {position}", u64::from(vertex) + 1)),
    }
}

/// Returns the line of a face, counted from 0 among the faces of three or more corners.
pub(crate) fn face_line(bytes: &[u8], face: usize) -> Option<u64> {
    let mut faces = logical_lines(bytes).filter(|line| {
        let (keyword, mut rest) = line.keyword();
        matches!(keyword, b"f" | b"fo") && std::iter::from_fn(|| next_word(&mut rest)).nth(2).is_some()
    });
    faces.nth(face).map(|line| line.number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &[u8]) -> String {
        fault(Path::new("a.obj"), text, "why").to_string()
    }

    #[test]
    fn the_first_fault_is_found() {
        let text = b"v 0 0 0\nvt 0.5 # x\n# v 0 0 x\nvn 0 0 1\nv 1 3.1+e2 0\nv x 0 0\n";
        assert_eq!(told(text), "a.obj, line 5: `3.1+e2` is no number: `v 1 3.1+e2 0`");
        assert!(told(b"v 0 0 0 0\n").contains("line 1: the vertex has the weight 0"));
        assert_eq!(
            told(b"v 0 0 0\nface 1 2 3\n"),
            "a.obj, line 2: `face` is no word of the format: `face 1 2 3`"
        );
        assert!(
            told(b"g a\nF 1 2 3\n").contains("line 2: `F` is no word of the format, which has `f` in lower")
        );
        assert_eq!(told(b"v 0 0 0\n"), "a.obj: cannot be read: why");
    }

    #[test]
    fn a_vertex_is_found_by_its_number() {
        let text = b"v 0 0 0\nvn 0 0 1\nv nan 0 0\n";
        let message = vertex_error(Path::new("a.obj"), text, 1, Vec3::NAN).to_string();
        assert!(message.starts_with("a.obj, line 3") && message.contains("`v nan 0 0`"), "{message}");
        assert!(
            vertex_error(Path::new("a.obj"), text, 7, Vec3::NAN)
                .to_string()
                .contains("vertex 8")
        );
    }

    #[test]
    fn a_face_is_found_by_its_number() {
        assert_eq!(face_line(b"f 1 2 3\nf 1 2\nl 1 2 3\nf 1 2 # 3\nf 1 2 3", 1), Some(5));
    }
}
