//! `s3d sample`: a mesh to a dense coloured point cloud.

use crate::args::{MeshArgs, Threads};
use crate::commands::on_threads;
use crate::failure::Outcome;
use crate::values::positive;
use clap::Args;
use s3d_dataset::sample::SampleOptions;
use s3d_geom::Density;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct SampleArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// The PLY file of the point cloud (metres, Z-up).
    #[arg(short, long, value_name = "CLOUD.ply")]
    pub(crate) output: PathBuf,
    /// Points per m² of surface.
    #[arg(long, value_name = "N", default_value_t = 10_000.0, value_parser = positive,
        conflicts_with = "points")]
    pub(crate) points_per_m2: f64,
    /// The number of points in all, instead of a density.
    #[arg(long, value_name = "N")]
    pub(crate) points: Option<u64>,
    /// The source of everything random.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Replace the file if it exists.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: SampleArgs) -> Outcome<()> {
    let options = SampleOptions {
        axes: args.mesh.axes(),
        density: args.points.map_or(Density::PerM2(args.points_per_m2), Density::Total),
        seed: args.seed,
        overwrite: args.overwrite,
    };
    on_threads(args.threads, |context| {
        s3d_dataset::sample(&args.mesh.mesh, &args.output, &options, context).map(drop)
    })
}
