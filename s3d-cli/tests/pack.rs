//! `s3d pack`, run as a process on a small data set. Packages are complete, the same for any number of
//! threads, and never change the data set; error messages name the file.

use crate::common;
use common::{files, list_files, s3d_fails, s3d_ok, text, write_scan};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A data set of two areas, made once. Tests only read it.
fn dataset() -> &'static Path {
    static DATASET: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, out) = DATASET.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let scenes = [1, 2].map(|area| write_scan(&dir.path().join(format!("scan_{area}")), area));
        let out = dir.path().join("dataset");
        let call = ["export", text(&scenes[0]), text(&scenes[1]), "-o", text(&out)];
        s3d_ok(&[&call[..], &SMALL].concat());
        (dir, out)
    });
    out
}

const SMALL: [&str; 8] = ["--views", "6", "--size", "48", "--pano-width", "64", "--points-per-m2", "100"];

/// Exports the scenes of [`dataset`] with these arguments.
fn export_call<'a>(scenes: &'a [PathBuf; 2], more: &[&'a str]) -> Vec<&'a str> {
    [&["export", text(&scenes[0]), text(&scenes[1])], more, &SMALL].concat()
}

fn scenes() -> [PathBuf; 2] {
    [1, 2].map(|area| dataset().with_file_name(format!("scan_{area}")).join("scene.toml"))
}

const KINDS: [&str; 14] = [
    "webdataset",
    "colmap",
    "nerfstudio",
    "coco",
    "parquet",
    "huggingface",
    "dust3r",
    "wai",
    "vggt",
    "pointcept",
    "habitat",
    "usd",
    "concerto",
    "spatial-qa",
];

/// Packs into `dir`, and returns all files written, by path.
fn pack(dir: &Path, kind: &str, more: &[&str]) -> BTreeMap<PathBuf, Vec<u8>> {
    let place = dir.join("package");
    s3d_ok(&[&["pack", text(dataset()), "--to", kind, "-o", text(&place)], more].concat());
    if kind == "parquet" {
        BTreeMap::from([(PathBuf::new(), fs::read(&place).unwrap())])
    } else {
        files(&place)
    }
}

/// The names of an area's images of a kind, as in the data set.
fn image_names(area: u32, kind: &str) -> Vec<String> {
    let folder = dataset().join(format!("area_{area}/{kind}/rgb"));
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn json(bytes: &[u8]) -> serde_json::Value {
    serde_json::from_slice(bytes).unwrap()
}

#[test]
fn the_same_bytes_for_any_number_of_threads_and_nothing_altered() {
    let before = files(dataset());
    for kind in KINDS {
        let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let more: &[&str] = if kind == "webdataset" {
            &["--max-count", "3", "--shuffle", "5"]
        } else {
            &[]
        };
        let one = pack(a.path(), kind, &[more, &["--threads", "1"]].concat());
        let four = pack(b.path(), kind, &[more, &["--threads", "4"]].concat());
        // nerfstudio's paths lead from the package to the data set, so both packages must lie equally deep.
        assert!(one.keys().eq(four.keys()), "{kind}");
        for (path, bytes) in &one {
            assert!(*bytes == four[path], "{kind}: {path:?}");
        }
        assert_eq!(fs::read_dir(a.path()).unwrap().count(), 1, "{kind} leaves nothing beside the package");
    }
    assert_eq!(files(dataset()), before);
}

#[test]
fn scenes_are_packed_like_their_data_set() {
    let scenes = scenes();
    for kind in ["webdataset", "huggingface", "dust3r", "wai", "vggt"] {
        let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let place = b.path().join("package");
        s3d_ok(&export_call(&scenes, &["--to", kind, "-o", text(&place)]));
        let (expected, found) = (pack(a.path(), kind, &[]), files(&place));
        assert!(expected.keys().eq(found.keys()), "{kind}");
        for (path, bytes) in &expected {
            assert!(*bytes == found[path], "{kind}: {path:?}");
        }
        assert_eq!(fs::read_dir(b.path()).unwrap().count(), 1, "{kind} leaves nothing beside the package");
    }
}

#[test]
fn scenes_that_cannot_be_packed_are_told_before_the_work() {
    let scenes = scenes();
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("package");
    let inside = scenes[0].with_file_name("package");
    for (more, expected) in [
        (&["--to", "coco"][..], "call `s3d pack`"),
        (&["--to", "dust3r", "--modalities", "rgb,depth"], "--modalities rgb,depth: DUSt3R needs pose"),
        (&["--to", "huggingface", "--modalities", "global_xyz"], "Hugging Face has no use for them"),
        (&["--to", "webdataset", "--profile", "pointnet"], "--profile pointnet"),
        (&["--to", "webdataset", "--shard", "1/2"], "cannot be used with"),
    ] {
        let more = [more, &["-o", text(&place)]].concat();
        s3d_fails(&export_call(&scenes, &more), 2, &[expected]);
    }
    let folder = text(scenes[0].parent().unwrap());
    s3d_fails(&["export", folder, "--to", "webdataset", "-o", text(&inside)], 2, &["in one another"]);
    assert!(!inside.exists() && fs::read_dir(dir.path()).unwrap().next().is_none());
}

#[test]
fn shards_hold_every_file_once() {
    let dir = tempfile::tempdir().unwrap();
    let package = pack(dir.path(), "webdataset", &["--max-count", "3"]);
    let index = json(&package[Path::new("shards.json")]);
    let shards = index["shardlist"].as_array().unwrap();
    let samples: u64 = shards.iter().map(|s| s["nsamples"].as_u64().unwrap()).sum();
    let images: usize = [1, 2]
        .iter()
        .map(|a| image_names(*a, "data").len() + image_names(*a, "pano").len())
        .sum();
    assert_eq!(samples as usize, images);
    let all = files(dataset());
    let mut found = 0;
    for shard in shards {
        let bytes = &package[Path::new(shard["url"].as_str().unwrap())];
        assert_eq!(bytes.len() as u64, shard["filesize"].as_u64().unwrap());
        assert!(shard["nsamples"].as_u64().unwrap() <= 3);
        // Every file of an image is in some shard, byte by byte.
        let mut meta = 0;
        for header in bytes.chunks(512).filter(|b| b.len() == 512 && b[257..262] == *b"ustar") {
            if header.starts_with(b"__s3d__/") {
                meta += 1;
                continue;
            }
            assert!(header.starts_with(b"area_") || header.starts_with(b"camera_"), "{header:?}");
            found += 1;
        }
        assert_eq!(meta, 2, "conventions and labels");
    }
    let in_images = |p: &&PathBuf| {
        p.components()
            .any(|c| c.as_os_str() == "data" || c.as_os_str() == "pano")
    };
    assert_eq!(found, all.keys().filter(in_images).count());
    assert!(package.contains_key(Path::new("area_1_panoramas-000000.tar")));

    let dir = tempfile::tempdir().unwrap();
    let more = ["--prefix", "train", "--images", "views", "--modalities", "rgb,depth", "--areas", "2"];
    let package = pack(dir.path(), "webdataset", &more);
    let names: Vec<_> = package.keys().map(|p| p.to_str().unwrap()).collect();
    // One shard for each sample.
    let samples = image_names(2, "data").len();
    let shards: Vec<_> = (0..samples).map(|i| format!("train-{i:06}.tar")).collect();
    assert!(samples > 1 && samples <= 8);
    assert_eq!(names[..2], ["pack.json", "shards.json"]);
    assert_eq!(names[2..], shards);
    for shard in shards {
        let headers = package[Path::new(&shard)]
            .chunks(512)
            .filter(|b| b[257..262] == *b"ustar")
            .count();
        assert_eq!(headers, 2 + 2);
    }
}

#[test]
fn colmap_models_and_copies() {
    let dir = tempfile::tempdir().unwrap();
    let package = pack(dir.path(), "colmap", &["--points", "50", "--copy-images"]);
    for area in [1, 2] {
        let names = image_names(area, "data");
        let text = |name: &str| {
            let path = format!("area_{area}/sparse/0/{name}");
            String::from_utf8(package[Path::new(&path)].clone()).unwrap()
        };
        let listed: Vec<String> = text("images.txt")
            .lines()
            .filter(|l| l.ends_with(".png"))
            .map(|l| l.split(' ').next_back().unwrap().to_owned())
            .collect();
        assert_eq!(
            {
                let mut l = listed.clone();
                l.sort();
                l
            },
            names
        );
        for name in names {
            let copy = &package[Path::new(&format!("area_{area}/images/{name}"))];
            assert_eq!(*copy, fs::read(dataset().join(format!("area_{area}/data/rgb/{name}"))).unwrap());
        }
        assert_eq!(text("points3D.txt").lines().filter(|l| !l.starts_with('#')).count(), 50);
        assert_eq!(text("cameras.txt").matches(" PINHOLE 48 48 ").count(), listed.len());
    }
    let dir = tempfile::tempdir().unwrap();
    let package = pack(dir.path(), "colmap", &["--binary", "--points", "0", "--areas", "1"]);
    assert_eq!(package[Path::new("area_1/sparse/0/points3D.bin")], [0; 8]);
    assert!(
        package
            .keys()
            .all(|p| p.extension().is_none_or(|e| e != "txt" && e != "png"))
    );
}

#[test]
fn nerfstudio_finds_its_files() {
    let dir = tempfile::tempdir().unwrap();
    for (more, depths) in [
        (&[] as &[&str], true),
        (&["--depth", "original", "--overwrite"], true),
        (&["--depth", "none", "--copy-images", "--overwrite"], false),
        (&["--depth", "original", "--copy-images", "--overwrite"], true),
    ] {
        let package = pack(dir.path(), "nerfstudio", more);
        for (name, kind, model) in
            [("transforms.json", "data", "OPENCV"), ("transforms_panoramas.json", "pano", "EQUIRECTANGULAR")]
        {
            let file = json(&package[Path::new(&format!("area_1/{name}"))]);
            assert_eq!(file["camera_model"], model);
            let frames = file["frames"].as_array().unwrap();
            assert_eq!(frames.len(), image_names(1, kind).len());
            let folder = dir.path().join("package/area_1");
            assert!(folder.join(file["ply_file_path"].as_str().unwrap()).is_file());
            for frame in frames {
                assert!(folder.join(frame["file_path"].as_str().unwrap()).is_file(), "{frame}");
                assert_eq!(frame.get("depth_file_path").is_some(), depths, "{more:?}");
                if let Some(depth) = frame.get("depth_file_path") {
                    assert!(folder.join(depth.as_str().unwrap()).is_file(), "{frame}");
                }
            }
        }
    }
}

#[test]
fn coco_has_a_panoptic_image_for_each_image() {
    let dir = tempfile::tempdir().unwrap();
    let package = pack(dir.path(), "coco", &["--stuff", "none", "--images", "views"]);
    let file = json(&package[Path::new("panoptic.json")]);
    assert!(file["categories"].as_array().unwrap().iter().all(|c| c["isthing"] == 1));
    let images = file["images"].as_array().unwrap();
    assert_eq!(images.len(), image_names(1, "data").len() + image_names(2, "data").len());
    for image in images {
        let name = image["file_name"].as_str().unwrap();
        assert!(dataset().join(name).is_file() && package.contains_key(&Path::new("panoptic").join(name)));
    }
    assert_eq!(package.len(), 3 + images.len());
}

#[test]
fn areas_are_scenes_splits_and_sequences() {
    let dir = tempfile::tempdir().unwrap();
    let has = |package: &BTreeMap<PathBuf, Vec<u8>>, path: &str| {
        assert!(package.contains_key(Path::new(path)), "{path}: {:?}", package.keys());
    };
    let made = |kind: &str| pack(&dir.path().join(kind), kind, &[]);

    let package = made("huggingface");
    for area in [1, 2] {
        for config in ["views", "panoramas"] {
            has(&package, &format!("data/{config}/area_{area}-00000-of-00001.parquet"));
        }
    }
    let card = String::from_utf8(package[Path::new("README.md")].clone()).unwrap();
    assert!(card.contains("  - split: area_2\n    path: data/views/area_2-*.parquet\n"), "{card}");

    let (dust3r, wai, vggt) = (made("dust3r"), made("wai"), made("vggt"));
    for area in [1, 2] {
        has(&wai, &format!("area_{area}/scene_meta.json"));
        for name in image_names(area, "data") {
            let stem = name.strip_suffix("_domain_rgb.png").unwrap();
            has(&dust3r, &format!("area_{area}/images/{stem}.jpg"));
            has(&dust3r, &format!("area_{area}/depth/{stem}.png"));
            has(&wai, &format!("area_{area}/rendered_depth/{stem}.exr"));
            has(&vggt, &format!("area_{area}/depths/{stem}.png"));
        }
    }

    let pointcept = made("pointcept");
    for area in [1, 2] {
        let rooms = fs::read_dir(dataset().join(format!("s3dis/Area_{area}"))).unwrap();
        for room in rooms.map(|room| room.unwrap()).filter(|room| room.path().is_dir()) {
            has(&pointcept, &format!("Area_{area}/{}/coord.npy", room.file_name().to_str().unwrap()));
        }
    }
}

#[test]
fn wrong_calls_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let (out, place) = (text(dataset()), dir.path().join("package"));
    let call = |more: &[&str], parts: &[&str]| {
        s3d_fails(&[&["pack", out, "-o", text(&place)], more].concat(), 2, parts);
        assert!(!place.exists());
    };
    call(&["--to", "zip"], &["webdataset", "parquet"]);
    call(&["--to", "colmap", "--areas", "4"], &["--areas 4", "there are 1, 2"]);
    call(&["--to", "parquet", "--points", "3"], &["--points belongs to colmap and nerfstudio only"]);
    call(&["--to", "colmap", "--images", "panoramas"], &["--images panoramas", "for nerfstudio"]);
    call(&["--to", "pointcept", "--images", "views"], &["--images belongs to webdataset and colmap and"]);
    call(&["--to", "huggingface", "--modalities", "pose"], &["--modalities pose", "k, rt, x, y and z"]);
    for kind in KINDS {
        let inside = dataset().join("area_1/packed");
        s3d_fails(&["pack", out, "--to", kind, "-o", text(&inside)], 2, &["in one another"]);
        assert!(!inside.exists());
    }
    fs::create_dir(&place).unwrap();
    fs::write(place.join("thesis.tex"), "").unwrap();
    s3d_fails(
        &["pack", out, "--to", "coco", "-o", text(&place), "--overwrite"],
        2,
        &["thesis.tex", "not written by s3d pack"],
    );
    s3d_fails(&["pack", text(&place), "--to", "coco"], 1, &["manifest.json", "not there"]);
}

#[test]
fn packages_are_replaced_only_when_asked() {
    let dir = tempfile::tempdir().unwrap();
    for kind in ["coco", "parquet"] {
        let place = dir.path().join(kind);
        let args = ["pack", text(dataset()), "--to", kind, "-o", text(&place)];
        s3d_ok(&args);
        s3d_fails(&args, 2, &["--overwrite"]);
        s3d_ok(&[&args[..], &["--overwrite"]].concat());
    }
}

/// A damaged copy of the data set.
fn damaged(dir: &Path, damage: impl FnOnce(&Path)) -> PathBuf {
    let out = dir.join("damaged");
    for (path, bytes) in files(dataset()) {
        let path = out.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    damage(&out);
    out
}

#[test]
fn a_damaged_data_set_is_told_by_the_file() {
    let depth = image_names(1, "data")[1].replace("rgb", "depth");
    let semantic = image_names(1, "data")[2].replace("rgb", "semantic");
    let pose = image_names(2, "data")[0].replace("_rgb.png", "_pose.json");
    let dir = tempfile::tempdir().unwrap();
    let (of_depth, of_semantic) =
        (format!("area_1/data/depth/{depth}"), format!("area_1/data/semantic/{semantic}"));
    let of_pose = format!("area_2/data/pose/{pose}");
    let out = damaged(dir.path(), |out| fs::remove_file(out.join(&of_depth)).unwrap());
    let place = dir.path().join("package");
    let fails = |kind: &str, parts: &[&str]| {
        s3d_fails(&["pack", text(&out), "--to", kind, "-o", text(&place)], 1, parts);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "nothing is left of a package that failed");
    };
    for kind in KINDS.iter().filter(|kind| !["pointcept", "habitat"].contains(kind)) {
        fails(kind, &[&of_depth, "missing"]);
    }
    fs::copy(dataset().join(&of_depth), out.join(&of_depth)).unwrap();

    // The faults from here on are a tool's that also updates files.csv.
    fs::write(out.join(&of_semantic), "no image").unwrap();
    list_files(&out);
    fails("coco", &[&of_semantic, "PNG"]);
    fails("parquet", &[&of_semantic, "PNG"]);
    // A label that no table has.
    let labels = out.join("assets/semantic_labels.json");
    fs::copy(dataset().join(&of_semantic), out.join(&of_semantic)).unwrap();
    fs::write(&labels, "[\"<UNK>_0_<UNK>_0_0\"]").unwrap();
    list_files(&out);
    fails("coco", &["_domain_semantic.png", "has label", "semantic_labels.json"]);
    fails("parquet", &["_domain_semantic.png", "has label", "semantic_labels.json"]);
    fs::copy(dataset().join("assets/semantic_labels.json"), &labels).unwrap();

    fs::write(out.join(&of_pose), "{\n}").unwrap();
    list_files(&out);
    let with_poses = ["colmap", "nerfstudio", "parquet", "huggingface", "dust3r", "wai", "vggt"];
    for kind in [&with_poses[..], &["usd", "concerto", "spatial-qa"]].concat() {
        fails(kind, &[&of_pose, "missing field"]);
    }
    fs::copy(dataset().join(&of_pose), out.join(&of_pose)).unwrap();
    let cloud = out.join("area_2/3d/pointcloud.ply");
    let bytes = fs::read(&cloud).unwrap();
    fs::write(&cloud, &bytes[..bytes.len() - 1]).unwrap();
    list_files(&out);
    fails("colmap", &["area_2/3d/pointcloud.ply", "ends too early"]);
    fs::remove_file(&cloud).unwrap();
    fails("nerfstudio", &["area_2/3d/pointcloud.ply", "cannot read"]);
}

#[test]
fn units_of_depth_are_those_of_the_manifest() {
    let dir = tempfile::tempdir().unwrap();
    let out = damaged(dir.path(), |_| {});
    let place = dir.path().join("package");
    let write = |units: &str, per_m: f64| {
        for (name, place, value) in [
            ("manifest.json", "/options/depth_units", units.into()),
            ("conventions.json", "/depth/units_per_m", per_m.into()),
        ] {
            let mut json = json(&fs::read(out.join(name)).unwrap());
            *json.pointer_mut(place).unwrap() = value;
            fs::write(out.join(name), json.to_string()).unwrap();
        }
        list_files(&out);
    };
    let args =
        ["pack", text(&out), "--to", "nerfstudio", "--depth", "original", "--overwrite", "-o", text(&place)];
    write("512", 512.0);
    assert!(s3d_ok(&args).contains("depth-unit-scale-factor 0.001953125 here"));
    write("mm", 1000.0);
    assert!(s3d_ok(&args).contains("depth-unit-scale-factor 0.001 here"));
    write("ell", 1000.0);
    s3d_fails(&args, 1, &["manifest.json", "\"ell\""]);
}

#[test]
fn a_data_set_without_a_modality_says_what_is_needed() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let out = dir.path().join("poses");
    s3d_ok(&[
        "export",
        text(&scene),
        "-o",
        text(&out),
        "--views",
        "2",
        "--modalities",
        "pose",
        "--points-per-m2",
        "50",
    ]);
    for (kind, modality) in [("colmap", "rgb"), ("nerfstudio", "rgb"), ("coco", "rgb")] {
        s3d_fails(&["pack", text(&out), "--to", kind], 1, &["missing", &format!("needs {modality}")]);
    }
    // Other packages need no single modality. By default they lie beside the data set.
    s3d_ok(&["pack", text(&out), "--to", "parquet"]);
    s3d_ok(&["pack", text(&out), "--to", "webdataset"]);
    assert!(dir.path().join("poses_images.parquet").is_file());
    assert!(dir.path().join("poses_webdataset/area_1_views-000000.tar").is_file());
}
