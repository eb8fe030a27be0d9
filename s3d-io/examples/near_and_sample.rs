//! How many points a second and core find their nearest face, and how many are sampled with their colour, on
//! a mesh of yours? Can write mesh, points and answers as plain columns, for another library to be timed on
//! the same.
//!
//! `cargo run --release -p s3d-io --example near_and_sample -- MESH [y|z] [POINTS] [FOLDER]`; MESH is a file,
//! or `scan_like:300000` for a generated one. bench/near_sample_peers.py compares with others.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

use s3d_geom::glam::Vec3;
use s3d_geom::{Density, FaceColor, Nearest, NearestFaces, PointCloud, SurfaceSampler, TriMesh};
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_synth::scenes::scan_like;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let Some(name) = args.first() else {
        return Err("usage: near_and_sample MESH|scan_like:FACES [y|z] [POINTS] [FOLDER]".into());
    };
    let up = if args.get(1).is_some_and(|up| up == "z") {
        UpAxis::Z
    } else {
        UpAxis::Y
    };
    let points: u64 = args.get(2).map_or(Ok(1_000_000), |n| n.parse())?;
    let mesh = match name.strip_prefix("scan_like:") {
        Some(faces) => scan_like(faces.parse()?, 1),
        None => read_mesh(Path::new(name), up)?.mesh,
    };
    let pool = rayon_pool()?;
    println!("{name}: {} faces, {:.0} m²", mesh.faces().len(), mesh.total_area());

    let sampler = SurfaceSampler::new(&mesh, Density::Total(points), 1);
    let mut cloud = PointCloud::default();
    let per_core = rate(points, || pool.install(|| sampler.sample(0..points, &mut cloud)));
    println!("sampling with colour  {per_core:.2} Mpt/s per core");

    let mut scan = cloud.positions.clone();
    for (i, (p, &face)) in scan.iter_mut().zip(&cloud.faces).enumerate() {
        *p += mesh.normal(face) * if hash(i) & 1 == 0 { 0.005 } else { -0.005 };
    }
    let start = Instant::now();
    let faces = NearestFaces::new(&mesh);
    println!("nearest, set-up       {:.3} s", start.elapsed().as_secs_f64());
    let mut order: Vec<usize> = (0..scan.len()).collect();
    order.sort_unstable_by_key(|&i| hash(i));
    let shuffled: Vec<Vec3> = order.iter().map(|&i| scan[i]).collect();
    let (mut in_order, mut out): (Vec<Nearest>, Vec<Nearest>) = Default::default();
    let per_core = rate(points, || pool.install(|| faces.nearest_many(&scan, &mut in_order)));
    println!("nearest, in order     {per_core:.2} Mpt/s per core");
    let per_core = rate(points, || pool.install(|| faces.nearest_many(&shuffled, &mut out)));
    println!("nearest, shuffled     {per_core:.2} Mpt/s per core");
    if order.iter().zip(&out).any(|(&i, n)| in_order[i] != *n) {
        return Err("the order of points changes their faces".into());
    }
    match args.get(3) {
        Some(folder) => write(Path::new(folder), &mesh, &scan, &shuffled, &in_order),
        None => Ok(()),
    }
}

/// One thread: its time is a core's.
fn rayon_pool() -> Result<rayon::ThreadPool, rayon::ThreadPoolBuildError> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build()
}

/// Millions of points a second of a core's time: the median of five measurements after a run that warms up.
fn rate(points: u64, mut work: impl FnMut()) -> f64 {
    work();
    // The wall's time where the system does not tell the process's.
    let origin = Instant::now();
    let now = || user_seconds().unwrap_or_else(|| origin.elapsed().as_secs_f64());
    let mut seconds: Vec<f64> = (0..5)
        .map(|_| {
            let (start, mut runs) = (now(), 0.0);
            loop {
                work();
                runs += 1.0;
                let passed = now() - start;
                // Linux counts in hundredths of a second.
                if passed >= 0.4 {
                    return passed / runs;
                }
            }
        })
        .collect();
    seconds.sort_unstable_by(f64::total_cmp);
    points as f64 * 1e-6 / seconds[2]
}

/// The time that this process has spent in its own code, where the system tells it as Linux does.
fn user_seconds() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // Fields 3 and later stand after the name, which is in parentheses; user time is the 14th.
    let ticks: f64 = stat.rsplit_once(')')?.1.split_whitespace().nth(11)?.parse().ok()?;
    Some(ticks / 100.0)
}

fn hash(i: usize) -> u64 {
    let mut x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x ^ (x >> 31)
}

/// Little-endian columns: vertices, faces, texture coordinates of corners, the first texture, points,
/// answers.
fn write(
    folder: &Path,
    mesh: &TriMesh,
    scan: &[Vec3],
    shuffled: &[Vec3],
    nearest: &[Nearest],
) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let f32s = |values: &mut dyn Iterator<Item = f32>| values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let column = |points: &[Vec3]| f32s(&mut points.iter().flat_map(|p| p.to_array()));
    fs::write(folder.join("vertices.f32"), column(mesh.positions()))?;
    let indices: Vec<u8> = mesh.faces().iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(folder.join("faces.u32"), indices)?;
    let uvs = (0..mesh.faces().len() as u32).flat_map(|face| match mesh.color_of(face) {
        FaceColor::Texture(_, _, uvs) => {
            uvs.map(|uv| uv.to_array()).into_iter().flatten().collect::<Vec<_>>()
        }
        _ => vec![0.0; 6],
    });
    fs::write(folder.join("uvs.f32"), f32s(&mut { uvs }))?;
    let image = mesh.textures().first().map(|t| &t.image);
    let size = image.map_or([0, 0], |i| [i.width(), i.height()]);
    fs::write(folder.join("texture.rgb"), image.map_or(&[][..], |i| i.pixels().as_flattened()))?;
    fs::write(folder.join("texture.txt"), format!("{} {}\n", size[0], size[1]))?;
    fs::write(folder.join("points.f32"), column(scan))?;
    fs::write(folder.join("shuffled.f32"), column(shuffled))?;
    let answers: Vec<u8> = nearest.iter().flat_map(|n| n.face.to_le_bytes()).collect();
    fs::write(folder.join("nearest.u32"), answers)?;
    fs::write(folder.join("distances.f32"), f32s(&mut nearest.iter().map(|n| n.distance_m)))?;
    Ok(())
}
