//! Reads files with which other projects test their readers, valid and broken. Each loads or is refused as
//! `hard_inputs.txt` says, in a short time and without a panic.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use s3d_io::mesh::{MeshFile, MeshFormat, UpAxis, read_mesh};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

const EXPECTED: &str = include_str!("hard_inputs.txt");
const PATIENCE: Duration = Duration::from_secs(20);

fn folder() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/hard-inputs");
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

/// Returns the outcome of a file in the words of the list, with its warnings or its error.
fn outcome(path: &Path) -> (String, Vec<String>) {
    let (sender, receiver) = mpsc::channel();
    let file = path.to_owned();
    // A thread that panics drops its sender; a thread that hangs keeps it.
    thread::spawn(move || {
        // The receiver is gone if the thread took too long.
        let _ = sender.send(read_mesh(&file, UpAxis::Y).map_err(|e| e.to_string()));
    });
    let shown = path.display().to_string();
    match receiver.recv_timeout(PATIENCE) {
        Ok(Ok(MeshFile { mesh, warnings, .. })) => {
            let faces = mesh.faces().len() + mesh.report().zero_area_faces;
            (format!("faces {faces} textures {}", mesh.textures().len()), warnings)
        }
        Ok(Err(message)) => match message.strip_prefix(&shown) {
            Some(rest) => ("refused".into(), vec![rest.to_owned()]),
            None => ("refused without its name".into(), vec![message]),
        },
        Err(mpsc::RecvTimeoutError::Timeout) => ("still running".into(), Vec::new()),
        Err(mpsc::RecvTimeoutError::Disconnected) => ("panicked".into(), Vec::new()),
    }
}

fn meshes_below(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        // Scans from the field are whole folders, and are read with the files beside them.
        if path.ends_with("hard-inputs/field") {
            continue;
        }
        if path.is_dir() {
            meshes_below(&path, found);
        } else if MeshFormat::of(&path).is_some() {
            found.push(path);
        }
    }
}

#[test]
fn every_file_has_the_outcome_that_its_content_asks_for() {
    let Some(folder) = folder() else { return };
    let listed: Vec<[&str; 3]> = EXPECTED
        .lines()
        .filter(|l| !l.is_empty() && !l.starts_with('#'))
        .map(|l| {
            l.split(" | ")
                .collect::<Vec<_>>()
                .try_into()
                .expect("path | outcome | words")
        })
        .collect();

    let mut differences = Vec::new();
    for [name, expected, words] in &listed {
        let path = folder.join(name);
        let (found, texts) = outcome(&path);
        // In the list, DIR stands for the folder of the file. Warnings may start with the path of another
        // file there.
        let words = words.replace("DIR", &path.parent().unwrap().display().to_string());
        let fits = match (*expected, words.as_str()) {
            ("refused", words) => texts.iter().any(|t| t.contains(words)),
            (_, "-") => texts.is_empty(),
            (_, words) => texts.iter().any(|t| t.starts_with(words)),
        };
        if found != *expected || !fits {
            differences.push(format!("{name}: {found}, {texts:?}"));
        }
    }

    let mut all = Vec::new();
    meshes_below(&folder, &mut all);
    all.sort();
    for path in all {
        let name = path.strip_prefix(&folder).unwrap().to_str().unwrap();
        if !listed.iter().any(|[listed, ..]| *listed == name) {
            differences.push(format!("{name} is not in the list: {:?}", outcome(&path)));
        }
    }

    assert!(differences.is_empty(), "\n{}", differences.join("\n"));
}

/// Files of other formats whose names have an ending of ours.
#[test]
fn files_of_other_formats_under_our_names_are_refused() {
    let Some(folder) = folder() else { return };
    let dir = tempfile::tempdir().unwrap();
    for name in
        ["assimp/test/models/PLY/cube_binary.ply", "happly/platonic_shelf.ply", "pngsuite/png/basn2c16.png"]
    {
        let ply = name.ends_with("ply");
        for ending in MeshFormat::ALL
            .iter()
            .flat_map(|format| format.endings)
            .filter(|e| !(ply && **e == "ply"))
        {
            let path = dir.path().join(format!("x.{ending}"));
            std::fs::copy(folder.join(name), &path).unwrap();
            let (found, texts) = outcome(&path);
            assert_eq!(found, "refused", "{name} as {ending}: {texts:?}");
        }
    }
}

/// Every readable file is cut off at a hundred places.
#[test]
fn cut_files_load_or_are_refused() {
    let Some(folder) = folder() else { return };
    let dir = tempfile::tempdir().unwrap();
    for name in [
        "assimp/test/models/OBJ/cube_with_vertexcolors.obj",
        "assimp/test/models/OBJ/concave_polygon.obj",
        "assimp/test/models/glTF2/BoxTextured-glTF-Binary/BoxTextured.glb",
        "assimp/test/models/glTF2/BoxTextured-glTF-Embedded/BoxTextured.gltf",
        "assimp/test/models/PLY/cube_binary.ply",
        "assimp/test/models/PLY/cube_uv.ply",
        "happly/platonic_shelf_big_endian.ply",
        "happly/platonic_shelf.ply",
    ] {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        let path = dir.path().join(Path::new(name).file_name().unwrap());
        for length in (0..bytes.len()).step_by(bytes.len() / 100) {
            std::fs::write(&path, &bytes[..length]).unwrap();
            let (found, texts) = outcome(&path);
            assert!(
                found.starts_with("faces") || found == "refused",
                "{name} cut at {length}: {found} {texts:?}"
            );
            // JSON, chunks and headers tell their length; OBJ does not. The last words of an ASCII file may
            // lose digits and stay numbers, but no file is cut there.
            assert!(name.ends_with(".obj") || found == "refused", "{name} cut at {length}: {found}");
        }
    }
}
