//! Renders a view and a panorama of a mesh, and writes every modality as PNG:
//!
//! ```text
//! cargo run --release -p s3d-render --example look -- FOLDER [MESH.obj X Y Z [YAW_DEG]]
//! ```
//!
//! The mesh is an OBJ file with Y up, seen from (X, Y, Z) in the Z-up world. Without one, a generated room is
//! rendered.

#[path = "../benches/common/mod.rs"]
mod common;

use s3d_geom::glam::{DVec3, dvec3};
use s3d_geom::{Camera, Pose, Raster};
use s3d_render::{MipMaps, Normals, Scene};
use std::error::Error;
use std::path::Path;

#[allow(clippy::print_stderr)]
fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let folder = Path::new(args.first().ok_or("usage: look FOLDER [MESH.obj X Y Z [YAW_DEG]]")?);
    let number =
        |k: usize| -> Result<f64, Box<dyn Error>> { Ok(args.get(k).ok_or("X Y Z are missing")?.parse()?) };
    let (mesh, location): (_, DVec3) = match args.get(1) {
        Some(path) => (common::read_obj(Path::new(path)), dvec3(number(2)?, number(3)?, number(4)?)),
        None => (s3d_synth::scenes::classroom(100_000), s3d_synth::scenes::CLASSROOM_LOCATION),
    };
    let yaw = if args.len() > 5 { number(5)?.to_radians() } else { 0.0 };
    std::fs::create_dir_all(folder)?;

    let scene = Scene::new(&mesh);
    let mip_maps = MipMaps::new(&mesh);
    let per_face: Vec<u32> = (0..mesh.faces().len() as u32).collect();
    let pose = Pose::level(location, yaw);
    let views = [
        ("view", Camera::perspective(pose, 75f64.to_radians(), 1080, 1080)),
        ("pano", Camera::equirectangular(pose, 4096)),
    ];

    for (name, camera) in &views {
        let hits = s3d_render::cast(&scene, camera);
        let save = |what: &str, image: &Raster<[u8; 3]>| {
            let path = folder.join(format!("{name}_{what}.png"));
            let bytes = image.pixels().as_flattened();
            image::save_buffer(path, bytes, image.width(), image.height(), image::ColorType::Rgb8)
        };
        save("rgb", &s3d_render::rgb_image(&scene, &mip_maps, &hits, camera))?;
        save("normal", &s3d_render::normal_image(&scene, &hits, camera, Normals::Flat))?;
        save("face", &s3d_render::index_image(&hits, &per_face))?;

        let depth = s3d_render::depth_image(&hits);
        let bytes: Vec<u8> = depth.pixels().iter().flat_map(|d| d.to_ne_bytes()).collect();
        let path = folder.join(format!("{name}_depth.png"));
        image::save_buffer(path, &bytes, depth.width(), depth.height(), image::ColorType::L16)?;

        let bytes: Vec<u8> = hits.depth.pixels().iter().flat_map(|d| d.to_le_bytes()).collect();
        std::fs::write(folder.join(format!("{name}_depth.f32")), bytes)?;
        eprintln!("{name}: {:.1} % of the pixels see the mesh", 100.0 * s3d_render::coverage(&hits));
    }
    Ok(())
}
