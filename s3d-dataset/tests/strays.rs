//! Annotated points far from the mesh: told, and left out on demand.

use crate::common;

use common::{options, scene_of};
use s3d_dataset::export::MemoryScene;
use s3d_dataset::info::{InfoOptions, info};
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{Context, DataSet, Export, ExportOptions, verify};
use s3d_geom::glam::vec3;
use s3d_synth::{Building, ScanOptions};
use std::path::Path;

/// A room whose floor has a point 100 km away, in place of the one in its middle.
fn scene_with_a_stray() -> MemoryScene {
    let middle = vec3(2.0, 1.5, 0.0);
    scene_of(
        |p| p,
        |p| {
            if p.distance(middle) < 1e-4 {
                vec3(100_000.0, 1.5, 0.25)
            } else {
                p
            }
        },
    )
}

const TOLD: &str =
    "floor_1_office_1_2: 1 of 441 annotated points is 99996.0 m from the mesh (it is number 221 of";

/// Exports the room. Returns the floor's box and points, the warnings, and the text of the manifest.
fn export(out: &Path, trim_strays: Option<f64>) -> ([f32; 6], u64, String, String) {
    let options = ExportOptions { trim_strays, ..options(3) };
    let export = Export::new([scene_with_a_stray()]).options(options);
    export.run(out, &Context::default()).unwrap().unwrap();
    let report = verify(out, &VerifyOptions::default(), &Context::default()).unwrap();
    assert_eq!(report.fault_count(), 0, "{report:?}");

    let data = DataSet::open(out).unwrap();
    let instances = data.instances(2).unwrap();
    let floor = instances.iter().find(|i| i.class == "floor").unwrap();
    let manifest = std::fs::read_to_string(out.join("manifest.json")).unwrap();
    let warnings =
        serde_json::from_str::<serde_json::Value>(&manifest).unwrap()["areas"][0]["warnings"].to_string();
    (floor.bbox, floor.points, warnings, manifest)
}

#[test]
fn a_stray_point_is_told_and_left_out_on_demand() {
    let dir = tempfile::tempdir().unwrap();
    let (bbox, points, warnings, manifest) = export(&dir.path().join("all"), None);
    assert_eq!((bbox, points), ([0.0, 0.0, 0.0, 100_000.0, 3.0, 0.25], 441));
    assert!(
        warnings.contains(TOLD) && warnings.contains("its box is 100000.0 m long instead of 4.0"),
        "{warnings}"
    );
    assert!(
        warnings.contains("the option `trim_strays`") && !manifest.contains("\"trim_strays\""),
        "{warnings}"
    );

    let (bbox, points, warnings, manifest) = export(&dir.path().join("trimmed"), Some(1.0));
    assert_eq!((bbox, points), ([0.0, 0.0, 0.0, 4.0, 3.0, 0.0], 440));
    assert!(warnings.contains(TOLD) && warnings.contains("and left out"), "{warnings}");
    assert!(manifest.contains("\"trim_strays\""), "{manifest}");
    let rooms = std::fs::read_to_string(dir.path().join("trimmed/area_2/3d/rooms.json")).unwrap();
    assert!(!rooms.contains("100000"), "{rooms}");

    // A longer distance keeps the point.
    let (bbox, ..) = export(&dir.path().join("far"), Some(200_000.0));
    assert_eq!(bbox[3], 100_000.0);
}

#[test]
fn info_names_stray_points() {
    let told = info(scene_with_a_stray(), &InfoOptions::default(), &Context::default()).unwrap();
    let doubts = told.doubts.join("\n");
    assert!(doubts.contains(TOLD) && doubts.contains("at 100000.00, 1.50, 0.25)"), "{doubts}");
}

/// Most of a storey is far from the other one.
#[test]
fn a_building_of_two_storeys_has_no_strays() {
    let dir = tempfile::tempdir().unwrap();
    let scan = ScanOptions { points_per_m2: 20.0, ..ScanOptions::default() };
    let building = Building::two_storeys().build().unwrap();
    let scene = building.write_scan(dir.path(), &scan, || true).unwrap();
    let told = info(scene, &InfoOptions::default(), &Context::default()).unwrap();
    assert!(
        told.points > 1000 && !told.doubts.iter().any(|d| d.contains("from the mesh")),
        "{:?}",
        told.doubts
    );
}
