//! `s3d render`: views of a mesh, without any annotation.

use crate::args::{MeshArgs, Threads};
use crate::commands::on_threads;
use crate::failure::{Failure, Outcome};
use crate::values::{field_of_view, finite, intrinsics, parsed, point, positive};
use clap::{Args, value_parser};
use glam::{DVec3, dvec2};
use s3d_dataset::WalkOptions;
use s3d_dataset::options::Condition;
use s3d_dataset::render::{PosesOptions, RenderOptions};
use s3d_geom::{Camera, Pose};
use s3d_io::camera::{Distortion, GivenIntrinsics, Optics};
use s3d_io::mesh::UpAxis;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// The position of the camera: metres, Z-up.
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true,
        required_unless_present_any = ["poses", "trajectory"])]
    pub(crate) at: Option<DVec3>,
    /// Render all cameras of a list instead: transforms.json, a COLMAP model, Metashape's cameras.xml,
    /// folders of ScanNet, 3RScan or Polycam, a trajectory of ARKitScenes or TUM, or a CSV table (name,x,y,z
    /// and a quaternion, look_x,look_y,look_z or yaw,pitch).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["at", "yaw", "pitch", "pano", "size"])]
    pub(crate) poses: Option<PathBuf>,
    /// Render a walk of so many seconds through rooms, doors and stairs instead.
    #[arg(long, value_name = "SECONDS", conflicts_with_all = ["at", "poses", "yaw", "pitch", "size"],
        value_parser = positive)]
    pub(crate) trajectory: Option<f64>,
    #[command(flatten)]
    pub(crate) walk: WalkOptions,
    /// Make a video of the images of --poses or --trajectory too, rgb.mp4, by ffmpeg, which must be
    /// installed.
    #[arg(long, conflicts_with = "at")]
    pub(crate) video: bool,
    /// The axis of the list's frame that points up.
    #[arg(long, default_value = "z", value_parser = parsed::<UpAxis>, value_name = "y|z",
        conflicts_with_all = ["at", "trajectory"])]
    pub(crate) poses_up: UpAxis,
    /// Width of the images of --poses or --trajectory; the intrinsics of the list are scaled to it [default:
    /// the list's; 1080, or 4096 for a panorama]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..=32_768),
        conflicts_with = "at")]
    pub(crate) width: Option<u32>,
    /// Height of the images of --poses or --trajectory [default: the list's; the width, or half of it for a
    /// panorama]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..=32_768),
        conflicts_with = "at")]
    pub(crate) height: Option<u32>,
    /// Focal lengths and principal point of the images of --poses, in pixels [default: the list's]
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = intrinsics, allow_hyphen_values = true,
        conflicts_with_all = ["at", "fov", "pano"])]
    pub(crate) k: Option<[f64; 4]>,
    /// Write the views even if none of them sees the mesh.
    #[arg(long, value_name = "coverage", value_parser = parsed::<Condition>, conflicts_with = "at")]
    pub(crate) allow: Vec<Condition>,
    /// Heading in degrees: 0 along +Y, growing to the left.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true, value_parser = finite)]
    pub(crate) yaw: f64,
    /// Pitch in degrees above the horizon.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true, value_parser = finite)]
    pub(crate) pitch: f64,
    /// Horizontal angle of view in degrees [default: 75, or the list's]
    #[arg(long, value_name = "DEG", value_parser = field_of_view, conflicts_with = "pano")]
    pub(crate) fov: Option<f64>,
    /// Render a panorama instead of a perspective view.
    #[arg(long)]
    pub(crate) pano: bool,
    /// Width in pixels [default: 1080, or 4096 for a panorama]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(8..=32_768))]
    pub(crate) size: Option<u32>,
    #[command(flatten)]
    pub(crate) options: RenderOptions,
    /// The folder for the images.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: RenderArgs) -> Outcome<()> {
    let options = RenderOptions { axes: args.mesh.axes(), ..args.options.clone() };
    let Some(at) = args.at else { return run_many(args, options) };

    let pose = Pose::level(at, args.yaw.to_radians()).turned(0.0, args.pitch.to_radians());
    let camera = if args.pano {
        let width = args.size.unwrap_or(4096);
        if width % 2 == 1 {
            let message = format!("--size {width}: a panorama is half as high as wide, so even");
            return Err(Failure::Usage(message));
        }
        Camera::equirectangular(pose, width)
    } else {
        let size = args.size.unwrap_or(1080);
        Camera::perspective(pose, args.fov.unwrap_or(75.0).to_radians(), size, size)
    };

    on_threads(args.threads, |context| {
        s3d_dataset::render(&args.mesh.mesh, &camera, &args.output, &options, context)
    })
}

/// Renders a list of cameras, or a walk.
fn run_many(args: RenderArgs, render: RenderOptions) -> Outcome<()> {
    let optics = match (args.k, args.fov) {
        (Some([fx, fy, cx, cy]), _) => Some(Optics::Pinhole {
            focal_px: dvec2(fx, fy),
            center_px: Some(dvec2(cx, cy)),
            distortion: Distortion::None,
        }),
        (None, Some(deg)) => Some(Optics::AngleOfView { fov_rad: deg.to_radians() }),
        (None, None) => args.pano.then_some(Optics::Equirectangular),
    };
    let options = PosesOptions {
        render,
        poses_up: args.poses_up,
        intrinsics: GivenIntrinsics { width: args.width, height: args.height, optics },
        allow: args.allow,
        video_rate: args.video.then_some(args.walk.rate),
    };

    let Some(seconds) = args.trajectory else {
        let poses = args.poses.unwrap_or_default();
        return on_threads(args.threads, |context| {
            s3d_dataset::render_poses(&args.mesh.mesh, &poses, &args.output, &options, context).map(drop)
        });
    };
    let walk = WalkOptions { frames: (seconds * args.walk.rate).round() as usize, ..args.walk };
    on_threads(args.threads, |context| {
        s3d_dataset::render_walk(&args.mesh.mesh, &walk, &args.output, &options, context).map(drop)
    })
}
