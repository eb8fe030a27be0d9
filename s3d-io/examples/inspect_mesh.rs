//! Prints the content of a mesh file as the tools of the data set see it: size, area, textures and repairs.
//!
//! `cargo run --release -p s3d-io --example inspect_mesh -- scan/rgb.obj [y|z]`. The last word is the axis
//! that points up, y by default.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

use s3d_io::mesh::{UpAxis, read_mesh};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (path, up) = match args.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        [path] | [path, "y"] => (Path::new(*path), UpAxis::Y),
        [path, "z"] => (Path::new(*path), UpAxis::Z),
        _ => {
            eprintln!("usage: inspect_mesh MESH [y|z]");
            return ExitCode::from(2);
        }
    };

    let start = Instant::now();
    let file = match read_mesh(path, up) {
        Ok(file) => file,
        Err(e) => {
            eprintln!("{e}");
            return ExitCode::FAILURE;
        }
    };

    let seconds = start.elapsed().as_secs_f64();
    let mesh = &file.mesh;
    let parts = mesh.parts();
    let size = mesh.aabb().size();
    println!("{} read in {seconds:.3} s", path.display());
    println!("  vertices   {}", mesh.positions().len());
    println!(
        "  faces      {} ({} polygons cut into triangles)",
        mesh.faces().len(),
        file.polygons_triangulated
    );
    println!("  size       {:.3} × {:.3} × {:.3} m, Z up", size.x, size.y, size.z);
    println!("  area       {:.3} m²", mesh.total_area());
    println!(
        "  colours    {}",
        if parts.colors.is_empty() {
            "none at vertices"
        } else {
            "at vertices"
        }
    );
    println!(
        "  normals    {}",
        if parts.face_normals.is_empty() {
            "none"
        } else {
            "at corners"
        }
    );

    let textured = mesh.materials().iter().filter(|m| m.texture.is_some()).count();
    println!("  materials  {}, {textured} of them textured", mesh.materials().len());
    for (texture, file) in mesh.textures().iter().zip(&file.texture_files) {
        let kind = file.as_ref().map_or("altered", |f| f.extension);
        println!(
            "  texture    {} {} × {} ({kind})",
            texture.name,
            texture.image.width(),
            texture.image.height()
        );
    }
    for warning in &file.warnings {
        println!("  warning    {warning}");
    }
    ExitCode::SUCCESS
}
