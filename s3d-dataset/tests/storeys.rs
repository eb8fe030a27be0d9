//! Buildings of more than one storey: images are named after the room that a camera is in, and rooms above
//! each other are no overlap.

use crate::common;

use common::options;
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{Context, Export, ExportOptions, verify};
use s3d_geom::glam::vec2;
use s3d_io::dataset::{Layout, dataset_images};
use s3d_synth::building::{RoomPlan, ScanLocation};
use s3d_synth::{Building, ScanOptions};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Writes a scan with one location in the middle of each room, whose uuid tells the number of the room.
fn write_scan(rooms: Vec<RoomPlan>, folder: &Path) -> PathBuf {
    let locations = (0..).zip(&rooms).map(|(number, room)| {
        let middle = 0.5 * (room.low + room.high);
        let position = middle.extend(room.floor_m + 1.5).as_dvec3();
        ScanLocation { uuid: format!("{number:032x}"), position, yaw_rad: 0.0 }
    });
    let locations = locations.collect();
    let building = Building { rooms, locations, texture_scale: 0.05, ..Building::two_storeys() };
    let scan = ScanOptions { points_per_m2: 200.0, ..ScanOptions::default() };
    building.build().unwrap().write_scan(folder, &scan, || true).unwrap()
}

/// Exports a scan. Returns the name of each image's room with the number of its location, and the manifest.
fn export(scan: &Path, out: &Path) -> (BTreeSet<(String, usize)>, String) {
    let options = ExportOptions { views: 1, size: 32, pano_width: 64, ..options(1) };
    Export::new([scan.to_owned()])
        .options(options)
        .run(out, &Context::default())
        .unwrap();
    let report = verify(out, &VerifyOptions::default(), &Context::default()).unwrap();
    assert_eq!(report.fault_count(), 0, "{report:?}");

    let images = dataset_images(&Layout::new(out.to_owned()), 1).unwrap();
    let rooms = images
        .into_iter()
        .map(|image| (image.room, usize::from_str_radix(&image.uuid, 16).unwrap()));
    (rooms.collect(), fs::read_to_string(out.join("manifest.json")).unwrap())
}

/// Every location of these rooms must be in its room, and no two rooms overlap.
fn stand_in_their_rooms(rooms: Vec<RoomPlan>, folder: &Path) {
    let expected: BTreeSet<(String, usize)> =
        rooms.iter().map(|room| room.room.to_string()).zip(0..).collect();
    let scan = write_scan(rooms, &folder.join("scan"));
    let (found, manifest) = export(&scan, &folder.join("out"));
    assert_eq!(found, expected);
    assert!(!manifest.contains("overlap"), "{manifest}");
}

/// An empty room of 4 × 3 m, whose south-west corner is `east` metres from the origin.
fn room(name: &str, east: f32, floor_m: f32) -> RoomPlan {
    let mut plan = Building::two_storeys().rooms.pop().unwrap();
    plan.room = name.parse().unwrap();
    plan.low = vec2(east, 0.0);
    plan.high = vec2(east + 4.0, 3.0);
    RoomPlan { floor_m, openings: Vec::new(), items: Vec::new(), lamps: Vec::new(), ..plan }
}

#[test]
fn a_camera_is_in_the_room_around_it_and_not_in_the_one_above() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    stand_in_their_rooms(Building::two_storeys().rooms, &at("stairs"));

    let stacked =
        || vec![room("storage_1", 0.0, 0.0), room("office_1", 0.0, 2.9), room("hallway_1", 0.0, 5.8)];
    stand_in_their_rooms(stacked(), &at("stacked"));

    let split = vec![room("lounge_1", 0.0, 0.0), room("office_1", 4.2, 1.4), room("hallway_1", 0.0, 2.9)];
    stand_in_their_rooms(split, &at("split"));
}

#[test]
fn a_list_that_names_a_room_out_of_sight_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let scan =
        write_scan(vec![room("storage_1", 0.0, 0.0), room("office_1", 0.0, 2.9)], &dir.path().join("scan"));
    let out = dir.path().join("out");
    let (rooms, _) = export(&scan, &out);

    // Poses and their names tell the rooms.
    for folder in ["pano/pose", "data/pose"].map(|folder| out.join("area_1").join(folder)) {
        for file in fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()) {
            let name = file.file_name().unwrap().to_str().unwrap();
            let pose = fs::read_to_string(&file).unwrap().replace("storage_1", "office_1");
            fs::write(&file, pose).unwrap();
            fs::rename(&file, file.with_file_name(name.replace("storage_1", "office_1"))).unwrap();
        }
    }
    let report = verify(&out, &VerifyOptions::default(), &Context::default()).unwrap();
    let told = format!("{report:?}");
    assert!(told.contains("sees nothing of office_1: it stands in storage_1"), "{told}");

    // Without these two it is a published area, whose files nobody lists.
    fs::remove_file(out.join("files.csv")).unwrap();
    fs::remove_file(out.join("manifest.json")).unwrap();
    let (again, manifest) = export(&out.join("area_1"), &dir.path().join("again"));
    assert_eq!(again, rooms);
    assert!(manifest.contains("is in office_1 by its list, but sees nothing of that room"), "{manifest}");
}
