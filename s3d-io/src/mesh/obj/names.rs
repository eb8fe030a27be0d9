//! Names of textures and materials that every reader and system takes.

use std::collections::HashSet;

/// The most characters of a cleaned name: file systems take 255 bytes, and a temporary file's name is longer.
const MAX_NAME: usize = 128;

/// A file name of ASCII letters, digits, `-`, `.` and `_`, not hidden, and without "rgb", which loaders
/// replace in paths. One that Windows keeps for a device (`con.png`) gets a `_` in front; a long one is cut
/// before its ending.
pub(crate) fn clean_file_name(name: &str) -> String {
    let safe = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_') { c } else { '_' };
    let mut clean: String = name.chars().map(safe).collect();
    while let Some(at) = clean.to_ascii_lowercase().find("rgb") {
        clean.replace_range(at..at + 3, "color");
    }
    // Windows drops dots at the end.
    let clean = clean.trim_matches('.');
    if clean.is_empty() {
        return "texture".into();
    }
    let device = clean.split('.').next().unwrap_or_default().to_ascii_lowercase();
    let numbered = device.strip_prefix("com").or(device.strip_prefix("lpt"));
    let is_device = matches!(device.as_str(), "con" | "prn" | "aux" | "nul")
        || numbered.is_some_and(|n| n.len() == 1 && n.bytes().all(|b| b.is_ascii_digit()));
    let clean = if is_device { format!("_{clean}") } else { clean.to_owned() };
    let (stem, ending) =
        clean.split_at(clean.rfind('.').filter(|at| clean.len() - at <= 8).unwrap_or(clean.len()));
    let stem = stem.get(..MAX_NAME - ending.len()).unwrap_or(stem);
    format!("{stem}{ending}")
}

/// A material name without white space, which ends it in many readers.
pub(crate) fn clean_material_name(name: &str) -> String {
    let clean: String =
        name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect();
    if clean.is_empty() { "material".into() } else { clean }
}

/// Hands out names that differ in more than case.
#[derive(Default)]
pub(crate) struct UniqueNames(HashSet<String>);

impl UniqueNames {
    /// `name`, or with a number before its ending if it was there already.
    pub(crate) fn add(&mut self, name: &str) -> String {
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
    fn names_of_files_stay_in_their_folder_and_work_everywhere() {
        for (name, clean) in [
            ("wall.png", "wall.png"),
            ("../../etc/passwd", "_.._etc_passwd"),
            ("..\\..\\x.png", "_.._x.png"),
            ("/etc/passwd", "_etc_passwd"),
            ("C:\\x.png", "C__x.png"),
            ("a\0b\n.png", "a_b_.png"),
            ("...", "texture"),
            ("", "texture"),
            (".hidden.jpg", "hidden.jpg"),
            ("dots...", "dots"),
            ("con.png", "_con.png"),
            ("COM7", "_COM7"),
            ("lpt1.tar.gz", "_lpt1.tar.gz"),
            ("console.png", "console.png"),
            ("com10.png", "com10.png"),
            ("Rgb.png", "color.png"),
        ] {
            assert_eq!(clean_file_name(name), clean, "{name:?}");
        }
        let long = clean_file_name(&format!("{}.png", "ä".repeat(500)));
        assert!(long.len() == MAX_NAME && long.ends_with("_.png"), "{long}");
        let mut names = UniqueNames::default();
        let unique = ["Wall.png", "wall.PNG", "WALL.png", "wall_2.png"].map(|name| names.add(name));
        assert_eq!(unique, ["Wall.png", "wall_2.PNG", "WALL_3.png", "wall_2_2.png"]);
    }
}
