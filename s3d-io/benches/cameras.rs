//! Measures how fast scan locations are read from each form of list, in locations a second.
//!
//! The lists have 2,000 cameras around a building. The files are warm in the system's cache.
#![allow(missing_docs, reason = "criterion's macros")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::{DAffine3, DQuat, dvec3};
use s3d_geom::{Camera, Pose};
use s3d_io::camera::read_scan_locations;
use s3d_io::dataset::{Frame, PoseFile};
use std::fmt::Write;
use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};

const LOCATIONS: u32 = 2000;

fn pose(i: u32) -> Pose {
    let x = f64::from(i % 50) * 0.9;
    let y = f64::from(i / 50) * 0.9;
    Pose::from_scanner(dvec3(x, y, 1.5), DQuat::from_rotation_z(0.01 * f64::from(i)))
}

fn uuid(i: u32) -> String {
    format!("{:032x}", u128::from(i) * 0x9e37_79b9_7f4a_7c15_f39c_c060 + 1)
}

/// Returns the list of images of a COLMAP model, as text and in binary.
fn colmap() -> (String, Vec<u8>) {
    let mut text = String::new();
    let mut binary = u64::from(LOCATIONS).to_le_bytes().to_vec();
    for i in 0..LOCATIONS {
        let p = pose(i);
        let r = p.opencv_from_world();
        let q = DQuat::from_mat3(&r);
        let t = -(r * p.location);
        let numbers = [q.w, q.x, q.y, q.z, t.x, t.y, t.z];

        let line: Vec<String> = numbers.iter().map(f64::to_string).collect();
        let _ = writeln!(text, "{} {} 1 {}.jpg\n1.5 2.5 -1 3.5 4.5 -1", i + 1, line.join(" "), uuid(i));

        binary.extend((i + 1).to_le_bytes());
        numbers.iter().for_each(|v| binary.extend(v.to_le_bytes()));
        binary.extend(1u32.to_le_bytes());
        binary.extend(format!("{}.jpg\0", uuid(i)).bytes());
        binary.extend(2u64.to_le_bytes());
        binary.extend([0; 48]);
    }
    (text, binary)
}

/// Writes a list of each form, and returns their names and paths.
fn write_all(dir: &Path) -> Vec<(&'static str, PathBuf)> {
    let at = |name: &str| dir.join(name);
    let mut csv = String::new();
    let mut frames = Vec::new();
    fs::create_dir(at("poses")).unwrap();
    for i in 0..LOCATIONS {
        let p = pose(i);
        let half = 0.005 * f64::from(i);
        let _ = writeln!(
            csv,
            "{},{},{},{},0,0,{},{}",
            uuid(i),
            p.location.x,
            p.location.y,
            p.location.z,
            half.sin(),
            half.cos()
        );

        let m = p.world_from_camera;
        let row =
            |k: usize| format!("[{}, {}, {}, {}]", m.x_axis[k], m.y_axis[k], m.z_axis[k], p.location[k]);
        frames.push(format!(
            "{{\"file_path\": \"{}.jpg\", \"transform_matrix\": [{}, {}, {}, [0, 0, 0, 1]]}}",
            uuid(i),
            row(0),
            row(1),
            row(2)
        ));

        let camera = Camera::equirectangular(p, 4096);
        let file = PoseFile::new(&camera, &p, &uuid(i), "office_1_1", Frame::Panorama).to_json();
        fs::write(at(&format!("poses/{}.json", uuid(i))), file).unwrap();
    }

    let (text, binary) = colmap();
    fs::write(at("cameras.csv"), csv).unwrap();
    fs::write(at("images.txt"), text).unwrap();
    fs::write(at("images.bin"), binary).unwrap();
    fs::write(at("transforms.json"), format!("{{\"frames\": [{}]}}", frames.join(",\n"))).unwrap();
    ["cameras.csv", "images.txt", "images.bin", "transforms.json", "poses"]
        .map(|n| (n, at(n)))
        .into()
}

fn cameras(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let mut group = c.benchmark_group("cameras");
    group
        .throughput(Throughput::Elements(u64::from(LOCATIONS)))
        .sample_size(10);
    for (name, path) in write_all(dir.path()) {
        let read = || read_scan_locations(black_box(&path), &DAffine3::IDENTITY).unwrap();
        assert_eq!(read().len(), LOCATIONS as usize);
        group.bench_function(name, |b| b.iter(read));
    }
}

criterion_group!(benches, cameras);
criterion_main!(benches);
