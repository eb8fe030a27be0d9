//! Raw scans: depth pictures with their lists, and laser scans.

use super::{check, choice, file};
use s3d_geom::glam::DAffine3;
use s3d_io::Error;
use s3d_io::cloud::OnFault;
use s3d_io::raw::{RawOptions, RawScan, Trajectory};
use std::fs;
use std::path::Path;

const POSE: &[u8] = b"1 0 0 1\n0 0 1 2\n0 -1 0 3\n0 0 0 1\n";
const FRAMES: &[u8] = br#"{"w": 4, "h": 3, "fl_x": 4, "fl_y": 4, "frames": [{"file_path": "a.png",
    "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], "depth_file_path": "depth"}]}"#;
const UUID: &str = "8eb9955b866b4b5f74abb1071416c628";

/// A picture of depth, 4 × 3 pixels.
const PGM: &[u8] = b"P5\n4 3\n65535\n\x07\xd0\x07\xd0\x07\xd0\x07\xd0\x07\xd0\x07\xd0\
                     \x07\xd0\x07\xd0\x07\xd0\x07\xd0\x07\xd0\x07\xd0";

/// By the first byte: a depth picture of any kind, or one of the lists that its form needs.
pub(super) fn depth(dir: &Path, data: &[u8]) {
    let (which, data) = choice(data, 8);
    let folder = dir.join(which.to_string());
    let put = |name: &str, content: &[u8]| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("the folder can be written");
        fs::write(path, content).expect("the folder can be written");
    };

    match which {
        0 => {
            put("transforms.json", FRAMES);
            put("depth", data);
        }
        1 => {
            put("transforms.json", data);
            put("depth", PGM);
        }
        2 => put("scan.sens", data),
        3 => {
            put("frame-000000.pose.txt", POSE);
            put("frame-000000.depth.pgm", PGM);
            put("_info.txt", data);
        }
        4 => {
            put("depth.txt", data);
            put("groundtruth.txt", b"0.5 1 2 3 0 0 0 1\n");
            put("depth", PGM);
        }
        5 => {
            put("house.conf", data);
            put("undistorted_depth_images/d", PGM);
        }
        6 => {
            put(&format!("{UUID}_d0_0.png"), data);
            put(&format!("{UUID}_pose_0_0.txt"), POSE);
            put(&format!("{UUID}_intrinsics_0.txt"), b"4 3 4 4 2 1.5 0 0 0 0 0");
        }
        _ => {
            put("pose/0.txt", POSE);
            put("depth/0.png", data);
            put("intrinsic/intrinsic_depth.txt", b"4 0 2 0 0 4 1.5 0 0 0 1 0 0 0 0 1");
        }
    }

    let Some(RawScan::Pictures(found)) = check(dir, RawScan::open(&folder, &RawOptions::default())) else {
        return;
    };
    for picture in &found.pictures {
        assert!(picture.pose.location.is_finite());
        let Some(depth) = check(dir, picture.read_depth()) else { continue };
        assert_eq!([depth.width(), depth.height()], picture.lens.size());
        assert!(depth.pixels().iter().all(|d| d.is_nan() || *d > 0.0));
        let _ = picture.read_confidence();
        let _ = picture.read_colors(&depth);
    }
}

/// By the first byte: a laser scan of a format, a list of places, or a trajectory.
pub(super) fn raw_scan(dir: &Path, data: &[u8]) {
    let names = ["a.e57", "a.ptx", "a.las", "a.ply", "a.pcd", "a.npy", "a.xyz", "origins.csv", "path.txt"];
    let (which, data) = choice(data, names.len() as u8);
    let path = file(dir, names[usize::from(which)], data);
    if which == 8 {
        if let Some(path) = check(dir, Trajectory::read(&path, &DAffine3::IDENTITY)) {
            assert!(path.place_at(path.times_s()[0]).is_some());
        }
        return;
    }
    if which == 7 {
        file(dir, "b.xyz", b"1 2 3\n");
    }

    for on_fault in [OnFault::Stop, OnFault::Skip] {
        let options = RawOptions { origin_m: Some([0.5; 3].into()), on_fault, ..RawOptions::default() };
        scans(dir, &path, &options);
    }
}

fn scans(dir: &Path, path: &Path, options: &RawOptions) {
    let Some(RawScan::Scans(found)) = check(dir, RawScan::open(path, options)) else { return };
    for (number, info) in found.scans().iter().enumerate() {
        let read = found.read(number, |block| {
            let points = block.len();
            assert!(points > 0 && block.positions_m.iter().all(|p| p.is_finite()));
            assert!(block.colors.is_empty() || block.colors.len() == points);
            assert!(block.intensities.is_empty() || block.intensities.len() == points);
            Ok::<(), Error>(())
        });
        check(dir, read);
        if let Some(Some(grid)) = check(dir, found.read_grid(number)) {
            assert_eq!(info.grid, Some([grid.offsets_m.height(), grid.offsets_m.width()]));
        }
    }
}
