//! Writes the scan of a building that `s3d export` reads: the demo's building, the house of two storeys
//! (`house`), or a random one of so many rooms.
//!
//! `cargo run --release -p s3d-synth --example building -- FOLDER [house | ROOMS [SEED]]`
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use s3d_synth::{Building, BuildingOptions, ScanOptions};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let folder = args.first().ok_or("usage: building FOLDER [house | ROOMS [SEED]]")?;
    let seed = args.get(2).map_or(Ok(1), |seed| seed.parse())?;
    let building = match args.get(1) {
        Some(name) if name == "house" => Building::two_storeys(),
        Some(rooms) => Building::generate(&BuildingOptions::drawn(rooms.parse()?, seed))?,
        None => Building::demo(),
    };
    let scene = building.build()?;
    let file = scene.write_scan(Path::new(folder), &ScanOptions::default(), || true)?;
    let faces = scene.mesh.faces().len();
    let things = scene.instances.len();
    println!("{}: {faces} faces, {things} things, {} locations", file.display(), scene.locations.len());
    Ok(())
}
