//! Samples a mesh file into a dense coloured point cloud.

use crate::context::Context;
use crate::error::{Result, UsageError};
use crate::mesh_axes::{MeshAxes, read_mesh};
use crate::store::new_file::NewFile;
use crate::useful::{PLY_POINT_BYTES, check_points, check_space};
use glam::DVec3;
use s3d_geom::{Density, PointCloud, SurfaceSampler};
use s3d_io::cloud::PlyPointWriter;
use s3d_io::mesh::MeshOrigin;
use std::path::Path;
use std::time::Instant;

/// The number of points that are drawn and in memory at a time.
const CHUNK: u64 = 1 << 20;

/// How a mesh is sampled.
#[derive(Clone, Debug)]
pub struct SampleOptions {
    /// What is known of the mesh file.
    pub axes: MeshAxes,
    /// The number of points, in all or per m².
    pub density: Density,
    /// The seed of everything random.
    pub seed: u64,
    /// Replace an existing file.
    pub overwrite: bool,
}

impl Default for SampleOptions {
    fn default() -> Self {
        Self { axes: MeshAxes::default(), density: Density::PerM2(10_000.0), seed: 0, overwrite: false }
    }
}

/// Samples a mesh file densely and uniformly into the PLY file `output`: world metres, Z-up, with colours. If
/// the mesh is far from the origin, an offset is subtracted ([`MeshOrigin::Near`]). Returns the number of
/// points.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if `output` does not end in `.ply`, exists and is not to be
/// replaced, or there are too many points. [`Error::File`](crate::Error::File).
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn sample(mesh: &Path, output: &Path, options: &SampleOptions, ctx: &Context) -> Result<u64> {
    if !output
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("ply"))
    {
        let why = "a cloud is written as PLY: give it a name that ends with .ply";
        return Err(UsageError::WrongEnding { path: output.to_owned(), why }.into());
    }
    NewFile::check_free(output, options.overwrite)?;

    let file = read_mesh(mesh, options.axes, MeshOrigin::Near, ctx)?;

    let points = match options.density {
        Density::PerM2(points_per_m2) => file.mesh.total_area() * points_per_m2,
        Density::Total(points) => points as f64,
    };
    check_points(points)?;

    // A killed process's file is removed here, so it takes no space afterwards.
    let file_of_points = NewFile::begin(ctx, output, options.overwrite)?;
    check_space(points * PLY_POINT_BYTES, output)?;

    if file.offset_m != DVec3::ZERO {
        ctx.info(format_args!(
            "the mesh lies far from the origin: {:?} is subtracted from its coordinates, which the cloud's \
             header tells",
            file.offset_m.to_array()
        ));
    }

    let started = Instant::now();
    let sampler = SurfaceSampler::new(&file.mesh, options.density, options.seed);
    let mut ply = PlyPointWriter::create_moved(file_of_points.path(), sampler.len(), file.offset_m)?;
    let progress = ctx.progress("sampling", "points", sampler.len());

    let mut cloud = PointCloud::default();
    let mut at = 0;
    while at < sampler.len() {
        ctx.check()?;
        let end = sampler.len().min(at + CHUNK);
        sampler.sample(at..end, &mut cloud);
        ply.append(&cloud, &vec![0; cloud.len()])?;
        progress.add(end - at);
        at = end;
    }

    ply.finish()?;
    file_of_points.finish()?;
    drop(progress);

    ctx.info(format_args!(
        "{}: {} points on {:.1} m² in {:.1} s",
        output.display(),
        sampler.len(),
        file.mesh.total_area(),
        started.elapsed().as_secs_f64()
    ));
    Ok(sampler.len())
}
