//! The command line: subcommands, options, defaults, help texts.

use crate::arg_values::{
    PadLabels, even_width, field_of_view, finite, normal_axes, parsed, point, positive, stored_xyz, uuid,
};
use crate::console::LogFormat;
use crate::pack::args::PackArgs;
use crate::pipeline::deal::Shard;
use crate::pipeline::profiles::Profile;
use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, value_parser};
use glam::DVec3;
use s3d_geom::NormalAxes;
use s3d_io::{Compression, Conventions, DepthUnits, Domain, UpAxis, XyzType};
use s3d_sample::Pool;
use std::path::PathBuf;

/// From an annotated scan to a registered 2D-3D-Semantic data set.
#[derive(Debug, Parser)]
#[command(
    name = "s3d",
    version,
    max_term_width = 110,
    after_help = "\
Start with the built-in scene:\n  s3d demo\nthen a scan of your own:\n  s3d info scan/scene.toml\n  s3d export scan/scene.toml -o dataset\n\n\
Exit codes: 0 done, 1 the input or the disk, 2 the call, 75 stopped by a signal or a full disk: call it again."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Log details.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,
    /// Log warnings and errors only, and show no progress.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Write to standard error for a person, or one JSON object a line for a program: log lines, progress, a line for each
    /// finished unit of work, and a summary (docs/log.md).
    #[arg(
        long,
        global = true,
        value_enum,
        default_value_t,
        value_name = "text|json",
        hide_possible_values = true
    )]
    pub(crate) log: LogFormat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write the built-in scene as input files and export it: a data set to look at.
    #[command(
        after_help = "Example:\n  s3d demo -o s3d-demo\nThe scene's own files are in OUT/scan; export them again, larger, with\n  s3d export s3d-demo/scan/scene.toml -o dataset"
    )]
    Demo(DemoArgs),
    /// Turn scans into a data set: images, poses, meshes, points, labels, tables.
    #[command(
        after_help = "Examples:\n  s3d export scan/scene.toml -o dataset\n  s3d export area_1.toml area_2.toml -o dataset --seed 7 --views 24 --size 512\n  s3d export scan/scene.toml --modalities rgb,depth,pose --keep-all\nAn export that was stopped or killed goes on where it was when it is called again with the same arguments."
    )]
    Export(ExportArgs),
    /// Label scenes and score their views ahead of an export that many machines share.
    #[command(
        after_help = "Examples:\n  s3d plan scan/scene.toml -o plan\n  s3d export scan/scene.toml -o dataset --plan plan --shard 1/4\nThe options are those of the export that labels and scores depend on. docs/cluster has files for Slurm and others."
    )]
    Plan(PlanArgs),
    /// Make one data set of what the shards of an export have written.
    #[command(
        after_help = "Examples:\n  s3d merge dataset -o dataset\n  s3d merge shard_1 shard_2 shard_3 -o dataset\nIt is that of a single run, byte for byte. What is missing is told with the shard to run again."
    )]
    Merge(MergeArgs),
    /// Sample a mesh densely and uniformly into a coloured point cloud.
    #[command(after_help = "Example:\n  s3d sample scan/rgb.obj -o cloud.ply --points-per-m2 10000")]
    Sample(SampleArgs),
    /// Render one view of a mesh, in every modality that needs no annotation.
    #[command(
        after_help = "Examples:\n  s3d render scan/rgb.obj --at 13.1,9.65,1.4 --yaw 30 --pitch -10 --fov 75 -o view\n  s3d render scan/rgb.obj --at 13.1,9.65,1.4 --pano -o pano"
    )]
    Render(RenderArgs),
    /// Tell what a scene holds, and what looks wrong in it.
    #[command(after_help = "Example:\n  s3d info scan/scene.toml")]
    Info(InfoArgs),
    /// Package a data set for a trainer: WebDataset, COLMAP, nerfstudio, COCO panoptic, or a Parquet table of its images.
    #[command(
        after_help = "Examples:\n  s3d pack dataset --to webdataset --images views --shuffle 1\n  s3d pack dataset --to colmap -o colmap --areas 1 --copy-images\n  s3d pack dataset --to nerfstudio\n  s3d pack dataset --to coco --areas 1,2,3,4,6 -o coco_train\n  s3d pack dataset --to parquet -o images.parquet"
    )]
    Pack(PackArgs),
    /// Make the world coordinates of a data set's images again, from depth and pose.
    #[command(
        after_help = "Example:\n  s3d xyz dataset --type float --overwrite\nDepth is stored in steps of 2 mm (or 1 mm), so what comes out is off by half of that along the ray; a pixel\nbeyond the depth's range is missing. What `s3d export` writes comes from the hits themselves."
    )]
    Xyz(XyzArgs),
    /// Write what a point cloud loader wants from an existing data set.
    #[command(
        after_help = "Example:\n  s3d profile dataset --to pointnet --to pointcept\nEach comes to dataset/profiles/NAME."
    )]
    Profile(ProfileArgs),
    /// Print the tables of statistics of a data set, counted from its files.
    #[command(after_help = "Example:\n  s3d stats dataset")]
    Stats(StatsArgs),
    /// Read a data set back and check it: against its manifest, against itself, and every image against the mesh.
    #[command(
        after_help = "Examples:\n  s3d verify dataset\n  s3d verify dataset --full\nEach fault is a line on standard output; the last line counts. Exit code 0 without faults, 1 with some."
    )]
    Verify(VerifyArgs),
}

impl Command {
    /// Whether a signal stops it between files. The others write one thing or nothing, and are ended by the system.
    pub(crate) fn stops_between_files(&self) -> bool {
        match self {
            Self::Demo(_) | Self::Export(_) | Self::Sample(_) => true,
            Self::Plan(_) | Self::Merge(_) | Self::Pack(_) | Self::Xyz(_) | Self::Profile(_) => true,
            Self::Render(_) | Self::Info(_) | Self::Stats(_) | Self::Verify(_) => false,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// The folder to make; the scene's own files come to OUT/scan.
    #[arg(short, long, value_name = "OUT", default_value = "s3d-demo")]
    pub(crate) output: PathBuf,
    /// Replace an earlier data set in OUT.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) options: DemoOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

/// The demo's options are the export's, at a reduced size.
#[derive(Clone, Debug, Args)]
pub(crate) struct DemoOptions {
    /// Candidate views a scan location.
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = value_parser!(u32).range(0..=100_000))]
    pub(crate) views: u32,
    /// Width and height of a view in pixels.
    #[arg(long, value_name = "PX", default_value_t = 540, value_parser = value_parser!(u32).range(8..=16_384))]
    pub(crate) size: u32,
    /// Width of a panorama in pixels, even; it is half as high.
    #[arg(long, value_name = "PX", default_value_t = 2048, value_parser = even_width)]
    pub(crate) pano_width: u32,
    /// Everything random comes from it.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Density of the point cloud.
    #[arg(long, value_name = "N", default_value_t = 2500.0, value_parser = positive)]
    pub(crate) points_per_m2: f64,
    /// How much time the images' files may take: fast, balanced (about the size that libpng and OpenEXR make them) or small
    /// (slowest). The pixels are the same.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// Scene files, or folders of published areas (area_3), one an area.
    #[arg(required = true, value_name = "SCENE.toml")]
    pub(crate) scenes: Vec<PathBuf>,
    /// The data set's folder [default: SCENE_2d3ds beside the first scene]
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Option<PathBuf>,
    /// Write into an OUT that holds something: an earlier data set there, or an unfinished one of another call, is
    /// replaced, other files stay.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Do one of N parts of the work, such as 2/4. The parts may be done anywhere, in any order, into one OUT or one each;
    /// `s3d merge` makes the data set of them.
    #[arg(long, value_name = "i/N", value_parser = parsed::<Shard>)]
    pub(crate) shard: Option<Shard>,
    /// Take labels and scores from the folder that `s3d plan` made, instead of making them.
    #[arg(long, value_name = "PLAN")]
    pub(crate) plan: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) options: ExportOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// Scene files, or folders of published areas, one an area.
    #[arg(required = true, value_name = "SCENE.toml")]
    pub(crate) scenes: Vec<PathBuf>,
    /// The plan's folder; called again, what is missing in it is made.
    #[arg(short, long, value_name = "PLAN")]
    pub(crate) output: PathBuf,
    /// Make the first, second, ... of N parts of the plan; the parts may be made anywhere, in any order.
    #[arg(long, value_name = "i/N", value_parser = parsed::<Shard>)]
    pub(crate) shard: Option<Shard>,
    /// Candidate views a scan location.
    #[arg(long, value_name = "N", default_value_t = 72, value_parser = value_parser!(u32).range(0..=100_000))]
    views: u32,
    /// Width and height of a view in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1080, value_parser = value_parser!(u32).range(8..=16_384))]
    size: u32,
    /// Everything random comes from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Put scan locations on the floor of every room, no two of a room nearer than this.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    place_cameras: Option<f64>,
    /// Count the classes of a candidate view on every Nth pixel of both axes.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = value_parser!(u32).range(1..=64))]
    entropy_stride: u32,
    /// Skip and count what is not as it should be in the annotations.
    #[arg(long)]
    lenient: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

impl PlanArgs {
    /// The options of an export of poses alone, which a plan with these labels and scores is for, among others.
    pub(crate) fn export_options(&self) -> ExportOptions {
        ExportOptions {
            views: self.views,
            size: self.size,
            pano_width: 8,
            seed: self.seed,
            pool: Pool::Dataset,
            // Of points nothing is asked.
            points_per_m2: f64::MIN_POSITIVE,
            place_cameras: self.place_cameras,
            entropy_stride: self.entropy_stride,
            modalities: vec![Domain::Pose],
            keep_all: false,
            only: Vec::new(),
            smooth_normals: false,
            lenient: self.lenient,
            compression: Compression::default(),
            format: FormatOptions::default(),
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// The folders that shards of the same export wrote into, in any order; OUT may be one of them.
    #[arg(required = true, value_name = "SHARD")]
    pub(crate) shards: Vec<PathBuf>,
    /// The data set's folder.
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Write into an OUT that holds something: an earlier data set there is replaced, other files stay.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct ExportOptions {
    /// Candidate views a scan location; the paper's are 3 × 24.
    #[arg(long, value_name = "N", default_value_t = 72, value_parser = value_parser!(u32).range(0..=100_000))]
    pub(crate) views: u32,
    /// Width and height of a view in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1080, value_parser = value_parser!(u32).range(8..=16_384))]
    pub(crate) size: u32,
    /// Width of a panorama in pixels, even; it is half as high.
    #[arg(long, value_name = "PX", default_value_t = 4096, value_parser = even_width)]
    pub(crate) pano_width: u32,
    /// Everything random comes from it: the same input and seed give the same bytes.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Put scan locations on the floor of every room instead of reading some: no two of a room nearer than this, 1.5 m high,
    /// clear of walls and things.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub(crate) place_cameras: Option<f64>,
    /// Among which candidates views are selected: of the whole data set, of an area, or of a location.
    #[arg(long, default_value = "dataset", value_parser = parsed::<Pool>, value_name = "dataset|area|location")]
    pub(crate) pool: Pool,
    /// Density of the point cloud.
    #[arg(long, value_name = "N", default_value_t = 10_000.0, value_parser = positive)]
    pub(crate) points_per_m2: f64,
    /// Count the classes of a candidate view on every Nth pixel of both axes; 1 counts all, exactly. With 4 the entropies
    /// of two scenes were off by 0.003 nats at most, 0.0006 on average, and the same views were kept.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = value_parser!(u32).range(1..=64))]
    pub(crate) entropy_stride: u32,
    /// Which images to write, such as rgb,depth,pose [default: all of rgb, depth, normal, semantic, semantic_pretty,
    /// global_xyz, pose]
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = Domain::ALL,
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
    /// Skip and count what is not as it should be in the annotations — odd names, lines that are no points, unknown
    /// classes — instead of stopping at it.
    #[arg(long)]
    pub(crate) lenient: bool,
    /// How much time the images' files may take: fast, balanced (about the size that libpng and OpenEXR make them) or small
    /// (slowest). The pixels are the same.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
    #[command(flatten)]
    pub(crate) format: FormatOptions,
}

/// In which of several forms an export is written. The defaults are the published ones.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct FormatOptions {
    /// World coordinates as half floats (1.6 cm steps at 20 m from the origin), as 32-bit floats, or not at all, whatever
    /// --modalities says: `s3d xyz` makes them later from depth and pose.
    #[arg(long, default_value_t, value_parser = parsed::<XyzType>, value_name = "half|float|none")]
    pub(crate) xyz: XyzType,
    /// Axes of normals in views: the paper's (B towards the camera) or OpenCV's (B forward, as omnidata has them).
    /// Panoramas have X, −Z, Y of the world in either.
    #[arg(long, default_value = "paper", value_parser = normal_axes, value_name = "paper|opencv")]
    pub(crate) normal_axes: NormalAxes,
    /// Depth in 512ths of a metre (up to 128 m), or in millimetres (up to 65.534 m; loaders of the published data divide
    /// by 512).
    #[arg(long, default_value_t, value_parser = parsed::<DepthUnits>, value_name = "512|mm")]
    pub(crate) depth_units: DepthUnits,
    /// Fill semantic_labels.json with null labels up to N entries: loaders look missing pixels up at index 3341.
    #[arg(long, default_value_t, value_parser = parsed::<PadLabels>, value_name = "N|off")]
    pub(crate) pad_labels: PadLabels,
    /// Write what a point cloud loader wants to OUT/profiles/NAME besides; may be repeated.
    #[arg(long = "profile", value_delimiter = ',', value_parser = parsed::<Profile>,
        value_name = "pointcept|open3d-ml|mmdet3d|pointnet")]
    pub(crate) profiles: Vec<Profile>,
}

impl FormatOptions {
    /// What `conventions.json` tells of them.
    pub(crate) fn conventions(&self) -> Conventions {
        Conventions { depth_units: self.depth_units, normal_axes: self.normal_axes, xyz: self.xyz }
    }
}

impl ExportOptions {
    /// The same options in their one form, however they were written: modalities once each and in their own order, uuids
    /// as in the data set and sorted, profiles likewise.
    pub(crate) fn canonical(mut self) -> Self {
        let asked = std::mem::take(&mut self.modalities);
        let no_xyz = self.format.xyz == XyzType::None;
        let left_out = |d: &Domain| no_xyz && *d == Domain::GlobalXyz;
        self.modalities = Domain::ALL.into_iter().filter(|d| asked.contains(d) && !left_out(d)).collect();
        self.format.profiles.sort();
        self.format.profiles.dedup();
        self.only.sort();
        self.only.dedup();
        self
    }
}

#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct Threads {
    /// Threads to work with [default: one a core]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=4096))]
    pub(crate) threads: Option<u16>,
}

#[derive(Debug, Args)]
pub(crate) struct MeshArgs {
    /// The mesh: OBJ, glTF, GLB or PLY.
    #[arg(value_name = "MESH")]
    pub(crate) mesh: PathBuf,
    /// Which axis of the file points up.
    #[arg(long, default_value = "y", value_parser = PossibleValuesParser::new(["y", "z"]))]
    pub(crate) up: String,
}

impl MeshArgs {
    pub(crate) fn up(&self) -> UpAxis {
        if self.up == "z" { UpAxis::Z } else { UpAxis::Y }
    }
}

#[derive(Debug, Args)]
pub(crate) struct SampleArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// The point cloud to write, PLY (Z-up metres).
    #[arg(short, long, value_name = "CLOUD.ply")]
    pub(crate) output: PathBuf,
    /// Density of the points.
    #[arg(long, value_name = "N", default_value_t = 10_000.0, value_parser = positive, conflicts_with = "points")]
    pub(crate) points_per_m2: f64,
    /// How many points in all, instead of a density.
    #[arg(long, value_name = "N")]
    pub(crate) points: Option<u64>,
    /// Everything random comes from it.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Replace the file if it is there.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

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
    /// How much time the images' files may take: fast, balanced (about the size that libpng and OpenEXR make them) or small
    /// (slowest). The pixels are the same.
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

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// The scene file, or the folder of a published area.
    #[arg(value_name = "SCENE.toml")]
    pub(crate) scene: PathBuf,
    /// Show the scan locations that export would put on the floor with this option.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub(crate) place_cameras: Option<f64>,
    /// The seed by which they would be placed.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Skip and count what is not as it should be in the annotations, as in an export with --lenient.
    #[arg(long)]
    pub(crate) lenient: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Debug, Args)]
pub(crate) struct StatsArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Besides, score all candidate views again, and hold the S3DIS tree and pointcloud.mat against the point cloud. Every
    /// pixel of every image is compared in either case.
    #[arg(long)]
    pub(crate) full: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Debug, Args)]
pub(crate) struct XyzArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Half floats or 32-bit floats.
    #[arg(long = "type", default_value = "half", value_parser = stored_xyz, value_name = "half|float")]
    pub(crate) xyz: XyzType,
    /// Replace coordinates that are there, though they may be more exact.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// How much time the images' files may take: fast, balanced or small.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Debug, Args)]
pub(crate) struct ProfileArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Which loader; may be repeated.
    #[arg(long = "to", required = true, value_delimiter = ',', value_parser = parsed::<Profile>,
        value_name = "pointcept|open3d-ml|mmdet3d|pointnet")]
    pub(crate) profiles: Vec<Profile>,
    /// Replace what is in OUT/profiles/NAME.
    #[arg(long)]
    pub(crate) overwrite: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn defaults_are_the_papers() {
        let cli = Cli::parse_from(["s3d", "export", "scene.toml"]);
        let Command::Export(args) = cli.command else { panic!("another command") };
        let o = args.options;
        assert_eq!((o.views, o.size, o.pano_width, o.seed, o.entropy_stride), (72, 1080, 4096, 0, 4));
        assert_eq!(o.modalities, Domain::ALL);
        assert_eq!(o.pool, Pool::Dataset);
        assert_eq!(o.compression, Compression::Balanced);
        let f = o.format;
        assert_eq!((f.xyz, f.depth_units, f.normal_axes), Default::default());
        assert_eq!((f.pad_labels, f.profiles.len()), (PadLabels(3342), 0));
    }

    #[test]
    fn options_written_in_two_ways_are_the_same() {
        let options =
            |args: &[&str]| match Cli::parse_from(["s3d", "export", "s.toml"].iter().chain(args)).command {
                Command::Export(args) => args.options.canonical(),
                _ => panic!("another command"),
            };
        let (x, y) = ("00112233445566778899aabbccddeeff", "508160ba5d80a2e365609578a09bab8b");
        let a =
            options(&["--modalities", "pose,rgb,pose", "--only", "508160BA-5d80-a2e3-6560-9578a09bab8b", x]);
        let b = options(&["--modalities", "rgb,pose", "--only", &[x, y, x].join(",")]);
        assert_eq!((&a.modalities, &a.only), (&b.modalities, &b.only));
        assert_eq!(a.modalities, [Domain::Rgb, Domain::Pose]);
        let none = options(&["--xyz", "none", "--profile", "pointnet,mmdet3d", "--profile", "pointnet"]);
        assert!(none.modalities.len() == 6 && !none.modalities.contains(&Domain::GlobalXyz));
        assert_eq!(none.format.profiles, [Profile::Mmdet3d, Profile::PointNet]);
        assert_eq!(options(&["--pad-labels", "off"]).format.pad_labels.to_string(), "off");
    }

    #[test]
    fn nonsense_is_refused() {
        for bad in [
            &["s3d", "export"] as &[&str],
            &["s3d", "export", "a.toml", "--pano-width", "4095"],
            &["s3d", "export", "a.toml", "--modalities", "rgb,smell"],
            &["s3d", "export", "a.toml", "--pool", "sea"],
            &["s3d", "export", "a.toml", "--xyz", "double"],
            &["s3d", "export", "a.toml", "--normal-axes", "left"],
            &["s3d", "export", "a.toml", "--depth-units", "inch"],
            &["s3d", "export", "a.toml", "--pad-labels", "0"],
            &["s3d", "export", "a.toml", "--pad-labels", "65537"],
            &["s3d", "export", "a.toml", "--profile", "sea"],
            &["s3d", "xyz", "out", "--type", "none"],
            &["s3d", "profile", "out"],
            &["s3d", "export", "a.toml", "--compression", "9"],
            &["s3d", "export", "--only", "00112233445566778899aabbccddeeff", "a.toml"],
            &["s3d", "export", "a.toml", "--points-per-m2", "nan"],
            &["s3d", "render", "a.obj", "--at", "1,2", "-o", "x"],
            &["s3d", "render", "a.obj", "--at", "1,2,3", "--fov", "180", "-o", "x"],
            &["s3d", "render", "a.obj", "--at", "1,2,3", "--fov", "60", "--pano", "-o", "x"],
        ] {
            assert!(Cli::try_parse_from(bad).is_err(), "{bad:?}");
        }
        assert!(Cli::try_parse_from(["s3d", "render", "a.obj", "--at", "-1,2,3", "-o", "x"]).is_ok());
    }
}
