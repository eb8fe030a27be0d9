//! A program that depends on this crate alone exports, cancels, resumes, verifies and packs.

use crate::common;

use common::{memory_scene, options};
use s3d_dataset::event::{MessageLevel, Stage, UnitKind};
use s3d_dataset::info::InfoOptions;
use s3d_dataset::options::Profile;
use s3d_dataset::pack::{PackOptions, Package, WebdatasetOptions};
use s3d_dataset::profile::ProfileOptions;
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::xyz::XyzOptions;
use s3d_dataset::{Cancel, Context, Error, Event, Export, ExportOptions};
use s3d_geom::glam::dvec3;
use s3d_geom::{Pose, TriMesh};
use s3d_synth::{Building, ScanOptions};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex};

/// The built-in scene as files in `folder`.
fn scan(folder: &Path) -> PathBuf {
    let scene = Building::demo().build().unwrap();
    scene.write_scan(folder, &ScanOptions::default(), || true).unwrap()
}

/// Every file below a folder with its bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fn walk(at: &Path, root: &Path, found: &mut BTreeMap<PathBuf, Vec<u8>>) {
        for entry in fs::read_dir(at).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, found);
            } else {
                found.insert(path.strip_prefix(root).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(folder, folder, &mut found);
    found
}

#[track_caller]
fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    let differ: Vec<_> = a
        .iter()
        .filter(|(name, bytes)| b[*name] != **bytes)
        .map(|(name, _)| name)
        .collect();
    assert!(differ.is_empty(), "{differ:?}");
}

#[test]
fn an_export_that_is_cancelled_half_way_goes_on_to_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scan(&dir.path().join("scan"));
    let (whole, stopped) = (dir.path().join("whole"), dir.path().join("stopped"));
    let export = Export::new([&scene]).options(options(3));
    let made = export.run(&whole, &Context::default()).unwrap().unwrap();
    assert!(made.tally.views.images > 0 && made.tally.files > 0);

    let cancel = Cancel::default();
    let (theirs, events) = (cancel.clone(), Arc::new(Mutex::new((0, false))));
    let seen = Arc::clone(&events);
    let context = Context::default()
        .cancelled_by(cancel.clone())
        .observed_by(move |event: &Event<'_>| {
            let mut seen = seen.lock().unwrap();
            match event {
                Event::UnitFinished { unit: UnitKind::Location, .. } => {
                    seen.0 += 1;
                    // Cancels from a thread that is not the caller's.
                    theirs.cancel();
                }
                Event::StageStarted { stage: Stage::Render, .. } => seen.1 = true,
                _ => {}
            }
        });
    assert!(matches!(export.run(&stopped, &context), Err(Error::Cancelled)));
    assert!(events.lock().unwrap().0 >= 1 && events.lock().unwrap().1);
    assert!(!stopped.join("manifest.json").exists() || stopped.join(".s3d/request.json").exists());

    // Another call is refused; the same one goes on.
    let other = Export::new([&scene])
        .options(options(4))
        .run(&stopped, &Context::default());
    assert!(matches!(other, Err(Error::Usage(_))));
    assert!(cancel.is_cancelled());
    cancel.reset();
    let context = Context::default().cancelled_by(cancel);
    assert!(export.run(&stopped, &context).unwrap().is_some());
    assert_same(&whole, &stopped);
    assert!(export.run(&stopped, &context).unwrap().is_none(), "nothing is left to do");
}

#[test]
fn two_exports_at_the_same_time_do_not_meet() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scan(&dir.path().join("scan"));
    let run = |name: &str, seed| {
        let warnings = Arc::new(Mutex::new(0u64));
        let counted = Arc::clone(&warnings);
        let context = Context::default().observed_by(move |event: &Event<'_>| {
            if let Event::Message { level: MessageLevel::Warning, .. } = event {
                *counted.lock().unwrap() += 1;
            }
        });
        let made = Export::new([&scene])
            .options(options(seed))
            .run(dir.path().join(name), &context);
        let made = made.unwrap().unwrap();
        assert_eq!((made.warnings, context.warnings()), (*warnings.lock().unwrap(), made.warnings));
    };
    std::thread::scope(|scope| {
        scope.spawn(|| run("a", 1));
        scope.spawn(|| run("b", 2));
    });
    run("c", 1);
    run("d", 2);
    assert_same(&dir.path().join("a"), &dir.path().join("c"));
    assert_same(&dir.path().join("b"), &dir.path().join("d"));
}

#[test]
fn values_in_memory_become_a_data_set_that_verifies_and_packs() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let context = Context::default();
    let export = |scene| Export::new([scene]).options(options(0));
    assert!(export(memory_scene()).run(&out, &context).unwrap().is_some());
    let report = s3d_dataset::verify(&out, &VerifyOptions { full: true }, &context).unwrap();
    assert_eq!(report.fault_count(), 0, "{report}");
    assert!(report.checks > 100, "{report}");

    // The same values make the same call; changed values do not.
    assert!(export(memory_scene()).run(&out, &context).unwrap().is_none());
    let mut moved = memory_scene();
    moved.locations[0].pose = Pose::level(dvec3(2.0, 1.0, 1.4), 0.3);
    let refused = export(moved).run(&out, &context).unwrap_err();
    assert!(matches!(&refused, Error::Usage(e) if e.to_string().contains("memory:locations")), "{refused}");
    let mut twice = memory_scene();
    let mut parts = twice.mesh.into_parts();
    parts.faces.push(parts.faces[0]);
    twice.mesh = TriMesh::new(parts).unwrap();
    let refused = export(twice).run(dir.path().join("twice"), &context).unwrap_err();
    assert!(refused.to_string().contains("1 faces have the corners of earlier ones"), "{refused}");

    let info = s3d_dataset::info(memory_scene(), &InfoOptions::default(), &context).unwrap();
    assert_eq!((info.area, info.mesh.faces, info.rooms.len(), info.labelled_faces), (2, 12, 1, 12));
    assert!((info.rooms[0].floor_m2 - 12.0).abs() < 0.5, "{info}");
    let statistics = s3d_dataset::statistics(&out).unwrap();
    assert_eq!(statistics.areas[0].labels.as_ref().unwrap().tally.instances_per_class["wall"], 4);

    let package = Package::Webdataset(WebdatasetOptions::default());
    let packed = PackOptions { output: Some(dir.path().join("packed")), ..PackOptions::default() };
    let place = s3d_dataset::pack(&out, &package, &packed, &context).unwrap();
    assert!(fs::read_dir(place).unwrap().count() >= 2);
    s3d_dataset::profile(&out, &[Profile::PointNet], &ProfileOptions::default(), &context).unwrap();
    assert!(out.join("profiles/pointnet").is_dir());
    let again = XyzOptions { overwrite: true, ..XyzOptions::default() };
    assert!(s3d_dataset::xyz(&out, &again, &context).unwrap() > 1);
}

#[test]
fn options_out_of_range_are_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let wrong = [
        ExportOptions { pano_width: 33, ..options(0) },
        ExportOptions { size: 1, ..options(0) },
        ExportOptions { entropy_stride: 0, ..options(0) },
        ExportOptions { points_per_m2: f64::NAN, ..options(0) },
        ExportOptions { only: vec!["a camera".into()], ..options(0) },
    ];
    for options in wrong {
        let refused = Export::new([memory_scene()])
            .options(options)
            .run(&out, &Context::default());
        assert!(matches!(refused, Err(Error::Usage(_))), "{refused:?}");
    }
    assert!(!out.exists());
}

/// Runs an example of this crate. Builds it if no call of cargo has done so yet.
fn example(name: &str, args: &[&Path]) -> String {
    let mut folder = std::env::current_exe().unwrap();
    folder.pop();
    folder.pop();
    let program = folder
        .join("examples")
        .join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    if !program.exists() {
        let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
        let target = folder.parent().unwrap();
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--manifest-path", manifest, "--example", name, "--target-dir"])
            .arg(target)
            .status();
        assert!(built.unwrap().success());
    }
    let run = Command::new(program).args(args).output().unwrap();
    assert!(run.status.success(), "{name}: {}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).unwrap()
}

#[test]
fn the_examples_do_what_they_say() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("memory");
    assert!(example("in_memory", &[&out]).contains("1 panorama"));
    assert!(example("verify", &[&out]).ends_with(" 0 faults\n"));
    // The new data set is a published area, which can be exported as a scene file is.
    let again = dir.path().join("again");
    assert!(example("export", &[&out.join("area_1"), &again]).contains(" files, "));
    assert!(example("export", &[&out.join("area_1"), &again]).contains("complete already"));
}
