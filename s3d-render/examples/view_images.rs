//! Times the six images of a view, made from its hits again and again, to compare two states of the project:
//!
//! ```text
//! cargo run --release -p s3d-render --example view_images -- scan-like|copyroom|office|fine-textures
//! ```
//!
//! For every input line it makes the images of nine views of 1080², and prints a line with the milliseconds
//! of each. With that, `bench/states.py` lets two programs take turns of a fraction of a second,
//! so that a busy machine disturbs both alike. The scenes are the same as in the bench `shade`.

#[path = "../benches/common/mod.rs"]
mod common;

use s3d_geom::{Camera, NormalAxes};
use s3d_render::{
    Hits, MipMaps, Modalities, Scene, Shading, TextureFilter, ViewImages, cast, view_images_into,
};
use std::error::Error;
use std::time::Instant;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args()
        .nth(1)
        .ok_or("usage: view_images scan-like|copyroom|office|fine-textures")?;
    let (mesh, location) = common::shaded_scene(&name).ok_or_else(|| format!("no scene {name} here"))?;

    let scene = Scene::new(&mesh);
    let mip_maps = MipMaps::new(&mesh);
    let index: Vec<u32> = (0..mesh.faces().len() as u32).collect();
    let color: Vec<[u8; 3]> = index.iter().map(|f| [*f as u8, (f >> 8) as u8, 7]).collect();
    let shading = Shading {
        scene: &scene,
        mip_maps: &mip_maps,
        filter: TextureFilter::default(),
        normal_axes: NormalAxes::Paper,
        index_of_face: &index,
        color_of_face: &color,
    };

    let views = common::views(location, 1080);
    let shots: Vec<(Camera, Hits)> = views
        .into_iter()
        .map(|camera| (camera, cast(&scene, &camera)))
        .collect();

    let mut images = ViewImages::default();
    for line in std::io::stdin().lines() {
        line?;
        let mut milliseconds = Vec::new();
        for (camera, hits) in &shots {
            let started = Instant::now();
            view_images_into(&shading, hits, camera, Modalities::ALL, &mut images);
            milliseconds.push(format!("{:.4}", started.elapsed().as_secs_f64() * 1e3));
        }
        println!("{}", milliseconds.join(" "));
    }
    Ok(())
}
