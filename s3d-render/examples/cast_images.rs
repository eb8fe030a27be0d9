//! Times casting, again and again, to compare two states of the project:
//!
//! ```text
//! cargo run --release -p s3d-render --example cast_images -- scan-like|copyroom|office|fine-textures
//! ```
//!
//! For every input line it casts nine views of 1080² and a panorama of 2048 × 1024, and prints a line with
//! the milliseconds of each. With that, `bench/states.py` lets two programs take turns. The scenes
//! are the same as in the bench `shade`.

#[path = "../benches/common/mod.rs"]
mod common;

use s3d_geom::{Camera, Pose};
use s3d_render::{Caster, Hits, Scene};
use std::error::Error;
use std::time::Instant;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args()
        .nth(1)
        .ok_or("usage: cast_images scan-like|copyroom|office|fine-textures")?;
    let (mesh, location) = common::shaded_scene(&name).ok_or_else(|| format!("no scene {name} here"))?;

    let scene = Scene::new(&mesh);
    let panorama = Camera::equirectangular(Pose::level(location, 0.0), 2048);
    let cameras: Vec<Camera> = common::views(location, 1080).into_iter().chain([panorama]).collect();
    let mut caster = Caster::new(&scene);
    let mut hits: Vec<Hits> = cameras.iter().map(|camera| caster.cast(camera)).collect();

    for line in std::io::stdin().lines() {
        line?;
        let mut milliseconds = Vec::new();
        for (camera, hits) in cameras.iter().zip(&mut hits) {
            let started = Instant::now();
            caster.cast_into(camera, 1, hits);
            milliseconds.push(format!("{:.4}", started.elapsed().as_secs_f64() * 1e3));
        }
        println!("{}", milliseconds.join(" "));
    }
    Ok(())
}
