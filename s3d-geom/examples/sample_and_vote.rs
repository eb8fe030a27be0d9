//! From a mesh to annotations. The program samples a table in a room into a cloud, adds noise, finds the
//! faces nearest to the points, and sorts the points of the table into voxels.
//!
//! `cargo run --release --example sample_and_vote -- [points per m²]`

use s3d_geom::glam::{Vec3, vec3};
use s3d_geom::{
    Density, FootprintBuilder, FootprintOptions, NearestFaces, PointCloud, SurfaceSampler, TriMesh,
    VoxelGrid, Voxels,
};
use std::error::Error;
use std::io::Write;

/// Adds a rectangle as two triangles, from a corner and two edges.
fn rectangle(positions: &mut Vec<Vec3>, faces: &mut Vec<[u32; 3]>, corner: Vec3, right: Vec3, up: Vec3) {
    let first = positions.len() as u32;
    positions.extend([corner, corner + right, corner + right + up, corner + up]);
    faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

fn main() -> Result<(), Box<dyn Error>> {
    let per_m2 = std::env::args().nth(1).map_or(Ok(5000.0), |arg| arg.parse::<f64>())?;
    if !(per_m2 >= 0.0 && per_m2.is_finite()) {
        return Err(format!("{per_m2} points per m²: a density is at least 0").into());
    }

    // Faces 0 and 1 are a floor of 4 × 5 m, faces 2 and 3 a table top, and faces 4 and 5 the leg of the
    // table.
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    rectangle(&mut positions, &mut faces, Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 5.0);
    rectangle(&mut positions, &mut faces, vec3(1.0, 1.0, 0.75), Vec3::X * 1.6, Vec3::Y * 0.8);
    rectangle(&mut positions, &mut faces, vec3(1.7, 1.4, 0.0), Vec3::X * 0.2, Vec3::Z * 0.75);
    let mesh = TriMesh::from_faces(positions, faces)?;

    let sampler = SurfaceSampler::new(&mesh, Density::PerM2(per_m2), 1);
    let table = sampler.points_before(2)..sampler.len();
    let mut cloud = PointCloud::default();
    sampler.sample(0..sampler.len(), &mut cloud);

    // A scanner is off by some millimetres.
    let measured: Vec<Vec3> = cloud
        .positions
        .iter()
        .enumerate()
        .map(|(i, &p)| p + Vec3::Z * ((i % 9) as f32 - 4.0) * 0.001)
        .collect();

    let mut votes = Vec::new();
    NearestFaces::new(&mesh).nearest_many(&measured, &mut votes);
    let right = votes
        .iter()
        .zip(&cloud.faces)
        .filter(|(vote, face)| vote.face == **face)
        .count();

    let mut footprint = FootprintBuilder::new(FootprintOptions::default());
    measured.iter().for_each(|&p| footprint.add(p));

    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{} points on {:.2} m², {} of them on the table",
        cloud.len(),
        mesh.total_area(),
        table.end - table.start
    )?;
    writeln!(out, "{right} vote for the face that they were drawn from")?;
    writeln!(out, "floor: {:.2} m²", footprint.finish().area_m2)?;

    if let Some(voxels) = Voxels::from_points(&measured[table.start as usize..]) {
        let occupied = voxels.occupancy().iter().filter(|&&o| o).count();
        writeln!(
            out,
            "table: {:?}, {occupied} of {} voxels hold a point",
            voxels.grid.bbox.to_array(),
            VoxelGrid::CELLS
        )?;
    }
    Ok(())
}
