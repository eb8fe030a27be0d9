//! Writes a scan of any size, to see what an export of it takes: see `s3d_synth::scenes::LargeScan`.
//!
//! `cargo run --release -p s3d-synth --example large_scene -- FOLDER [--faces N] [--materials N] [--labels N]
//! [--points N] [--cameras N] [--texture PX] [--form ply|npy|s3dis]`; `s3d-cli/tests/reliability/curves.py`
//! makes and exports a row of them.
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use s3d_synth::scenes::{LargeScan, PointFormat};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let folder = args
        .next()
        .filter(|f| !f.starts_with('-'))
        .ok_or("usage: large_scene FOLDER [--points N] …")?;

    let mut scan = LargeScan::default();
    while let Some(key) = args.next() {
        let value = args.next().ok_or_else(|| format!("{key} wants a value"))?;
        match &*key {
            "--faces" => scan.faces = value.parse()?,
            "--materials" => scan.materials = value.parse()?,
            "--labels" => scan.labels = value.parse()?,
            "--points" => scan.points = value.parse()?,
            "--cameras" => scan.cameras = value.parse()?,
            "--texture" => scan.texture_px = value.parse()?,
            "--form" => {
                scan.format = match &*value {
                    "ply" => PointFormat::Ply,
                    "npy" => PointFormat::Npy,
                    "s3dis" => PointFormat::S3dis,
                    other => return Err(format!("{other}: a form is ply, npy or s3dis").into()),
                }
            }
            other => return Err(format!("{other} is no option").into()),
        }
    }

    let written = scan.write(Path::new(&folder))?;

    println!(
        "{folder}: {} faces, {} materials, {} labels in {} rooms, {} points, {} scan locations, {:.0} m²",
        written.faces,
        scan.materials,
        written.labels,
        written.rooms,
        scan.points,
        scan.cameras,
        written.area_m2
    );
    Ok(())
}
