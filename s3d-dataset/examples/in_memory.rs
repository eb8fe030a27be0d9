//! A data set of a mesh, labels and a camera that are made here: no file is read.
//! `cargo run --release -p s3d-dataset --example in_memory OUT`

#![allow(clippy::print_stdout, clippy::print_stderr)]

use s3d_dataset::export::MemoryScene;
use s3d_dataset::{Context, Export, ExportOptions};
use s3d_geom::glam::{Vec3, dvec3, vec3};
use s3d_geom::{MeshParts, Pose, TriMesh};
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::Annotations;
use s3d_label::{Class, Label};
use std::path::Path;

/// The coloured corners of a room of 4 × 3 × 2.5 m, and its six walls seen from inside, each of two
/// triangles.
fn room() -> Result<TriMesh, s3d_geom::MeshError> {
    let corner = |i: u32| vec3((i & 1) as f32 * 4.0, (i >> 1 & 1) as f32 * 3.0, (i >> 2) as f32 * 2.5);
    let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let positions: Vec<Vec3> = (0..8).map(corner).collect();
    let colors = (0..8).map(|i| [30 * i, 200, 100]).collect();
    TriMesh::new(MeshParts { positions, faces, colors, ..MeshParts::default() })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::env::args().nth(1).ok_or("give a folder")?;
    let mesh = room()?;
    let label = |class, instance| Label { class, instance, room: "office_1".parse().unwrap(), area: 1 };
    let labels: Vec<Label> = [(Class::FLOOR, 1), (Class::CEILING, 1)]
        .into_iter()
        .chain((1..=4).map(|wall| (Class::WALL, wall)))
        .map(|(class, instance)| label(class, instance))
        .collect();
    // Two triangles a label.
    let label_of_face: Vec<u32> = (0..12).map(|face| face / 2).collect();
    let annotations = Annotations::from_face_labels(Path::new("labels"), &mesh, &labels, &label_of_face)?;
    let pose = Pose::level(dvec3(2.0, 1.5, 1.4), 0.0);
    let locations = vec![ScanLocation { uuid: "0".repeat(32), pose, line: 0 }];

    let scene = MemoryScene { area: 1, mesh, annotations: Some(annotations), locations };
    let options = ExportOptions { views: 4, size: 128, pano_width: 256, ..ExportOptions::default() };
    let made = Export::new([scene]).options(options).run(&out, &Context::default())?;
    if let Some(made) = made {
        println!("{}: {} panorama, {} views", out, made.tally.panoramas.images, made.tally.views.images);
    }
    Ok(())
}
