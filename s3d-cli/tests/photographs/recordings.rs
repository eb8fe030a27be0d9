//! Photographs that are parts of a recording of ScanNet, and those of a trajectory of matrices.

use super::first_of;
use super::studio::*;
use crate::common::s3d_ok;
use s3d_geom::{Lens, PhotoLens, Pose, Raster};
use s3d_io::image::read_rgb8;
use std::fs;

fn pinhole() -> PhotoLens {
    PhotoLens::Straight(Lens::new(SIZE, FOCAL, CENTER, [0.0; 5]).unwrap())
}

/// The bytes of a matrix of 32-bit floats.
fn matrix(rows: [[f64; 4]; 4]) -> Vec<u8> {
    rows.as_flattened()
        .iter()
        .flat_map(|v| (*v as f32).to_le_bytes())
        .collect()
}

/// A recording with these photographs, PNG inside, and a frame whose pose is lost.
fn recording(taken: &[(Pose, Raster<[u8; 3]>)]) -> Vec<u8> {
    let intrinsics = [
        [FOCAL.x, 0.0, CENTER.x, 0.0],
        [0.0, FOCAL.y, CENTER.y, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ];
    let mut origin = [[0.0; 4]; 4];
    (0..4).for_each(|k| origin[k][k] = 1.0);

    let mut bytes = [&4u32.to_le_bytes()[..], &3u64.to_le_bytes(), b"iPa"].concat();
    for rows in [intrinsics, origin, intrinsics, origin] {
        bytes.extend(matrix(rows));
    }
    // PNG and zlib.
    bytes.extend([1i32, 1].iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend([SIZE[0], SIZE[1], 4, 3].iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend(1000f32.to_le_bytes());
    bytes.extend((taken.len() as u64 + 1).to_le_bytes());

    let dir = tempfile::tempdir().unwrap();
    let lost = matrix([[f64::NEG_INFINITY; 4]; 4]);
    let mut frames = vec![(lost, taken[0].1.clone())];
    frames.extend(
        taken
            .iter()
            .map(|(pose, image)| (matrix(rows(pose, -1.0)), image.clone())),
    );
    for (matrix, image) in frames {
        let path = dir.path().join("a.png");
        write(&path, &image);
        let png = fs::read(&path).unwrap();
        bytes.extend(matrix);
        bytes.extend([0, 0, png.len() as u64, 5].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(png);
        bytes.extend(b"depth");
    }
    bytes.extend(0u64.to_le_bytes());
    bytes
}

#[test]
fn pictures_inside_of_a_recording_become_views() {
    let taken: Vec<_> = poses()
        .into_iter()
        .take(2)
        .map(|pose| (pose, take(&pose, &pinhole())))
        .collect();
    let project = Project::new("[frames]\npath = \"scene0000_00.sens\"\n");
    let bytes = recording(&taken);
    fs::write(project.at("scene0000_00.sens"), &bytes).unwrap();

    let (out, log) = project.export("out", &[]);
    assert!(log.contains("1 of 3 photographs are left out"), "{log}");
    let names: Vec<String> = photographs(&out).into_iter().map(|record| record.name).collect();
    assert_eq!(names, ["1", "2"]);
    for (name, (_, photo)) in names.iter().zip(&taken) {
        let view = read_rgb8(&first_of(&out, name)).unwrap();
        let same = view.pixels().iter().zip(photo.pixels());
        assert!(same.into_iter().all(|(a, b)| *a == b.map(|v| v.max(1))), "{name}");
    }
    assert!(photographs(&out).iter().all(|record| record.agreement.unwrap() > 0.6));

    // The recording is one input, by its checksum.
    let manifest = fs::read_to_string(out.join("manifest.json")).unwrap();
    assert_eq!(manifest.matches("scene0000_00.sens").count(), 1, "{manifest}");

    // A recording that is cut short is refused at once.
    fs::write(project.at("scene0000_00.sens"), &bytes[..bytes.len() - 100]).unwrap();
    fs::remove_dir_all(&out).unwrap();
    project.fails(&["scene0000_00.sens: frame 2: the file ends within it, and tells of 3 frames"]);
}

/// The mesh of the demo, Z-up, with colours by place.
fn ply() -> String {
    let mesh = mesh();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        mesh.positions().len(),
        mesh.faces().len()
    );
    for p in mesh.positions() {
        let [r, g, b] = p.to_array().map(|v| (v * 40.0).rem_euclid(256.0) as u8);
        text += &format!("{} {} {} {r} {g} {b}\n", p.x, p.y, p.z);
    }
    mesh.faces()
        .iter()
        .for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
    text
}

/// Replica's sequences, found by their folder.
#[test]
fn a_sequence_of_replica_is_found_in_its_folder() {
    let project = Project::new("");
    let mut lines = String::new();
    for (i, pose) in poses().iter().take(2).enumerate() {
        let rows = rows(pose, -1.0);
        let numbers: Vec<String> = rows.as_flattened().iter().map(f64::to_string).collect();
        lines += &(numbers.join(" ") + "\n");
        write(&project.at(&format!("room0/results/frame{i:06}.png")), &take(pose, &pinhole()));
    }
    project.write("room0/traj.txt", &lines);
    // Pixels count from the middle of the first.
    let camera = format!(
        "{{\"camera\": {{\"w\": {}, \"h\": {}, \"fx\": {}, \"fy\": {}, \"cx\": {}, \"cy\": {}}}}}",
        SIZE[0],
        SIZE[1],
        FOCAL.x,
        FOCAL.y,
        CENTER.x - 0.5,
        CENTER.y - 0.5
    );
    project.write("cam_params.json", &camera);
    project.write("room0_mesh.ply", &ply());

    let (room, out) = (project.at("room0"), project.at("out"));
    let log = s3d_ok(&project.args(&room, &out));
    assert!(log.contains("read as a scene of Replica"), "{log}");
    let records = photographs(&out);
    assert_eq!((records.len(), records[0].name.as_str()), (2, "frame000000.png"));
    let off = registered(&out);
    assert!(off.len() > 20 && off[off.len() / 2] < 0.1, "{off:?}");
}
