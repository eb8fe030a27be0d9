//! The scene file beside a fused mesh: it names the photographs and the places that the raw scan brings.

use super::images::Images;
use crate::error::Result;
use glam::DAffine3;
use s3d_io::Error as FileError;
use s3d_io::camera::{E57Pictures, read_posed_cameras};
use s3d_io::mesh::UpAxis;
use s3d_io::raw::RawForm;
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

/// The list of places beside a fused mesh.
pub(super) const LOCATIONS: &str = "locations.csv";

/// What an export needs beside the mesh.
pub(super) struct SceneText {
    pub(super) toml: String,
    /// The list of the scanner's places, if no file of the scan tells them to an export.
    pub(super) locations: Option<String>,
}

/// Returns the scene file of a fused mesh in `folder`.
pub(super) fn scene(images: &Images, folder: &Path) -> Result<SceneText> {
    let mut toml =
        "# Fused from a raw scan by s3d fuse.\narea = 1\n[mesh]\npath = \"mesh.ply\"\nup = \"z\"\n"
            .to_owned();
    // Several inputs are several lists.
    let only = match images.inputs() {
        [(path, form)] => Some((path.as_path(), *form)),
        _ => None,
    };
    let place = only
        .map(|(path, _)| relative(path, folder))
        .transpose()?
        .unwrap_or_default();
    let up = if images.up() == Some(UpAxis::Y) {
        "up = \"y\"\n"
    } else {
        ""
    };
    let row = |table: &str| format!("[{table}]\npath = {:?}\n{up}", place.display().to_string());

    match only {
        Some((_, RawForm::Matterport)) => {
            toml += &row("cameras");
            toml += "[rgb]\nsource = \"captures\"\n";
            let _ = writeln!(toml, "path = {:?}", place.display().to_string());
        }
        Some((path, RawForm::E57)) => {
            toml += &row("cameras");
            if E57Pictures::open(path, &DAffine3::IDENTITY).is_ok() {
                toml += "[rgb]\nsource = \"e57\"\n";
            }
        }
        Some((path, form)) if form.is_pictures() && has_photographs(path) => toml += &row("frames"),
        _ => {
            let locations = images.place_table();
            if locations.is_some() {
                let _ = write!(toml, "[cameras]\npath = {LOCATIONS:?}\n");
            }
            return Ok(SceneText { toml, locations });
        }
    }
    Ok(SceneText { toml, locations: None })
}

/// Whether all cameras of a list have photographs that are there.
fn has_photographs(list: &Path) -> bool {
    let is_there = |path: &Path| path.is_file();
    read_posed_cameras(list, &DAffine3::IDENTITY).is_ok_and(|found| {
        let mut pictures = found.cameras.iter().map(|camera| camera.picture.as_ref());
        pictures.all(|picture| picture.is_some_and(|picture| is_there(&picture.path)))
    })
}

/// Returns the path of a file or folder from a folder that may not exist yet.
fn relative(path: &Path, folder: &Path) -> Result<PathBuf> {
    let path = std::path::absolute(path).map_err(|e| FileError::io(path, "look for", e))?;
    let folder = std::path::absolute(folder).map_err(|e| FileError::io(folder, "look for", e))?;
    let [path, folder]: [Vec<Component<'_>>; 2] =
        [path.as_path(), folder.as_path()].map(|p| p.components().collect());
    let shared = path.iter().zip(&folder).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return Ok(path.iter().collect());
    }
    let up = folder[shared..].iter().map(|_| Component::ParentDir);
    Ok(up.chain(path[shared..].iter().copied()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_is_named_from_the_folder_of_its_mesh() {
        for (path, folder, from) in [
            ("/a/raw", "/a/raw.fused", "../raw"),
            ("/a/b/raw.e57", "/a/out", "../b/raw.e57"),
            ("/a/raw", "/a/raw/out", ".."),
            ("raw", "raw.fused", "../raw"),
        ] {
            assert_eq!(relative(Path::new(path), Path::new(folder)).unwrap(), Path::new(from));
        }
    }
}
