//! The table `[annotations]` of a `scene.toml`.

use crate::cloud::annotations::AnnotationOptions;
use s3d_geom::glam::DVec3;
use s3d_label::{Class, Room, Taxonomy};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

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
    /// The key that names files, and the files as they are written; none if the mesh's own labels are meant.
    pub(crate) fn paths(&self) -> std::result::Result<(&'static str, &[PathBuf]), String> {
        match (&self.path, &self.paths, self.mesh) {
            (Some(path), None, false) => Ok(("annotations.path", std::slice::from_ref(path))),
            (None, Some(paths), false) if !paths.is_empty() => Ok(("annotations.paths", paths)),
            (None, None, true) => Ok(("annotations.mesh", &[])),
            _ => {
                Err("annotations needs one of path, paths (a list of at least one) and mesh = true (its own \
                      labels)"
                    .into())
            }
        }
    }

    /// Whether they say what is subtracted from coordinates.
    pub(crate) fn has_offset(&self) -> bool {
        self.offset_m.is_some()
    }

    /// How they are read.
    pub(crate) fn options(&self, taxonomy: &Taxonomy) -> std::result::Result<AnnotationOptions, String> {
        let room: Option<Room> = match &self.room {
            Some(name) => Some(
                taxonomy
                    .room_of_word(name)
                    .map_err(|e| format!("annotations.room: {e}"))?,
            ),
            None => None,
        };
        let mut classes = BTreeMap::new();
        for (key, word) in &self.classes {
            let class: Option<Class> = match word.as_str() {
                "" => None,
                word => match taxonomy.meaning(word) {
                    Some(meant) => meant,
                    None => {
                        let unknown = taxonomy
                            .class(word)
                            .map_err(|e| format!("annotations.classes.{key:?}: {e}"));
                        Some(unknown?)
                    }
                },
            };
            classes.insert(key.clone(), class);
        }
        let offset_m = self.offset_m.unwrap_or_default();
        if !offset_m.iter().all(|v| v.is_finite()) {
            return Err(format!("annotations.offset_m = {offset_m:?} is not finite"));
        }
        if self.unknown_as_clutter && taxonomy.clutter().is_none() {
            return Err(format!(
                "annotations.unknown_as_clutter = true: the taxonomy {} has no class for it: say which it \
                 is, with clutter = \"…\" in the taxonomy",
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
