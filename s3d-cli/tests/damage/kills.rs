//! Kills every command that writes, at any moment. No file is half written, nothing unfinished passes for
//! complete, and the same call then ends with the same files as an undisturbed one.
//!
//! `S3D_KILLS=100 cargo test -p s3d-cli damage::kills` kills each command 100 times.

use super::structured::{Random, number_of};
use super::{SMALL, common, folder};
use common::{files, s3d_ok, text, write_scan};
use s3d_annotate::labelling::{Action, FaceRuns, LabelFolder};
use s3d_dataset::{BareScene, Context};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The commands, called in a folder with `scan` (the input), `out` (an export) and `shard_1`, `shard_2` (its
/// shards). A new command that writes needs a line here.
const COMMANDS: [&str; 54] = [
    "export scan/scene.toml -o new SMALL",
    "export scan/scene.toml -o out SMALL --seed 7 --overwrite",
    "export scan/scene.toml -o new SMALL --profile pointcept,open3d-ml",
    "export scan/photographs.toml -o new SMALL --place-cameras 2",
    "export scan/scene.toml --to webdataset -o new SMALL",
    "export scan/photographs.toml --to huggingface -o new SMALL --place-cameras 2",
    "plan scan/scene.toml -o new --views 3 --size 32",
    "merge shard_1 shard_2 -o new",
    "demo -o new --views 1 --size 32 --pano-width 64 --points-per-m2 5",
    "xyz out --type float --overwrite",
    "profile out --to pointcept,mmdet3d",
    "pairs out --samples 64",
    "refine out",
    "profile out --to pointnet,open3d-ml --overwrite",
    "figures out -o figs --dpi 30",
    "figures out -o drawn --dpi 30 --overwrite",
    "pack out --to webdataset",
    "pack out --to webdataset -o packed --overwrite",
    "pack out --to colmap --copy-images",
    "pack out --to nerfstudio --copy-images -o new/package",
    "pack out --to coco",
    "pack out --to parquet -o new.parquet",
    "pack out --to huggingface",
    "pack out --to dust3r",
    "pack out --to wai",
    "pack out --to vggt",
    "pack out --to pointcept",
    "pack out --to scene-graph",
    "pack out --to habitat",
    "pack out --to usd",
    "pack out --to concerto",
    "pack out --to spatial-qa",
    "sample scan/room.obj -o new.ply --points 200000",
    "sample scan/room.obj -o old.ply --points 200000 --overwrite",
    "segments scan/room.obj -o new.segs.json",
    "fuse scan/points.xyz -o new --origin 2,1.5,1.25 --cell 0.1",
    "fuse scan/points.xyz -o old.ply --origin 2,1.5,1.25 --cell 0.1 --overwrite",
    "fuse scan/points.xyz -o new.ply --origin 2,1.5,1.25 --cell 0.1 --memory 0.0003",
    "align scan/room.obj scan/room.obj -o old.ply --nth 1 --overwrite",
    "label scan/room.obj -o labels --write ply",
    "label scan/room.obj -o labels --write scannet --to new",
    "render scan/room.obj --at 2,1.2,1.5 --size 200 -o new",
    "render scan/room.obj --at 2,1.2,1.5 --size 200 -o old --pano --overwrite",
    "render scan/room.obj --poses scan/cameras.csv --width 120 --height 90 --fov 70 -o new/views",
    "render scan/room.obj --poses scan/cameras.csv --width 120 --height 90 --fov 70 -o views --overwrite",
    "render scan/room.obj --trajectory 4 --rate 10 --width 80 -o walk",
    "profile out --to mmdet3d",
    "report out --pano-width 32 --thumbs 16",
    "report out --single -o new.html --poster new.png --pano-width 32 --thumbs 16",
    "report out --against out --pano-width 32 --thumbs 16",
    "compare out out --json new.json",
    "eval det --truth out --pred boxes.json --json new.json",
    "compare out out --full --json old.ply --overwrite",
    "detect train out -o new.json --most-spaces 1",
];

/// A command that takes longer is killed a third as often.
const LONG: Duration = Duration::from_secs(1);

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// The folder that each command starts from.
struct Template {
    dir: TempDir,
    files: Files,
}

/// What a scanner in the middle of the room of 4 × 3 × 2.5 m measures: a line x y z for each direction.
fn scanned_room() -> String {
    let mut text = String::new();
    for (i, j) in (0..240).flat_map(|i| (1..120).map(move |j| (i, j))) {
        let (azimuth, polar) = (f64::from(i) * PI / 120.0, f64::from(j) * PI / 120.0);
        let direction = [polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()];
        let range = [2.0, 1.5, 1.25]
            .iter()
            .zip(direction)
            .map(|(half, d): (&f64, f64)| half / d.abs())
            .fold(f64::INFINITY, f64::min);
        let [x, y, z] = direction.map(|d| d * range);
        let _ = writeln!(text, "{:.4} {:.4} {:.4}", 2.0 + x, 1.5 + y, 1.25 + z);
    }
    text
}

impl Template {
    fn new() -> Self {
        let dir = folder();
        let at = |name: &str| dir.path().join("template").join(name);
        let scene = write_scan(&at("scan"), 1);
        let export = |name: &str, more: &[&str]| {
            s3d_ok(&[&["export", text(&scene), "-o", text(&at(name))], &SMALL[..], more].concat());
        };
        export("out", &["--profile", "pointnet"]);
        export("shard_1", &["--shard", "1/2"]);
        export("shard_2", &["--shard", "2/2"]);
        s3d_ok(&[
            "pack",
            text(&at("out")),
            "--to",
            "webdataset",
            "-o",
            text(&at("packed")),
            "--max-count",
            "2",
        ]);
        s3d_ok(&["sample", text(&at("scan/room.obj")), "-o", text(&at("old.ply")), "--points", "1000"]);
        let view = ["--at", "2,1.2,1.5", "--size", "100", "-o", text(&at("old"))].map(str::to_owned);
        let view: Vec<&str> = view.iter().map(String::as_str).collect();
        s3d_ok(&[&["render", text(&at("scan/room.obj"))], &view[..]].concat());
        let poses = [text(&at("scan/cameras.csv")), "-o", text(&at("views"))].map(str::to_owned);
        let [list, o, views] = &poses;
        let size = ["--width", "50", "--height", "60", "--fov", "60"];
        s3d_ok(&[&["render", text(&at("scan/room.obj")), "--poses", list, o, views], &size[..]].concat());
        let photographs =
            "area = 1\n[mesh]\npath = \"room.obj\"\n[frames]\npath = \"../views/transforms.json\"\n";
        fs::write(at("scan/photographs.toml"), photographs).unwrap();
        fs::write(at("boxes.json"), "[]").unwrap();
        fs::write(at("scan/points.xyz"), scanned_room()).unwrap();
        label(&at("scan/room.obj"), &at("labels"));
        let files = files(&at(""));
        Self { dir, files }
    }

    /// A new folder for one run of a command.
    fn begin(&self, name: &str) -> PathBuf {
        let folder = self.dir.path().join(name);
        for (path, bytes) in &self.files {
            let to = folder.join(path);
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::write(to, bytes).unwrap();
        }
        folder
    }
}

/// Labels the first faces of a mesh.
fn label(mesh: &Path, folder: &Path) {
    let scene = BareScene::open(mesh.to_owned(), &Context::default()).unwrap();
    let mut labels = LabelFolder::open(folder, scene.mesh(), scene.taxonomy()).unwrap();
    let class = Some("floor".to_owned());
    labels
        .add(0, Action::Paint { faces: FaceRuns::of_range(0..2), instance: 1, class }, None)
        .unwrap();
}

/// Runs a command in a folder, and kills it after a while if it is not done by then.
fn run(folder: &Path, command: &str, delay: Option<Duration>) -> ExitStatus {
    let words = command
        .split(' ')
        .flat_map(|word| if word == "SMALL" { SMALL.to_vec() } else { vec![word] });
    let mut child = Command::new(env!("CARGO_BIN_EXE_s3d"))
        .args(words)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(fs::File::create(folder.with_extension("log")).unwrap())
        .spawn()
        .unwrap();
    let Some(delay) = delay else { return child.wait().unwrap() };
    let until = Instant::now() + delay;
    while Instant::now() < until {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        thread::sleep(Duration::from_micros(300));
    }
    child.kill().unwrap();
    child.wait().unwrap()
}

/// Whether a file is a process's own while it works.
fn is_working(path: &Path) -> bool {
    path.components()
        .any(|name| name.as_os_str().to_str().is_some_and(|name| name.starts_with(".s3d")))
}

/// The result of a command. Every process that makes a plan keeps a journal of its own in it, which does not
/// count.
fn made(folder: &Path, command: &str) -> Files {
    let mut all = files(folder);
    all.retain(|path, _| !(command.starts_with("plan") && is_working(path)));
    all
}

/// At whatever moment the kill came, a file has the content from before the command, or the final one.
fn assert_nothing_by_halves(folder: &Path, before: &Files, whole: &Files, command: &str) {
    for (path, bytes) in files(folder) {
        // The manifest of an export under way says so.
        let says_so =
            path.ends_with("manifest.json") && String::from_utf8_lossy(&bytes).contains("\"running\"");
        let known = [before, whole].iter().any(|files| files.get(&path) == Some(&bytes));
        assert!(known || is_working(&path) || says_so, "{command}: {} is there by halves", path.display());
    }
    // A package exists as a whole or not at all.
    for place in whole.keys().filter(|path| path.ends_with("pack.json")) {
        if fs::read(folder.join(place)).ok().as_ref() == whole.get(place) {
            let inside = |path: &&PathBuf| path.starts_with(place.parent().unwrap());
            assert!(whole.keys().filter(inside).all(|path| folder.join(path).exists()), "{command}");
        }
    }
    // A data set is whole too, or `verify` reports it.
    for name in ["out", "new"] {
        let out = folder.join(name);
        if command.contains(&format!(" {name}")) && out.join("manifest.json").exists() {
            let said = common::s3d(&["verify", text(&out)]);
            let report = String::from_utf8_lossy(&said.stdout).into_owned();
            let told = ["half changed", "did not finish"]
                .iter()
                .any(|words| report.contains(words));
            assert!(said.status.success() || told, "{command}: {report}");
        }
    }
}

/// Two tests share the commands, since they are the longest of all.
#[test]
fn killed_commands_with_even_numbers_are_made_whole_by_the_same_call() {
    kill_each(COMMANDS.iter().enumerate().step_by(2));
}

#[test]
fn killed_commands_with_odd_numbers_are_made_whole_by_the_same_call() {
    kill_each(COMMANDS.iter().enumerate().skip(1).step_by(2));
}

fn kill_each<'a>(commands: impl Iterator<Item = (usize, &'a &'static str)>) {
    let template = Template::new();
    let kills_each = number_of("S3D_KILLS", 3);
    for (number, command) in commands {
        let undisturbed = template.begin(&format!("undisturbed_{number}"));
        let started = Instant::now();
        assert!(run(&undisturbed, command, None).success(), "{command}");
        let mut took = started.elapsed();
        let whole = made(&undisturbed, command);
        assert!(whole != template.files, "{command} makes nothing");
        fs::remove_dir_all(undisturbed).unwrap();

        let wanted = if took > LONG {
            kills_each.div_ceil(3)
        } else {
            kills_each
        };
        let mut random = Random(number as u64);
        let (mut kills, mut cycles) = (0, 0);
        while kills < wanted {
            let folder = template.begin(&format!("killed_{number}_{cycles}"));
            let before = kills;
            loop {
                // After enough kills it is left alone: a command that begins anew each time would not end on
                // a machine that has become slower.
                let share = 0.02 + 1.08 * random.below(1000) as f64 / 1000.0;
                let delay = (kills < wanted).then(|| took.mul_f64(share));
                let started = Instant::now();
                let status = run(&folder, command, delay);
                if status.success() {
                    // On one that has become faster, kills by the first time would come after the end.
                    if kills == before {
                        took = took.min(started.elapsed());
                    }
                    break;
                }
                // It was killed after all was done, so the next call says that the files exist.
                if status.code() == Some(2) && made(&folder, command) == whole {
                    break;
                }
                let said = fs::read_to_string(folder.with_extension("log")).unwrap();
                assert_eq!(
                    status.code(),
                    None,
                    "{command}: the same call failed after {kills} kills: {said}"
                );
                assert_nothing_by_halves(&folder, &template.files, &whole, command);
                kills += 1;
            }
            let found = made(&folder, command);
            let names = |files: &Files| files.keys().cloned().collect::<Vec<_>>();
            assert_eq!(names(&found), names(&whole), "{command} after {kills} kills");
            for (path, bytes) in &whole {
                assert!(found[path] == *bytes, "{command} after {kills} kills: {} differs", path.display());
            }
            fs::remove_dir_all(folder).unwrap();
            cycles += 1;
        }
    }
}
