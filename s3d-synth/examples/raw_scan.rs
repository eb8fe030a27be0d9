//! Scans a scene by a simulated device and writes the raw scan, or scores a mesh that was made of it.
//!
//! `cargo run --release -p s3d-synth --example raw_scan -- matterport|tum|scannet|ptx|e57 DIR [OPTION…]`
//!
//! | option | |
//! |---|---|
//! | `--scene NAME` | what is scanned: see below (`demo`) |
//! | `--seed N` | of the device, and of generated buildings (1) |
//! | `--locations N` | only the first N scan locations |
//! | `--pictures N` | poses a location of a hand-held camera (60) |
//! | `--scale F` | the size of pictures and grids beside the devices' own (1; 0.5 for Matterport) |
//! | `--score MESH.ply` | writes nothing; prints how the mesh agrees with the scene, as a line of JSON |
//! | `--truth` | writes the scene's mesh beside, as `rgb.obj` |
//!
//! A scene is `demo`, its `office` alone, `two-storeys`, a generated `area_N`, a building of so many rooms,
//! or the `.obj` (Y-up) of a mesh with `cameras.csv` beside it.
//!
//! Of a score, `doors` is the share of the doors' seen surface that lies within 1 cm of the mesh, and `legs`
//! the share of what stands under tables.
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use s3d_geom::{Pose, TriMesh};
use s3d_io::camera::read_cameras;
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_label::{Class, Room, RoomType};
use s3d_synth::building::ScanLocation;
use s3d_synth::device::{DepthCamera, LaserScanner, ScanTarget, turntable_poses};
use s3d_synth::truth::{MeshScores, Truth, TruthOptions, View};
use s3d_synth::{AnnotatedScene, Building, BuildingOptions, Instance};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

const USAGE: &str = "usage: raw_scan matterport|tum|scannet|ptx|e57 DIR [--scene NAME] [--seed N] \
                     [--locations N] [--pictures N] [--scale F] [--score MESH.ply] [--truth]";

fn main() -> Result<(), Box<dyn Error>> {
    let job = Job::parse()?;
    let scene = named_scene(&job.scene, job.seed)?;
    let target = ScanTarget::new(&scene);
    let locations = &scene.locations[..job.locations.min(scene.locations.len())];

    if let Some(path) = &job.score {
        let mesh = read_mesh(path, UpAxis::Z)?.mesh;
        let truth = Truth::new(&target, &job.views(&target, locations), &TruthOptions::default())?;
        println!("{}", json(&truth.score(&mesh), kept(&scene, &truth, &mesh)));
        return Ok(());
    }

    let began = Instant::now();
    job.write(&target, locations)?;
    if job.truth {
        s3d_io::mesh::write_rgb_obj(&job.folder, &scene.mesh, &[])?;
    }
    let seconds = began.elapsed().as_secs_f64();
    println!("{}: {} locations in {seconds:.1} s", job.folder.display(), locations.len());
    Ok(())
}

struct Job {
    form: String,
    folder: PathBuf,
    scene: String,
    seed: u64,
    locations: usize,
    pictures: u32,
    scale: f64,
    score: Option<PathBuf>,
    truth: bool,
}

impl Job {
    fn parse() -> Result<Self, Box<dyn Error>> {
        let mut args = std::env::args().skip(1);
        let form = args.next().ok_or(USAGE)?;
        let folder = args.next().ok_or(USAGE)?.into();
        let scale = if form == "matterport" { 0.5 } else { 1.0 };
        let scene = "demo".to_owned();
        let (seed, locations, pictures) = (1, usize::MAX, 60);
        let mut job =
            Self { form, folder, scene, seed, locations, pictures, scale, score: None, truth: false };

        while let Some(key) = args.next() {
            if key == "--truth" {
                job.truth = true;
                continue;
            }
            let value = args.next().ok_or_else(|| format!("{key} wants a value"))?;
            match &*key {
                "--scene" => job.scene = value,
                "--seed" => job.seed = value.parse()?,
                "--locations" => job.locations = value.parse()?,
                "--pictures" => job.pictures = value.parse()?,
                "--scale" => job.scale = value.parse()?,
                "--score" => job.score = Some(value.into()),
                other => return Err(format!("{other} is no option. {USAGE}").into()),
            }
        }
        Ok(job)
    }

    fn camera(&self) -> DepthCamera {
        let camera = match &*self.form {
            "matterport" => DepthCamera::turntable(),
            _ => DepthCamera::default(),
        };
        DepthCamera { seed: self.seed, ..camera.scaled(self.scale) }
    }

    fn scanner(&self) -> LaserScanner {
        let scanner = LaserScanner::default();
        let [columns, rows] =
            [scanner.columns, scanner.rows].map(|side| (f64::from(side) * self.scale).round() as u32);
        LaserScanner { columns, rows, seed: self.seed, ..scanner }
    }

    fn path(&self, target: &ScanTarget<'_>, locations: &[ScanLocation]) -> Vec<Pose> {
        locations
            .iter()
            .flat_map(|l| target.hand_held_poses(l, self.pictures))
            .collect()
    }

    fn write(&self, target: &ScanTarget<'_>, locations: &[ScanLocation]) -> Result<(), Box<dyn Error>> {
        let folder: &Path = &self.folder;
        std::fs::create_dir_all(folder)?;
        let go_on = || true;
        let poses = || self.path(target, locations);
        match &*self.form {
            "matterport" => target.write_matterport(folder, locations, &self.camera(), go_on)?,
            "tum" => target.write_tum(folder, &poses(), &self.camera(), go_on)?,
            "scannet" => target.write_scannet(folder, &poses(), &self.camera(), go_on)?,
            "ptx" => target.write_ptx(&folder.join("scan.ptx"), locations, &self.scanner(), go_on)?,
            "e57" => target.write_e57(&folder.join("scan.e57"), locations, &self.scanner(), 2048, go_on)?,
            other => return Err(format!("{other} is no form. {USAGE}").into()),
        }
        Ok(())
    }

    fn views(&self, target: &ScanTarget<'_>, locations: &[ScanLocation]) -> Vec<View> {
        let camera = self.camera();
        match &*self.form {
            "ptx" | "e57" => locations.iter().map(|l| View::of_laser(l, &self.scanner())).collect(),
            "matterport" => {
                let stops = locations.iter().flat_map(turntable_poses);
                stops.map(|stop| View::of_camera(&stop.pose, &camera)).collect()
            }
            _ => {
                let poses = self.path(target, locations);
                poses.iter().map(|pose| View::of_camera(pose, &camera)).collect()
            }
        }
    }
}

fn named_scene(name: &str, seed: u64) -> Result<AnnotatedScene, Box<dyn Error>> {
    if name.ends_with(".obj") {
        return scanned(Path::new(name));
    }
    let building = match name {
        "demo" => Building::demo(),
        "office" => {
            let demo = Building::demo();
            Building { rooms: demo.rooms[..1].to_vec(), locations: demo.locations[..1].to_vec(), ..demo }
        }
        "two-storeys" => Building::two_storeys(),
        area if area.starts_with("area_") => {
            Building::generate(&BuildingOptions::area(area[5..].parse()?, seed)?)?
        }
        rooms => Building::generate(&BuildingOptions::drawn(rooms.parse()?, seed))?,
    };
    Ok(building.build()?)
}

/// A mesh that was scanned before, as a scene of one wall.
fn scanned(mesh: &Path) -> Result<AnnotatedScene, Box<dyn Error>> {
    let cameras = read_cameras(&mesh.with_file_name("cameras.csv"))?;
    let locations = cameras.into_iter().map(|camera| {
        let forward = camera.pose.forward();
        // Headings are 0 along +Y and grow to the left.
        let yaw_rad = f64::atan2(-forward.x, forward.y);
        ScanLocation { uuid: camera.uuid, position: camera.pose.location, yaw_rad }
    });
    let mesh = read_mesh(mesh, UpAxis::Y)?.mesh;
    let room = Room { room_type: RoomType::OFFICE, number: 1 };
    Ok(AnnotatedScene {
        instance_of_face: vec![0; mesh.faces().len()],
        instances: vec![Instance { class: Class::WALL, number: 1, room }],
        mesh,
        locations: locations.collect(),
        title: "A mesh".to_owned(),
    })
}

/// What stands under a table ends at this share of its height.
const TOP: f32 = 0.85;

/// Surfaces are upright below this slope of their normals.
const UPRIGHT: f32 = 0.5;

/// A distance at which a surface is kept, metres.
const KEPT_M: f32 = 0.01;

/// Returns the shares of doors, and of what stands under tables, that were seen and are near a mesh. NaN if
/// the scene has none.
fn kept(scene: &AnnotatedScene, truth: &Truth<'_>, mesh: &TriMesh) -> [f64; 2] {
    let mut heights = vec![[f32::INFINITY, f32::NEG_INFINITY]; scene.instances.len()];
    for (face, instance) in (0..).zip(&scene.instance_of_face) {
        let [low, high] = &mut heights[*instance as usize];
        for corner in scene.mesh.triangle(face) {
            (*low, *high) = (low.min(corner.z), high.max(corner.z));
        }
    }

    let samples = truth.samples();
    let mut counts = [[0_usize; 2]; 2];
    let measured = samples.positions.iter().zip(&samples.faces).zip(truth.distances(mesh));
    for (((place, face), distance_m), _) in measured.zip(truth.seen()).filter(|(_, seen)| *seen) {
        let instance = scene.instance_of_face[*face as usize] as usize;
        let [low, high] = heights[instance];
        let is_leg = || scene.mesh.normal(*face).z.abs() < UPRIGHT && place.z < low + TOP * (high - low);
        let kind = match scene.instances[instance].class {
            Class::DOOR => 0,
            Class::TABLE if is_leg() => 1,
            _ => continue,
        };
        counts[kind][0] += usize::from(distance_m < KEPT_M);
        counts[kind][1] += 1;
    }
    counts.map(|[kept, seen]| kept as f64 / seen as f64)
}

fn json(scores: &MeshScores, kept: [f64; 2]) -> String {
    let at = scores.at.iter().map(|at| {
        let millimetres = at.distance_m * 1000.0;
        let (p, r, f) = (at.precision, at.recall, at.f_score);
        format!("\"{millimetres:.0} mm\": {{\"precision\": {p:.4}, \"recall\": {r:.4}, \"f_score\": {f:.4}}}")
    });
    let [doors, legs] = kept.map(|share| match share.is_nan() {
        true => "null".to_owned(),
        false => format!("{share:.4}"),
    });
    let (accuracy, completeness) = (&scores.accuracy, &scores.completeness);
    format!(
        "{{{}, \"accuracy_mean_mm\": {:.2}, \"accuracy_median_mm\": {:.2}, \"completeness_mean_mm\": {:.2}, \
         \"completeness_median_mm\": {:.2}, \"normal_consistency\": {:.4}, \"flipped\": {:.4}, \
         \"closed_sight\": {:.4}, \"seen_share\": {:.4}, \"doors\": {doors}, \"legs\": {legs}}}",
        at.collect::<Vec<_>>().join(", "),
        accuracy.mean_m * 1000.0,
        accuracy.median_m * 1000.0,
        completeness.mean_m * 1000.0,
        completeness.median_m * 1000.0,
        scores.normals.consistency,
        scores.normals.flipped,
        scores.closed_sight,
        scores.seen_share
    )
}
