//! The built-in scene as files, as a scanner and an annotator would have left them.

use crate::error::ScanError;
use crate::scene::{DemoScene, demo_scene};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use s3d_geom::{Density, PointCloud, SurfaceSampler, glam::DQuat};
use s3d_io::{S3disAreaWriter, create_dir, write_bytes, write_rgb_obj};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const AREA: u32 = 1;

const SCENE_FILE: &str = "scene.toml";

/// Annotated points a square metre: about what S3DIS has.
const POINTS_PER_M2: f64 = 3000.0;

/// How far points lie off the surface, at most, in metres.
const NOISE_M: f32 = 0.003;

const SEED: u64 = 20170203;

/// How the scene file begins: what tells the scene from a user's own.
const MARK: &str = "# The built-in scene of s3d";

/// Whether `dir` holds the built-in scene, and may be written again.
pub fn is_demo_scan(dir: &Path) -> bool {
    std::fs::read_to_string(dir.join(SCENE_FILE)).is_ok_and(|text| text.starts_with(MARK))
}

/// Writes the scene into `dir`: textured mesh, annotated points, scan locations, and the scene file that ties them
/// together, whose path is returned.
///
/// `go_on` is asked before each room; where it says no, what was written so far stays.
///
/// # Errors
/// [`ScanError`].
pub fn write_scan(dir: &Path, mut go_on: impl FnMut() -> bool) -> Result<PathBuf, ScanError> {
    let scene = demo_scene();
    create_dir(dir)?;
    write_rgb_obj(dir, &scene.mesh, &[])?;
    write_annotations(&dir.join(format!("Area_{AREA}")), &scene, &mut go_on)?;
    write_bytes(&dir.join("cameras.csv"), camera_table(&scene).as_bytes())?;
    let toml = format!(
        "{MARK}: three rooms and a hallway.\narea = {AREA}\n\n\
         [mesh]\npath = \"rgb.obj\"\nup   = \"y\"\n\n\
         [annotations]\npath = \"Area_{AREA}\"\n\n\
         [cameras]\npath = \"cameras.csv\"\n"
    );
    let path = dir.join(SCENE_FILE);
    write_bytes(&path, toml.as_bytes())?;
    Ok(path)
}

/// The annotated points, with the noise of a scanner.
fn write_annotations(
    dir: &Path,
    scene: &DemoScene,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<(), ScanError> {
    let tree = S3disAreaWriter::create(dir)?;
    let rooms: BTreeSet<&str> = scene.instances.iter().map(|i| i.room).collect();
    let mut noise = ChaCha8Rng::seed_from_u64(SEED);
    let mut cloud = PointCloud::default();
    for room in &rooms {
        if !go_on() {
            return Err(ScanError::Cancelled);
        }
        let mut files = tree.room(room)?;
        for (index, instance) in scene.instances.iter().enumerate().filter(|(_, i)| i.room == *room) {
            let faces: Vec<u32> = (0u32..)
                .zip(&scene.face_instances)
                .filter_map(|(face, of)| (*of == Some(index as u32)).then_some(face))
                .collect();
            let sampler = SurfaceSampler::over_faces(
                &scene.mesh,
                faces,
                Density::PerM2(POINTS_PER_M2),
                SEED + index as u64,
            );
            sampler.sample(0..sampler.len(), &mut cloud);
            for (position, face) in cloud.positions.iter_mut().zip(&cloud.faces) {
                *position += scene.mesh.normal(*face) * noise.random_range(-NOISE_M..NOISE_M);
            }
            let mut file = files.instance(instance.class, instance.number)?;
            file.append(&cloud.positions, &cloud.colors)?;
            file.finish()?;
        }
        files.finish()?;
    }
    let angles: Vec<(String, u32)> = rooms.iter().map(|r| ((*r).to_owned(), 0)).collect();
    tree.alignment(&angles)?;
    Ok(())
}

/// `uuid,x,y,z,qx,qy,qz,qw` a line.
fn camera_table(scene: &DemoScene) -> String {
    let mut text = String::new();
    for l in &scene.locations {
        let (p, q) = (l.position, DQuat::from_rotation_z(l.yaw_rad));
        let _ = writeln!(
            text,
            "{},{:.6},{:.6},{:.6},{:.9},{:.9},{:.9},{:.9}",
            l.uuid, p.x, p.y, p.z, q.x, q.y, q.z, q.w
        );
    }
    text
}
