//! How an export finds the labels: a scene file for a mesh that has none.

use s3d_dataset::{BareScene, Result};
use s3d_io::fs::write_bytes;
use s3d_io::mesh::MeshFormat;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The name of a scene file. `s3d export` takes it, or a folder that has it.
const SCENE_FILE: &str = "scene.toml";

/// Writes a scene file into the folder of labels, if the scene is a mesh alone and no such file is there.
/// Returns whether the folder has one.
pub(super) fn write_scene_file(scene: &BareScene, folder: &Path) -> Result<bool> {
    let path = folder.join(SCENE_FILE);
    if path.exists() {
        return Ok(true);
    }
    let [mesh] = scene.mesh_files() else { return Ok(false) };
    let Some((up, units)) = scene.mesh_axes().filter(|_| MeshFormat::of(scene.path()).is_some()) else {
        return Ok(false);
    };

    let mut text = String::from(
        "# A mesh and its labels. Cameras of your own may follow: see docs/scan.md.\narea = 1\n\n",
    );
    let path_of_mesh = basic_string(&seen_from(folder, mesh).to_string_lossy());
    // Writing to a string does not fail.
    let _ = write!(text, "[mesh]\npath = {path_of_mesh}\nup = \"{}\"\n", up.name());
    if let Some(units) = units {
        let _ = writeln!(text, "units = \"{}\"", units.name());
    }
    text.push_str("\n[annotations]\npath = \".\"\n");
    write_bytes(&path, text.as_bytes())?;
    Ok(true)
}

/// The path of a file as a scene file in the folder names it: short if the file lies beside the folder.
fn seen_from(folder: &Path, file: &Path) -> PathBuf {
    let beside = |path: &Path| path.canonicalize().ok()?.parent().map(Path::to_owned);
    match (beside(folder), beside(file), file.file_name()) {
        (Some(one), Some(other), Some(name)) if one == other => Path::new("..").join(name),
        _ => file.canonicalize().unwrap_or_else(|_| file.to_owned()),
    }
}

/// A string of TOML.
fn basic_string(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
