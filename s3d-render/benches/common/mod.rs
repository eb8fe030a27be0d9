//! Meshes that the benches, examples and tests share: the scenes of s3d-synth, and a plain reader of textured
//! OBJ files.
#![allow(dead_code, unreachable_pub)]

use s3d_geom::glam::{DVec3, dvec3, vec2, vec3};
use s3d_geom::{Camera, Material, MeshParts, NO_INDEX, Pose, Raster, Texture, TriMesh};
use s3d_synth::scenes::{CLASSROOM_LOCATION, classroom, scan_like};
use std::path::{Path, PathBuf};

/// Reads the v, vt and f lines of an OBJ file with Y up, and the picture `map_Kd` of the material file next
/// to it.
pub fn read_obj(path: &Path) -> TriMesh {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut parts = MeshParts::default();

    for line in text.lines() {
        let mut words = line.split_whitespace();
        let tag = words.next();
        let words: Vec<&str> = words.collect();
        let number = |k: usize| words[k].parse::<f32>().expect("a number");
        match tag {
            Some("v") => parts.positions.push(vec3(number(0), -number(2), number(1))),
            Some("vt") => parts.uvs.push(vec2(number(0), number(1))),
            Some("f") => {
                let corner = |word: &str| {
                    let mut indices = word.split('/').map(|w| w.parse::<u32>().map_or(NO_INDEX, |i| i - 1));
                    (indices.next().unwrap_or(NO_INDEX), indices.next().unwrap_or(NO_INDEX))
                };
                for k in 1..words.len() - 1 {
                    let corners = [words[0], words[k], words[k + 1]].map(corner);
                    parts.faces.push(corners.map(|c| c.0));
                    parts.face_uvs.push(corners.map(|c| c.1));
                }
            }
            _ => {}
        }
    }

    let picture = std::fs::read_to_string(path.with_extension("mtl"))
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.trim_start().starts_with("map_Kd"))?;
            Some(path.with_file_name(line.split_whitespace().nth(1)?))
        });

    if let Some(picture) = picture {
        let image = image::open(&picture)
            .unwrap_or_else(|e| panic!("{}: {e}", picture.display()))
            .to_rgb8();
        let (width, height) = image.dimensions();
        let image = Raster::from_vec(width, height, image.pixels().map(|p| p.0).collect());
        parts.textures = vec![Texture { name: "picture".into(), image, wrap: Default::default() }];
        parts.materials = vec![Material { name: "picture".into(), color: [128; 3], texture: Some(0) }];
        parts.face_materials = vec![0; parts.faces.len()];
    }

    TriMesh::new(parts).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Returns the real scan next to the project: its OBJ file and the place of its first scanner. Returns `None`
/// if it is not there.
pub fn real_scan() -> Option<(PathBuf, DVec3)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scans/copyroom/rgb.obj");
    path.exists().then_some((path, dvec3(13.1, 9.65, 1.4)))
}

/// Returns a scene whose images are timed, and the place of the viewer. `scan-like` is generated. `copyroom`
/// is the real scan next to the project. `office` is the OBJ file with Z up that `S3D_BENCH_OFFICE` names.
/// `fine-textures` has about three texels for one pixel of the image, which keeps the filter busy. Returns
/// `None` if the scene is not there.
pub fn shaded_scene(name: &str) -> Option<(TriMesh, DVec3)> {
    match name {
        "scan-like" => Some((scan_like(300_000, 1), dvec3(3.0, 2.5, 1.5))),
        "copyroom" => real_scan().map(|(path, location)| (read_obj(&path), location)),
        "office" => {
            let path = PathBuf::from(std::env::var_os("S3D_BENCH_OFFICE")?);
            Some((z_up(&read_obj(&path)), dvec3(4.03, 3.07, 1.5)))
        }
        "fine-textures" => Some((classroom(285_000), CLASSROOM_LOCATION)),
        _ => None,
    }
}

/// Turns a mesh of [`read_obj`] whose file has Z up.
pub fn z_up(mesh: &TriMesh) -> TriMesh {
    let mut parts = mesh.clone().into_parts();
    parts.positions.iter_mut().for_each(|p| *p = vec3(p.x, p.z, -p.y));
    TriMesh::new(parts).expect("it was a mesh")
}

/// Returns views all around from one place: level, up and down.
pub fn views(location: DVec3, size: u32) -> Vec<Camera> {
    let level = Pose::level(location, 0.13);
    (0..9)
        .map(|k| {
            let yaw = (k as f64) * 0.7;
            let pitch = [0.0, 0.26, -0.26][k % 3];
            Camera::perspective(level.turned(yaw, pitch), [75f64, 60.0, 40.0][k / 3].to_radians(), size, size)
        })
        .collect()
}
