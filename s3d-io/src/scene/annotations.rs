//! The table `[annotations]` of a `scene.toml`.

use crate::cloud::annotations::AnnotationOptions;
use s3d_geom::glam::DVec3;
use s3d_label::{Class, Room, Taxonomy};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The table as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AnnotationTable {
    path: Option<PathBuf>,
    paths: Option<Vec<PathBuf>>,
    #[serde(default)]
    mesh: bool,
    class: Option<String>,
    instance: Option<String>,
    room: Option<String>,
    rooms: Option<String>,
    #[serde(default)]
    columns: Vec<String>,
    offset_m: Option<[f64; 3]>,
    #[serde(default)]
    unknown_as_clutter: bool,
    #[serde(default)]
    classes: BTreeMap<String, String>,
}

impl AnnotationTable {
    /// Returns the key that names the files, and the files as written. There are none if the labels of the
    /// mesh itself are meant. The error is a sentence.
    pub(crate) fn paths(&self) -> std::result::Result<(&'static str, &[PathBuf]), String> {
        match (&self.path, &self.paths, self.mesh) {
            (Some(path), None, false) => Ok(("annotations.path", std::slice::from_ref(path))),
            (None, Some(paths), false) if !paths.is_empty() => Ok(("annotations.paths", paths)),
            (None, None, true) => Ok(("annotations.mesh", &[])),
            _ => {
                let message = "annotations needs one of path, paths (a list of at least one) and mesh = true \
                               (the labels of the mesh itself)";
                Err(message.into())
            }
        }
    }

    /// Returns whether the labels of the mesh itself are meant.
    pub(crate) fn is_of_mesh(&self) -> bool {
        self.mesh
    }

    /// Returns whether the table says what is subtracted from coordinates.
    pub(crate) fn has_offset(&self) -> bool {
        self.offset_m.is_some()
    }

    /// Returns how the annotations are read. Words mean what `taxonomy` says. The error is a sentence.
    pub(crate) fn options(&self, taxonomy: &Taxonomy) -> std::result::Result<AnnotationOptions, String> {
        let room: Option<Room> = self
            .room
            .as_ref()
            .map(|name| taxonomy.room_of_word(name))
            .transpose()
            .map_err(|e| format!("annotations.room: {e}"))?;

        let mut classes = BTreeMap::new();
        for (key, word) in &self.classes {
            classes.insert(key.clone(), class_of_word(key, word, taxonomy)?);
        }

        let offset_m = self.offset_m.unwrap_or_default();
        if !offset_m.iter().all(|v| v.is_finite()) {
            return Err(format!("annotations.offset_m = {offset_m:?} is not finite"));
        }
        if self.unknown_as_clutter && taxonomy.clutter().is_none() {
            return Err(format!(
                "annotations.unknown_as_clutter = true: the taxonomy {} has no class for clutter: name it \
                 there, with clutter = \"…\"",
                taxonomy.name()
            ));
        }

        Ok(AnnotationOptions {
            taxonomy: taxonomy.clone(),
            unknown_as_clutter: self.unknown_as_clutter,
            classes,
            room,
            class_column: self.class.clone(),
            instance_column: self.instance.clone(),
            room_column: self.rooms.clone(),
            columns: self.columns.clone(),
            offset_m: DVec3::from_array(offset_m),
            ..AnnotationOptions::default()
        })
    }
}

/// Returns the class that the table gives to a key of the annotations; `None` means unlabelled.
fn class_of_word(key: &str, word: &str, taxonomy: &Taxonomy) -> std::result::Result<Option<Class>, String> {
    if word.is_empty() {
        return Ok(None);
    }
    if let Some(meant) = taxonomy.meaning(word) {
        return Ok(meant);
    }
    taxonomy
        .class(word)
        .map(Some)
        .map_err(|e| format!("annotations.classes.{key:?}: {e}"))
}
