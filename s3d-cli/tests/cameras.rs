//! Scan locations that are placed, or read from other forms than the table.

use crate::common;
use common::{files, s3d, s3d_fails, s3d_ok, text, write_scan};
use s3d_io::dataset::{PoseFile, read_pose};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const SMALL: [&str; 8] = ["--size", "32", "--pano-width", "64", "--views", "3", "--points-per-m2", "50"];

fn export(scene: &Path, out: &Path, extra: &[&str]) {
    let mut args = vec!["export", text(scene), "-o", text(out)];
    args.extend(SMALL);
    args.extend(extra);
    s3d_ok(&args);
}

/// The scan's scene with another `[cameras]` table.
fn with_cameras(scene: &Path, table: &str) -> PathBuf {
    let toml = fs::read_to_string(scene).unwrap();
    let (head, _) = toml.split_once("[cameras]").unwrap();
    let other = scene.with_file_name("other.toml");
    fs::write(&other, format!("{head}{table}")).unwrap();
    other
}

/// The panoramas' poses, by uuid.
fn poses(out: &Path) -> BTreeMap<String, PoseFile> {
    let all = files(&out.join("area_1/pano/pose"));
    all.keys()
        .map(|name| read_pose(&out.join("area_1/pano/pose").join(name)).unwrap())
        .map(|pose| (pose.camera_uuid.clone(), pose))
        .collect()
}

#[test]
fn the_same_cameras_in_three_forms_give_the_same_data_set() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let csv = dir.path().join("csv");
    export(&scene, &csv, &[]);
    // COLMAP: world → camera, from the poses of the first data set; names carry the uuids.
    let (mut colmap, mut frames) = (String::from("# a comment\n"), Vec::new());
    for (i, (uuid, pose)) in poses(&csv).iter().enumerate() {
        let p = pose.original();
        let r = p.opencv_from_world();
        let q = s3d_geom::glam::DQuat::from_mat3(&r);
        let t = -(r * p.location);
        colmap += &format!(
            "{} {} {} {} {} {} {} {} 1 camera_{uuid}.jpg\n\n",
            i + 1,
            q.w,
            q.x,
            q.y,
            q.z,
            t.x,
            t.y,
            t.z
        );
        let m = p.world_from_camera;
        let rows: Vec<String> = (0..3)
            .map(|k| format!("[{}, {}, {}, {}]", m.x_axis[k], m.y_axis[k], m.z_axis[k], p.location[k]))
            .collect();
        frames.push(format!(
            "{{\"file_path\": \"camera_{uuid}.jpg\", \"transform_matrix\": [{}, [0, 0, 0, 1]]}}",
            rows.join(", ")
        ));
    }
    fs::write(dir.path().join("scan/images.txt"), colmap).unwrap();
    fs::write(dir.path().join("scan/transforms.json"), format!("{{\"frames\": [{}]}}", frames.join(", ")))
        .unwrap();
    for form in ["images.txt", "transforms.json"] {
        let other = with_cameras(&scene, &format!("[cameras]\npath = \"{form}\"\n"));
        let out = dir.path().join(form).with_extension("out");
        export(&other, &out, &[]);
        let (a, b) = (poses(&csv), poses(&out));
        assert!(a.keys().eq(b.keys()));
        for (a, b) in a.values().zip(b.values()) {
            assert!(a.pose().location.abs_diff_eq(b.pose().location, 1e-9), "{form}");
            assert!(a.pose().world_from_camera.abs_diff_eq(b.pose().world_from_camera, 1e-9), "{form}");
        }
        let images = |out: &Path| files(&out.join("area_1/pano/depth"));
        assert_eq!(images(&csv), images(&out), "{form}");
    }
}

#[test]
fn locations_are_placed_by_option_and_by_scene_file() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let bare = with_cameras(&scene, "");
    // Without an option, locations are placed until they see enough; one location sees all of this room.
    let seen = dir.path().join("seen");
    export(&bare, &seen, &[]);
    let manifest = fs::read_to_string(seen.join("manifest.json")).unwrap();
    assert!(manifest.contains("\"see\": 0.95") && manifest.contains("\"surface_seen\""), "{manifest}");
    assert_eq!(poses(&seen).len(), 1);
    let (a, b, c) = (dir.path().join("a"), dir.path().join("b"), dir.path().join("c"));
    export(&bare, &a, &["--place-cameras", "1.2", "--threads", "1"]);
    let placed = poses(&a);
    assert!((2..=6).contains(&placed.len()), "{}", placed.len());
    let places: Vec<_> = placed.values().map(|p| p.pose().location).collect();
    for (i, p) in places.iter().enumerate() {
        assert!((p.z - 1.5).abs() < 1e-6 && p.x > 0.5 && p.x < 3.5 && p.y > 0.5 && p.y < 2.5, "{p}");
        assert!(places[..i].iter().all(|q| q.distance(*p) >= 1.2));
    }
    export(&with_cameras(&scene, "[cameras]\nplace = 1.2\n"), &b, &["--threads", "2"]);
    let images = |out: &Path| files(&out.join("area_1/pano"));
    assert_eq!(images(&a), images(&b));
    export(&bare, &c, &["--place-cameras", "1.2", "--seed", "1"]);
    assert_ne!(poses(&c).keys().collect::<Vec<_>>(), placed.keys().collect::<Vec<_>>());
    let info = s3d(&["info", text(&bare), "--place-cameras", "1.2"]);
    let info = String::from_utf8(info.stdout).unwrap();
    assert!(placed.keys().all(|uuid| info.contains(uuid)), "{info}");
    // The error is found once the rooms are known.
    s3d_fails(
        &[
            "export",
            text(&bare),
            "--place-cameras",
            "2",
            "-o",
            text(&dir.path().join("x")),
            "--only",
            &"0".repeat(32),
        ],
        2,
        &["no scan location has this uuid"],
    );
}
