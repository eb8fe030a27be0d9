//! Folders of labels: locks, revisions, other meshes, damage.

use super::{faces, fast_folder, paint, strip};
use s3d_annotate::labelling::{Action, Error, Event, FaceRuns, LabelFolder, ROOMS_FILE, Room, RoomPart};
use s3d_io::cloud::{EVENTS_FILE, LABELS_FILE, SavedLabels, mesh_checksum};
use s3d_label::Taxonomy;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

fn open(path: &Path) -> Result<LabelFolder, Error> {
    LabelFolder::open(path, &strip(6, 1, 0.0), &Taxonomy::s3dis())
}

#[test]
fn one_process_at_a_time_and_only_from_the_last_revision() {
    let dir = fast_folder();
    let path = dir.path().join("scan.labels");
    let mut labels = open(&path).unwrap();
    assert!(matches!(open(&path), Err(Error::InUse { .. })));
    assert_eq!(labels.add(0, paint(&[0], 1, "chair"), Some(17)).unwrap(), 1);
    // The other window has not seen the chair.
    let stale = labels.add(0, paint(&[0], 2, "table"), None).unwrap_err();
    assert!(matches!(stale, Error::Stale { given: 0, now: 1 }), "{stale}");
    assert!(matches!(labels.redo(1, None), Err(Error::Fault(_))));
    assert!(matches!(labels.undo(0, None), Err(Error::Stale { given: 0, now: 1 })));

    drop(labels);
    let labels = open(&path).unwrap();
    assert_eq!((labels.state().revision(), labels.state().instance_of_face()[0]), (1, 1));
    let text = fs::read_to_string(labels.log()).unwrap();
    assert!(text.ends_with(
        "\"at_ms\":17,\"do\":{\"paint\":{\"faces\":[0,1],\"instance\":1,\"class\":\"chair\"}}}\n"
    ));
}

#[test]
fn words_of_no_taxonomy_are_refused_and_old_ones_are_kept() {
    let dir = fast_folder();
    let mut labels = open(dir.path()).unwrap();
    assert!(matches!(labels.add(0, paint(&[0], 1, "stairs"), None), Err(Error::Class(_))));
    let kitchen = Room { kind: Some("kitchen".into()), ..Room::default() };
    assert!(matches!(labels.add(0, Action::Room { room: 1, is: kitchen }, None), Err(Error::RoomType(_))));
    labels.add(0, paint(&[0], 1, "board"), None).unwrap();
    drop(labels);

    // Another taxonomy has no board. The one that is there stays.
    let other = Taxonomy::built_in("scannet20").unwrap();
    let mut labels = LabelFolder::open(dir.path(), &strip(6, 1, 0.0), &other).unwrap();
    labels.add(1, paint(&[1], 2, "bed"), None).unwrap();
    assert_eq!((labels.undo(2, None).unwrap(), labels.state().instances().len()), (3, 1));
    assert_eq!((labels.redo(3, None).unwrap(), labels.state().instances()[&2].as_str()), (4, "bed"));
    labels.write_labels(&strip(6, 1, 0.0)).unwrap();
    let saved = SavedLabels::read(dir.path()).unwrap();
    let words: Vec<&str> = saved.class[..2]
        .iter()
        .map(|class| saved.classes[*class as usize].as_str())
        .collect();
    assert_eq!(words, ["board", "bed"]);
}

#[test]
fn other_meshes_and_other_folders_are_refused() {
    let dir = fast_folder();
    open(dir.path()).unwrap();
    let taxonomy = Taxonomy::s3dis();
    for (mesh, labelled, faces) in [(strip(7, 1, 0.0), 12, 14), (strip(6, 1, 0.5), 12, 12)] {
        let refused = LabelFolder::open(dir.path(), &mesh, &taxonomy).unwrap_err();
        assert!(
            matches!(refused, Error::OtherMesh { labelled: a, faces: b, .. } if (a, b) == (labelled, faces)),
            "{refused}"
        );
        assert!(refused.to_string().contains("carry them over"));
    }
    let labels = open(dir.path()).unwrap();
    assert!(matches!(labels.write_labels(&strip(6, 1, 0.5)), Err(Error::OtherMesh { .. })));

    let other = fast_folder();
    fs::write(other.path().join("thesis.txt"), "chapter 1").unwrap();
    assert!(matches!(open(other.path()), Err(Error::NoLabels { .. })));
    fs::write(other.path().join(EVENTS_FILE), "a line of another program").unwrap();
    let refused = open(other.path()).unwrap_err().to_string();
    assert!(refused.contains("line 1") && refused.contains("no log of labels"), "{refused}");
}

#[test]
fn damage_before_the_last_line_names_the_line() {
    let dir = fast_folder();
    let mut labels = open(dir.path()).unwrap();
    for i in 0..4 {
        labels.add(u64::from(i), paint(&[i], i + 1, "chair"), None).unwrap();
    }
    drop(labels);
    let log = dir.path().join(EVENTS_FILE);
    let whole = fs::read_to_string(&log).unwrap();

    for (from, to, words) in [
        ("\"n\":2", "\"n\":?", "line 3: is damaged"),
        ("\"n\":2", "\"n\":3", "line 3: does not fit: event 3 does not follow event 1"),
        ("[1,1]", "[99,1]", "line 3: does not fit: there is no face 99"),
        ("\"v\":1,\"n\":2", "\"v\":2,\"n\":2", "line 3: does not fit: its version is 2"),
        ("{\"v\":1,\"mesh", "{\"v\":7,\"mesh", "line 1: its version is 7"),
    ] {
        fs::write(&log, whole.replacen(from, to, 1)).unwrap();
        let message = open(dir.path()).unwrap_err().to_string();
        assert!(message.contains("events.jsonl") && message.contains(words), "{message}");
        // Nothing is repaired by force.
        assert_eq!(fs::read_to_string(&log).unwrap(), whole.replacen(from, to, 1));
    }
}

#[test]
fn labels_and_rooms_are_written_and_nothing_but_the_log_counts() {
    let dir = fast_folder();
    let mesh = strip(6, 1, 0.0);
    let mut labels = open(dir.path()).unwrap();
    let outline = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]];
    let parts = vec![RoomPart { outline, heights: [0.0, 2.5] }];
    let office = Room { kind: Some("office".into()), name: Some("of Ada".into()), parts };
    for (revision, action) in (0..).zip([
        paint(&[0, 1], 1, "chair"),
        paint(&[2], 2, "chair"),
        paint(&[4, 5, 6, 7], 3, "floor"),
        Action::Room { room: 1, is: office },
        Action::Erase { faces: faces(&[0, 1]) },
    ]) {
        labels.add(revision, action, None).unwrap();
    }
    labels.write_labels(&mesh).unwrap();
    let saved = SavedLabels::read(dir.path()).unwrap();
    assert_eq!((saved.mesh, saved.revision), (mesh_checksum(&mesh), 5));
    assert_eq!(saved.class, [-1, -1, 8, -1, 1, 1, 1, 1, -1, -1, -1, -1]);
    assert_eq!(saved.instance, [-1, -1, 2, -1, 3, 3, 3, 3, -1, -1, -1, -1]);
    // The face behind the outline is within the rim of no room: its middle is 33 cm away.
    assert_eq!(saved.room, [1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1, -1]);
    assert_eq!(saved.instances, [(2, "chair_1".to_owned()), (3, "floor_1".to_owned())]);
    assert_eq!(saved.rooms, [(1, "office_1".to_owned())]);
    let rooms: serde_json::Value =
        serde_json::from_slice(&fs::read(dir.path().join(ROOMS_FILE)).unwrap()).unwrap();
    let room = &rooms["rooms"][0];
    assert_eq!(
        (&room["label"], &room["name"], &room["area_m2"]),
        (&"office_1".into(), &"of Ada".into(), &3.0.into())
    );

    drop(labels);
    for name in [LABELS_FILE, ROOMS_FILE] {
        fs::remove_file(dir.path().join(name)).unwrap();
    }
    let labels = open(dir.path()).unwrap();
    labels.write_labels(&mesh).unwrap();
    assert_eq!(SavedLabels::read(dir.path()).unwrap(), saved);
}

/// 100,000 strokes of 200 faces in 10 runs, on a mesh of 100,000 faces.
#[test]
fn a_long_log_opens_soon() {
    let dir = fast_folder();
    let mesh = strip(50_000, 1, 0.0);
    drop(LabelFolder::open(dir.path(), &mesh, &Taxonomy::s3dis()).unwrap());
    let log = dir.path().join(EVENTS_FILE);
    let mut text = fs::read_to_string(&log).unwrap();
    let mut instances = 0;
    for number in 1..=100_000u64 {
        let start = (number * 7919 % 99_000) as u32;
        let runs = (0..10).flat_map(|run| (start + 80 * run..start + 80 * run + 20).collect::<Vec<_>>());
        let faces: FaceRuns = runs.collect();
        let action = match number % 10 {
            0 if instances > 2 => Action::Join { into: instances, instances: vec![instances - 1] },
            1..=4 => {
                instances += 1;
                Action::Paint { faces, instance: instances, class: Some("chair".into()) }
            }
            _ => Action::Paint { faces, instance: instances, class: None },
        };
        let event = Event { version: 1, number, at_ms: None, action };
        writeln!(text, "{}", serde_json::to_string(&event).unwrap()).unwrap();
    }
    fs::write(&log, &text).unwrap();

    let started = Instant::now();
    let labels = LabelFolder::open(dir.path(), &mesh, &Taxonomy::s3dis()).unwrap();
    let took = started.elapsed();
    assert_eq!(labels.state().revision(), 100_000);
    let shown = format!("{} MB of 100,000 strokes opened in {took:?}\n", text.len() / 1_000_000);
    std::io::Write::write_all(&mut std::io::stderr(), shown.as_bytes()).unwrap();
    assert!(took < Duration::from_secs(60), "{took:?}");
}
