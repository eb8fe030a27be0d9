//! The command line as a whole.

use crate::commands::meshes::{align, fuse, render, sample, segments};
use crate::commands::scores::{detect, eval};
use crate::commands::shards::{merge, plan};
use crate::commands::{additions, compare, demo, export, info, label, pack, report, stats, verify};
use crate::console::LogFormat;
use crate::failure::Outcome;
use clap::{Parser, Subcommand};
use s3d_dataset::xyz::XyzOptions;
use s3d_dataset::{PairsOptions, RefineOptions};

/// From an annotated scan to a registered 2D-3D-Semantic data set.
#[derive(Debug, Parser)]
#[command(
    name = "s3d",
    version,
    max_term_width = 110,
    after_help = concat!(
        "Start with the built-in scene:\n  s3d demo\n",
        "then a scan of your own:\n  s3d info scan/scene.toml\n  s3d export scan/scene.toml -o dataset\n\n",
        "Exit codes: 0 done, 1 the input or the disk, 2 the call, 75 stopped by a signal or a full disk: ",
        "call it again.",
    )
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
    /// Write standard error as text for a person, or as one JSON object a line for a program: log lines,
    /// progress, a line for each finished unit of work, and a summary.
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
    /// Write the built-in scene, or generated areas to train on, as input files and export them.
    #[command(
        after_help = concat!(
            "Example:\n",
            "  s3d demo -o s3d-demo\n",
            "The scene's own files are in OUT/scan; export them again, larger, with\n",
            "  s3d export s3d-demo/scan/scene.toml -o dataset\n",
            "Six generated areas to train a detector of objects on, without images:\n",
            "  s3d demo --areas 6 --seed 1 --no-images -o areas\n",
            "Results on generated areas test programs; they are not comparable with results on the six \
             licensed areas of 2D-3D-S.",
        )
    )]
    Demo(demo::DemoArgs),
    /// Turn scans into a data set: images, poses, meshes, points, labels, tables.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d export scan/scene.toml -o dataset\n",
            "  s3d export scan.glb -o dataset\n",
            "  s3d export area_1.toml area_2.toml -o dataset --seed 7 --views 24 --size 512\n",
            "  s3d export scan/scene.toml --modalities rgb,depth,pose --keep-all\n",
            "  s3d export scan/scene.toml --to webdataset -o shards\n",
            "Call an export that was stopped or killed again with the same arguments: ",
            "it goes on where it was.",
        )
    )]
    Export(export::ExportArgs),
    /// Fuse a raw scan, depth pictures or laser scans, to a mesh. `s3d export` takes raw scans too.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d fuse scan.e57 -o mesh.ply\n",
            "  s3d fuse keyframes -o scan --close 0.3\n",
            "  s3d fuse kitchen.las --origin 1.2,3.4,1.5 -o mesh.glb --cell 0.02",
        )
    )]
    Fuse(fuse::FuseArgs),
    /// Find where a mesh or cloud lies in the frame of another one of the same building.
    #[command(after_help = "Example:\n  s3d align kitchen.ply house.glb -o moved.glb\nExit code 1: nothing \
        fits, or several answers do. The page \"Alignment\" of the documentation has the rest.")]
    Align(align::AlignArgs),
    /// Label scenes and score their views ahead of an export that many machines share.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d plan scan/scene.toml -o plan\n",
            "  s3d export scan/scene.toml -o dataset --plan plan --shard 1/4\n",
            "The options are the options of `s3d export` on which labels and scores depend. The page \"Many \
             machines\" of the documentation has files for Slurm and others.",
        )
    )]
    Plan(plan::PlanArgs),
    /// Merge the shards of an export into one data set.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d merge dataset -o dataset\n",
            "  s3d merge shard_1 shard_2 shard_3 -o dataset\n",
            "The result equals the data set of a single run, byte for byte. If something is missing, the \
             message names the shard to run again.",
        )
    )]
    Merge(merge::MergeArgs),
    /// Sample a mesh densely and uniformly into a coloured point cloud.
    #[command(after_help = "Example:\n  s3d sample scan/rgb.obj -o cloud.ply --points-per-m2 10000")]
    Sample(sample::SampleArgs),
    /// Cut a mesh into segments, as ScanNet's and Matterport3D's tools read them.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d segments scene0000_00_vh_clean_2.ply -o scene0000_00_vh_clean_2.0.010000.segs.json\n",
            "  s3d segments scan.obj -o scan.fsegs.json --scale 0.01\n",
            "The method is Felzenszwalb and Huttenlocher's, on the turn of the surface and its colours.",
        )
    )]
    Segments(segments::SegmentsArgs),
    /// Label a bare scan: a page on this machine, where strokes become classes and instances.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d label scan.glb\n",
            "  s3d label scan.glb --write scannet\n",
            "Each stroke is on the disk at once, in scan.labels. Ctrl-C ends the server.",
        )
    )]
    Label(label::LabelArgs),
    /// Render a mesh from one camera or a list of cameras, in every modality that needs no annotation.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d render scan/rgb.obj --at 13.1,9.65,1.4 --yaw 30 --pitch -10 --fov 75 -o view\n",
            "  s3d render scan/rgb.obj --at 13.1,9.65,1.4 --pano -o pano\n",
            "  s3d render scan/rgb.obj --poses transforms.json -o views\n",
            "  s3d render scan/rgb.obj --poses trajectory.txt --width 640 --height 480 --fov 60 -o views\n",
            "  s3d render scan/rgb.obj --trajectory 60 --width 1280 --height 720 --video -o walk",
        )
    )]
    Render(render::RenderArgs),
    /// Print what a scene holds, and what looks wrong in it.
    #[command(after_help = "Examples:\n  s3d info scan/scene.toml\n  s3d info scan.glb")]
    Info(info::InfoArgs),
    /// Package a data set for a trainer: as WebDataset or Parquet, or for Hugging Face, COLMAP, nerfstudio,
    /// COCO, DUSt3R, MapAnything, VGGT, Pointcept, Concerto, habitat-sim or OpenUSD, or as a scene graph or
    /// questions about rooms.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d pack dataset --to webdataset --images views --shuffle 1\n",
            "  s3d pack dataset --to colmap -o colmap --areas 1 --copy-images\n",
            "  s3d pack dataset --to nerfstudio\n",
            "  s3d pack dataset --to coco --areas 1,2,3,4,6 -o coco_train\n",
            "  s3d pack dataset --to parquet -o images.parquet",
        )
    )]
    Pack(pack::PackArgs),
    /// Compute the world coordinates of a data set's images again, from depth and pose.
    #[command(
        after_help = concat!(
            "Example:\n",
            "  s3d xyz dataset --type float --overwrite\n",
            "Depth is stored in steps of 2 mm (or 1 mm), so the coordinates are off by up to half a step \
             along the ray.\n",
            "A pixel beyond the range of the depth is missing. `s3d export` writes the coordinates of the \
             hits themselves.",
        )
    )]
    Xyz(additions::AddArgs<XyzOptions>),
    /// Find the images of a data set that see the same surface: overlaps, angles, scales and distances, in
    /// area_N/pairs.npz.
    Pairs(additions::AddArgs<PairsOptions>),
    /// Move the borders of a data set's image labels to the edges of the pictures, in images of their own:
    /// semantic_refined, and semantic_moved, which tells where.
    #[command(after_help = "Example:\n  s3d refine dataset")]
    Refine(additions::AddArgs<RefineOptions>),
    /// Write the files that point cloud loaders read, from an existing data set.
    #[command(
        after_help = concat!(
            "Example:\n",
            "  s3d profile dataset --to pointnet --to pointcept\n",
            "Each loader's files are in dataset/profiles/NAME.",
        )
    )]
    Profile(additions::ProfileArgs),
    /// Write a page that shows a data set: panoramas, views, plan, numbers, warnings. It opens from the disk.
    #[command(
        after_help = concat!(
            "Example:\n",
            "  s3d report dataset\n",
            "Then open dataset_report/index.html. It needs no server and no network.",
        )
    )]
    Report(report::ReportArgs),
    /// Draw figures of a data set for print, as PDF and PNG: modalities, areas from above, samples,
    /// distributions, examples, detections.
    #[command(after_help = "Example:\n  s3d figures dataset -o figs")]
    Figures(report::FiguresArgs),
    /// Print the tables of statistics of a data set, counted from its files.
    #[command(after_help = "Example:\n  s3d stats dataset")]
    Stats(stats::StatsArgs),
    /// Read a data set back and check it: against its manifest, against itself, and every image against the
    /// mesh.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d verify dataset\n",
            "  s3d verify dataset --full\n",
            "Each fault is a line on standard output; the last line counts. Exit code 0 without faults, 1 \
             with some.",
        )
    )]
    Verify(verify::VerifyArgs),
    /// Print the differences between two data sets: options, files, labels, views, pixels, poses.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d compare dataset other\n",
            "  s3d compare dataset other --json - | jq .labels.matrix\n",
            "Exit code 0 if both hold the same data, 1 if they differ or could not be compared, 2 for a \
             wrong call.\n",
            "Data sets hold the same data if their files have the same bytes. The manifests tell how they \
             were made:\n",
            "differences between them are listed but do not count.",
        )
    )]
    Compare(compare::CompareArgs),
    /// Score predictions against a data set, by the definitions that published results use.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d eval sem3d --truth dataset --pred predictions --areas 5\n",
            "  s3d eval det --truth dataset --pred boxes.json --folds paper --json result.json\n",
            "The page \"Evaluation\" of the documentation (the module `s3d_eval::protocols`) describes each \
             protocol and the files of its predictions.",
        )
    )]
    Eval(eval::EvalArgs),
    /// Train, run or measure the paper's baseline detector: boxes of twelve classes in the points of an area.
    #[command(
        after_help = concat!(
            "Examples:\n",
            "  s3d detect table dataset --seeds 5\n",
            "  s3d detect train dataset --areas 1,2,3,4,6 -o model.json\n",
            "  s3d detect run dataset model.json --areas 5 -o found.json\n",
            "The page \"The baseline detector\" of the documentation explains how it works and what its \
             numbers mean.",
        )
    )]
    Detect(detect::DetectArgs),
}

impl Command {
    /// Whether a signal stops this command between files. The other commands write one thing or nothing, and
    /// the system ends them.
    pub(crate) fn stops_between_files(&self) -> bool {
        match self {
            Self::Demo(_)
            | Self::Export(_)
            | Self::Fuse(_)
            | Self::Plan(_)
            | Self::Merge(_)
            | Self::Sample(_)
            | Self::Segments(_)
            | Self::Pack(_)
            | Self::Xyz(_)
            | Self::Pairs(_)
            | Self::Refine(_)
            | Self::Profile(_)
            | Self::Report(_)
            | Self::Figures(_)
            | Self::Align(_)
            | Self::Label(_)
            | Self::Compare(_)
            | Self::Eval(_)
            | Self::Detect(_) => true,
            Self::Render(args) => args.at.is_none(),
            Self::Info(_) | Self::Stats(_) | Self::Verify(_) => false,
        }
    }

    pub(crate) fn run(self) -> Outcome<()> {
        match self {
            Self::Demo(args) => demo::run(args),
            Self::Export(args) => export::run(args),
            Self::Fuse(args) => fuse::run(args),
            Self::Align(args) => align::run(args),
            Self::Plan(args) => plan::run(args),
            Self::Merge(args) => merge::run(args),
            Self::Sample(args) => sample::run(args),
            Self::Segments(args) => segments::run(args),
            Self::Label(args) => label::run(args),
            Self::Render(args) => render::run(args),
            Self::Info(args) => info::run(args),
            Self::Pack(args) => pack::run(args),
            Self::Xyz(args) => additions::xyz(args),
            Self::Pairs(args) => additions::pairs(args),
            Self::Refine(args) => additions::refine(args),
            Self::Profile(args) => additions::profile(args),
            Self::Report(args) => report::run(args),
            Self::Figures(args) => report::figures(args),
            Self::Stats(args) => stats::run(&args),
            Self::Verify(args) => verify::run(args),
            Self::Compare(args) => compare::run(args),
            Self::Eval(args) => eval::run(args),
            Self::Detect(args) => detect::run(args),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use s3d_dataset::ExportOptions;
    use s3d_dataset::options::Profile;
    use s3d_io::dataset::Domain;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    fn options(args: &[&str]) -> ExportOptions {
        match Cli::parse_from(["s3d", "export", "s.toml"].iter().chain(args)).command {
            Command::Export(args) => args.options,
            _ => panic!("another command"),
        }
    }

    #[test]
    fn defaults_are_the_papers() {
        let o = options(&[]);
        assert_eq!(o, ExportOptions::default());
        assert_eq!((o.views, o.size, o.pano_width, o.seed, o.entropy_stride), (72, 1080, 4096, 0, 4));
    }

    fn canonical(args: &[&str]) -> ExportOptions {
        options(args).canonical().unwrap()
    }

    #[test]
    fn options_written_in_two_ways_are_the_same() {
        let (x, y) = ("00112233445566778899aabbccddeeff", "508160ba5d80a2e365609578a09bab8b");
        let a = canonical(&[
            "--modalities",
            "pose,rgb,pose",
            "--only",
            "508160BA-5d80-a2e3-6560-9578a09bab8b",
            x,
        ]);
        assert_eq!(a, canonical(&["--modalities", "rgb,pose", "--only", &[x, y, x].join(",")]));
        assert_eq!(a.modalities, [Domain::Rgb, Domain::Pose]);
        let none = canonical(&["--xyz", "none", "--profile", "pointnet,mmdet3d", "--profile", "pointnet"]);
        assert!(none.modalities.len() == 6 && !none.modalities.contains(&Domain::GlobalXyz));
        assert_eq!(none.profiles, [Profile::Mmdet3d, Profile::PointNet]);
        assert_eq!(options(&["--pad-labels", "off"]).pad_labels.to_string(), "off");
    }
}
