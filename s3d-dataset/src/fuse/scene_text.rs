//! The scene file beside a fused mesh: it names the photographs and the places that the raw scan brings.

use super::images::Images;
use crate::error::Result;
use glam::{DAffine3, DMat3};
use s3d_geom::PhotoLens;
use s3d_io::Error as FileError;
use s3d_io::camera::E57Pictures;
use s3d_io::mesh::UpAxis;
use s3d_io::raw::RawForm;
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

/// The list of the scanner's places beside a fused mesh.
const LOCATIONS: &str = "locations.csv";

/// How the scans of an E57 file are moved, beside a fused mesh.
const MOTIONS: &str = "motions.csv";

/// The list of photographs beside a fused mesh.
const PHOTOGRAPHS: &str = "photographs.json";

/// What an export needs beside the mesh.
pub(super) struct SceneText {
    pub(super) toml: String,
    /// The lists that it names: the name and content of each.
    pub(super) lists: Vec<(&'static str, String)>,
}

/// Returns the scene file of a fused mesh in `folder`. `turn` leads from the world of the images to the
/// mesh's.
pub(super) fn scene(images: &Images, turn: Option<DMat3>, folder: &Path) -> Result<SceneText> {
    let mut toml =
        "# Fused from a raw scan by s3d fuse.\narea = 1\n[mesh]\npath = \"mesh.ply\"\nup = \"z\"\n"
            .to_owned();
    let mut lists = Vec::new();
    // Several inputs are several lists.
    let only = match images.inputs() {
        [(path, form)] => Some((path.as_path(), *form, relative(path, folder)?.display().to_string())),
        _ => None,
    };
    let up = match images.up() {
        Some(UpAxis::Y) => "up = \"y\"\n",
        Some(UpAxis::Z) | None => "",
    };

    match only {
        Some((_, RawForm::Matterport, path)) => {
            let _ = write!(
                toml,
                "[cameras]\npath = {path:?}\n{up}[rgb]\nsource = \"captures\"\npath = {path:?}\n"
            );
        }
        Some((_, RawForm::Recording, path)) => {
            let _ = write!(toml, "[frames]\npath = {path:?}\n{up}");
        }
        Some((file, RawForm::E57, path)) => {
            let has_pictures = E57Pictures::open(file, &DAffine3::IDENTITY).is_ok();
            // The file does not know how its scans were moved.
            match images.place_table().filter(|_| images.are_moved()) {
                None => {
                    let _ = write!(toml, "[cameras]\npath = {path:?}\n{up}");
                    if has_pictures {
                        toml += "[rgb]\nsource = \"e57\"\n";
                    }
                }
                Some(table) => {
                    let _ = write!(toml, "[cameras]\npath = {LOCATIONS:?}\n");
                    lists.push((LOCATIONS, table));
                    if has_pictures {
                        let of_file = format!("path = {path:?}\nmotions = {MOTIONS:?}\n");
                        toml += &format!("[rgb]\nsource = \"e57\"\n{of_file}");
                        lists.push((MOTIONS, images.motion_table()));
                    }
                }
            }
        }
        _ => {
            if let Some(json) = photographs(images, turn.unwrap_or_default(), folder)? {
                let _ = write!(toml, "[frames]\npath = {PHOTOGRAPHS:?}\n");
                lists.push((PHOTOGRAPHS, json));
            }
            if let Some(table) = images.place_table() {
                let _ = write!(toml, "[cameras]\npath = {LOCATIONS:?}\n");
                lists.push((LOCATIONS, table));
            }
        }
    }
    Ok(SceneText { toml, lists })
}

/// Lists the photographs that were taken together with depth pictures, in the form of nerfstudio's
/// `transforms.json`. Returns `None` if there are none.
fn photographs(images: &Images, turn: DMat3, folder: &Path) -> Result<Option<String>> {
    let mut frames = Vec::new();
    for color in images.colors() {
        let lens = color.lens()?;
        let [w, h] = lens.size();
        let (focal_px, center_px) = (lens.focal_px(), lens.center_px());
        let axes = turn * color.pose.world_from_camera;
        let place = turn * color.pose.location;
        let row = |k: usize| {
            let [x, y, z] = axes.row(k).to_array();
            [x, y, z, place[k]]
        };
        let mut frame = json!({
            "file_path": relative(&color.picture.path, folder)?,
            "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
            "w": w, "h": h,
            "fl_x": focal_px.x, "fl_y": focal_px.y, "cx": center_px.x, "cy": center_px.y,
        });
        let distortion: Vec<(&str, f64)> = match &lens {
            PhotoLens::Straight(lens) => ["k1", "k2", "p1", "p2", "k3"]
                .into_iter()
                .zip(lens.distortion())
                .collect(),
            PhotoLens::Fisheye(lens) => {
                frame["camera_model"] = json!("OPENCV_FISHEYE");
                ["k1", "k2", "k3", "k4"].into_iter().zip(lens.distortion()).collect()
            }
        };
        for (key, value) in distortion.into_iter().filter(|(_, value)| *value != 0.0) {
            frame[key] = json!(value);
        }
        frames.push(frame);
    }
    Ok((!frames.is_empty()).then(|| format!("{:#}\n", json!({ "frames": frames }))))
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
