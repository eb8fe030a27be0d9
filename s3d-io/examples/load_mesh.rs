//! Measures how long a mesh with its textures takes to load, and how much memory. Prints one line of JSON for
//! bench/load_peers.py, which compares it with other readers.
//!
//! `cargo run --release -p s3d-io --example load_mesh -- scan/rgb.obj`; `RAYON_NUM_THREADS` sets the threads.
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use s3d_io::mesh::{UpAxis, read_mesh};
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: load_mesh MESH")?;
    let before = user_seconds().unwrap_or(0.0);
    let start = Instant::now();
    let file = read_mesh(Path::new(&path), UpAxis::Y)?;
    let wall = start.elapsed().as_secs_f64();
    // Systems other than Linux have no processor time and no memory here; the wall time counts instead.
    let user = user_seconds().map_or(wall, |after| after - before);
    let faces = file.mesh.faces().len();
    let textures = file.mesh.textures().len();
    let mib = peak_mib().unwrap_or(0.0);
    println!(
        "RESULT {{\"wall\": {wall:.4}, \"user\": {user:.4}, \"faces\": {faces}, \"textures\": {textures}, \
         \"mib\": {mib:.1}}}"
    );
    Ok(())
}

/// Returns the user time of this process in seconds, which Linux tells in hundredths.
fn user_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The third field follows the name, which is in parentheses. User time is the 14th.
    let ticks: f64 = stat.rsplit_once(')')?.1.split_whitespace().nth(11)?.parse().ok()?;
    Some(ticks / 100.0)
}

fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<f64>().ok()? / 1024.0)
}
