//! What a program that watches an export can rely on: events and exit codes, the effect of a signal at every
//! stage, and the counts of the summary.
#![cfg(unix)]

use crate::common;
use common::{UUID_A, files, s3d, s3d_ok, text, write_scan};
use s3d_io::dataset::{Domain, Frame, Layout};
use s3d_io::image::read_gray16;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write as _};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const SMALL: [&str; 8] = ["--size", "64", "--pano-width", "128", "--views", "12", "--points-per-m2", "300"];

/// The longest time from a signal to the end, where the work is cut into small pieces: one file of this size,
/// on a busy machine.
const SOON: Duration = Duration::from_secs(4);

/// The longest time within one long call: 5 seconds, and time to notice the signal.
const AT_LAST: Duration = Duration::from_secs(9);

/// The events of a JSON log; every line must be one.
fn events(log: &str) -> Vec<Value> {
    let events = log.lines().map(|line| match serde_json::from_str::<Value>(line) {
        Ok(event) => event,
        Err(e) => panic!("{e} in the line {line}"),
    });
    events.collect()
}

fn kind(event: &Value) -> &str {
    event["event"].as_str().expect("every line has an event")
}

fn of_kind<'a>(events: &'a [Value], name: &str) -> Vec<&'a Value> {
    events.iter().filter(|e| kind(e) == name).collect()
}

fn number(event: &Value, key: &str) -> u64 {
    event[key].as_u64().unwrap_or_else(|| panic!("{key} in {event}"))
}

/// A running `s3d --log json`, whose log is read line by line.
struct Run {
    child: Child,
    log: BufReader<std::process::ChildStderr>,
    seen: String,
}

impl Run {
    fn start(args: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_s3d"))
            .args(["--log", "json"])
            .args(args)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary starts");
        let log = BufReader::new(child.stderr.take().unwrap());
        Self { child, log, seen: String::new() }
    }

    /// Reads on to the first line that `is_it` accepts.
    fn wait_for(&mut self, what: &str, is_it: impl Fn(&Value) -> bool) {
        loop {
            let from = self.seen.len();
            assert!(self.log.read_line(&mut self.seen).unwrap() > 0, "no {what} in {}", self.seen);
            if is_it(&events(&self.seen[from..])[0]) {
                return;
            }
        }
    }

    fn wait_for_stage(&mut self, stage: &str) {
        self.wait_for(stage, |e| kind(e) == "stage_finished" && e["stage"] == stage);
    }

    fn signal(&self, name: &str) {
        let kill = Command::new("kill")
            .args(["-s", name, &self.child.id().to_string()])
            .status()
            .unwrap();
        assert!(kill.success(), "{}", self.seen);
    }

    /// Waits for the end. Returns the time that took, the exit status, and the whole log. Standard output
    /// must be empty.
    fn end(mut self) -> (Duration, ExitStatus, String) {
        let started = Instant::now();
        self.log.read_to_string(&mut self.seen).unwrap();
        let status = self.child.wait().unwrap();
        let took = started.elapsed();
        let mut answer = String::new();
        self.child.stdout.take().unwrap().read_to_string(&mut answer).unwrap();
        assert_eq!(answer, "", "standard output");
        (took, status, self.seen)
    }
}

/// The command that the last error recommends.
fn command_told(log: &str) -> String {
    let all = events(log);
    let told = all
        .iter()
        .rev()
        .find(|e| e["level"] == "error")
        .unwrap_or_else(|| panic!("no error in {log}"));
    let message = told["message"].as_str().unwrap();
    message
        .split_once("; go on with: ")
        .unwrap_or_else(|| panic!("no command in {message}"))
        .1
        .to_owned()
}

/// Runs a command line in a shell, as a person does who copies it.
fn shell(line: &str) -> String {
    let out = Command::new("sh").args(["-c", line]).output().unwrap();
    let log = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success(), "{line}: {log}");
    log
}

fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    assert!(a.keys().eq(b.keys()), "{:?} and {:?}", a.keys(), b.keys());
    for (path, bytes) in &a {
        assert!(bytes == &b[path], "{} differs", path.display());
    }
}

/// Asserts that a stopped run ends soon with exit code 75, that every line of its log is an event and the
/// last one is the end, and that the recommended command makes the same files as an undisturbed run.
fn assert_stopped(run: Run, signal: &str, within: Duration) -> String {
    run.signal(signal);
    let (took, status, log) = run.end();
    assert_eq!(status.code(), Some(75), "{log}");
    assert!(took < within, "{signal}: it took {took:?} to stop: {log}");
    let all = events(&log);
    assert!(log.contains(&format!("stopped by SIG{signal}")), "{log}");
    let last = all.last().unwrap();
    assert_eq!((kind(last), &last["exit_code"]), ("finished", &Value::from(75)), "{log}");
    assert!(of_kind(&all, "summary").is_empty(), "{log}");
    command_told(&log)
}

#[test]
fn a_signal_stops_each_stage_soon_and_the_command_told_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    // A shell needs quotes for this name.
    let scene = write_scan(&dir.path().join("it's a scan"), 1);
    // Each case: a long stage, the options that make it long, and the stage before it. The signal is sent
    // between the two.
    let cases: [(&str, &[&str], &str); 4] = [
        ("score", &["--views", "4000", "--entropy-stride", "1", "--size", "128", "--only", UUID_A], "label"),
        ("render", &["--views", "60", "--size", "512", "--pano-width", "256", "--keep-all"], "score"),
        ("points", &["--views", "0", "--modalities", "pose", "--points-per-m2", "60000"], "meshes"),
        ("profile", &["--views", "0", "--modalities", "pose", "--points-per-m2", "10000"], "points"),
    ];
    for ((name, options, before), signal) in cases.into_iter().zip(["INT", "TERM", "INT", "TERM"]) {
        let out = dir.path().join(name);
        let mut args = vec!["export", text(&scene), "-o", text(&out)];
        args.extend(options);
        if name == "profile" {
            args.extend(["--profile", "pointnet,mmdet3d,open3d-ml,pointcept"]);
        }
        let mut run = Run::start(&args);
        run.wait_for_stage(before);
        let line = assert_stopped(run, signal, SOON);
        if name == "points" {
            shell(&line);
            let undisturbed = dir.path().join("undisturbed");
            args[3] = text(&undisturbed);
            s3d_ok(&args);
            assert_same(&out, &undisturbed);
        }
    }
}

/// Starts an export that spends minutes in one call, reading its mesh: to cut faces with many unordered
/// corners into triangles takes long.
fn start_endless(dir: &Path) -> Run {
    let (scene, out) = (write_scan(dir, 1), dir.join("out"));
    let mut obj = fs::OpenOptions::new().append(true).open(dir.join("room.obj")).unwrap();
    let (corners, mut random) = (16_000, 1u64);
    let mut text_of_faces = String::new();
    for _ in 0..corners {
        let mut next = || {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (random >> 40) as f64 / 1e6
        };
        let _ = writeln!(text_of_faces, "v {} 0 {}", next(), next());
    }
    for face in 0..100 {
        text_of_faces.push('f');
        (0..corners).for_each(|i| {
            let _ = write!(text_of_faces, " {}", 1 + (i * 7_919 + face) % corners - corners - 1);
        });
        text_of_faces.push('\n');
    }
    obj.write_all(text_of_faces.as_bytes()).unwrap();
    let mut run = Run::start(&["export", text(&scene), "-o", text(&out)]);
    run.wait_for("start", |e| kind(e) == "started");
    // All earlier work is done by then.
    sleep(Duration::from_secs(1));
    run
}

#[test]
fn a_signal_is_followed_inside_a_call_that_does_not_end() {
    let dir = tempfile::tempdir().unwrap();
    assert_stopped(start_endless(dir.path()), "TERM", AT_LAST);
}

#[test]
fn a_second_signal_kills() {
    let dir = tempfile::tempdir().unwrap();
    for (first, second, number) in [("INT", "INT", 2), ("INT", "TERM", 15), ("TERM", "TERM", 15)] {
        let mut run = start_endless(dir.path());
        run.signal(first);
        run.wait_for("acknowledgement", |e| {
            e["message"]
                .as_str()
                .is_some_and(|m| m.contains("a second signal stops at once"))
        });
        run.signal(second);
        let (took, status, log) = run.end();
        assert_eq!((status.code(), status.signal()), (None, Some(number)), "{log}");
        assert!(took < Duration::from_secs(2), "{took:?}");
    }
}

/// Labelling stops between two of many files, and between chunks of a file of millions of points.
#[test]
fn a_signal_stops_the_votes() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(dir.path(), 1);
    let mut lines = String::new();
    for i in 0..1_000_000u32 {
        let (x, y) = (f64::from(i % 1000) * 0.004, f64::from(i / 1000) * 0.003);
        let _ = writeln!(lines, "{x:.3} {y:.3} 0.002 90 90 90");
    }
    let annotations = dir.path().join("Area_1/office_1/Annotations");
    fs::write(annotations.join("floor_1.txt"), &lines).unwrap();
    lines.truncate(lines.len() / 10);
    lines.truncate(lines.rfind('\n').unwrap() + 1);
    for i in 1..=40 {
        fs::write(annotations.join(format!("clutter_{i}.txt")), &lines).unwrap();
    }
    let out = dir.path().join("out");
    let mut run = Run::start(&["export", text(&scene), "-o", text(&out)]);
    run.wait_for_stage("load");
    assert_stopped(run, "INT", SOON);
}

#[test]
fn other_commands_stop_too() {
    let dir = tempfile::tempdir().unwrap();
    let _scene = write_scan(dir.path(), 1);
    let (mesh, cloud) = (dir.path().join("room.obj"), dir.path().join("cloud.ply"));
    let mut run = Run::start(&["sample", text(&mesh), "-o", text(&cloud), "--points", "100000000"]);
    run.wait_for("progress", |e| kind(e) == "progress");
    assert_stopped(run, "TERM", SOON);
    assert!(!cloud.exists());

    let demo = dir.path().join("demo");
    let options = ["--views", "2", "--size", "16", "--pano-width", "32", "--points-per-m2", "20"];
    let args = [&["demo", "-o", text(&demo)][..], &options].concat();
    let mut run = Run::start(&args);
    run.wait_for("start", |e| kind(e) == "started");
    // The scene is made in one piece.
    shell(&assert_stopped(run, "INT", AT_LAST));
    assert!(
        fs::read_to_string(demo.join("manifest.json"))
            .unwrap()
            .contains("\"complete\"")
    );
    let names: Vec<_> = fs::read_dir(&demo).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(names.iter().any(|n| n == "scan"), "{names:?}");
    assert!(!names.iter().any(|n| n.to_string_lossy().starts_with('.')), "{names:?}");
}

/// A room without a ceiling, so that rays leave it.
fn write_open_scan(dir: &Path, area: u32) -> PathBuf {
    let scene = write_scan(dir, area);
    let obj = fs::read_to_string(dir.join("room.obj")).unwrap();
    let mut lines: Vec<&str> = obj.lines().collect();
    let ceiling = lines.iter().position(|l| *l == "usemtl ceiling").unwrap();
    let face = ceiling + lines[ceiling..].iter().position(|l| l.starts_with("f ")).unwrap();
    lines.remove(face);
    fs::write(dir.join("room.obj"), lines.join("\n") + "\n").unwrap();
    fs::remove_file(dir.join(format!("Area_{area}/office_1/Annotations/ceiling_1.txt"))).unwrap();
    scene
}

/// Files, images and missing pixels of a kind of images, read back from the disk. In this scene a pixel that
/// is missing in the depth image sees no face.
fn read_images(layout: &Layout, areas: &[u32], frame: Frame) -> (u64, u64, u64) {
    let (mut images, mut pixels, mut missing) = (0, 0, 0);
    for area in areas {
        for entry in fs::read_dir(layout.image_dir(*area, frame, Domain::Depth)).unwrap() {
            let depth = read_gray16(&entry.unwrap().path()).unwrap();
            images += 1;
            pixels += depth.len() as u64;
            missing += depth.pixels().iter().filter(|v| **v == 65_535).count() as u64;
        }
    }
    (images, pixels, missing)
}

fn counted(tally: &Value) -> (u64, u64, u64) {
    (number(tally, "images"), number(tally, "pixels"), number(tally, "pixels_missing"))
}

#[test]
fn every_line_is_an_event_and_counts_what_is_on_the_disk() {
    let dir = tempfile::tempdir().unwrap();
    let one = write_open_scan(&dir.path().join("one"), 1);
    let five = write_open_scan(&dir.path().join("five"), 5);
    let out = dir.path().join("out");
    let args = ["--log", "json", "-v", "export", text(&one), text(&five), "-o", text(&out)];
    let run = s3d(&[&args[..], &SMALL].concat());
    let log = String::from_utf8(run.stderr).unwrap();
    assert!(run.status.success() && run.stdout.is_empty(), "{log}");
    let all = events(&log);

    let known = ["started", "log", "progress", "unit_finished", "units_taken", "stage_finished", "summary"];
    let mut last = 0.0;
    for (i, event) in all.iter().enumerate() {
        let at = event["at_seconds"].as_f64().unwrap();
        assert!(at >= last || kind(event) == "log" || at > last - 0.1, "{event}");
        last = at;
        let expected = match i {
            0 => kind(event) == "started",
            i if i + 1 == all.len() => kind(event) == "finished",
            _ => known.contains(&kind(event)),
        };
        assert!(expected, "line {i}: {event}");
    }
    assert_eq!(all.last().unwrap()["exit_code"], 0);
    assert!(all.iter().any(|e| e["level"] == "debug") && !log.contains("\u{1b}"), "{log}");

    let stages: Vec<&str> = of_kind(&all, "stage_finished")
        .iter()
        .map(|e| e["stage"].as_str().unwrap())
        .collect();
    for stage in ["load", "label", "score", "render", "meshes", "points", "tables"] {
        assert!(stages.contains(&stage), "{stage} in {stages:?}");
    }
    let progress = of_kind(&all, "progress");
    assert!(
        progress
            .iter()
            .any(|e| e["what"] == "rendering" && e["done"] == e["total"]),
        "{progress:?}"
    );

    // The units of work.
    let layout = Layout::new(out.clone());
    let on_disk = files(&out);
    let units = of_kind(&all, "unit_finished");
    let mut locations = BTreeMap::new();
    for unit in units.iter().filter(|u| u["unit"] == "location") {
        let uuid = unit["location"].as_str().unwrap();
        let of_it = on_disk.iter().filter(|(path, _)| {
            let name = path.file_name().unwrap().to_str().unwrap();
            name.starts_with(&format!("camera_{uuid}_"))
        });
        let (count, bytes) = of_it.fold((0, 0), |(n, b), (_, file)| (n + 1, b + file.len() as u64));
        assert_eq!((number(unit, "files"), number(unit, "bytes")), (count, bytes), "{unit}");
        assert!(count > 7 && locations.insert(uuid, number(unit, "area")).is_none(), "{unit}");
    }
    assert_eq!(locations.into_values().collect::<Vec<_>>().len(), 4);

    for (name, file) in [("labels", "3d/instances.npz"), ("rest", "3d/pointcloud.mat")] {
        let of_kind: Vec<_> = units
            .iter()
            .filter(|u| u["unit"] == name && u.get("location").is_none())
            .collect();
        let areas: Vec<u64> = of_kind.iter().map(|u| number(u, "area")).collect();
        assert_eq!(areas, [1, 5], "{name}");
        let largest = on_disk[&PathBuf::from(format!("area_1/{file}"))].len() as u64;
        assert!(number(of_kind[0], "bytes") > largest && number(of_kind[0], "files") > 3, "{name}");
    }

    // The summary.
    let summary = of_kind(&all, "summary")[0];
    assert_eq!((number(summary, "areas"), number(summary, "locations")), (2, 4));
    assert_eq!(number(summary, "files"), on_disk.len() as u64);
    assert_eq!(number(summary, "bytes"), on_disk.values().map(|f| f.len() as u64).sum::<u64>());
    for (name, frame) in [("panoramas", Frame::Panorama), ("views", Frame::View(0))] {
        let read = read_images(&layout, &[1, 5], frame);
        assert_eq!(counted(&summary[name]), read, "{name}");
        assert!(read.2 > 0 && read.2 < read.1, "{name}: {read:?} has some missing, and not all");
    }
    let views = &summary["candidate_views"];
    let of = |key| number(views, key);
    assert_eq!((of("candidates"), of("dropped_lowest"), of("not_asked")), (48, 7, 0), "0.15 · 48 = 7.2");
    assert_eq!(of("kept"), number(&summary["views"], "images"));
    assert_eq!(of("candidates"), of("kept") + of("dropped_lowest") + of("dropped_not_drawn"));
    let warnings = all.iter().filter(|e| e["level"] == "warning").count();
    assert_eq!(number(summary, "warnings"), warnings as u64);
    let stage_seconds = summary["stage_seconds"].as_object().unwrap();
    assert_eq!(stage_seconds.len(), 7);
    for (stage, seconds) in stage_seconds {
        let told = of_kind(&all, "stage_finished");
        let sum: f64 = told
            .iter()
            .filter(|e| e["stage"] == **stage)
            .map(|e| e["seconds"].as_f64().unwrap())
            .sum();
        assert!((seconds.as_f64().unwrap() - sum).abs() < 0.01, "{stage}: {seconds} and {sum}");
    }
}

#[test]
fn a_person_reads_the_same_summary() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_open_scan(dir.path(), 1);
    let out = dir.path().join("out");
    let args = ["export", text(&scene), "-o", text(&out), "--pool", "location", "--only", UUID_A];
    let run = s3d(&[&args[..], &SMALL].concat());
    let log = String::from_utf8(run.stderr).unwrap();
    assert!(run.status.success() && run.stdout.is_empty(), "{log}");
    let (_, pixels, missing) = read_images(&Layout::new(out.clone()), &[1], Frame::Panorama);
    let share = 100.0 * missing as f64 / pixels as f64;
    // In each pool of 12 views, 1 is dropped and 7 are kept; of the other 4, as many stay as make 8.7 in all,
    // rounded.
    for part in [
        "1 panoramas and 9 views of 2 locations",
        &format!("{} files, ", files(&out).len()),
        &format!("{share:.2} % of the pixels of panoramas"),
        "6 of 24 candidate views dropped: 2 for the lowest entropies of their pool, 4 not drawn from its \
         middle",
        "9 kept views are of locations whose images were not asked for",
        "load ",
    ] {
        assert!(log.contains(part), "{part:?} in {log}");
    }
}

#[test]
fn quiet_json_is_warnings_and_the_end() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(dir.path(), 1);
    let out = dir.path().join("out");
    let log =
        s3d_ok(&[&["--log", "json", "-q", "export", text(&scene), "-o", text(&out)][..], &SMALL].concat());
    for event in events(&log) {
        let told = ["summary", "finished"].contains(&kind(&event)) || event["level"] == "warning";
        assert!(told, "{event}");
    }
    assert!(log.contains("\"event\":\"summary\""), "{log}");
}

#[test]
fn wrong_calls_and_bad_input_have_their_own_codes() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(dir.path(), 1);
    let out = dir.path().join("out");
    // Errors of the argument parser are text, since `--log json` is not known yet.
    let run = s3d(&["--log", "json", "export"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("Usage"));

    fs::create_dir(&out).unwrap();
    fs::write(out.join("mine.txt"), "mine").unwrap();
    let new = dir.path().join("new");
    let (exists, missing) =
        (["export", text(&scene), "-o", text(&out)], ["export", "none.toml", "-o", text(&new)]);
    for (args, code) in [(exists, 2), (missing, 1)] {
        let run = s3d(&[&["--log", "json"][..], &args].concat());
        let log = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(code), "{log}");
        let all = events(&log);
        assert_eq!(all.last().unwrap()["exit_code"], code);
        let errors = all.iter().filter(|e| e["level"] == "error").count();
        assert_eq!(errors, 1, "{log}");
        assert!(run.stdout.is_empty() && !log.contains("go on with"), "{log}");
    }
}

/// A full disk: a file system of a megabyte or two, which then grows.
#[cfg(target_os = "linux")]
#[test]
#[allow(clippy::print_stderr, reason = "a test that is skipped says so")]
fn a_full_disk_is_told_and_the_same_call_goes_on_if_it_was_insisted_on() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(dir.path(), 1);
    let (mount, copy, undisturbed) =
        (dir.path().join("disk"), dir.path().join("copy"), dir.path().join("undisturbed"));
    fs::create_dir(&mount).unwrap();
    let script = r#"
        mount -t tmpfs -o size="$1" none "$2" || exit 99
        "$3" export "$4" -o "$2/out" $5 2> "$6.log"
        [ "$?" = 1 ] && [ ! -e "$2/out" ] && grep -q "allow size" "$6.log" || exit 97
        "$3" --log json export "$4" -o "$2/out" --allow size $5 2> "$6.log"
        echo "$?" > "$6.code"
        mount -o remount,size=256m "$2" || exit 99
        "$3" --log json export "$4" -o "$2/out" $5 2>> "$6.log" || exit 98
        cp -r "$2/out" "$6"
    "#;
    let options = SMALL.join(" ");
    let args = |size: &'static str, copy: &Path| {
        let words = [size, text(&mount), env!("CARGO_BIN_EXE_s3d"), text(&scene), &options, text(copy)];
        words.map(str::to_owned)
    };
    for size in ["40k", "200k", "600k"] {
        let copy = copy.with_extension(size);
        let run = Command::new("unshare")
            .args(["--user", "--map-root-user", "--mount", "sh", "-c", script, "sh"])
            .args(args(size, &copy))
            .output();
        let Ok(run) = run.inspect_err(|e| eprintln!("skipped: unshare: {e}")) else { return };
        let log = fs::read_to_string(copy.with_extension(format!("{size}.log"))).unwrap_or_default();
        if run.status.code() != Some(0) && log.is_empty() {
            eprintln!("skipped: no file system can be mounted: {}", String::from_utf8_lossy(&run.stderr));
            return;
        }
        assert!(run.status.success(), "{size}: {log}");
        let code = fs::read_to_string(copy.with_extension(format!("{size}.code"))).unwrap();
        assert_eq!(code.trim(), "75", "{size}: {log}");
        assert!(log.contains("No space left on device"), "{size}: {log}");
        if !undisturbed.exists() {
            s3d_ok(&[&["export", text(&scene), "-o", text(&undisturbed)][..], &SMALL].concat());
        }
        assert_same(&copy, &undisturbed);
    }
}

/// A LAZ file whose table lists no chunk, which makes the decoder's own code panic.
fn write_broken_laz(path: &Path) {
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/../s3d-io/tests/fixtures/clouds/1_4_format_7.laz");
    let mut bytes = fs::read(fixture).unwrap();
    let record = bytes.windows(14).position(|w| w == b"laszip encoded").unwrap() - 2 + 54;
    let four = |at: usize, bytes: &[u8]| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let table = four(four(96, &bytes), &bytes);
    // Chunks of variable size, and a count of 0.
    bytes[record + 12..record + 16].fill(0xff);
    bytes[table + 4..table + 8].fill(0);
    fs::write(path, bytes).unwrap();
}

#[test]
fn a_decoder_that_panics_is_an_error_of_the_file_and_no_more() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(dir.path(), 1);
    write_broken_laz(&dir.path().join("broken.laz"));
    let toml = fs::read_to_string(&scene).unwrap();
    let annotations = "path = \"broken.laz\"\nroom = \"office_1\"\nunknown_as_clutter = true";
    fs::write(&scene, toml.replace("path = \"Area_1\"", annotations)).unwrap();
    for verbose in [false, true] {
        let mut args = vec!["--log", "json", "info", text(&scene)];
        args.extend(verbose.then_some("-v"));
        let run = s3d(&args);
        let log = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(1), "{log}");
        let all = events(&log);
        let errors: Vec<&str> = all
            .iter()
            .filter(|e| e["level"] == "error")
            .map(|e| e["message"].as_str().unwrap())
            .collect();
        assert!(
            errors.len() == 1 && errors[0].ends_with("broken.laz: its compressed points are damaged"),
            "{log}"
        );
        assert!(!log.contains("panicked") && !log.contains("RUST_BACKTRACE"), "{log}");
        assert_eq!(log.contains("a decoder gave up: "), verbose, "{log}");
    }
}
