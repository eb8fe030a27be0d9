//! Where in an OBJ file a number is bad: a plain scan of its lines, for when it is known only that one is.

use crate::error::Error;
use crate::mesh::obj::lines::{logical_lines, parse_f32, without_comment, words};
use crate::quote::quote;
use s3d_geom::glam::Vec3;
use std::path::Path;

/// The error for the first number that cannot be read.
pub(crate) fn number_error(path: &Path, bytes: &[u8]) -> Error {
    for (number, line) in logical_lines(bytes) {
        let mut words = words(without_comment(&line));
        let most = match words.next() {
            Some(b"v") => 7,
            Some(b"vt") => 2,
            Some(b"vn") => 3,
            _ => continue,
        };
        let is_vertex = most == 7;
        let numbers: Vec<&[u8]> = words.take(most).collect();
        let bad = |word: &&&[u8]| !std::str::from_utf8(word).is_ok_and(|w| w.parse::<f32>().is_ok());
        if let Some(word) = numbers.iter().find(bad) {
            return Error::line(path, number, format!("{} is no number: {}", quote(word), quote(&line)));
        }
        if let [_, _, _, weight] = numbers[..]
            && is_vertex
            && parse_f32(weight) == Some(0.0)
        {
            return Error::line(path, number, format!("the vertex has the weight 0: {}", quote(&line)));
        }
    }
    Error::format(path, "has a number that cannot be read")
}

/// The error for the vertex `vertex`, from 0, whose position is not finite.
pub(crate) fn vertex_error(path: &Path, bytes: &[u8], vertex: u32, position: Vec3) -> Error {
    let mut vertices = logical_lines(bytes).filter(|(_, line)| words(line).next() == Some(b"v"));
    match vertices.nth(vertex as usize) {
        Some((number, line)) => {
            let message = format!("a face uses a vertex that is not finite: {}", quote(&line));
            Error::line(path, number, message)
        }
        None => Error::format(path, format!("vertex {} is not finite: {position}", u64::from(vertex) + 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bad_number_is_found() {
        let text = b"v 0 0 0\nvt 0.5 # x\n# v 0 0 x\nvn 0 0 1\nv 1 3.1+e2 0\nv x 0 0\n";
        let message = number_error(Path::new("a.obj"), text).to_string();
        assert_eq!(message, "a.obj, line 5: `3.1+e2` is no number: `v 1 3.1+e2 0`");
        let message = number_error(Path::new("a.obj"), b"v 0 0 0 0\n").to_string();
        assert!(message.contains("line 1: the vertex has the weight 0"), "{message}");
        let message = number_error(Path::new("a.obj"), b"v 0 0 0\n").to_string();
        assert_eq!(message, "a.obj: has a number that cannot be read");
    }

    #[test]
    fn a_vertex_is_found_by_its_number() {
        let text = b"v 0 0 0\nvn 0 0 1\nv nan 0 0\n";
        let message = vertex_error(Path::new("a.obj"), text, 1, Vec3::NAN).to_string();
        assert!(message.starts_with("a.obj, line 3") && message.contains("`v nan 0 0`"), "{message}");
        assert!(vertex_error(Path::new("a.obj"), text, 7, Vec3::NAN).to_string().contains("vertex 8"));
    }
}
