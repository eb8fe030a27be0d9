//! File names that every system accepts.

use std::collections::HashSet;

/// The length of the longest portable name, in characters. File systems allow 255 bytes, and the name of a
/// temporary file is longer than the final one.
const MAX_NAME: usize = 128;

/// Returns `name` as a file name that every system accepts.
///
/// It consists of ASCII letters, digits, `-`, `.` and `_`, and is not hidden. Any other character becomes
/// `_`. A name that Windows reserves for a device (`con.png`) gets a `_` in front. A long name is cut before
/// its extension. The result is empty if nothing is left of `name`.
pub fn portable_file_name(name: &str) -> String {
    let clean: String = name.chars().map(portable_char).collect();
    // Windows drops dots at the end.
    let clean = clean.trim_matches('.');

    let device = clean.split('.').next().unwrap_or_default().to_ascii_lowercase();
    let numbered = device.strip_prefix("com").or(device.strip_prefix("lpt"));
    let is_device = matches!(device.as_str(), "con" | "prn" | "aux" | "nul")
        || numbered.is_some_and(|n| n.len() == 1 && n.bytes().all(|b| b.is_ascii_digit()));
    let clean = if is_device {
        format!("_{clean}")
    } else {
        clean.to_owned()
    };

    let (stem, ending) = clean.split_at(
        clean
            .rfind('.')
            .filter(|at| clean.len() - at <= 8)
            .unwrap_or(clean.len()),
    );
    let stem = stem.get(..MAX_NAME - ending.len()).unwrap_or(stem);
    format!("{stem}{ending}")
}

fn portable_char(c: char) -> char {
    if c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_') {
        c
    } else {
        '_'
    }
}

/// Hands out names that differ in more than case.
#[derive(Debug, Default)]
pub struct UniqueNames(HashSet<String>);

impl UniqueNames {
    /// Returns `name`. If it was handed out before, it gets a number before its extension.
    pub fn add(&mut self, name: &str) -> String {
        let dot = name.rfind('.');
        let (stem, ending) = dot.and_then(|dot| name.split_at_checked(dot)).unwrap_or((name, ""));

        let mut candidate = name.to_owned();
        let mut number = 2;
        while !self.0.insert(candidate.to_lowercase()) {
            candidate = format!("{stem}_{number}{ending}");
            number += 1;
        }
        candidate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_apart_in_more_than_case() {
        let mut names = UniqueNames::default();
        let unique = ["Wall.png", "wall.PNG", "WALL.png", "wall_2.png"].map(|name| names.add(name));
        assert_eq!(unique, ["Wall.png", "wall_2.PNG", "WALL_3.png", "wall_2_2.png"]);
        assert_eq!(["RGB.png", "...", "a/b c"].map(portable_file_name), ["RGB.png", "", "a_b_c"]);
        assert_eq!(portable_file_name(&"x".repeat(300)).len(), MAX_NAME);
    }
}
