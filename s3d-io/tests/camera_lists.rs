//! Reads lists of cameras that people have, rebuilt small.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use s3d_geom::glam::{DAffine3, DVec3, dvec2, dvec3};
use s3d_io::camera::{Optics, PosedCamera, read_photograph_cameras};
use std::path::{Path, PathBuf};

fn sample(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/hard-inputs/field")
        .join(name);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

/// Returns the one camera of a list. It stands at (2, 0.3, 1.5), level, and looks along +Y.
fn only_camera(list: &Path, images: &Path) -> PosedCamera {
    let found = read_photograph_cameras(list, Some(images), &DAffine3::IDENTITY).unwrap();
    assert_eq!((found.cameras.len(), found.untracked), (1, 0));
    let camera = found.cameras.into_iter().next().unwrap();
    assert!(camera.pose.location.abs_diff_eq(dvec3(2.0, 0.3, 1.5), 1e-5), "{camera:?}");
    assert!(camera.pose.forward().abs_diff_eq(DVec3::Y, 1e-5), "{camera:?}");
    assert!(camera.pose.up().abs_diff_eq(DVec3::Z, 1e-5), "{camera:?}");
    camera
}

#[test]
fn a_panorama_of_colmap_is_read() {
    let Some(dir) = sample("17-colmap-equirectangular") else { return };
    let camera = only_camera(&dir.join("sparse/0"), &dir.join("images"));
    assert_eq!((camera.name.as_str(), camera.size), ("pano.png", Some([512, 256])));
    assert!(camera.is_panorama() && camera.camera(&Default::default()).unwrap().is_panorama());
}

#[test]
fn a_video_of_arkitscenes_is_read() {
    let Some(dir) = sample("18-arkitscenes") else { return };
    let camera = only_camera(&dir.join("lowres_wide.traj"), &dir.join("lowres_wide"));
    assert_eq!((camera.name.as_str(), camera.size), ("41254925_6845.806.png", Some([256, 192])));
    let Some(Optics::Pinhole { focal_px, center_px, .. }) = camera.optics else { panic!("{camera:?}") };
    assert_eq!((focal_px, center_px), (dvec2(211.9, 211.9), Some(dvec2(127.9, 95.6))));
}
