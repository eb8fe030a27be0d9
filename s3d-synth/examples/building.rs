//! Writes the scan of a building that `s3d export` reads: that of the demo.
//!
//! `cargo run --release -p s3d-synth --example building -- FOLDER`
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use s3d_synth::{Building, ScanOptions};
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: building FOLDER")?);
    let scene = Building::demo().build()?;
    let file = scene.write_scan(&folder, &ScanOptions::default(), || true)?;
    println!("{}: {} faces", file.display(), scene.mesh.faces().len());
    Ok(())
}
