//! The archive of DUSt3R's and MUSt3R's ScanNet++ loaders: `all_metadata.npz`.
//!
//! Source: `naver/dust3r` at 4c24a6e, `dust3r/datasets/scannetpp.py`, and `naver/must3r` at 0c0d76b.

use crate::cloud::npy::npz::{NpzWriter, bytes};
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use std::io;
use std::path::Path;

/// A scene: a folder with `images/NAME.jpg` and `depth/NAME.png`.
#[derive(Clone, Debug, Default)]
pub struct Dust3rScene {
    /// The name of its folder.
    pub name: String,
    /// Its images.
    pub images: Vec<Dust3rImage>,
    /// Pairs of images by their places in the scene, with a score from 0 to 1.
    pub pairs: Vec<(usize, usize, f32)>,
}

/// An image of a scene.
#[derive(Clone, Debug)]
pub struct Dust3rImage {
    /// The name of its files without ending.
    pub name: String,
    /// The camera matrix in pixels. The centre of the first pixel is (0, 0).
    pub intrinsics: [[f64; 3]; 3],
    /// Camera (x right, y down, z forward) → world, metres.
    pub world_from_camera: [[f64; 4]; 4],
}

/// Writes the archive, whole or not at all. Returns its size in bytes.
///
/// For S scenes with N images and M pairs in all: `scenes` (S names), `counts` (S, the place of each scene's
/// first image), `sceneids` (N), `images` (N names), `intrinsics` (N × 3 × 3), `trajectories` (N × 4 × 4)
/// and `pairs` (M × 3: two images and the score).
///
/// # Errors
/// [`Error::Io`].
pub fn write_dust3r(path: &Path, scenes: &[Dust3rScene]) -> Result<u64> {
    let file = AtomicFile::create(path)?;
    write_archive(file, scenes)
        .map_err(|e| Error::io(path, "write", e))?
        .commit()
}

fn write_archive(file: AtomicFile, scenes: &[Dust3rScene]) -> io::Result<AtomicFile> {
    let mut archive = NpzWriter::new(file);
    let images = || scenes.iter().flat_map(|scene| &scene.images);
    let count = images().count() as u64;

    let mut first = Vec::new();
    let mut scene_ids = Vec::new();
    let mut pairs: Vec<[f64; 3]> = Vec::new();
    for (id, scene) in scenes.iter().enumerate() {
        let before = scene_ids.len();
        first.push(before as i64);
        scene_ids.extend(std::iter::repeat_n(id as i64, scene.images.len()));
        let of_scene = scene.pairs.iter();
        pairs.extend(
            of_scene.map(|(a, b, score)| [(before + a) as f64, (before + b) as f64, f64::from(*score)]),
        );
    }

    let names: Vec<&str> = scenes.iter().map(|scene| scene.name.as_str()).collect();
    archive.texts("scenes", &names)?;
    archive.array("counts", "<i8", &[first.len() as u64], bytes(first.into_iter(), i64::to_le_bytes))?;
    archive.array("sceneids", "<i8", &[count], bytes(scene_ids.into_iter(), i64::to_le_bytes))?;
    let names: Vec<&str> = images().map(|image| image.name.as_str()).collect();
    archive.texts("images", &names)?;
    let values = images().flat_map(|image| image.intrinsics.into_iter().flatten());
    archive.array("intrinsics", "<f8", &[count, 3, 3], bytes(values, f64::to_le_bytes))?;
    let values = images().flat_map(|image| image.world_from_camera.into_iter().flatten());
    archive.array("trajectories", "<f8", &[count, 4, 4], bytes(values, f64::to_le_bytes))?;
    let rows = pairs.len() as u64;
    archive.array("pairs", "<f8", &[rows, 3], bytes(pairs.into_iter().flatten(), f64::to_le_bytes))?;
    archive.finish()
}
