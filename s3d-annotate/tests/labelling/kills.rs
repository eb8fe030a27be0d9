//! A kill at any moment loses at most the event in hand.

use super::{act, faces, fast_folder, labels, paint, strip};
use proptest::prelude::*;
use s3d_annotate::labelling::{Action, LabelFolder, State};
use s3d_io::cloud::EVENTS_FILE;
use s3d_label::Taxonomy;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

const SQUARES: u32 = 20;

/// Where the killed process works.
const FOLDER: &str = "S3D_TEST_LABEL_FOLDER";

fn open(path: &Path) -> LabelFolder {
    LabelFolder::open(path, &strip(SQUARES, 1, 0.0), &Taxonomy::s3dis()).unwrap()
}

/// What is done from a state: always the same.
fn next_action(state: &State) -> Action {
    let revision = state.revision();
    match (revision % 5, state.next_undo(), state.next_redo()) {
        (3, Some(of), _) => Action::Undo { of },
        (4, _, Some(of)) => Action::Redo { of },
        (2, ..) => Action::Erase { faces: (0..2 * SQUARES).collect() },
        _ => {
            let first = (revision * 7 % u64::from(SQUARES)) as u32;
            paint(&[first, first + 2, first + 9], state.next_instance(), "chair")
        }
    }
}

/// The state at a revision.
fn state_at(revision: u64) -> State {
    let mut state = State::of_mesh(&strip(SQUARES, 1, 0.0));
    for _ in 0..revision {
        let action = next_action(&state);
        act(&mut state, action).unwrap();
    }
    state
}

#[test]
fn every_beginning_of_a_log_opens() {
    let dir = fast_folder();
    let mut folder = open(dir.path());
    for revision in 0..8 {
        let action = next_action(folder.state());
        folder.add(revision, action, None).unwrap();
    }
    drop(folder);
    let log = dir.path().join(EVENTS_FILE);
    let whole = fs::read(&log).unwrap();

    for bytes in 0..=whole.len() {
        fs::write(&log, &whole[..bytes]).unwrap();
        let lines = whole[..bytes].iter().filter(|byte| **byte == b'\n').count() as u64;
        let revision = lines.saturating_sub(1);
        let mut folder = open(dir.path());
        assert_eq!(labels(folder.state()), labels(&state_at(revision)), "{bytes} bytes");
        let is_cut = lines > 0 && whole[bytes - 1] != b'\n';
        assert_eq!(folder.warnings().len(), usize::from(is_cut), "{bytes} bytes");

        // Work goes on, and what was cut is gone.
        let action = next_action(folder.state());
        folder.add(revision, action, None).unwrap();
        drop(folder);
        assert_eq!(labels(open(dir.path()).state()), labels(&state_at(revision + 1)), "{bytes} bytes");
    }
}

proptest! {
    #[test]
    fn garbage_in_a_log_never_panics(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        insert in prop::option::of((any::<prop::sample::Index>(), prop::collection::vec(any::<u8>(), 1..40))),
    ) {
        let dir = fast_folder();
        let mut folder = open(dir.path());
        for revision in 0..4 {
            let action = next_action(folder.state());
            folder.add(revision, action, None).unwrap();
        }
        drop(folder);
        let log = dir.path().join(EVENTS_FILE);
        let mut bytes = fs::read(&log).unwrap();
        for (place, byte) in flips {
            let at = place.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some((place, more)) = insert {
            let at = place.index(bytes.len());
            bytes.splice(at..at, more);
        }
        fs::write(&log, &bytes).unwrap();
        if let Err(e) = LabelFolder::open(dir.path(), &strip(SQUARES, 1, 0.0), &Taxonomy::s3dis()) {
            prop_assert!(e.to_string().contains("events.jsonl"), "{}", e);
        }
    }
}

/// Not a test by itself: the process that
/// [`a_killed_process_has_lost_nothing_that_it_was_told`] starts and kills.
#[test]
fn child() {
    let Some(path) = std::env::var_os(FOLDER) else { return };
    let mut folder = open(Path::new(&path));
    loop {
        let revision = folder.state().revision();
        let action = next_action(folder.state());
        let now = folder.add(revision, action, None).unwrap();
        let mut out = std::io::stdout().lock();
        // The parent may be gone.
        if writeln!(out, "at {now}").and_then(|()| out.flush()).is_err() {
            return;
        }
    }
}

#[test]
fn a_killed_process_has_lost_nothing_that_it_was_told() {
    let dir = fast_folder();
    let mut total = 0;
    for kill in 0..12u64 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "labelling::kills::child", "--nocapture", "--test-threads=1"])
            .env(FOLDER, dir.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let told = thread::spawn(move || {
            let numbers = lines.map_while(Result::ok);
            // A last line may be cut.
            let numbers = numbers.filter_map(|line| line.strip_prefix("at ")?.parse::<u64>().ok());
            numbers.max().unwrap_or(0)
        });
        thread::sleep(Duration::from_millis(40 + kill * 13 % 50));
        child.kill().unwrap();
        child.wait().unwrap();
        let told = told.join().unwrap();

        let folder = open(dir.path());
        let revision = folder.state().revision();
        assert!(revision >= told && revision >= total, "told of {told}, found {revision}");
        assert!(told == 0 || revision <= told + 1, "told of {told}, found {revision}");
        assert_eq!(labels(folder.state()), labels(&state_at(revision)));
        total = revision;
    }
    assert!(total > 20, "the child hardly worked: {total} events");
    // Faces of the whole mesh are one short run.
    assert_eq!(serde_json::to_string(&faces(&(0..2 * SQUARES).collect::<Vec<_>>())).unwrap(), "[0,40]");
}
