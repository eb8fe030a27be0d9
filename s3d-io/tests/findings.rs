//! Feeds the findings of fuzzing to the readers again. Each file in `fixtures/fuzz/TARGET` once ended the
//! program, kept it busy, or made it take memory without bound. See `../fuzz/README.md`.

use crate::feed;

use feed::FEEDS;
use s3d_io::mesh::MeshFormat;
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

/// The reader that reads files of this name is fed by the fuzz target of this name.
#[test]
fn every_feed_is_a_fuzz_target_and_every_mesh_format_has_one() {
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    let text = |name: &str| fs::read_to_string(fuzz.join(name)).unwrap();
    let manifest = text("Cargo.toml");
    let readme = text("README.md");
    for (name, _) in FEEDS {
        assert!(text(&format!("fuzz_targets/{name}.rs")).contains(&format!("{name:?}")), "{name}");
        assert!(manifest.contains(&format!("name = {name:?}\npath = \"fuzz_targets/{name}.rs\"")), "{name}");
        assert!(readme.contains(&format!("`{name}`")), "the table of README.md has no {name}");
    }
    for format in MeshFormat::ALL {
        let names = [format.feature.to_owned(), format!("{}_mesh", format.feature)];
        let feed = FEEDS.iter().find(|(name, _)| names.contains(&(*name).to_owned()));
        let (feed, _) = feed.unwrap_or_else(|| panic!("nothing feeds {}", format.name));
        assert!(fuzz.join("seeds").join(feed).is_dir(), "{feed} starts from no seed");
    }
}
