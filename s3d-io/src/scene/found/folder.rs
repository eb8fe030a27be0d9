//! The folder of a scene, and what lies in it.

use std::path::{Path, PathBuf};

/// The folder of a scene.
pub(super) struct Folder {
    path: PathBuf,
}

impl Folder {
    pub(super) fn new(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// Whether there is a file or folder at a path below.
    pub(super) fn has(&self, below: &str) -> bool {
        self.path.join(below).exists()
    }

    /// Returns the folder's own name.
    pub(super) fn name(&self) -> String {
        let path = self.path.canonicalize().unwrap_or_else(|_| self.path.clone());
        path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Returns the paths of the folders in a folder below, by name.
    pub(super) fn folders(&self, below: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path.join(below)).into_iter().flatten();
        let mut found: Vec<String> = entries
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .map(|name| format!("{below}{name}"))
            .filter(|folder| self.path.join(folder).is_dir())
            .collect();
        found.sort();
        found
    }

    /// Returns the path of the first file, by name, in a folder below whose name fits.
    pub(super) fn first(&self, below: &str, fits: impl Fn(&str) -> bool) -> Option<String> {
        let entries = std::fs::read_dir(self.path.join(below)).ok()?;
        let mut names: Vec<String> = entries
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .filter(|name| fits(name))
            .collect();
        names.sort();
        names.first().map(|name| format!("{below}{name}"))
    }

    /// Returns a room for a scene without names of rooms: of the type that the folder is named after.
    pub(super) fn room(&self) -> &'static str {
        let name = self.name().to_lowercase();
        let types = [("office", "office_1"), ("conference", "conferenceRoom_1"), ("hall", "hallway_1")];
        types
            .iter()
            .find(|(word, _)| name.contains(word))
            .map_or("lounge_1", |(_, room)| room)
    }
}
