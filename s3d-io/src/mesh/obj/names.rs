//! Cleans names of textures and materials, so that every reader and system takes them.

use crate::fs::names::portable_file_name;

/// Returns a [`portable_file_name`] without "rgb", which loaders replace in paths.
pub(crate) fn clean_file_name(name: &str) -> String {
    let mut name = name.to_owned();
    while let Some(at) = name.to_ascii_lowercase().find("rgb") {
        name.replace_range(at..at + 3, "color");
    }
    Some(portable_file_name(&name))
        .filter(|name| !name.is_empty())
        .unwrap_or_else(|| "texture".into())
}

/// Returns a material name without white space, at which many readers end a name.
pub(crate) fn clean_material_name(name: &str) -> String {
    let clean: String = name
        .chars()
        .map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c })
        .collect();
    if clean.is_empty() { "material".into() } else { clean }
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
        assert!(long.len() == 128 && long.ends_with("_.png"), "{long}");
    }
}
