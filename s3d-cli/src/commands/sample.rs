//! `s3d sample`: a mesh to a dense coloured point cloud.

use super::{on_threads, refuse_existing};
use crate::args::SampleArgs;
use crate::console::Progress;
use crate::failure::Outcome;
use crate::pipeline::points::check_density;
use crate::stop;
use s3d_geom::{Density, PointCloud, SurfaceSampler};
use s3d_io::PlyPointWriter;
use std::time::Instant;
use tracing::{info, warn};

/// Points drawn at a time: what is in memory of a cloud of any size.
const CHUNK: u64 = 1 << 20;

pub(crate) fn run(args: SampleArgs) -> Outcome<()> {
    refuse_existing(&args.output, args.overwrite)?;
    on_threads(args.threads, || {
        let file = s3d_io::read_mesh(&args.mesh.mesh, args.mesh.up())?;
        file.warnings.iter().for_each(|w| warn!("{w}"));
        if args.points.is_none() {
            check_density(&file.mesh, args.points_per_m2)?;
        }
        let started = Instant::now();
        let density = args.points.map_or(Density::PerM2(args.points_per_m2), Density::Total);
        let sampler = SurfaceSampler::new(&file.mesh, density, args.seed);
        let mut ply = PlyPointWriter::create(&args.output, sampler.len())?;
        let progress = Progress::new("sampling", "points", sampler.len());
        let mut cloud = PointCloud::default();
        let mut at = 0;
        while at < sampler.len() {
            stop::check()?;
            let end = sampler.len().min(at + CHUNK);
            sampler.sample(at..end, &mut cloud);
            ply.append(&cloud, &vec![0; cloud.len()])?;
            progress.add(end - at);
            at = end;
        }
        ply.finish()?;
        drop(progress);
        info!(
            "{}: {} points on {:.1} m² in {:.1} s",
            args.output.display(),
            sampler.len(),
            file.mesh.total_area(),
            started.elapsed().as_secs_f64()
        );
        Ok(())
    })
}
