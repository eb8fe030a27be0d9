//! `s3d demo --areas`: the generated areas make a complete data set. A killed run goes on, and no other files
//! are overwritten. Exports of two areas find pairs in each.

use crate::common;
use common::{s3d_fails, s3d_ok, text, write_scan};
use s3d_io::dataset::{Layout, read_splits};
use std::fs;

const SMALL: [&str; 8] = ["--views", "1", "--size", "16", "--pano-width", "32", "--points-per-m2", "20"];

#[test]
fn two_generated_areas_are_a_data_set_that_verify_passes() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("areas");
    let demo = [&["demo", "--areas", "2", "--seed", "3", "-o", text(&out)][..], &SMALL].concat();
    s3d_ok(&demo);
    s3d_ok(&["verify", text(&out)]);
    let layout = Layout::new(&out);
    for area in [1, 2] {
        assert!(
            layout
                .s3dis_area_dir(area)
                .join("office_1/Annotations/table_1.txt")
                .exists()
        );
        assert!(out.join(format!("scan/area_{area}/scene.toml")).exists());
        assert!(fs::read_dir(layout.area_dir(area).join("pano/rgb")).unwrap().count() > 60);
    }
    // The published folds: areas 1 and 2 are in different buildings, so each is tested after training on the
    // other.
    let splits = read_splits(&layout.splits()).unwrap();
    assert!(splits.len() >= 2 && splits.iter().all(|split| split.train_areas != split.test_areas));
}

#[test]
fn a_demo_of_areas_goes_on_and_writes_over_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("areas");
    let few = ["demo", "--areas", "1", "--points-per-m2", "10", "--no-images", "-o", text(&out)];
    s3d_ok(&few);
    let layout = Layout::new(&out);
    assert!(layout.instances_json(1).exists() && layout.rooms_json(1).exists());
    assert!(!layout.area_dir(1).join("pano").exists());
    let list = fs::read(out.join("files.csv")).unwrap();

    // Leaves what a kill between the scan and the data set leaves: the whole scan alone.
    for entry in fs::read_dir(&out).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true if path.ends_with("scan") => {}
            true => fs::remove_dir_all(path).unwrap(),
            false => fs::remove_file(path).unwrap(),
        }
    }
    fs::create_dir(out.join(".s3d-scan.part")).unwrap();
    s3d_ok(&few);
    assert_eq!(fs::read(out.join("files.csv")).unwrap(), list);
    assert!(!out.join(".s3d-scan.part").exists());

    // One scan was changed by a user, and the other was not generated.
    let other = dir.path().join("other");
    fs::create_dir_all(other.join("scan")).unwrap();
    fs::rename(out.join("scan/area_1"), other.join("scan/area_1")).unwrap();
    fs::write(other.join("scan/area_1/cameras.csv"), "mine").unwrap();
    let demo = ["demo", "--areas", "1", "--no-images", "-o", text(&other), "--points-per-m2", "10"];
    s3d_fails(&demo, 2, &["differs from the generated area 1", "--overwrite"]);
    fs::write(other.join("scan/area_1/scene.toml"), "area = 1").unwrap();
    s3d_fails(&demo, 2, &["is not the generated area 1", "another folder"]);
    s3d_fails(&["demo", "--areas", "7"], 2, &["--areas"]);
}

#[test]
fn an_export_finds_pairs_as_the_command_does_and_keeps_those_that_are_there() {
    let dir = tempfile::tempdir().unwrap();
    let scenes = [1, 2].map(|area| write_scan(&dir.path().join(format!("scan_{area}")), area));
    let export = |out: &str, extra: &[&str]| -> Vec<String> {
        let out = dir.path().join(out);
        let scenes = scenes.each_ref().map(|scene| text(scene));
        let words = [&["export", "-o", text(&out)], &scenes[..], &SMALL, extra].concat();
        words.into_iter().map(str::to_owned).collect()
    };
    let run = |words: &[String]| s3d_ok(&words.iter().map(String::as_str).collect::<Vec<_>>());
    let list = |out: &str| fs::read_to_string(dir.path().join(out).join("files.csv")).unwrap();

    run(&export("at_once", &["--pairs"]));
    run(&export("later", &[]));
    let later = dir.path().join("later");
    s3d_ok(&["pairs", text(&later)]);
    assert_eq!(list("at_once"), list("later"));
    assert_eq!(list("later").matches("pairs.npz").count(), 2);

    // Other pairs are kept.
    s3d_ok(&["pairs", text(&later), "--samples", "16", "--overwrite"]);
    let other = list("later");
    assert_ne!(other, list("at_once"));
    run(&export("later", &["--pairs"]));
    assert_eq!(list("later"), other);

    let none = export("none", &["--pairs", "--modalities", "rgb,depth"]);
    s3d_fails(&none.iter().map(String::as_str).collect::<Vec<_>>(), 2, &["add pose to --modalities"]);
    assert!(!dir.path().join("none").exists());
}
