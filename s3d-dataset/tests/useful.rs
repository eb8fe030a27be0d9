//! Useless data sets are not made, unless the caller insists; `info` agrees.

use crate::common;

use common::{memory_scene, options, scene_of};
use s3d_dataset::event::MessageLevel;
use s3d_dataset::export::MemoryScene;
use s3d_dataset::info::InfoOptions;
use s3d_dataset::options::Condition;
use s3d_dataset::{Context, Error, Event, Export, ExportOptions};
use s3d_geom::glam::{Vec3, dvec3, vec3};
use s3d_geom::{Pose, TriMesh};
use s3d_synth::{Building, ScanOptions};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// The export must be refused for this condition, with these words, and `info` must name it too. With the
/// condition allowed there is a data set, and a warning in the same words.
#[track_caller]
fn stops(scene: impl Fn() -> MemoryScene, options: &ExportOptions, condition: Condition, words: &str) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let export = |allow: &[Condition], context: &Context| {
        let options = ExportOptions { allow: allow.to_vec(), ..options.clone() };
        Export::new([scene()]).options(options).run(&out, context)
    };
    let error = export(&[], &Context::default()).unwrap_err();
    assert!(matches!(&error, Error::Input(e) if e.to_string().contains(words)), "{error}");
    assert!(error.to_string().contains(&format!("`allow = {condition}`")), "{error}");
    let manifest = || std::fs::read_to_string(out.join("manifest.json")).unwrap_or_default();
    assert!(!manifest().contains("complete"), "nothing passes for a data set");
    let others: Vec<Condition> = Condition::ALL.into_iter().filter(|c| *c != condition).collect();
    assert!(export(&others, &Context::default()).is_err());

    let info_options = InfoOptions { place_cameras: options.place_cameras, ..InfoOptions::default() };
    let info = s3d_dataset::info(scene(), &info_options, &Context::default()).unwrap();
    let named = info
        .doubts
        .iter()
        .any(|d| d.contains(words) && d.contains(&format!("unless {condition} is allowed")));
    assert!(named || condition == Condition::Size, "{info}");

    let warnings = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&warnings);
    let context = Context::default().observed_by(move |event: &Event<'_>| {
        if let Event::Message { level: MessageLevel::Warning, text } = event {
            seen.lock().unwrap().push((*text).to_owned());
        }
    });
    // These two are limits on the size of an image and on the disk, not properties of the scene.
    if condition == Condition::Size || condition == Condition::Locations {
        return;
    }
    assert!(export(&[condition], &context).unwrap().is_some(), "an export that is insisted on");
    assert!(warnings.lock().unwrap().iter().any(|w| w.contains(words)), "{:?}", warnings.lock().unwrap());
    assert!(manifest().contains("complete") && !manifest().contains("allow"));
    // The manifest has the same warnings for later readers.
    let noted = noted(&out);
    for warning in &*warnings.lock().unwrap() {
        assert!(noted.contains(warning), "{warning}: {noted:?}");
    }
}

/// The warnings in the manifest about the first area.
fn noted(out: &Path) -> Vec<String> {
    let manifest = std::fs::read(out.join("manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let warnings = manifest["areas"][0]["warnings"].as_array().cloned().unwrap_or_default();
    warnings.iter().map(|w| w.as_str().unwrap().to_owned()).collect()
}

#[test]
fn warnings_that_are_kept_do_not_tell_where_the_scene_lay() {
    let dir = tempfile::tempdir().unwrap();
    let export = |name: &str| {
        let folder = dir.path().join(name);
        let scan = ScanOptions { points_per_m2: 60.0, ..ScanOptions::default() };
        let scene = Building::demo()
            .build()
            .unwrap()
            .write_scan(&folder.join("scan"), &scan, || true)
            .unwrap();
        let gone = folder.join("scan/rgb_textures/cork_13.png");
        std::fs::remove_file(&gone).unwrap();
        let out = folder.join("out");
        let options = ExportOptions { views: 2, size: 32, pano_width: 64, ..options(0) };
        Export::new([scene])
            .options(options)
            .run(&out, &Context::default())
            .unwrap()
            .unwrap();
        noted(&out)
    };
    let first = export("a");
    assert!(first.iter().any(|w| w.contains("cork_13.png") && !w.contains("/a/")), "{first:?}");
    assert_eq!(first, export("quite another name"));
}

#[test]
fn a_good_scene_is_of_use() {
    let info = s3d_dataset::info(memory_scene(), &InfoOptions::default(), &Context::default()).unwrap();
    assert_eq!(info.doubts, Vec::<String>::new());
    assert!(
        info.estimate.files > 300.0 && info.to_string().contains("an export with the default options: about")
    );
}

#[test]
fn points_beside_the_mesh() {
    stops(
        || scene_of(|p| p, |p| p + 1.0),
        &options(0),
        Condition::Frame,
        "farther than 5 cm from every face",
    );
}

#[test]
fn another_axis_that_points_up() {
    // Mesh and points lie on their side, with a location in the middle.
    let turned = |p: Vec3| vec3(p.x, -p.z, p.y);
    let scene = move || {
        let mut scene = scene_of(turned, turned);
        scene.locations[0].pose = Pose::level(dvec3(2.0, -1.25, 1.5), 0.0);
        scene
    };
    stops(scene, &options(0), Condition::Up, "floors and ceilings are level");
}

#[test]
fn feet_for_metres() {
    let scene = || {
        let mut scene = scene_of(|p| 4.0 * p, |p| 4.0 * p);
        scene.locations[0].pose = Pose::level(dvec3(8.0, 6.0, 5.0), 0.0);
        scene
    };
    stops(scene, &options(0), Condition::Scale, "rooms are 10.0 m high");
}

#[test]
fn a_mesh_of_millimetres() {
    let scene = || {
        let mut scene = scene_of(|p| 0.02 * p, |p| 0.02 * p);
        scene.locations[0].pose = Pose::level(dvec3(0.04, 0.03, 0.025), 0.0);
        scene
    };
    let dense = ExportOptions { points_per_m2: 1e5, ..options(0) };
    stops(scene, &dense, Condition::Scale, "only 8.0 cm long");
}

#[test]
fn a_location_outside() {
    let scene = || {
        let mut scene = memory_scene();
        scene.locations[0].pose = Pose::level(dvec3(12.0, 1.5, 1.4), 0.0);
        scene
    };
    let both = ExportOptions { allow: vec![Condition::InsideOut], ..options(0) };
    let dir = tempfile::tempdir().unwrap();
    let error = Export::new([scene()])
        .options(both)
        .run(dir.path().join("out"), &Context::default())
        .unwrap_err();
    assert!(
        error.to_string().contains("scan locations see the mesh in")
            && error.to_string().contains("`allow = coverage`")
    );
}

#[test]
fn faces_wound_the_other_way() {
    let scene = || {
        let mut scene = memory_scene();
        let mut parts = scene.mesh.into_parts();
        parts.faces.iter_mut().for_each(|f| f.swap(1, 2));
        scene.mesh = TriMesh::new(parts).unwrap();
        scene
    };
    stops(scene, &options(0), Condition::InsideOut, "are back sides");
}

#[test]
fn a_mesh_without_colours() {
    let scene = || {
        let mut scene = memory_scene();
        let mut parts = scene.mesh.into_parts();
        parts.colors.clear();
        scene.mesh = TriMesh::new(parts).unwrap();
        scene
    };
    stops(scene, &options(0), Condition::Colour, "no texture and no colours");
    // Without RGB images the data set is not impaired.
    let modalities = options(0)
        .modalities
        .into_iter()
        .filter(|d| d.to_string() != "rgb")
        .collect();
    let dir = tempfile::tempdir().unwrap();
    let export = Export::new([scene()]).options(ExportOptions { modalities, ..options(0) });
    assert!(
        export
            .run(dir.path().join("out"), &Context::default())
            .unwrap()
            .is_some()
    );
}

#[test]
fn a_location_on_every_millimetre() {
    let close = ExportOptions { place_cameras: Some(0.001), ..options(0) };
    stops(memory_scene, &close, Condition::Locations, "scan locations on 12 m² of floor");
}

#[test]
fn more_than_the_disk_holds() {
    let dense = ExportOptions { points_per_m2: 1e8, ..options(0) };
    stops(memory_scene, &dense, Condition::Size, "points: is the mesh in metres?");
    let large = ExportOptions { views: 100_000, size: 16_384, ..options(0) };
    stops(memory_scene, &large, Condition::Size, "are free at");
}

#[test]
fn a_data_set_is_told_of_as_a_whole_and_by_area() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    Export::new([memory_scene()])
        .options(options(5))
        .run(&out, &Context::default())
        .unwrap();
    assert!(s3d_dataset::info::is_data_set(&out) && !s3d_dataset::info::is_data_set(dir.path()));
    let info = s3d_dataset::info::data_set_info(&out, &Context::default()).unwrap();
    assert_eq!((info.seed, info.panoramas, info.areas.len(), &*info.taxonomy), (5, 1, 1, "s3dis"));
    assert_eq!((info.areas[0].area, info.areas[0].storeys.len()), (2, 1));
    let text = info.to_string();
    for part in ["a complete data set of s3d ", "seed 5", "7 labels of the taxonomy s3dis", "\narea 2\n"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    std::fs::write(out.join("files.csv"), "").unwrap();
    let refused = s3d_dataset::info::data_set_info(&out, &Context::default()).unwrap_err();
    assert!(refused.to_string().contains("files.csv"), "{refused}");
}

/// A mesh without a place for a scanner: `info` still reports all the rest.
#[test]
fn a_table_top_is_no_room_but_is_told_of() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("top.obj");
    std::fs::write(&path, "v 0 0 0\nv 2 0 0\nv 2 0 -1\nv 0 0 -1\nf 1 2 3 4\n").unwrap();
    let info = s3d_dataset::info(&path, &InfoOptions::default(), &Context::default()).unwrap();
    assert_eq!((info.mesh.faces, info.locations.len()), (2, 0));
    assert!(info.doubts.iter().any(|d| d.contains("an export stops here")), "{info}");
}

#[test]
fn a_folder_without_a_scene_is_told_what_it_may_hold() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("top.obj"), "").unwrap();
    let refused = s3d_dataset::info(dir.path(), &InfoOptions::default(), &Context::default()).unwrap_err();
    let words = "holds no scene.toml, no published area (3d/rgb.obj), and no scene of ScanNet";
    assert!(refused.to_string().contains(words), "{refused}");
}
