//! Lists of files with points, each with the place of the scanner: lines `file,x,y,z`, or with blanks.

use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::quote::quote;
use crate::fs::{open_file, read_file};
use s3d_geom::glam::DVec3;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The bytes of a file that tell whether it is a list.
const HEAD: u64 = 4096;

/// The names of a list in a folder.
const NAMES: [&str; 4] = ["origins.csv", "origins.txt", "scanners.csv", "scanners.txt"];

/// Returns the list in a folder, if there is one.
pub(super) fn find_in(dir: &Path) -> Option<PathBuf> {
    NAMES.iter().map(|name| dir.join(name)).find(|path| is_list(path))
}

/// Returns whether a file is a list: its first line that names no columns begins with the name of a file
/// beside it, and three numbers follow.
pub(super) fn is_list(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = open_file(path).map(|file| file.take(HEAD).read_to_end(&mut head));
    let Ok(text) = text_of(&head, path) else { return false };
    let mut lines = text
        .split(|&b| b == b'\n')
        .map(<[u8]>::trim_ascii)
        .filter(|line| !line.is_empty() && !line.starts_with(b"#"));
    let entries = [lines.next(), lines.next()];
    matches!(read, Ok(Ok(_)))
        && entries
            .into_iter()
            .flatten()
            .filter_map(|line| entry(line, path))
            .any(|(file, _)| file.is_file())
}

/// Reads a list: each file with the scanner's place in the file's frame.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the line if it names no file or place, or a file twice.
pub(super) fn read(path: &Path) -> Result<Vec<(PathBuf, DVec3)>> {
    let bytes = read_file(path)?;
    let text = text_of(&bytes, path)?;
    let mut list: Vec<(PathBuf, DVec3)> = Vec::new();
    let mut is_first = true;
    for (number, line) in (1u64..).zip(text.split(|&b| b == b'\n').map(<[u8]>::trim_ascii)) {
        if line.is_empty() || line.starts_with(b"#") {
            continue;
        }
        let may_name_columns = std::mem::take(&mut is_first);
        let fault = |message: String| Error::line(path, number, message);
        let Some((file, origin)) = entry(line, path) else {
            if may_name_columns {
                continue;
            }
            return Err(fault(format!("{}: a line is file,x,y,z", quote(line))));
        };
        if !file.is_file() {
            return Err(fault(format!("{} is not there", file.display())));
        }
        if list.iter().any(|(other, _)| *other == file) {
            return Err(fault(format!("{} is listed twice", file.display())));
        }
        list.push((file, origin));
    }
    Ok(list)
}

/// Returns the file and the place of a line.
fn entry(line: &[u8], list: &Path) -> Option<(PathBuf, DVec3)> {
    let text = std::str::from_utf8(line).ok()?;
    let is_between: fn(char) -> bool = if text.contains([',', ';']) {
        |c| matches!(c, ',' | ';')
    } else {
        char::is_whitespace
    };
    // The name may hold blanks, so the numbers are taken from the end.
    let is_end = |c: char| is_between(c) || c.is_whitespace();
    let mut rest = text.trim_end_matches(is_end);
    let mut number = || {
        let (before, word) = rest.rsplit_once(is_between)?;
        rest = before.trim_end_matches(is_end);
        word.trim().parse().ok().filter(|v: &f64| v.is_finite())
    };
    let (z, y, x) = (number()?, number()?, number()?);
    let name = rest.trim().trim_matches(['"', '\'']);
    let folder = list.parent().unwrap_or(Path::new(""));
    (!name.is_empty()).then(|| (folder.join(name), DVec3::new(x, y, z)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::dvec3;
    use std::fs;

    #[test]
    fn lists_are_told_from_tables_of_points() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::write(at("a b.ply"), "").unwrap();
        for (text, is_one) in [
            ("file,x,y,z\na b.ply,1,2,3\n", true),
            ("# places\n\"a b.ply\"; 1; 2; 3\n", true),
            ("a b.ply 1 2 3\n", true),
            ("1 2 3 4\n", false),
            ("x,y,z,i\n1,2,3,4\n", false),
            ("c.ply,1,2,3\n", false),
            ("", false),
        ] {
            fs::write(at("origins.csv"), text).unwrap();
            assert_eq!(is_list(&at("origins.csv")), is_one, "{text}");
            assert_eq!(find_in(dir.path()).is_some(), is_one, "{text}");
            if is_one {
                assert_eq!(read(&at("origins.csv")).unwrap(), [(at("a b.ply"), dvec3(1.0, 2.0, 3.0))]);
            }
        }
        assert!(!is_list(dir.path()));
    }

    #[test]
    fn faults_have_their_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("origins.csv");
        fs::write(dir.path().join("a.ply"), "").unwrap();
        for (text, words) in [
            ("a.ply,1,2,3\nb.ply,1,2,3\n", "line 2: "),
            ("a.ply,1,2,3\na.ply,1,2,3\n", "is listed twice"),
            ("a.ply,1,2,3\na.ply,1,2\n", "line 2: `a.ply,1,2`: a line is file,x,y,z"),
            ("a.ply,1,2,3\na.ply,1,2,inf\n", "a line is file,x,y,z"),
        ] {
            fs::write(&path, text).unwrap();
            let message = read(&path).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
