//! `s3d export`: scenes to a data set.

use super::on_threads;
use crate::args::{Allow, Placing, Scenes, Threads};
use crate::failure::Outcome;
use crate::values::{even_width, normal_axes, parsed, positive, uuid};
use clap::{Args, value_parser};
use s3d_dataset::{Export, ExportOptions, PadLabels, Profile, Shard};
use s3d_geom::NormalAxes;
use s3d_io::dataset::{DepthUnits, Domain, XyzType};
use s3d_io::image::Compression;
use s3d_render::Normals;
use s3d_sample::Pool;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    #[command(flatten)]
    pub(crate) scenes: Scenes,
    /// The data set's folder [default: SCENE_2d3ds beside the first scene]
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Option<PathBuf>,
    /// Write into an OUT that holds something: an earlier data set there, or an unfinished one of another
    /// call, is replaced, other files stay.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Do one of N parts of the work, such as 2/4. The parts may be done anywhere, in any order, into one OUT
    /// or one each; `s3d merge` makes the data set of them.
    #[arg(long, value_name = "i/N", value_parser = parsed::<Shard>)]
    pub(crate) shard: Option<Shard>,
    /// Take labels and scores from the folder that `s3d plan` made, instead of making them.
    #[arg(long, value_name = "PLAN")]
    pub(crate) plan: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) options: OptionArgs,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct OptionArgs {
    /// Candidate views a scan location; the paper's are 3 × 24.
    #[arg(long, value_name = "N", default_value_t = 72, value_parser = value_parser!(u32).range(0..=100_000))]
    pub(crate) views: u32,
    /// Width and height of a view in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1080,
        value_parser = value_parser!(u32).range(8..=16_384))]
    pub(crate) size: u32,
    /// Width of a panorama in pixels, even; it is half as high.
    #[arg(long, value_name = "PX", default_value_t = 4096, value_parser = even_width)]
    pub(crate) pano_width: u32,
    /// Everything random comes from it: the same input and seed give the same bytes.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) placing: Placing,
    /// Among which candidates views are selected: of the whole data set, of an area, or of a location.
    #[arg(long, default_value = "dataset", value_parser = parsed::<Pool>,
        value_name = "dataset|area|location")]
    pub(crate) pool: Pool,
    /// Density of the point cloud.
    #[arg(long, value_name = "N", default_value_t = 10_000.0, value_parser = positive)]
    pub(crate) points_per_m2: f64,
    /// Count the classes of a candidate view on every Nth pixel of both axes; 1 counts all, exactly. With 4
    /// the entropies of two scenes were off by 0.003 nats at most, 0.0006 on average, and the same views were
    /// kept.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = value_parser!(u32).range(1..=64))]
    pub(crate) entropy_stride: u32,
    /// Which images to write, such as rgb,depth,pose [default: rgb, depth, normal, semantic,
    /// semantic_pretty, global_xyz, pose; besides there is semantic_class: PNG with a palette, a colour a
    /// class]
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = Domain::PUBLISHED,
        hide_default_value = true, value_parser = parsed::<Domain>)]
    pub(crate) modalities: Vec<Domain>,
    /// Write every candidate view, whatever its entropy.
    #[arg(long)]
    pub(crate) keep_all: bool,
    /// Write the images of these scan locations only. The selection stays that of all locations.
    #[arg(long, value_name = "UUID", num_args = 1.., value_delimiter = ',', value_parser = uuid)]
    pub(crate) only: Vec<String>,
    /// Normals interpolated from the mesh's own where it has some, instead of the faces'.
    #[arg(long)]
    pub(crate) smooth_normals: bool,
    /// Take N samples of the colour of a pixel where surfaces end or turn, so that there are no stair-steps;
    /// all other images keep one.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u32).range(1..=64))]
    pub(crate) rgb_samples: u32,
    /// Skip and count what is not as it should be in the annotations — odd names, lines that are no points,
    /// unknown classes — instead of stopping at it.
    #[arg(long)]
    pub(crate) lenient: bool,
    /// Give faces that no annotated point voted for the label of the surface next to them, along the surface
    /// and not around sharp edges, if it is no farther than this. Left out, nothing is filled, as published.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub(crate) fill: Option<f64>,
    /// How much time the images' files may take: fast, balanced (about the size that libpng and OpenEXR make
    /// them) or small (slowest). The pixels are the same.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
    #[command(flatten)]
    pub(crate) allow: Allow,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// In which of several forms an export is written. The defaults are the published ones.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct FormatArgs {
    /// World coordinates as half floats (1.6 cm steps at 20 m from the origin), as 32-bit floats, or not at
    /// all, whatever --modalities says: `s3d xyz` makes them later from depth and pose.
    #[arg(long, default_value_t, value_parser = parsed::<XyzType>, value_name = "half|float|none")]
    pub(crate) xyz: XyzType,
    /// Axes of normals in views: the paper's (B towards the camera) or OpenCV's (B forward, as omnidata has
    /// them). Panoramas have X, −Z, Y of the world in either.
    #[arg(long, default_value = "paper", value_parser = normal_axes, value_name = "paper|opencv")]
    pub(crate) normal_axes: NormalAxes,
    /// Depth in 512ths of a metre (up to 128 m), or in millimetres (up to 65.534 m; loaders of the published
    /// data divide by 512).
    #[arg(long, default_value_t, value_parser = parsed::<DepthUnits>, value_name = "512|mm")]
    pub(crate) depth_units: DepthUnits,
    /// Fill semantic_labels.json with null labels up to N entries: loaders look missing pixels up at index
    /// 3341.
    #[arg(long, default_value_t, value_parser = parsed::<PadLabels>, value_name = "N|off")]
    pub(crate) pad_labels: PadLabels,
    /// Write what a point cloud loader wants to OUT/profiles/NAME besides; may be repeated.
    #[arg(long = "profile", value_delimiter = ',', value_parser = parsed::<Profile>,
        value_name = "pointcept|open3d-ml|mmdet3d|pointnet")]
    pub(crate) profiles: Vec<Profile>,
}

impl From<OptionArgs> for ExportOptions {
    fn from(args: OptionArgs) -> Self {
        let FormatArgs { xyz, normal_axes, depth_units, pad_labels, profiles } = args.format;
        Self {
            seed: args.seed,
            place_cameras: args.placing.place_cameras,
            see: args.placing.see,
            views: args.views,
            size: args.size,
            pano_width: args.pano_width,
            pool: args.pool,
            points_per_m2: args.points_per_m2,
            lenient: args.lenient,
            fill: args.fill,
            entropy_stride: args.entropy_stride,
            modalities: args.modalities,
            keep_all: args.keep_all,
            only: args.only,
            normals: if args.smooth_normals {
                Normals::Smooth
            } else {
                Normals::Flat
            },
            rgb_samples: args.rgb_samples,
            compression: args.compression,
            xyz,
            normal_axes,
            depth_units,
            pad_labels,
            profiles,
            allow: args.allow.allow,
        }
    }
}

pub(crate) fn run(args: ExportArgs) -> Outcome<()> {
    let output = args.output.unwrap_or_else(|| default_output(&args.scenes.scenes[0]));
    let export = Export::new(args.scenes.sources())
        .options(args.options.into())
        .overwrite(args.overwrite)
        .shard(args.shard)
        .plan(args.plan);
    on_threads(args.threads, |context| export.run(output, context).map(drop))
}

/// The data set's folder if none is given: beside the scene file, named after it.
fn default_output(scene: &Path) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or("scene".as_ref()).to_owned();
    name.push("_2d3ds");
    scene.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_lies_beside_the_scene() {
        assert_eq!(default_output(Path::new("a/scan.toml")), Path::new("a/scan_2d3ds"));
        assert_eq!(default_output(Path::new("scene.toml")), Path::new("scene_2d3ds"));
    }
}
