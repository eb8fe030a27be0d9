//! A scene of MapAnything's WAI format: `scene_meta.json`, and how much of each image every other one sees.
//!
//! Source: `facebookresearch/map-anything` at f7ebafb, `mapanything/utils/wai/` and
//! `mapanything/datasets/wai/scannetpp.py`.

#![expect(clippy::indexing_slicing, reason = "a writer: its rows are its own")]

use crate::cloud::npy::NpyWriter;
use crate::cloud::npy::write::npy_header;
use crate::error::Result;
use crate::fs::atomic::write_bytes;
use crate::fs::json::write_json;
use serde_json::{Value, json};
use std::path::Path;

/// An image of a scene.
#[derive(Clone, Debug)]
pub struct WaiFrame {
    /// Its name, unique in the scene.
    pub name: String,
    /// The path of its colours below the scene's folder.
    pub image: String,
    /// The path of its depth below the scene's folder: OpenEXR, metres along the optical axis, 0 where
    /// missing.
    pub depth: String,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// The camera matrix in pixels. The centre of the first pixel is (0, 0).
    pub intrinsics: [[f64; 3]; 3],
    /// Camera (x right, y down, z forward) → world, metres.
    pub world_from_camera: [[f64; 4]; 4],
}

/// Writes `scene_meta.json` of a scene. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
pub fn write_wai_scene(path: &Path, scene: &str, frames: &[WaiFrame]) -> Result<u64> {
    let frames: Vec<Value> = frames.iter().map(frame).collect();
    let meta = json!({
        "scene_name": scene,
        "dataset_name": "s3d",
        "version": "0.1",
        "shared_intrinsics": false,
        "camera_model": "PINHOLE",
        "camera_convention": "opencv",
        "scale_type": "metric",
        "scene_modalities": {},
        "frame_modalities": {
            "image": {"frame_key": "image", "format": "image"},
            "rendered_depth": {"frame_key": "rendered_depth", "format": "depth"},
        },
        "frames": frames,
    });
    write_json(path, &meta)
}

fn frame(frame: &WaiFrame) -> Value {
    let [[fx, _, cx], [_, fy, cy], _] = frame.intrinsics;
    json!({
        "frame_name": frame.name,
        "file_path": frame.image,
        "image": frame.image,
        "rendered_depth": frame.depth,
        "transform_matrix": frame.world_from_camera,
        "w": frame.size.0,
        "h": frame.size.1,
        "fl_x": fx,
        "fl_y": fy,
        "cx": cx,
        "cy": cy,
    })
}

/// Writes the covisibility of `count` images to `folder`, a row of floats for each image: the share of its
/// points that each image sees. `overlaps` are the entries that are not 0, sorted: two images and the share.
/// An image sees all of its own points. Returns the size of the file in bytes. Its name is
/// `pairwise_covisibility--NxN.npy`, from which the loader takes the size, and its numbers begin at byte 128,
/// where the loader looks for them.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// If an entry is of an image that there is not.
pub fn write_wai_covisibility(folder: &Path, count: usize, overlaps: &[(usize, usize, f32)]) -> Result<u64> {
    let path = folder.join(format!("pairwise_covisibility--{count}x{count}.npy"));
    let mut array = NpyWriter::create(&path, "<f4", &[count as u64; 2])?;
    let mut rest = overlaps.iter().peekable();
    for image in 0..count {
        let mut row = vec![0f32; count];
        row[image] = 1.0;
        while let Some((_, other, share)) = rest.next_if(|(of, ..)| *of == image) {
            row[*other] = *share;
        }
        let bytes: Vec<u8> = row.iter().flat_map(|share| share.to_le_bytes()).collect();
        array.put(&bytes)?;
    }
    array.finish()
}

/// Writes a list of scenes, an array of texts. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
pub fn write_wai_scene_list(path: &Path, scenes: &[String]) -> Result<u64> {
    let longest = scenes.iter().map(|name| name.chars().count()).max().unwrap_or(0).max(1);
    let mut file = npy_header(&format!("<U{longest}"), &[scenes.len() as u64]);
    for name in scenes {
        let units = name.chars().map(u32::from).chain(std::iter::repeat(0)).take(longest);
        file.extend(units.flat_map(u32::to_le_bytes));
    }
    write_bytes(path, &file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_begin_where_the_loader_looks_for_them() {
        for count in [1, 3, 123] {
            let folder = tempfile::tempdir().unwrap();
            let overlaps: &[(usize, usize, f32)] = if count > 1 { &[(0, 1, 0.5), (1, 0, 0.25)] } else { &[] };
            write_wai_covisibility(folder.path(), count, overlaps).unwrap();
            let name = format!("pairwise_covisibility--{count}x{count}.npy");
            let bytes = std::fs::read(folder.path().join(name)).unwrap();
            assert_eq!(bytes.len(), 128 + 4 * count * count);
            let at = |i: usize, j: usize| {
                let from = 128 + 4 * (i * count + j);
                f32::from_le_bytes(bytes[from..from + 4].try_into().unwrap())
            };
            assert!((0..count).all(|i| at(i, i) == 1.0));
            if count > 1 {
                assert_eq!((at(0, 1), at(1, 0), at(2, 1)), (0.5, 0.25, 0.0));
            }
        }
    }
}
