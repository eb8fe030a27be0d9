//! `s3d render`: one view of a mesh, without any annotation.

use super::on_threads;
use crate::args::{MeshArgs, Threads};
use crate::failure::Outcome;
use crate::values::{field_of_view, finite, parsed, point};
use clap::{Args, value_parser};
use glam::DVec3;
use s3d_dataset::{Error, RenderOptions};
use s3d_geom::{Camera, Pose};
use s3d_io::image::Compression;
use s3d_render::Normals;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// Where the camera stands: metres, Z-up.
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub(crate) at: DVec3,
    /// Heading in degrees: 0 along +Y, growing to the left.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true, value_parser = finite)]
    pub(crate) yaw: f64,
    /// Degrees above the horizon.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true, value_parser = finite)]
    pub(crate) pitch: f64,
    /// Angle of view in degrees.
    #[arg(long, value_name = "DEG", default_value_t = 75.0, value_parser = field_of_view, conflicts_with = "pano")]
    pub(crate) fov: f64,
    /// A panorama instead of a perspective view.
    #[arg(long)]
    pub(crate) pano: bool,
    /// Width in pixels [default: 1080, a panorama's 4096]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(8..=32_768))]
    pub(crate) size: Option<u32>,
    /// Normals interpolated from the mesh's own where it has some, instead of the faces'.
    #[arg(long)]
    pub(crate) smooth_normals: bool,
    /// How much time the images' files may take: fast, balanced (about the size that libpng and OpenEXR make
    /// them) or small (slowest). The pixels are the same.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
    /// The folder for the images.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Replace images that are there.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: RenderArgs) -> Outcome<()> {
    let pose = Pose::level(args.at, args.yaw.to_radians()).turned(0.0, args.pitch.to_radians());
    let camera = if args.pano {
        let width = args.size.unwrap_or(4096);
        if width % 2 == 1 {
            let message = format!("--size {width}: a panorama is half as high as wide, so even");
            return Err(Error::Usage(message).into());
        }
        Camera::equirectangular(pose, width)
    } else {
        let size = args.size.unwrap_or(1080);
        Camera::perspective(pose, args.fov.to_radians(), size, size)
    };
    let options = RenderOptions {
        up: args.mesh.up,
        normals: if args.smooth_normals { Normals::Smooth } else { Normals::Flat },
        compression: args.compression,
        overwrite: args.overwrite,
    };
    on_threads(args.threads, |context| {
        s3d_dataset::render(&args.mesh.mesh, &camera, &args.output, &options, context)
    })
}
