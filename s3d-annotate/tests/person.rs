//! How many strokes a simulated person needs.

use super::person_oracle::{Session, label};
use super::person_scenes::{Known, copy_room, demo, house, office};

fn session(scene: &Known) -> Session {
    let memory = std::path::Path::new("/dev/shm");
    let folder = if memory.is_dir() {
        tempfile::tempdir_in(memory)
    } else {
        tempfile::tempdir()
    }
    .unwrap();
    let t = std::time::Instant::now();
    let s = label(scene, &folder.path().join("scan.labels"), 0.99, 400);
    println!(
        "{}: {} faces, {} things, 90/95/99: {:?} {:?} {:?}, end {:.3} after {}, purity {:.3} -> {:.3} {:?} accept {:.3} in {:?}",
        scene.name,
        scene.mesh.faces().len(),
        s.things,
        s.strokes_to(0.9),
        s.strokes_to(0.95),
        s.strokes_to(0.99),
        s.right.last().unwrap(),
        s.right.len() - 1,
        s.purity_before,
        s.purity_after,
        s.kinds,
        s.right[s.kinds["accept"]],
        t.elapsed()
    );
    s
}

#[test]
fn explore_office() {
    let office = office();
    session(&office);
    session(&office.scanned(0.04, 0.004));
}

#[test]
fn explore_others() {
    session(&demo());
    session(&house());
    if let Some(room) = copy_room() {
        session(&room);
    }
}
