//! Pixels, poses and views.

use super::common::{list_files, s3d_ok, text};
use super::exports::{altered, copy, file, first, seeded, whole, with_table_moved};
use super::{compare, compare_with, count, entry};
use s3d_geom::Raster;
use s3d_io::dataset::{Domain, Layout, read_pose};
use s3d_io::image::{
    Compression, Content, encode_rgb8, read_gray16, read_palette8, read_rgb8, write_gray16, write_rgb8,
};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// Replaces the pixel in the middle of a file of colours; returns the one that was there.
fn repaint(path: &Path, paint: impl Fn([u8; 3]) -> [u8; 3]) -> [u8; 3] {
    let mut image = read_rgb8(path).unwrap();
    let middle = image.len() / 2;
    let old = image.pixels()[middle];
    image.pixels_mut()[middle] = paint(old);
    write_rgb8(path, &image, Content::Photo, Compression::Fast).unwrap();
    old
}

#[test]
fn a_data_set_is_equal_to_itself_and_to_a_copy() {
    let (_dir, out) = copy(whole());
    for (other, more) in [(whole(), &[][..]), (&out, &["--threads", "1"]), (&out, &["--full"])] {
        let (answer, json, code) = compare_with(whole(), other, more);
        assert_eq!(code, 0, "{answer}");
        // Two lines name the data sets, one says that they are equal.
        assert_eq!(answer.lines().count(), 3, "{answer}");
        let empty = ["settings", "inputs", "images", "notes", "unread"];
        assert!(empty.iter().all(|key| count(&json[*key]) == 0), "{json:#}");
        assert_eq!(entry(&json["modalities"], "modality", "rgb")["same"], 12);
        assert_eq!(json["poses"]["same"], 12);
        assert_eq!((&json["areas"][0]["geometry"], &json["labels"]["a"]), (&"same".into(), &7.into()));
    }
}

/// The manifest says how the data were made. Another version of s3d that makes the same data is reported.
#[test]
fn what_the_manifest_alone_tells_does_not_make_data_differ() {
    let (_dir, out) = copy(whole());
    let path = out.join("manifest.json");
    let mut manifest: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    manifest["version"] = "0.1.9".into();
    manifest["areas"][0]["inputs"][0]["xxh3_128"] = "0".repeat(32).into();
    s3d_io::fs::write_bytes(&path, manifest.to_string().as_bytes()).unwrap();
    let (answer, json, code) = compare(whole(), &out);
    assert_eq!(code, 0, "{answer}");
    assert_eq!(entry(&json["settings"], "name", "version")["b"], "0.1.9");
    assert_eq!((count(&json["inputs"]), &json["inputs"][0]["b"]), (1, &"0".repeat(32).into()));
    assert!(answer.contains("made with") && answer.contains("0.1.9"), "{answer}");
}

#[test]
fn one_pixel_is_found_and_measured() {
    let changed = |value: u8| if value > 127 { value - 60 } else { value + 60 };
    let (_dir, out) = altered(whole(), |out| {
        repaint(&file(out, false, Domain::Rgb), |[r, g, b]| [changed(r), g, b]);
        repaint(&file(out, true, Domain::Normal), |_| [255, 127, 127]);
        repaint(&file(out, true, Domain::SemanticPretty), |[r, g, b]| [r, g, b ^ 1]);
        let depth = file(out, false, Domain::Depth);
        let image = read_gray16(&depth).unwrap();
        let middle = image.len() / 2;
        let mut at = 0..;
        let image = image.map(|v| if at.next() == Some(middle) { v + 256 } else { v });
        write_gray16(&depth, &image, Compression::Fast).unwrap();
        // The same pixels, encoded in other bytes.
        let same = file(out, true, Domain::Rgb);
        let image = read_rgb8(&same).unwrap();
        s3d_io::fs::write_bytes(&same, &encode_rgb8(&image, Content::Photo, Compression::Small)).unwrap();
    });
    let (answer, json, code) = compare(whole(), &out);
    assert_eq!(code, 1, "{answer}");
    let of = |modality: &str| entry(&json["modalities"], "modality", modality).clone();
    let rgb = of("rgb");
    assert_eq!((&rgb["same"], &rgb["same_pixels"], &rgb["changed"]), (&10.into(), &1.into(), &1.into()));
    assert_eq!((&rgb["pixels"], &rgb["pixels_changed"]), (&(48 * 48).into(), &1.into()));
    // One of the 3 · 48² numbers is off by 60.
    let psnr = 10.0 * (255f64.powi(2) / (60f64.powi(2) / (3.0 * 48.0 * 48.0))).log10();
    assert!((rgb["psnr_db"].as_f64().unwrap() - psnr).abs() < 1e-9, "{rgb}");
    let depth = of("depth");
    assert_eq!((&depth["pixels_changed"], &depth["largest"]), (&1.into(), &0.5.into()));
    let seen = read_gray16(&file(whole(), false, Domain::Depth)).unwrap();
    let seen = seen.pixels().iter().filter(|v| **v != 65_535).count() as f64;
    assert!((depth["mean"].as_f64().unwrap() - 0.5 / seen).abs() < 1e-12, "{depth}");
    let normal = of("normal");
    assert_eq!((&normal["changed"], &normal["pixels_changed"]), (&1.into(), &1.into()));
    assert!(normal["largest"].as_f64().unwrap() > 1.0, "{normal}");
    assert_eq!(
        (&of("semantic_pretty")["changed"], &of("semantic_pretty")["mean"]),
        (&1.into(), &Value::Null)
    );
    assert_eq!((&of("semantic")["changed"], &of("global_xyz")["same"]), (&0.into(), &12.into()));
    let image = entry(&json["images"], "modality", "rgb");
    assert_eq!(image["a"], first(whole(), false).relative_path(Domain::Rgb));
    assert_eq!((count(&json["images"]), image["pixels_changed"].as_u64()), (4, Some(1)));
    assert_eq!(entry(&json["files"], "kind", "data/rgb")["changed"], 1);
    assert!(answer.contains(&format!("{psnr:.1} dB")) && answer.ends_with("different\n"), "{answer}");
}

#[test]
fn a_moved_pose_is_measured_and_its_pixels_are_not_compared() {
    let (_dir, out) = altered(whole(), |out| {
        let path = file(out, false, Domain::Pose);
        let mut pose = read_pose(&path).unwrap();
        pose.camera_location[1] += 0.25;
        pose.camera_k_matrix[0][2] += 1.5;
        pose.write(&path).unwrap();
        repaint(&file(out, false, Domain::Rgb), |[r, g, b]| [r ^ 7, g, b]);
        // The pose file names another room for the same camera.
        let path = file(out, true, Domain::Pose);
        let mut pose = read_pose(&path).unwrap();
        pose.room = "lobby_7_1".to_owned();
        pose.write(&path).unwrap();
        repaint(&file(out, true, Domain::Rgb), |[r, g, b]| [r ^ 7, g, b]);
    });
    let (answer, json, code) = compare(whole(), &out);
    let poses = &json["poses"];
    assert_eq!((code, &poses["same"], &poses["same_camera"]), (1, &10.into(), &1.into()), "{answer}");
    assert_eq!((&poses["largest_m"], &poses["largest_k_px"]), (&0.25.into(), &1.5.into()));
    assert_eq!((count(&poses["moved"]), &poses["largest_degrees"]), (1, &0.0.into()));
    assert_eq!(poses["moved"][0]["b"], first(&out, false).relative_path(Domain::Pose));
    let rgb = entry(&json["modalities"], "modality", "rgb");
    assert_eq!((&rgb["other_pose"], &rgb["changed"]), (&1.into(), &1.into()), "{answer}");
    assert!(answer.contains("poses that moved: 1"), "{answer}");
}

#[test]
fn another_seed_keeps_other_views() {
    let (a, b) = (seeded(0), seeded(7));
    let kept = |out: &Path| -> BTreeSet<(String, u64)> {
        let views: Vec<Value> =
            serde_json::from_slice(&std::fs::read(Layout::new(out).views_json(1)).unwrap()).unwrap();
        let kept = views.iter().filter(|view| !view["frame_num"].is_null());
        let name = |v: &Value| (v["camera_uuid"].as_str().unwrap().into(), v["candidate"].as_u64().unwrap());
        kept.map(name).collect()
    };
    let named = |list: &Value| -> BTreeSet<(String, u64)> {
        let all = list.as_array().unwrap().iter();
        all.map(|v| (v["uuid"].as_str().unwrap().into(), v["candidate"].as_u64().unwrap()))
            .collect()
    };
    let (in_a, in_b) = (kept(&a), kept(&b));
    let (answer, json, code) = compare(&a, &b);
    let views = &json["views"];
    assert_eq!(code, 1);
    assert_eq!((&views["kept_a"], &views["kept_b"]), (&in_a.len().into(), &in_b.len().into()));
    let lost: BTreeSet<_> = in_a.difference(&in_b).cloned().collect();
    let gained: BTreeSet<_> = in_b.difference(&in_a).cloned().collect();
    assert!(!lost.is_empty() && !gained.is_empty());
    assert_eq!((named(&views["lost"]), named(&views["gained"])), (lost.clone(), gained.clone()));
    // All views in both were drawn anew.
    assert_eq!(named(&views["redrawn"]), in_a.intersection(&in_b).cloned().collect());
    let rgb = entry(&json["modalities"], "modality", "rgb");
    assert_eq!((&rgb["only_a"], &rgb["only_b"]), (&lost.len().into(), &gained.len().into()));
    assert_eq!((&rgb["other_pose"], &rgb["same"]), (&count(&views["redrawn"]).into(), &2.into()));
    assert_eq!((count(&json["poses"]["moved"]), &json["labels"]["changed"]["faces"]), (0, &0.into()));
    let seed = entry(&json["settings"], "name", "seed");
    assert_eq!((&seed["a"], &seed["b"]), (&0.into(), &7.into()));
    assert!(answer.contains(&format!("  views  {:>6}  {:>6}\n", lost.len(), gained.len())), "{answer}");
}

#[test]
fn another_mesh_and_another_size_are_told_and_not_compared() {
    let out = with_table_moved(&["--size", "40", "--depth-units", "mm", "--normal-axes", "opencv"]);
    let (answer, json, code) = compare(whole(), &out);
    assert_eq!((code, &json["areas"][0]["geometry"]), (1, &"other".into()), "{answer}");
    assert!(answer.contains("note: area 1: the meshes differ; faces were compared by place"), "{answer}");
    let depth = "depth is in units of 512 in A and mm in B; its pixels were not compared";
    assert!(answer.contains(depth) && answer.contains("axes paper in A and opencv in B"), "{answer}");
    assert_eq!(entry(&json["settings"], "name", "options.size")["b"], 40);
    let of = |modality: &str| entry(&json["modalities"], "modality", modality).clone();
    // The views differ in size; the panoramas show the table in another place.
    assert_eq!((&of("rgb")["other_form"], &of("depth")["other_form"]), (&10.into(), &12.into()));
    assert!(of("rgb")["changed"].as_u64().unwrap() > 0, "{answer}");
    let labels = &json["labels"];
    let pixels = of("semantic")["pixels_changed"].as_u64().unwrap();
    assert!(pixels > 0 && labels["changed"]["pixels"] == pixels && labels["changed"]["faces"] == 0);
    assert_eq!((&of("semantic_class")["only_a"], &of("semantic_class")["only_b"]), (&12.into(), &0.into()));
    // K is compared only where sizes are equal: for panoramas.
    let poses = &json["poses"];
    assert_eq!((&poses["same"], &poses["same_camera"], count(&poses["moved"])), (&2.into(), &10.into(), 0));
    // The table is 5 cm higher: it is found.
    let area = &json["areas"][0];
    assert_eq!((&area["m2_only_a"], &area["m2_only_b"]), (&0.0.into(), &0.0.into()), "{answer}");
}

#[test]
fn the_answer_is_the_same_for_any_number_of_threads_and_goes_to_a_file() {
    let (_dir, out) = altered(whole(), |out| {
        for domain in [Domain::Rgb, Domain::Normal, Domain::SemanticPretty] {
            for is_panorama in [false, true] {
                repaint(&file(out, is_panorama, domain), |[r, g, b]| [r ^ 1, g ^ 2, b]);
            }
        }
        let path = file(out, true, Domain::SemanticClass);
        let (image, palette) = read_palette8(&path).unwrap();
        let image = Raster::from_vec(image.width(), image.height(), vec![0; image.len()]);
        let bytes = s3d_io::image::encode_palette8(&image, &palette, Compression::Fast);
        s3d_io::fs::write_bytes(&path, &bytes).unwrap();
    });
    let one = compare_with(whole(), &out, &["--threads", "1"]);
    assert_eq!(one, compare_with(whole(), &out, &["--threads", "2"]));
    let class = entry(&one.1["modalities"], "modality", "semantic_class").clone();
    assert_eq!((&class["changed"], &class["pixels"]), (&1.into(), &(96 * 48).into()));
    let json = out.with_file_name("compare.json");
    let call = ["compare", text(whole()), text(&out), "--json", text(&json)];
    let said = super::s3d(&call);
    assert_eq!((said.status.code(), String::from_utf8(said.stdout).unwrap()), (Some(1), one.0));
    let written: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!(written, one.1);
    let again = super::s3d(&call);
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--overwrite"));
    list_files(&out);
    s3d_ok(&["compare", text(&out), text(&out), "--json", text(&json), "--overwrite"]);
}
