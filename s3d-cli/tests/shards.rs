//! Merged shards of an export are byte for byte what a single run writes.

use crate::common;
use common::{UUID_A, UUID_B, files, s3d, s3d_fails, s3d_ok, text, write_scan};
use s3d_geom::Raster;
use s3d_io::image::{Compression, Content, write_rgb8};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const SMALL: [&str; 8] = ["--size", "48", "--pano-width", "96", "--views", "8", "--points-per-m2", "40"];
const SCORING: [&str; 4] = ["--size", "48", "--views", "8"];

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Scenes, a folder for all files, and the result of a single run with these options.
struct Trial {
    dir: tempfile::TempDir,
    scenes: Vec<PathBuf>,
    options: Vec<String>,
    single: Files,
}

impl Trial {
    fn of(scenes: impl FnOnce(&Path) -> Vec<PathBuf>, options: &[&str]) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let scenes = scenes(dir.path());
        let options: Vec<String> = SMALL.iter().chain(options).map(|o| (*o).to_owned()).collect();
        let mut trial = Self { dir, scenes, options, single: Files::new() };
        let out = trial.path("single");
        s3d_ok(&words(&trial.export(&out, &[])));
        trial.single = files(&out);
        assert!(trial.single.len() > 20);
        trial
    }

    /// Two areas of two locations each.
    fn two_areas(options: &[&str]) -> Self {
        Self::of(|dir| vec![write_scan(&dir.join("one"), 1), write_scan(&dir.join("five"), 5)], options)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn export(&self, out: &Path, extra: &[&str]) -> Vec<String> {
        let mut args = vec!["export".to_owned()];
        args.extend(self.scenes.iter().map(|s| text(s).to_owned()));
        args.extend(["-o".to_owned(), text(out).to_owned()]);
        args.extend(self.options.iter().cloned());
        args.extend(extra.iter().map(|e| (*e).to_owned()));
        args
    }

    fn shard(&self, out: &Path, i: u32, n: u32, extra: &[&str]) {
        let shard = format!("{i}/{n}");
        s3d_ok(&words(&self.export(out, &[&["--shard", &shard], extra].concat())));
    }

    fn plan(&self, plan: &Path, extra: &[&str]) {
        let mut args = vec!["plan"];
        args.extend(self.scenes.iter().map(|s| text(s)));
        args.extend(["-o", text(plan)]);
        args.extend(SCORING);
        args.extend(extra);
        s3d_ok(&args);
    }

    /// Merges the shards, and compares the result with the single run.
    fn merge(&self, shards: &[&Path], out: &Path) {
        s3d_ok(&merging(shards, out));
        self.assert_single(out);
    }

    fn assert_single(&self, out: &Path) {
        let merged = files(out);
        let names = |files: &Files| files.keys().map(|k| k.display().to_string()).collect::<Vec<_>>();
        assert_eq!(names(&merged), names(&self.single));
        for (path, bytes) in &merged {
            assert!(bytes == &self.single[path], "{} differs", path.display());
        }
    }
}

fn words(args: &[String]) -> Vec<&str> {
    args.iter().map(String::as_str).collect()
}

fn merging<'a>(shards: &[&'a Path], out: &'a Path) -> Vec<&'a str> {
    let mut args = vec!["merge"];
    args.extend(shards.iter().map(|s| text(s)));
    args.extend(["-o", text(out)]);
    args
}

/// Starts `s3d` without waiting for it.
fn begin(args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_s3d"));
    command
        .args(args)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts")
}

#[test]
fn any_number_of_shards_with_an_out_of_their_own() {
    let trial = Trial::two_areas(&[]);
    // The last number: more shards than units of work.
    for n in [1, 3, 17] {
        let outs: Vec<PathBuf> = (1..=n).map(|i| trial.path(&format!("own-{n}-{i}"))).collect();
        // In reverse order, and the first shard twice.
        for i in (1..=n).rev().chain([1]) {
            trial.shard(&outs[i as usize - 1], i, n, &[]);
        }
        let mut shards: Vec<&Path> = outs.iter().map(PathBuf::as_path).collect();
        shards.rotate_left(n as usize / 2);
        shards.push(&outs[0]);
        let out = trial.path(&format!("merged-{n}"));
        trial.merge(&shards, &out);
        // Again, by mistake.
        trial.merge(&shards, &out);
    }
}

#[test]
fn shards_that_share_an_out() {
    let trial = Trial::two_areas(&["--profile", "pointcept,pointnet", "--pool", "area"]);
    let out = trial.path("shared");
    // All at once, and the second twice by mistake.
    let calls = [1, 2, 3, 2].map(|i| trial.export(&out, &["--shard", &format!("{i}/3")]));
    let mut children: Vec<Child> = calls.iter().map(|call| begin(&words(call))).collect();
    for child in &mut children {
        assert!(child.wait().unwrap().success());
    }
    assert!(
        fs::read_to_string(out.join("manifest.json"))
            .unwrap()
            .contains("\"running\"")
    );
    // A merge is refused while a shard is at work.
    let lock = fs::File::open(out.join(".s3d/lock")).unwrap();
    lock.lock_shared().unwrap();
    s3d_fails(&merging(&[&out], &out), 75, &["another process", "go on with: "]);
    s3d_fails(&merging(&[&out], &trial.path("elsewhere")), 75, &["another process"]);
    // A program that another test starts at this moment may have the file open, too.
    lock.unlock().unwrap();
    trial.merge(&[&out], &out);
    // A late shard finds all work done, and so does another merge.
    trial.shard(&out, 3, 3, &[]);
    trial.merge(&[&out], &out);
    // Shards of different numbers go together: the units are the same.
    let mixed = trial.path("mixed");
    for (i, n) in [(1, 2), (1, 3), (2, 3), (3, 3)] {
        trial.shard(&mixed, i, n, &[]);
    }
    trial.merge(&[&mixed], &mixed);
}

#[test]
fn with_a_plan_that_is_made_by_one_or_by_many() {
    let trial = Trial::two_areas(&["--pool", "location"]);
    let (plan, parts) = (trial.path("plan"), trial.path("parts"));
    trial.plan(&plan, &[]);
    for shard in ["3/3", "1/3", "2/3", "1/3"] {
        trial.plan(&parts, &["--shard", shard]);
    }
    let annotations = ["one", "five"].map(|name| trial.path(name)).map(|dir| {
        let folder = fs::read_dir(&dir).unwrap().map(|e| e.unwrap().path());
        folder.into_iter().find(|p| p.is_dir()).unwrap()
    });
    let out = trial.path("out");
    for i in 1..=2 {
        trial.shard(&out, i, 2, &["--plan", text(&parts)]);
    }
    trial.merge(&[&out], &out);
    // A single run with a plan writes the same as one without.
    let whole = trial.path("whole");
    s3d_ok(&words(&trial.export(&whole, &["--plan", text(&plan)])));
    trial.assert_single(&whole);
    // Annotations are not opened again: they now have bytes that are not even text, of the same length.
    for folder in &annotations {
        for name in files(folder).keys() {
            let length = fs::metadata(folder.join(name)).unwrap().len();
            fs::write(folder.join(name), vec![0xff; length as usize]).unwrap();
        }
    }
    let later = trial.path("later");
    trial.shard(&later, 1, 1, &["--plan", text(&plan)]);
    trial.merge(&[&later], &later);
}

#[test]
fn what_a_plan_is_not_for_is_refused() {
    let trial = Trial::two_areas(&[]);
    let (plan, out) = (trial.path("plan"), trial.path("out"));
    let fails = |extra: &[&str], code: i32, parts: &[&str]| {
        let call = trial.export(&out, &[&["--shard", "1/2", "--plan", text(&plan)], extra].concat());
        s3d_fails(&words(&call), code, parts);
        assert!(!out.exists(), "nothing is begun");
    };
    fails(&[], 1, &["holds no plan", "s3d plan"]);
    trial.plan(&plan, &["--shard", "1/3"]);
    fails(&[], 1, &["is not complete", "s3d plan"]);
    for shard in ["2/3", "3/3"] {
        trial.plan(&plan, &["--shard", shard]);
    }
    fails(&["--seed", "7"], 2, &["--seed 0 there, 7 now"]);
    let other = trial.plan_again(&plan, &["--seed", "7"]);
    assert!(other.contains("--seed 0 there, 7 now"), "{other}");
    // A damaged journal, table or file of face labels is made again by another call.
    for (part, message) in [
        ("journal", "is not complete"),
        ("instances.json", "instances.json: "),
        ("label_of_face", "is damaged"),
    ] {
        let all = files(&plan);
        let (name, whole) = all
            .iter()
            .find(|(name, bytes)| text(name).contains(part) && !bytes.is_empty())
            .unwrap();
        fs::write(plan.join(name), &whole[..whole.len() / 2]).unwrap();
        let call = trial.export(&out, &["--shard", "1/1", "--plan", text(&plan)]);
        s3d_fails(&words(&call), 1, &[message]);
        trial.plan(&plan, &[]);
        let _ = fs::remove_dir_all(&out);
    }
    trial.shard(&out, 1, 1, &["--plan", text(&plan)]);
    trial.merge(&[&out], &out);
    fs::remove_dir_all(&out).unwrap();
    // A changed input.
    let mesh = trial.path("one/room.obj");
    let obj = fs::read_to_string(&mesh).unwrap();
    fs::write(&mesh, obj.replacen("v 4 ", "v 4.5 ", 1)).unwrap();
    fails(&[], 2, &["room.obj: other bytes"]);
}

impl Trial {
    /// The message that refuses a plan with other options.
    fn plan_again(&self, plan: &Path, extra: &[&str]) -> String {
        let mut args = vec!["plan"];
        args.extend(self.scenes.iter().map(|s| text(s)));
        args.extend(["-o", text(plan)]);
        args.extend(SCORING);
        args.extend(extra);
        let done = s3d(&args);
        assert_eq!(done.status.code(), Some(2));
        String::from_utf8(done.stderr).unwrap()
    }
}

#[test]
fn a_shard_that_is_killed_is_run_again() {
    let trial = Trial::two_areas(&["--modalities", "rgb,depth,pose"]);
    let (out, own) = (trial.path("shared"), trial.path("own"));
    trial.shard(&out, 1, 2, &[]);
    // The shard is killed several times, each time a little later, and at last finishes.
    let started = Instant::now();
    for (out, i) in [(&out, 2), (&own, 1)] {
        for delay in [5, 20, 60, 120] {
            let mut child = begin(&words(&trial.export(out, &["--shard", &format!("{i}/2")])));
            std::thread::sleep(Duration::from_millis(delay));
            let _ = child.kill();
            let _ = child.wait();
        }
        trial.shard(out, i, 2, &[]);
    }
    assert!(started.elapsed() < Duration::from_secs(600));
    trial.merge(&[&out], &out);
    // The shard with a folder of its own has half of the work.
    let halves = trial.path("halves");
    s3d_fails(&merging(&[&own], &halves), 1, &["run again shard 2/2"]);
    assert!(!halves.exists());
    let second = trial.path("second");
    trial.shard(&second, 2, 2, &[]);
    trial.merge(&[&second, &own], &halves);
}

#[test]
fn a_shard_that_is_missing_damaged_or_of_another_call_is_named() {
    let trial = Trial::two_areas(&["--modalities", "depth,pose"]);
    let outs = [1, 2, 3].map(|i| trial.path(&format!("shard-{i}")));
    for (i, out) in (1..).zip(&outs) {
        trial.shard(out, i, 3, &[]);
    }
    let out = trial.path("merged");
    let all = [outs[0].as_path(), &outs[1], &outs[2]];
    s3d_fails(&merging(&[all[0], all[2]], &out), 1, &["run again shard 2/3"]);
    s3d_fails(&merging(&[all[0], &trial.path("nowhere")], &out), 1, &["nowhere"]);
    assert!(!out.exists());
    // One byte of an image.
    let image = files(all[2])
        .into_keys()
        .find(|name| name.extension().is_some_and(|e| e == "png"))
        .unwrap();
    let path = all[2].join(image);
    let whole = fs::read(&path).unwrap();
    let mut damaged = whole.clone();
    *damaged.last_mut().unwrap() ^= 1;
    fs::write(&path, &damaged).unwrap();
    s3d_fails(&merging(&all, &out), 1, &["other content", "run again shard 3/3"]);
    // Another run of this shard mends that, and the merge goes on.
    trial.shard(all[2], 3, 3, &[]);
    assert_eq!(fs::read(&path).unwrap(), whole);
    trial.merge(&all, &out);
    // Shards with other options or other input are refused.
    let other = trial.path("other");
    trial.shard(&other, 2, 3, &["--seed", "7"]);
    s3d_fails(&merging(&[all[0], &other, all[2]], &trial.path("mix")), 2, &["--seed 0 there, 7 now"]);
    // An OUT that holds something else is left alone unless `--overwrite` is given.
    s3d_fails(&merging(&[all[0], all[1], all[2]], &trial.path("single")), 0, &["nothing to do"]);
    let single_of_seven = trial.path("seven");
    s3d_ok(&words(&trial.export(&single_of_seven, &["--seed", "7"])));
    s3d_fails(&merging(&all, &single_of_seven), 2, &["--seed 7 there, 0 now", "--overwrite"]);
    s3d_ok(&[&merging(&all, &single_of_seven)[..], &["--overwrite"]].concat());
    trial.assert_single(&single_of_seven);
    // Shards may begin in such an OUT as well, if each is called with `--overwrite`.
    let call = trial.export(&other, &["--shard", "1/2"]);
    s3d_fails(&words(&call), 2, &["an unfinished export of another call", "--seed 7 there, 0 now"]);
    let again = trial.path("seven-again");
    s3d_ok(&words(&trial.export(&again, &["--seed", "7"])));
    for out in [&other, &again] {
        for i in 1..=2 {
            trial.shard(out, i, 2, &["--overwrite"]);
        }
        trial.merge(&[out], out);
    }
}

#[test]
fn locations_that_are_placed_and_those_that_are_asked_for() {
    let place = ["--place-cameras", "1.5"];
    let trial = Trial::two_areas(&[&place[..], &["--modalities", "rgb,pose", "--keep-all"]].concat());
    let plan = trial.path("plan");
    for shard in ["2/2", "1/2"] {
        trial.plan(&plan, &[&place[..], &["--shard", shard]].concat());
    }
    let outs = ["with", "without"].map(|name| trial.path(name));
    for i in 1..=3 {
        trial.shard(&outs[0], i, 3, &["--plan", text(&plan)]);
        trial.shard(&outs[1], i, 3, &[]);
    }
    outs.iter().for_each(|out| trial.merge(&[out], out));

    let trial = Trial::two_areas(&["--only", UUID_A]);
    let out = trial.path("only");
    for i in 1..=2 {
        trial.shard(&out, i, 2, &[]);
    }
    trial.merge(&[&out], &out);
}

#[test]
fn colours_from_pictures() {
    let trial = Trial::of(
        |dir| {
            let scene = write_scan(&dir.join("scan"), 1);
            let toml = fs::read_to_string(&scene).unwrap();
            fs::write(&scene, format!("rgb = \"panorama\"\n{toml}")).unwrap();
            fs::create_dir(dir.join("scan/panorama")).unwrap();
            for (k, uuid) in [(0u32, UUID_A), (90, UUID_B)] {
                let pixels = (0..64 * 32u32).map(|i| [(4 * (i % 64)) as u8, (8 * (i / 64)) as u8, k as u8]);
                let image = Raster::from_vec(64, 32, pixels.collect());
                let path = dir.join(format!("scan/panorama/{uuid}.png"));
                write_rgb8(&path, &image, Content::Photo, Compression::Fast).unwrap();
            }
            vec![scene]
        },
        &["--modalities", "rgb"],
    );
    let out = trial.path("out");
    for i in 1..=2 {
        trial.shard(&out, i, 2, &[]);
    }
    trial.merge(&[&out], &out);
}

#[test]
fn wrong_calls_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    for shard in ["0/2", "3/2", "2", "a/b"] {
        s3d_fails(&["export", text(&scene), "--shard", shard], 2, &["--shard"]);
    }
    s3d_fails(&["merge", "-o", "x"], 2, &["SHARD"]);
    let out = dir.path().join("out");
    s3d_fails(&merging(&[&dir.path().join("scan")], &out), 1, &["no shard"]);
}

/// All folders below `dir`, empty ones too.
fn folders(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut left = vec![dir.to_owned()];
    while let Some(folder) = left.pop() {
        let below = fs::read_dir(&folder)
            .unwrap()
            .map(|e| e.unwrap().path())
            .filter(|path| path.is_dir());
        left.extend(below);
        found.push(folder.strip_prefix(dir).unwrap().to_owned());
    }
    found.sort();
    found
}

#[test]
fn merged_too_early_again_or_by_another_version() {
    // The second area has no images, but still has its folders.
    let trial = Trial::two_areas(&["--only", UUID_A, "--modalities", "depth"]);
    let [one, two] = ["one-of-two", "two-of-two"].map(|name| trial.path(name));
    trial.shard(&one, 1, 2, &[]);
    // Missing work may still come while some shard is at work.
    let lock = fs::File::open(one.join(".s3d/lock")).unwrap();
    lock.lock_shared().unwrap();
    s3d_fails(&merging(&[&one], &one), 75, &["another process", "go on with: "]);
    drop(lock);
    s3d_fails(&merging(&[&one], &one), 1, &["run again shard 2/2"]);
    trial.shard(&two, 2, 2, &[]);
    // The file is missing too where a shard was killed early, and in an export without shards.
    fs::remove_file(two.join(".s3d/labels.jsonl")).unwrap();
    let out = trial.path("merged");
    let log = s3d_ok(&merging(&[&two, &one], &out));
    assert!(log.contains("1 panoramas and"), "the account is that of all shards: {log}");
    trial.assert_single(&out);
    assert_eq!(folders(&out), folders(&trial.path("single")));

    let requests = [&one, &two].map(|shard| shard.join(".s3d/request.json"));
    let written = requests.each_ref().map(|path| fs::read_to_string(path).unwrap());
    for (path, text) in requests.iter().zip(&written) {
        fs::write(path, text.replace(env!("CARGO_PKG_VERSION"), "0.0.1")).unwrap();
    }
    let call = trial.path("other-version");
    s3d_fails(&merging(&[&one, &two], &call), 2, &["version 0.0.1 of s3d", "merge with that version"]);
    // Folders of shards with other options are still shards, and must not be removed.
    for (path, text) in requests.iter().zip(&written) {
        let other = text
            .replace(env!("CARGO_PKG_VERSION"), "0.0.1")
            .replace("\"seed\": 0,", "");
        assert!(other.len() + 8 < text.len());
        fs::write(path, other).unwrap();
    }
    s3d_fails(&merging(&[&one, &two], &call), 2, &["version 0.0.1 of s3d", "merge with that version"]);
    let before = files(&one);
    for how in [&["--shard", "1/2"][..], &[]] {
        s3d_fails(&words(&trial.export(&one, how)), 2, &["version 0.0.1 of s3d there", "--overwrite"]);
    }
    assert_eq!(files(&one), before);
    requests
        .iter()
        .zip(&written)
        .for_each(|(path, text)| fs::write(path, text).unwrap());

    // The merge goes into one of the shards, and is repeated by mistake.
    trial.merge(&[&one, &two], &one);
    let log = s3d_ok(&merging(&[&one, &two], &one));
    assert!(log.contains("nothing to do"), "{log}");
    trial.assert_single(&one);
}

#[test]
fn a_plan_is_no_folder_for_a_data_set() {
    let dir = tempfile::tempdir().unwrap();
    let scenes = [1, 5].map(|area| write_scan(&dir.path().join(area.to_string()), area));
    let plan = dir.path().join("plan");
    s3d_ok(&[&["plan", text(&scenes[0]), "-o", text(&plan)], &SCORING[..]].concat());
    let before = files(&plan);
    for scene in &scenes {
        let call = [&["export", text(scene), "-o", text(&plan), "--overwrite"], &SMALL[..]].concat();
        s3d_fails(&call, 2, &["holds a plan"]);
        assert_eq!(files(&plan), before);
    }
    // A plan without its first line does not say what it is for.
    fs::write(plan.join("plan.jsonl"), "{").unwrap();
    let call = [&["plan", text(&scenes[0]), "-o", text(&plan)], &SCORING[..]].concat();
    s3d_fails(&call, 1, &["plan.jsonl", "remove the folder"]);
}
