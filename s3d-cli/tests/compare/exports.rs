//! Small exports, each made once, and copies of them for tests to change.

use super::common::{files, list_files, s3d_ok, text, write_scan};
use s3d_io::dataset::{DatasetImage, Domain, Frame, Layout, dataset_images};
use s3d_io::fs::create_dir;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Options with their values, unless a test gives others.
const SMALL: [[&str; 2]; 5] = [
    ["--size", "48"],
    ["--pano-width", "96"],
    ["--views", "5"],
    ["--points-per-m2", "60"],
    ["--compression", "fast"],
];

/// A folder with the scan of a room, and exports of it.
fn room() -> &'static Path {
    static ROOM: OnceLock<TempDir> = OnceLock::new();
    ROOM.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        write_scan(&dir.path().join("scan"), 1);
        dir
    })
    .path()
}

/// Exports a scene of the room's folder.
fn export(scene: &str, name: &str, more: &[&str]) -> PathBuf {
    let (scene, out) = (room().join("scan").join(scene), room().join(name));
    let others = SMALL.into_iter().filter(|[option, _]| !more.contains(option));
    let options: Vec<&str> = others.flatten().collect();
    s3d_ok(&[&["export", text(&scene), "-o", text(&out)], &options[..], more].concat());
    out
}

/// The room with all candidate views.
pub(crate) fn whole() -> &'static Path {
    static OUT: OnceLock<PathBuf> = OnceLock::new();
    let all = Domain::ALL.map(Domain::folder).join(",");
    OUT.get_or_init(|| export("scene.toml", "whole", &["--keep-all", "--modalities", &all]))
}

/// The room with its views selected with this seed, without points.
pub(crate) fn seeded(seed: u32) -> PathBuf {
    export("scene.toml", &format!("seed_{seed}"), &["--seed", &seed.to_string(), "--views", "12"])
}

/// The room exported with a changed copy of its scene file.
pub(crate) fn with_scene(name: &str, alter: impl Fn(&str) -> String, more: &[&str]) -> PathBuf {
    let folder = room().join("scan");
    let scene = fs::read_to_string(folder.join("scene.toml")).unwrap();
    fs::write(folder.join(format!("{name}.toml")), alter(&scene)).unwrap();
    export(&format!("{name}.toml"), name, &[&["--keep-all"], more].concat())
}

/// The room with its table moved in the mesh.
pub(crate) fn with_table_moved(more: &[&str]) -> PathBuf {
    let folder = room().join("scan");
    let mesh = fs::read_to_string(folder.join("room.obj")).unwrap();
    // The height of the table, Y-up.
    assert!(mesh.contains(" 0.7 "), "{mesh}");
    fs::write(folder.join("moved.obj"), mesh.replace(" 0.7 ", " 0.75 ")).unwrap();
    with_scene("moved", |scene| scene.replace("room.obj", "moved.obj"), more)
}

/// A copy to change: hard links, so a file is shared until it is replaced.
pub(crate) fn copy(of: &Path) -> (TempDir, PathBuf) {
    copy_to(of, "copy")
}

/// Makes the same copy in a folder of this name.
pub(crate) fn copy_to(of: &Path, name: &str) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join(name);
    for path in files(of).into_keys() {
        let to = out.join(&path);
        create_dir(to.parent().unwrap()).unwrap();
        fs::hard_link(of.join(&path), &to)
            .or_else(|_| fs::copy(of.join(&path), &to).map(drop))
            .unwrap();
    }
    (dir, out)
}

/// A changed copy whose lists of files are up to date.
pub(crate) fn altered(of: &Path, alter: impl Fn(&Path)) -> (TempDir, PathBuf) {
    let (dir, out) = copy(of);
    alter(&out);
    list_files(&out);
    (dir, out)
}

/// The first view of a data set, or the first panorama.
pub(crate) fn first(out: &Path, is_panorama: bool) -> DatasetImage {
    let images = dataset_images(&Layout::new(out), 1).unwrap();
    images
        .into_iter()
        .find(|image| (image.frame == Frame::Panorama) == is_panorama)
        .unwrap()
}

/// The file of a modality of that first image.
pub(crate) fn file(out: &Path, is_panorama: bool, domain: Domain) -> PathBuf {
    first(out, is_panorama).path(&Layout::new(out), domain)
}
