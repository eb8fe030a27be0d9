//! `pointcloud.mat`: files that h5py wrote in the published layout (see `fixtures/pointcloud_mat`), our own
//! files read back, and damaged files.

use s3d_geom::PointCloud;
use s3d_geom::glam::{Vec3, vec3};
use s3d_io::Error;
use s3d_io::cloud::{MatArea, MatWriter};
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures/pointcloud_mat")
        .join(name)
}

/// The points that the fixtures' script makes.
fn expected(at: Vec3, n: usize) -> PointCloud {
    let mut cloud = PointCloud::default();
    for i in 0..n {
        cloud
            .positions
            .push(at + vec3((i % 4) as f32, (i / 4) as f32, i as f32 / 8.0));
        cloud.colors.push([i as u8, (2 * i) as u8, 255 - i as u8]);
    }
    cloud
}

/// Room, name and points of all objects.
fn contents(area: &MatArea) -> Vec<(String, String, PointCloud)> {
    let mut all = Vec::new();
    for room in &area.rooms {
        for object in &room.objects {
            let mut cloud = PointCloud::default();
            object.read(&mut cloud).unwrap();
            assert_eq!(cloud.len() as u64, object.len);
            all.push((room.name.clone(), object.name.clone(), cloud));
        }
    }
    all
}

fn wall_chair_door() -> Vec<(String, String, PointCloud)> {
    vec![
        ("office_1".into(), "wall_1".into(), expected(vec3(10.0, 0.0, 0.0), 12)),
        ("office_1".into(), "chair_3".into(), expected(vec3(-1.0, 2.0, 0.5), 5)),
        ("hallway_2".into(), "door_1".into(), expected(vec3(0.0, 0.0, 7.0), 1)),
    ]
}

#[test]
fn a_file_of_struct_arrays() {
    let area = MatArea::open(&fixture("area.mat")).unwrap();
    assert_eq!(area.name.as_deref(), Some("Area_3"));
    assert_eq!((area.rooms[0].alignment_deg, area.rooms[1].alignment_deg), (Some(45.0), Some(0.0)));
    assert_eq!(area.rooms[0].objects[1].global_name.as_deref(), Some("chair_3_office_1_3"));
    assert_eq!(contents(&area), wall_chair_door());
}

#[test]
fn a_file_of_cells_and_other_classes_of_numbers() {
    let area = MatArea::open(&fixture("cells.mat")).unwrap();
    assert_eq!(area.rooms[0].alignment_deg, Some(45.0));
    let mut found = contents(&area);
    let names: Vec<&str> = found.iter().map(|(_, name, _)| name.as_str()).collect();
    assert_eq!(names, ["wall_1", "chair_3", "door_1", "stairs_1", "window_1"]);
    assert!(found[4].2.is_empty());
    found.truncate(3);
    assert_eq!(found, wall_chair_door());
}

#[test]
fn a_file_of_one_room_with_one_object_in_the_old_and_the_new_form() {
    for name in ["single.mat", "latest.mat"] {
        assert_eq!(contents(&MatArea::open(&fixture(name)).unwrap()), wall_chair_door()[2..], "{name}");
    }
}

fn write(path: &Path, objects: &[(&str, &str, PointCloud)]) {
    let mut mat = MatWriter::create(path, "Area_3").unwrap();
    let mut last = "";
    for (room, name, cloud) in objects {
        if *room != last {
            mat.room(room, 30).unwrap();
            last = room;
        }
        mat.object(name, &format!("{name}_{room}_3")).unwrap();
        for (positions, colors) in cloud.positions.chunks(1000).zip(cloud.colors.chunks(1000)) {
            mat.append(positions, colors).unwrap();
        }
    }
    let bytes = mat.finish().unwrap();
    assert_eq!(bytes, std::fs::metadata(path).unwrap().len());
}

/// Writes 36 rooms of 40 objects: more than a node of names holds, and more than a node of nodes.
#[test]
fn what_is_written_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("pointcloud.mat");
    let rooms: Vec<String> = (1..=36).map(|i| format!("office_{i}")).collect();
    let names: Vec<String> = (1..=40).map(|i| format!("chair_{i}")).collect();
    let mut objects = Vec::new();
    for (r, room) in rooms.iter().enumerate() {
        for (o, name) in names.iter().enumerate() {
            let n = if (r, o) == (7, 7) { 2500 } else { 1 + (r + o) % 5 };
            objects.push((room.as_str(), name.as_str(), expected(vec3(r as f32, o as f32, 0.1), n)));
        }
    }

    write(&path, &objects);
    let area = MatArea::open(&path).unwrap();
    assert!(area.rooms.iter().all(|r| r.alignment_deg == Some(30.0)));
    let read = contents(&area);
    assert_eq!(read.len(), objects.len());
    for ((room, name, cloud), read) in objects.iter().zip(&read) {
        assert_eq!((*room, *name, cloud), (read.0.as_str(), read.1.as_str(), &read.2));
    }

    let again = dir.path().join("again.mat");
    write(&again, &objects);
    assert_eq!(std::fs::read(&path).unwrap(), std::fs::read(&again).unwrap());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
}

#[test]
fn one_room_one_object_or_none() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("pointcloud.mat");
    let door = ("hallway_2", "door_1", expected(Vec3::ZERO, 3));
    write(&path, &[("office_1", "chair_1", PointCloud::default()), door.clone()]);
    let read = contents(&MatArea::open(&path).unwrap());
    // An object without points is left out, and so is a room without objects.
    assert_eq!(read, [(door.0.to_owned(), door.1.to_owned(), door.2)]);

    write(&path, &[]);
    assert!(MatArea::open(&path).unwrap().rooms.is_empty());
}

#[test]
fn a_point_that_is_not_finite_leaves_no_file() {
    let dir = tempfile::tempdir().unwrap();
    let mut mat = MatWriter::create(&dir.path().join("pointcloud.mat"), "Area_1").unwrap();
    mat.room("office_1", 0).unwrap();
    mat.object("chair_1", "chair_1_office_1_1").unwrap();
    let message = mat
        .append(&[vec3(0.0, f32::NAN, 0.0)], &[[0; 3]])
        .unwrap_err()
        .to_string();
    assert!(message.contains("pointcloud.mat: a point of chair_1 at [0, NaN, 0]"), "{message}");
    drop(mat);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
#[should_panic(expected = "the object chair_1 has no room")]
fn an_object_without_a_room_is_a_callers_mistake() {
    let dir = tempfile::tempdir().unwrap();
    let _ = MatWriter::create(&dir.path().join("a.mat"), "Area_1")
        .unwrap()
        .object("chair_1", "");
}

#[test]
fn other_files_are_refused_by_what_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("pointcloud.mat");
    let single = std::fs::read(fixture("single.mat")).unwrap();
    let cut = single[..single.len() - 100].to_vec();
    // The array `Disjoint_Space` gets another name.
    let mut renamed = single.clone();
    let at = renamed.windows(15).position(|w| w == b"Disjoint_Space\0").unwrap();
    renamed[at] = b'X';

    for (bytes, words) in [
        (&b""[..], "no HDF5 file"),
        (b"MATLAB 5.0 MAT-file, Platform: GLNXA64", "version 5"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
        (b"\x89HDF\r\n\x1a\n", "beyond its end"),
        (&cut, "is cut off: it has"),
        (&renamed, "no variable Area with a field Disjoint_Space, but [\"#refs#\", \"Area\"]"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let e = MatArea::open(&path).unwrap_err();
        assert!(e.to_string().contains(words) && e.path() == path, "{e}");
    }
    assert!(matches!(MatArea::open(&dir.path().join("gone.mat")), Err(Error::Io { .. })));
    assert!(MatArea::open(dir.path()).is_err());
}

#[test]
fn a_field_that_is_missing_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("pointcloud.mat");
    let single = std::fs::read(fixture("single.mat")).unwrap();

    let mut without = single.clone();
    for at in single
        .windows(8)
        .enumerate()
        .filter(|(_, w)| w == b"points\0\0")
        .map(|(at, _)| at)
    {
        without[at..at + 6].copy_from_slice(b"pointy");
    }

    std::fs::write(&path, without).unwrap();
    let message = MatArea::open(&path).unwrap_err().to_string();
    assert!(message.contains("Disjoint_Space(1).object(1): has no field points"), "{message}");
}

/// Files with some bytes changed, and files cut off: each gives an area or an error, in bounded memory and
/// without a panic.
#[test]
fn damaged_files_never_panic() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("pointcloud.mat");
    let mut state = 1u64;
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let mut read = 0;
    let mut refused = 0;

    for name in ["area.mat", "cells.mat", "single.mat", "latest.mat"] {
        let good = std::fs::read(fixture(name)).unwrap();
        for round in 0..150 {
            let mut bytes = good.clone();
            for _ in 0..=round % 6 {
                let at = 512 + random(bytes.len() - 512);
                bytes[at] = [0, 255, random(256) as u8, bytes[at] ^ (1 << random(8))][random(4)];
            }
            if round % 10 == 0 {
                bytes.truncate(random(bytes.len()));
            }

            std::fs::write(&path, &bytes).unwrap();
            let Ok(area) = MatArea::open(&path) else {
                refused += 1;
                continue;
            };

            for object in area.rooms.iter().flat_map(|r| &r.objects) {
                let mut cloud = PointCloud::default();
                match object.read(&mut cloud) {
                    Ok(()) => read += 1,
                    Err(_) => refused += 1,
                }
            }
        }
    }
    assert!(read > 150 && refused > 50, "{read} objects read, {refused} refused");
}
