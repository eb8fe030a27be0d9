//! The parts of a found scene, and the scene file that they make.

use crate::mesh::file::UpAxis;
use crate::mesh::read::MeshFormat;
use crate::scene::found::folder::Folder;
use std::fmt::Write as _;
use std::path::Path;

/// The parts of a scene: paths below its folder.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) mesh: String,
    pub(super) up: Option<UpAxis>,
    pub(super) labels: Option<String>,
    /// The built-in taxonomy of the labels, if they have one of their own.
    pub(super) taxonomy: Option<&'static str>,
    /// The room of what lies in no room, if the labels tell rooms.
    pub(super) nowhere: Option<&'static str>,
    pub(super) cameras: Option<String>,
    /// The folder of the scanner's captures.
    pub(super) captures: Option<String>,
    pub(super) frames: Option<String>,
    pub(super) images: Option<String>,
    pub(super) masks: Option<String>,
    /// World from the frame of the list of photographs, if it is another one.
    pub(super) turn: Option<&'static str>,
}

impl Parts {
    /// Returns the scene file of a scene of the data set `set`.
    pub(super) fn to_toml(&self, set: &str, dir: &Folder) -> String {
        let mut text = format!("# A scene of {set}, found in its folder.\narea = 1\n");
        if let Some(taxonomy) = self.taxonomy {
            push_row(&mut text, "taxonomy", taxonomy);
        }
        text.push_str("[mesh]\n");
        if self.mesh.ends_with(".semantic.glb") {
            text.push_str("# Its colours are those of its labels: name a textured mesh for real ones.\n");
        }
        push_row(&mut text, "path", &self.mesh);
        if let Some(up) = self.up.filter(|_| !has_own_frame(&self.mesh)) {
            push_row(&mut text, "up", up.name());
        }

        if let Some(labels) = &self.labels {
            text.push_str("[annotations]\n");
            push_row(&mut text, "path", labels);
            // Many words are none of the classes, and most data sets name no rooms.
            if self.nowhere.is_some() {
                text.push_str("# The file tells rooms: this one is for what lies in none.\n");
            }
            push_row(&mut text, "room", self.nowhere.unwrap_or_else(|| dir.room()));
            text.push_str("unknown_as_clutter = true\n");
        }
        if let Some(cameras) = &self.cameras {
            text.push_str("[cameras]\n");
            push_row(&mut text, "path", cameras);
        }
        if let Some(captures) = &self.captures {
            text.push_str("[rgb]\nsource = \"captures\"\n");
            push_row(&mut text, "path", captures);
        }
        if let Some(frames) = &self.frames {
            text.push_str("[frames]\n");
            push_row(&mut text, "path", frames);
            if let Some(images) = &self.images {
                push_row(&mut text, "images", images);
            }
            if let Some(masks) = &self.masks {
                push_row(&mut text, "masks", masks);
            }
            if let Some(turn) = self.turn {
                let _ = writeln!(text, "transform = {turn}    # the list has another world than the mesh");
            }
        }
        text
    }
}

/// Appends a key and its text.
fn push_row(text: &mut String, key: &str, value: &str) {
    let _ = writeln!(text, "{key} = {}", toml::Value::from(value));
}

/// Whether the format of a mesh says itself which axis points up.
fn has_own_frame(mesh: &str) -> bool {
    MeshFormat::of(Path::new(mesh)).is_some_and(|format| format.defines_frame)
}
