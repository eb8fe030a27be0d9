//! An input that changes while it is read ends an export.

use crate::common::{memory_scene, options};

use s3d_dataset::{Context, Event, Export};
use s3d_synth::{Building, ScanOptions};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Exports a scan, and appends a line to `victim` as soon as a task of this name begins. Returns the message.
fn change_during(task: &'static str, scene: &Path, victim: PathBuf, out: &Path) -> String {
    let context = Context::default().observed_by(move |event: &Event<'_>| {
        if let Event::TaskStarted { task: begun } = event
            && begun.what == task
        {
            let mut file = fs::File::options().append(true).open(&victim).unwrap();
            file.write_all(b"\n").unwrap();
        }
    });
    let export = Export::new([scene]).options(options(3));
    export.run(out, &context).unwrap_err().to_string()
}

#[test]
fn a_changed_input_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let scan = ScanOptions { points_per_m2: 20.0, ..ScanOptions::default() };
    let folder = dir.path().join("scan");
    let building = Building::demo().build().unwrap();
    let scene = building.write_scan(&folder, &scan, || true).unwrap();
    let walk = |name: &str| -> PathBuf {
        let mut folders = vec![folder.clone()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.file_name().unwrap().to_str().unwrap().starts_with(name) {
                    return path;
                }
            }
        }
        panic!("no {name}");
    };

    for (number, (task, file)) in [("reading", "chair_1"), ("labelling", "chair_1"), ("labelling", "cameras")]
        .into_iter()
        .enumerate()
    {
        let out = dir.path().join(format!("out {number}"));
        let message = change_during(task, &scene, walk(file), &out);
        assert!(message.contains(file) && message.contains("changed while it was read"), "{task}: {message}");
        let manifest = fs::read_to_string(out.join("manifest.json")).unwrap_or_default();
        assert!(!manifest.contains("complete"), "{manifest}");
    }

    let again = Export::new([&scene]).options(options(3));
    assert!(
        again
            .run(dir.path().join("calm"), &Context::default())
            .unwrap()
            .is_some()
    );
}

#[test]
fn half_written_files_of_a_killed_plan_are_removed() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("plan");
    let plan = |shard: Option<&str>| {
        let shard = shard.map(|word| word.parse().unwrap());
        s3d_dataset::plan(&[memory_scene()], &folder, &options(3), shard, &Context::default()).unwrap();
    };
    plan(None);
    let parts = [folder.join(".s3d-Ab12Cd.part"), folder.join("area_2/.s3d-Ef34Gh.part")];
    parts.iter().for_each(|part| fs::write(part, "half").unwrap());
    // Another shard may be writing them.
    plan(Some("1/2"));
    assert!(parts.iter().all(|part| part.exists()));
    plan(None);
    assert!(!parts.iter().any(|part| part.exists()));
}
