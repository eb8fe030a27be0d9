//! Measures the visibility pass and writes what it sees, for a comparison with other ray casters:
//!
//! ```text
//! cargo run --release -p s3d-render --example visibility -- MESH X Y Z
//!     [--up y|z] [--rounds N] [--threads N] [--dump DIR]
//! ```
//!
//! MESH is an OBJ file (Y up, unless `--up z`) or `scan-like:FACES`, a generated scan. From (X, Y, Z) in the
//! Z-up world the program casts 72 views of 1080² (24 yaws at the pitches 0°, −15° and 15°, 75° wide)
//! and a panorama of 4096 × 2048. It writes the face and depth of every pixel, and prints the rays per
//! second of user time and of wall time: the median of the rounds. The location is rounded to `f32` first, so
//! that ray casters of `f32` start at the same point.
//!
//! With `--dump` it also writes the data that `bench/embree_cast.cpp` needs to cast the same rays
//! and compare. All files are little-endian:
//!
//! - `dump.txt`: vertices, faces, views, their width and height, the panorama's width and height, the origin.
//! - `positions.f32`, `faces.u32`: three numbers a vertex or face.
//! - `views.f64`: nine numbers a view, `corner`, `x_step` and `y_step`. The direction of pixel (i, j) is
//!   corner + x_step·(i + ½) + y_step·(j + ½).
//! - `columns.f64`, `rows.f64`: for the panorama, the cosine and sine of the azimuth c of each column and of
//!   the latitude r of each row. The direction is (r.cos·c.cos, r.cos·c.sin, r.sin).
//! - `view_00.face`, `view_00.depth`, …, `pano.face`, `pano.depth`: `u32` and `f32` by row; 4,294,967,295
//!   and infinity where nothing is hit.

#[path = "../benches/common/mod.rs"]
mod common;

use s3d_geom::glam::{DVec2, DVec3, Vec3, dvec3};
use s3d_geom::{Camera, Pose, Rays};
use s3d_render::{Caster, Hits, Scene};
use s3d_synth::scenes::scan_like;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

const USAGE: &str =
    "usage: visibility MESH.obj|scan-like:FACES X Y Z [--up y|z] [--rounds N] [--threads N] [--dump DIR]";

/// The number of panoramas a round: enough for the kernel's clock of 10 ms.
const PANORAMAS: usize = 8;

struct Options {
    mesh: String,
    origin: DVec3,
    z_up: bool,
    rounds: usize,
    threads: usize,
    dump: Option<PathBuf>,
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn Error>> {
    let options = options()?;
    let mesh = match options.mesh.strip_prefix("scan-like:") {
        Some(faces) => scan_like(faces.parse()?, 1),
        None if options.z_up => common::z_up(&common::read_obj(Path::new(&options.mesh))),
        None => common::read_obj(Path::new(&options.mesh)),
    };

    let started = Instant::now();
    let scene = Scene::new(&mesh);
    println!(
        "{}: {} faces, scene in {:.2} s",
        options.mesh,
        mesh.faces().len(),
        started.elapsed().as_secs_f64()
    );

    let views = views(options.origin);
    let panorama = Camera::equirectangular(Pose::level(options.origin, 0.0), 4096);
    if let Some(folder) = &options.dump {
        dump(folder, &scene, &views, &panorama)?;
    }

    let panoramas = vec![panorama; PANORAMAS];
    let mut view_rates = Vec::new();
    let mut panorama_rates = Vec::new();
    for _ in 0..options.rounds {
        view_rates.push(round(&scene, &views, options.threads)?);
        panorama_rates.push(round(&scene, &panoramas, options.threads)?);
    }

    for (what, mut rates) in [("views", view_rates), ("panorama", panorama_rates)] {
        let mut median = |which: fn(&Rates) -> f64| {
            rates.sort_by(|a, b| which(a).total_cmp(&which(b)));
            which(&rates[rates.len() / 2])
        };
        let core = median(|r| r.core);
        let wall = median(|r| r.wall);
        println!("{what}: {core:.2} Mray/s a core, {wall:.2} Mray/s on {} thread(s)", options.threads);
    }
    Ok(())
}

fn options() -> Result<Options, Box<dyn Error>> {
    let mut plain = Vec::new();
    let mut z_up = false;
    let mut rounds = 3;
    let mut threads = 1;
    let mut dump = None;
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        if !arg.starts_with("--") {
            plain.push(arg);
            continue;
        }
        let value = args.next().ok_or(USAGE)?;
        match (arg.as_str(), value.as_str()) {
            ("--up", up @ ("y" | "z")) => z_up = up == "z",
            ("--rounds", n) => rounds = n.parse()?,
            ("--threads", n) => threads = n.parse()?,
            ("--dump", folder) => dump = Some(PathBuf::from(folder)),
            _ => return Err(USAGE.into()),
        }
    }

    let [mesh, x, y, z] = <[String; 4]>::try_from(plain).map_err(|_| USAGE)?;
    if rounds == 0 || threads == 0 {
        return Err(USAGE.into());
    }

    let coordinate = |text: &str| text.parse::<f32>().map(f64::from);
    let origin = dvec3(coordinate(&x)?, coordinate(&y)?, coordinate(&z)?);
    Ok(Options { mesh, origin, z_up, rounds, threads, dump })
}

fn views(origin: DVec3) -> Vec<Camera> {
    let level = Pose::level(origin, 0.0);
    let view = |k: usize| {
        let from_x = 7.3 + 15.0 * (k % 24) as f64;
        let pitch = [0f64, -15.0, 15.0][k / 24];
        let pose = level.turned((from_x - 90.0).to_radians(), pitch.to_radians());
        Camera::perspective(pose, 75f64.to_radians(), 1080, 1080)
    };
    (0..72).map(view).collect()
}

/// Rates in millions of rays a second: of user time, and of wall time.
struct Rates {
    core: f64,
    wall: f64,
}

/// Casts all images on some threads. Each thread has memory of its own, which it keeps from image to image.
fn round(scene: &Scene<'_>, cameras: &[Camera], threads: usize) -> Result<Rates, Box<dyn Error>> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut caster = Caster::new(scene);
        let mut hits = Hits::default();
        while let Some(camera) = cameras.get(next.fetch_add(1, Ordering::Relaxed)) {
            caster.cast_into(camera, 1, &mut hits);
            std::hint::black_box(&hits);
        }
    };

    let started = Instant::now();
    let user_before = user_seconds()?;
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(work);
        }
        work();
    });
    let wall = started.elapsed().as_secs_f64();
    let user = user_seconds()? - user_before;
    let rays: f64 = cameras
        .iter()
        .map(|c| f64::from(c.width) * f64::from(c.height) * 1e-6)
        .sum();
    Ok(Rates { core: rays / user, wall: rays / wall })
}

/// Returns the user time of this process, in seconds, from Linux's accounts.
fn user_seconds() -> Result<f64, Box<dyn Error>> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    // After the name in parentheses, utime is field 14 of the line, in ticks of 10 ms.
    let fields = stat.rsplit_once(')').ok_or("no name in /proc/self/stat")?.1;
    let ticks: u64 = fields
        .split_whitespace()
        .nth(11)
        .ok_or("no utime in /proc/self/stat")?
        .parse()?;
    Ok(ticks as f64 / 100.0)
}

/// Writes the files of `--dump`.
fn dump(folder: &Path, scene: &Scene<'_>, views: &[Camera], panorama: &Camera) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let mesh = scene.mesh();
    let origin = panorama.pose.location;
    let numbers = format!(
        "{} {}\n{} {} {}\n{} {}\n{} {} {}\n",
        mesh.positions().len(),
        mesh.faces().len(),
        views.len(),
        views[0].width,
        views[0].height,
        panorama.width,
        panorama.height,
        origin.x,
        origin.y,
        origin.z
    );
    std::fs::write(folder.join("dump.txt"), numbers)?;

    let write = |name: &str, bytes: Vec<u8>| std::fs::write(folder.join(name), bytes);
    let doubles = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let corners = mesh.positions().iter().flat_map(Vec3::to_array);
    write("positions.f32", corners.flat_map(f32::to_le_bytes).collect())?;
    write("faces.u32", mesh.faces().iter().flatten().flat_map(|i| i.to_le_bytes()).collect())?;

    let mut parameters = Vec::new();
    for camera in views.iter().chain([panorama]) {
        match camera.rays() {
            Rays::Perspective { x_step, y_step, origin } => {
                parameters.extend([origin, x_step, y_step].iter().flat_map(|v| v.to_array()));
            }
            Rays::Equirectangular { columns, rows } => {
                let flat = |pairs: &[DVec2]| pairs.iter().flat_map(|p| p.to_array()).collect::<Vec<_>>();
                write("columns.f64", doubles(&flat(&columns)))?;
                write("rows.f64", doubles(&flat(&rows)))?;
            }
        }
    }
    write("views.f64", doubles(&parameters))?;

    let mut caster = Caster::new(scene);
    for (k, camera) in views.iter().chain([panorama]).enumerate() {
        let name = if k < views.len() {
            format!("view_{k:02}")
        } else {
            "pano".to_owned()
        };
        let hits = caster.cast(camera);
        let faces = hits.face.pixels().iter().flat_map(|f| f.to_le_bytes());
        let depths = hits.depth.pixels().iter().flat_map(|d| d.to_le_bytes());
        write(&format!("{name}.face"), faces.collect())?;
        write(&format!("{name}.depth"), depths.collect())?;
    }
    Ok(())
}
