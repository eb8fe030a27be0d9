//! The memory of an export does not grow with the points of an instance. The example `large_scene` and
//! `s3d-cli/tests/reliability/curves.py` measure the same on clouds of hundreds of millions of points.
#![allow(clippy::print_stderr, reason = "says why it measures nothing")]

use crate::common;
use common::{files, text, write_scan};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// Runs `s3d` and returns its largest observed memory in bytes; `None` if the system does not tell it.
fn peak_of(args: &[&str]) -> Option<u64> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_s3d"))
        .args(args)
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts");
    let mut peak = None;
    loop {
        // The peak so far, which only rises: the last reading misses the last milliseconds alone.
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        if let Some(line) = status.lines().find_map(|l| l.strip_prefix("VmHWM:")) {
            let kb: u64 = line
                .trim()
                .trim_end_matches(" kB")
                .parse()
                .expect("a number of kilobytes");
            peak = peak.max(Some(1024 * kb));
        }
        if let Some(status) = child.try_wait().expect("the process can be waited for") {
            assert!(status.success(), "s3d {args:?} failed");
            return peak;
        }
        sleep(Duration::from_millis(2));
    }
}

/// The room of `write_scan`; its floor has this many points.
fn scan(dir: &Path, points: u32) -> std::path::PathBuf {
    let scene = write_scan(dir, 1);
    let path = dir.join("Area_1/office_1/Annotations/floor_1.txt");
    let mut file = BufWriter::new(File::create(path).unwrap());
    for i in 0..points {
        let (x, y) = (f64::from(i % 1999) * 0.002, f64::from(i / 1999 % 1499) * 0.002);
        writeln!(file, "{x:.3} {y:.3} 0 {} 2 3", i % 256).unwrap();
    }
    file.into_inner().unwrap().flush().unwrap();
    scene
}

#[test]
fn memory_does_not_grow_with_the_points_of_an_instance() {
    let dir = tempfile::tempdir().unwrap();
    let mut peaks = Vec::new();
    // Both counts exceed a block of points.
    for points in [800_000, 2_400_000] {
        let scan_dir = dir.path().join("scan");
        let scene = scan(&scan_dir, points);
        let out = dir.path().join("out");
        peaks.push(peak_of(&[
            "export",
            text(&scene),
            "-o",
            text(&out),
            "--views=0",
            "--modalities=pose",
            "--points-per-m2=1",
            "--threads=2",
        ]));
        let written = files(&out.join("area_1/3d"));
        let json = written
            .iter()
            .find(|(path, _)| path.ends_with("instances.json"))
            .expect("the instances")
            .1;
        assert!(String::from_utf8_lossy(json).contains(&format!("\"points\":{points}")));
        fs::remove_dir_all(&out).unwrap();
        fs::remove_dir_all(&scan_dir).unwrap();
    }
    let [Some(few), Some(many)] = peaks[..] else {
        eprintln!("not measured: the system tells no peak memory");
        return;
    };
    // Held in memory as a whole, 1.6 million points more would take 64 MB more, at 40 bytes each.
    let more = many.saturating_sub(few) >> 20;
    assert!(more < 24, "{more} MiB more, {} MiB in all, for 1.6 million points more", many >> 20);
}
