//! Feeds the findings of fuzzing to the readers again. Each file in `fixtures/fuzz/TARGET` once ended the
//! program, kept it busy, or made it take memory without bound. See `../fuzz/README.md`.

use crate::feed;

use feed::FEEDS;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

#[test]
fn every_finding_is_read_or_refused() {
    let findings = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/fuzz");
    let mut fed = 0;
    for (name, feed) in FEEDS {
        let Ok(entries) = fs::read_dir(findings.join(name)) else { continue };
        for entry in entries {
            let path = entry.unwrap().path();
            let dir = tempfile::tempdir().unwrap();
            let started = Instant::now();
            feed(dir.path(), &fs::read(&path).unwrap());
            let time = started.elapsed();
            // They take milliseconds; the slowest once took minutes.
            assert!(time < Duration::from_secs(20), "{}: {time:?}", path.display());
            fed += 1;
        }
    }
    assert!(fed > 0, "{} holds no finding", findings.display());
}

/// Files that are cut off anywhere, and files with a byte changed: a small and quick part of what the fuzz
/// targets do, without a nightly compiler.
#[test]
fn cut_and_changed_fixtures_are_read_or_refused() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let dir = tempfile::tempdir().unwrap();
    let mut fed = 0;
    for (name, feed) in FEEDS {
        let Ok(entries) = fs::read_dir(seeds.join(name)) else { continue };
        for entry in entries {
            let whole = fs::read(entry.unwrap().path()).unwrap();
            let step = (whole.len() / 12).max(1);
            for at in (0..whole.len()).step_by(step) {
                feed(dir.path(), &whole[..at]);
                let mut changed = whole.clone();
                changed[at] ^= 0xff;
                feed(dir.path(), &changed);
                fed += 2;
            }
        }
    }
    assert!(fed > 0, "{} holds no seed", seeds.display());
}
