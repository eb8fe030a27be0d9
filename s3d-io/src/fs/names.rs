//! File names that every system takes.

use std::collections::HashSet;

/// The most characters of a portable name: file systems take 255 bytes, and a temporary file's name is
/// longer.
const MAX_NAME: usize = 128;

/// A file name of ASCII letters, digits, `-`, `.` and `_`, not hidden; anything else becomes `_`. One that
/// Windows keeps for a device (`con.png`) gets a `_` in front; a long one is cut before its ending. Empty if
/// nothing is left of `name`.
pub fn portable_file_name(name: &str) -> String {
    let safe = |c: char| {
        if c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_') {
            c
        } else {
            '_'
        }
    };
    let clean: String = name.chars().map(safe).collect();
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

/// Hands out names that differ in more than case.
#[derive(Debug, Default)]
pub struct UniqueNames(HashSet<String>);

impl UniqueNames {
    /// `name`, or with a number before its ending if it was there already.
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
