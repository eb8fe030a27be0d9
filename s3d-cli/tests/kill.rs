//! An export is killed at any moment, on a disk that loses or mangles recently written files. The same call
//! then goes on and ends with the same bytes as an undisturbed export.
#![cfg(unix)]

use crate::common;
use common::{UUID_B, files, s3d, s3d_fails, s3d_ok, text, write_scan};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Kills of the real process, over all cycles of [`killed_at_any_moment_it_goes_on_to_the_same_bytes`].
const KILLS: u32 = 60;

const OPTIONS: [&str; 10] = [
    "--size",
    "48",
    "--pano-width",
    "128",
    "--views",
    "12",
    "--points-per-m2",
    "400",
    "--profile",
    "pointnet,open3d-ml",
];

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Numbers that look random and are the same in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// A time up to `longest`.
    fn delay(&mut self, longest: Duration) -> Duration {
        longest.mul_f64((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }
}

/// Two areas of two scan locations each, and the files of an undisturbed export of them.
struct Scene {
    dir: tempfile::TempDir,
    scenes: [PathBuf; 2],
    whole: Files,
    /// How long the undisturbed export took.
    took: Duration,
}

impl Scene {
    fn new() -> Self {
        // A disk in memory, if there is one. The test is about the files that a killed process leaves there;
        // on a busy disk it would mostly wait.
        let memory = Path::new("/dev/shm");
        let dir = if memory.is_dir() {
            tempfile::tempdir_in(memory)
        } else {
            tempfile::tempdir()
        }
        .unwrap();
        let scenes = [1, 2].map(|area| write_scan(&dir.path().join(format!("scan_{area}")), area));
        let mut scene = Self { dir, scenes, whole: Files::new(), took: Duration::ZERO };
        let started = Instant::now();
        scene.whole = scene.undisturbed(&[]);
        scene.took = started.elapsed();
        scene
    }

    fn out(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn args<'a>(&'a self, out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
        let [a, b] = &self.scenes;
        [&["export", text(a), text(b), "-o", text(out)], &OPTIONS[..], more].concat()
    }

    /// The files of an undisturbed export.
    fn undisturbed(&self, more: &[&str]) -> Files {
        let out = self.out(&format!("undisturbed{}", more.concat()));
        s3d_ok(&self.args(&out, more));
        let whole = files(&out);
        assert!(!whole.keys().any(|path| text(path).contains(".s3d")), "{:?}", whole.keys());
        whole
    }

    fn start(&self, out: &Path, more: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_s3d"))
            .args(self.args(out, more))
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    }

    /// Lets an export run for a while and kills it. Returns false if it had finished before.
    fn run_for(&self, out: &Path, more: &[&str], delay: Duration) -> bool {
        let mut child = self.start(out, more);
        let until = Instant::now() + delay;
        while Instant::now() < until {
            if let Some(status) = child.try_wait().unwrap() {
                assert!(status.success(), "an export that goes on failed: {status}");
                return false;
            }
            thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        // It may have finished at that moment.
        !child.wait().unwrap().success()
    }

    /// Kills an export as soon as a file of its folder is there. It begins from what `prepare` makes, again
    /// if it finished first.
    fn kill_when_there(&self, out: &Path, more: &[&str], name: &str, prepare: impl Fn()) {
        for _ in 0..100 {
            prepare();
            let mut child = self.start(out, more);
            while !out.join(name).exists() && child.try_wait().unwrap().is_none() {
                thread::sleep(Duration::from_millis(1));
            }
            child.kill().unwrap();
            if !child.wait().unwrap().success() {
                return;
            }
        }
        panic!("no export was killed while {name} was there");
    }
}

/// OUT holds these files, and nothing else.
fn assert_whole(out: &Path, whole: &Files, when: &str) {
    let found = files(out);
    let names = |files: &Files| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&found), names(whole), "{when}: other files");
    for (path, bytes) in whole {
        assert!(found[path] == *bytes, "{when}: {} differs", path.display());
    }
    assert!(!out.join(".s3d").exists(), "{when}: the working folder is still there");
}

/// At whatever moment the kill came, a file under its final name has its final content, if the disk keeps
/// what was written.
fn assert_no_half_files(out: &Path, whole: &Files) {
    if !out.exists() {
        return;
    }
    for (path, bytes) in files(out) {
        let name = text(&path);
        if name.starts_with(".s3d") || name.ends_with(".part") || name == "manifest.json" {
            continue;
        }
        let expected = whole
            .get(&path)
            .unwrap_or_else(|| panic!("{name} is in no undisturbed export"));
        assert!(*expected == bytes, "{name} is there by halves");
    }
}

/// The number of units of work that are recorded as done.
fn finished_units(out: &Path) -> usize {
    let journals = fs::read_dir(out.join(".s3d/journal")).into_iter().flatten();
    let lines = journals.map(|journal| {
        let content = fs::read(journal.unwrap().path()).unwrap_or_default();
        content.iter().filter(|byte| **byte == b'\n').count()
    });
    lines.sum()
}

#[test]
fn killed_at_any_moment_it_goes_on_to_the_same_bytes() {
    let scene = Scene::new();
    let mut random = Random(1);
    let (mut kills, mut cycles, mut deepest) = (0, 0, 0);
    let mut stages = BTreeSet::new();
    // On a busy machine kills come early or late, and it takes more of them to reach every stage.
    while kills < KILLS || (stages.len() < 5 && kills < 10 * KILLS) {
        let out = scene.out(&format!("killed_{cycles}"));
        let threads = ["1", "2", "3"][cycles % 3];
        let mut of_cycle = 0;
        while scene.run_for(&out, &["--threads", threads], random.delay(scene.took.mul_f64(1.1))) {
            assert_no_half_files(&out, &scene.whole);
            of_cycle += 1;
            stages.insert(finished_units(&out));
        }
        assert_whole(&out, &scene.whole, &format!("cycle {cycles} of {of_cycle} kills"));
        fs::remove_dir_all(&out).unwrap();
        kills += of_cycle;
        deepest = deepest.max(of_cycle);
        cycles += 1;
    }
    assert!(cycles >= 3 && deepest >= 2, "{kills} kills in {cycles} cycles, {deepest} at most in one");
    // 12 units: two areas labelled, four locations scored and rendered, meshes and points of two areas.
    assert!(stages.len() >= 5, "kills came only when {stages:?} units of work were done");
}

#[test]
fn stopped_by_a_signal_it_goes_on_to_the_same_bytes() {
    let scene = Scene::new();
    let mut random = Random(2);
    let mut stops = 0;
    for cycle in 0..8 {
        let out = scene.out(&format!("stopped_{cycle}"));
        let signal = ["-TERM", "-INT"][cycle % 2];
        let mut child = scene.start(&out, &[]);
        // In the first milliseconds the program does not handle signals yet, and the system ends it.
        thread::sleep(scene.took.mul_f64(0.2) + random.delay(scene.took.mul_f64(0.6)));
        let pid = child.id().to_string();
        let _ = Command::new("kill")
            .args([signal, &pid])
            .stderr(Stdio::null())
            .status()
            .unwrap();
        match child.wait().unwrap().code() {
            Some(0) => {}
            Some(75) => stops += 1,
            other => panic!("{signal}: exit code {other:?}"),
        }
        s3d_ok(&scene.args(&out, &[]));
        assert_whole(&out, &scene.whole, signal);
    }
    assert!(stops > 0, "no export was stopped");
}

/// Damages a recently written file as a power loss does.
fn mangle(path: &Path, random: &mut Random) {
    let mut bytes = fs::read(path).unwrap();
    if bytes.is_empty() {
        return;
    }
    let at = random.below(bytes.len());
    match random.below(5) {
        0 => bytes.truncate(at),
        1 => bytes.fill(0),
        2 => bytes[at..].fill(0),
        3 => bytes[at] ^= 1 << random.below(8),
        _ => bytes.clear(),
    }
    // A new file, since profiles hold hard links to some.
    fs::remove_file(path).unwrap();
    if random.below(6) > 0 {
        fs::write(path, bytes).unwrap();
    }
}

#[test]
fn after_a_power_loss_what_was_lost_is_made_again() {
    let scene = Scene::new();
    let mut random = Random(3);
    let mut lost = 0;
    for cycle in 0..8 {
        let out = scene.out(&format!("power_{cycle}"));
        let late = scene.took.mul_f64(0.5) + random.delay(scene.took.mul_f64(0.4));
        while scene.run_for(&out, &["--threads", "2"], late) {
            // A data set was flushed to the disk before its manifest says "complete".
            if fs::read_to_string(out.join("manifest.json")).is_ok_and(|text| text.contains("\"complete\"")) {
                continue;
            }
            // Any file may be hit except the request, which is flushed to the disk before any other file is
            // written.
            let request = Path::new(".s3d/request.json");
            let all: Vec<PathBuf> = files(&out).into_keys().filter(|path| path != request).collect();
            for _ in 0..all.len().div_ceil(3) {
                let path = out.join(&all[random.below(all.len())]);
                if path.exists() {
                    mangle(&path, &mut random);
                    lost += 1;
                }
            }
            // The next run must finish.
            s3d_ok(&scene.args(&out, &[]));
        }
        assert_whole(&out, &scene.whole, &format!("power loss {cycle}"));
    }
    assert!(lost > 50, "{lost} files were mangled");
}

#[test]
fn every_journal_may_be_torn_anywhere() {
    let scene = Scene::new();
    let mut random = Random(4);
    let out = scene.out("torn");
    for share in [0.4, 0.6, 0.8, 0.95] {
        if !scene.run_for(&out, &[], scene.took.mul_f64(share)) {
            break;
        }
        let journals = out.join(".s3d/journal");
        for journal in fs::read_dir(&journals).into_iter().flatten() {
            mangle(&journal.unwrap().path(), &mut random);
        }
    }
    s3d_ok(&scene.args(&out, &[]));
    assert_whole(&out, &scene.whole, "torn journals");
}

#[test]
fn other_arguments_are_refused_with_what_differs() {
    let scene = Scene::new();
    let out = scene.out("other");
    scene.kill_when_there(&out, &[], ".s3d/journal", || {
        let _ = fs::remove_dir_all(&out);
    });
    let before = files(&out);
    s3d_fails(
        &scene.args(&out, &["--seed", "7"]),
        2,
        &["unfinished", "--seed 0 there, 7 now", "--overwrite"],
    );
    s3d_fails(&scene.args(&out, &["--only", UUID_B]), 2, &["--only none there"]);
    let wall = scene.dir.path().join("scan_1/Area_1/office_1/Annotations/wall_1.txt");
    let points = fs::read(&wall).unwrap();
    fs::write(&wall, [&points[..], b"1 0.000 1 3 4 5\n"].concat()).unwrap();
    s3d_fails(&scene.args(&out, &[]), 2, &["Area_1/: other bytes"]);
    fs::write(&wall, points).unwrap();
    let one = ["export", text(&scene.scenes[0]), "-o", text(&out)];
    s3d_fails(&[&one, &OPTIONS[..]].concat(), 2, &["area 2 there, not now"]);
    assert!(files(&out) == before, "a refused call changed something");

    // Another number of threads, or another path of the same folder, is still the same call.
    let again = scene.dir.path().join("./other");
    s3d_ok(&scene.args(&again, &["--threads", "1", "-q"]));
    assert_whole(&out, &scene.whole, "the same call");
    let log = s3d_ok(&scene.args(&out, &[]));
    assert!(log.contains("nothing to do"), "{log}");
    assert_whole(&out, &scene.whole, "nothing to do");
    s3d_fails(
        &scene.args(&out, &["--seed", "7"]),
        2,
        &["a data set", "--seed 0 there, 7 now", "--overwrite"],
    );
}

#[test]
fn a_complete_data_set_that_lost_something_is_not_taken_for_complete() {
    let scene = Scene::new();
    let out = scene.out("lost");
    s3d_ok(&scene.args(&out, &[]));
    let obj = out.join("area_1/3d/rgb.obj");
    fs::write(&obj, "").unwrap();
    s3d_fails(&scene.args(&out, &[]), 1, &["1 of its files", "area_1/3d/rgb.obj", "--overwrite"]);
    s3d_ok(&scene.args(&out, &["--overwrite"]));
    assert_whole(&out, &scene.whole, "made again");
    let mut bytes = fs::read(&obj).unwrap();
    bytes[100] ^= 1;
    fs::write(&obj, bytes).unwrap();
    s3d_ok(&scene.args(&out, &["--overwrite"]));
    assert_whole(&out, &scene.whole, "a flipped bit");
}

#[test]
fn one_process_at_a_time_exports_into_a_folder() {
    let scene = Scene::new();
    let out = scene.out("locked");
    fs::create_dir_all(out.join(".s3d")).unwrap();
    let lock = File::create(out.join(".s3d/lock")).unwrap();
    lock.lock().unwrap();
    s3d_fails(&scene.args(&out, &[]), 75, &["another process exports into it", "go on with: "]);
    drop(lock);
    s3d_ok(&scene.args(&out, &[]));
    assert_whole(&out, &scene.whole, "after the lock was given back");

    // Two processes at once: one does the work. The other is refused, or finds it done.
    let both = scene.out("both");
    let mut children = [scene.start(&both, &[]), scene.start(&both, &[])];
    let codes = children.each_mut().map(|child| child.wait().unwrap().code().unwrap());
    assert!(codes.contains(&0) && codes.iter().all(|code| [0, 75].contains(code)), "{codes:?}");
    assert_whole(&both, &scene.whole, "two at once");
}

#[test]
fn a_killed_replacement_goes_on_or_gives_way_to_another() {
    let scene = Scene::new();
    let (seven, nine) = (["--seed", "7", "--overwrite"], ["--seed", "9", "--overwrite"]);
    let [whole_seven, whole_nine] = [&seven[..2], &nine[..2]].map(|options| scene.undisturbed(options));
    let mut random = Random(5);
    let (mut kept, mut refused) = (0, 0);
    for cycle in 0..9 {
        let out = scene.out(&format!("replaced_{cycle}"));
        s3d_ok(&scene.args(&out, &[]));
        fs::write(out.join("notes.txt"), "mine").unwrap();
        let killed = scene.run_for(&out, &seven, random.delay(scene.took));
        if killed && out.join(".s3d").exists() {
            // The unfinished files that a killed process left in folders that hold other files too.
            for folder in ["", "assets", ".s3d"]
                .map(|name| out.join(name))
                .iter()
                .filter(|f| f.is_dir())
            {
                fs::write(folder.join(".s3d-Ab12Cd.part"), "half").unwrap();
            }
        }
        let (then, whole) = match cycle % 3 {
            // The same call again.
            0 => (&seven[..], &whole_seven),
            1 => (&nine[..], &whole_nine),
            _ => {
                // The call before the replacement: its files are there, complete, or they were moved aside.
                let log = s3d(&scene.args(&out, &[]));
                match log.status.code() {
                    Some(0) => kept += 1,
                    Some(2) => refused += 1,
                    other => panic!("{other:?}: {}", String::from_utf8_lossy(&log.stderr)),
                }
                (&seven[..], &whole_seven)
            }
        };
        s3d_ok(&scene.args(&out, then));
        assert_eq!(fs::read(out.join("notes.txt")).unwrap(), b"mine");
        fs::remove_file(out.join("notes.txt")).unwrap();
        assert_whole(&out, whole, &format!("cycle {cycle}, killed: {killed}"));
        fs::remove_dir_all(&out).unwrap();
    }
    assert_eq!(kept + refused, 3);
}

/// A resumed replacement that then fails for good gives the earlier data set back.
#[test]
fn a_replacement_that_fails_for_good_gives_the_earlier_one_back() {
    let scene = Scene::new();
    let out = scene.out("back");
    let seven = ["--seed", "7", "--overwrite"];
    // A part of the new data set, and the earlier one moved aside.
    scene.kill_when_there(&out, &seven, ".s3d/journal", || {
        s3d_ok(&scene.args(&out, &["--overwrite"]));
    });
    assert!(out.join(".s3d-previous").exists());
    // A folder in place of a file, which then cannot be written.
    let blocked = out.join("area_2/3d/rgb.obj/in/the/way");
    let _ = fs::remove_file(out.join("area_2/3d/rgb.obj"));
    fs::create_dir_all(blocked).unwrap();
    s3d_fails(&scene.args(&out, &seven), 1, &["rgb.obj"]);
    assert_whole(&out, &scene.whole, "given back");
}

/// A file that may not grow stands in for a disk that refuses.
#[test]
#[cfg(target_os = "linux")]
fn what_was_done_before_the_disk_refused_is_not_lost() {
    let scene = Scene::new();
    let out = scene.out("refused");
    let mut sizes: Vec<usize> = scene.whole.values().map(Vec::len).collect();
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    for place in [9, 2, 0] {
        // The limit is in units of 512 bytes, one too small for a file of this size.
        let blocks = (sizes[place] - 1) / 512;
        let run = Command::new("sh")
            .args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"")])
            .arg(env!("CARGO_BIN_EXE_s3d"))
            .args(scene.args(&out, &[]))
            .output()
            .unwrap();
        let log = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && log.contains("cannot write"), "{log}");
        assert_no_half_files(&out, &scene.whole);
    }
    // The failed export blocks no call with other arguments; the same call goes on.
    let log = s3d_ok(&scene.args(&out, &[]));
    assert!(log.contains("goes on where it stopped"), "{log}");
    assert_whole(&out, &scene.whole, "after the disk refused");
}

/// A file system of its own that is too small, if the test may make one.
#[test]
#[cfg(target_os = "linux")]
#[allow(clippy::print_stderr, reason = "a test that is skipped says so")]
fn a_full_disk_is_gone_on_with_when_there_is_space_again() {
    struct Mounted(PathBuf);
    impl Drop for Mounted {
        fn drop(&mut self) {
            let _ = Command::new("umount").arg(&self.0).stderr(Stdio::null()).status();
        }
    }
    let scene = Scene::new();
    let disk = scene.out("disk");
    fs::create_dir(&disk).unwrap();
    let size: usize = scene.whole.values().map(Vec::len).sum();
    let mount = |options: &str| {
        let args = ["-t", "tmpfs", "-o", options, "tmpfs", text(&disk)];
        Command::new("mount")
            .args(args)
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    };
    if !mount(&format!("size={}", size / 3)) {
        eprintln!("skipped: no file system can be mounted here");
        return;
    }
    let mounted = Mounted(disk.clone());
    let out = disk.join("out");
    for share in [3, 2, 1] {
        let size = format!("remount,size={}", size / share);
        assert!(mount(&size));
        s3d_fails(&scene.args(&out, &[]), 75, &["cannot ", "go on with: "]);
        assert_no_half_files(&out, &scene.whole);
    }
    assert!(mount(&format!("remount,size={}", 8 * size)));
    s3d_ok(&scene.args(&out, &[]));
    assert_whole(&out, &scene.whole, "when there was space again");
    drop(mounted);
}
