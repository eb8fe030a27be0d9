//! `s3d export`: scenes to a data set.

use super::on_threads;
use crate::args::{Scenes, Threads};
use crate::failure::{Failure, Outcome};
use crate::values::parsed;
use clap::Args;
use s3d_dataset::export::Shard;
use s3d_dataset::pack::{PackageArguments, PackageKind, default_output, pack_scenes};
use s3d_dataset::{Export, ExportOptions};
use s3d_io::dataset::Domain;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    #[command(flatten)]
    pub(crate) scenes: Scenes,
    /// The data set's folder [default: SCENE_2d3ds beside the first scene]
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Option<PathBuf>,
    /// Write into an OUT that is not empty. An earlier data set there, or an unfinished one of another call,
    /// is replaced; other files stay.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Do one of N parts of the work, such as 2/4. The parts may be done anywhere, in any order, into the
    /// same OUT or into one OUT each; `s3d merge` joins them into the data set.
    #[arg(long, value_name = "i/N", value_parser = parsed::<Shard>)]
    pub(crate) shard: Option<Shard>,
    /// Take labels and scores from the folder that `s3d plan` made, instead of computing them.
    #[arg(long, value_name = "PLAN")]
    pub(crate) plan: Option<PathBuf>,
    /// Find the images that see the same surface, too, as `s3d pairs OUT` does.
    #[arg(long, conflicts_with = "shard")]
    pub(crate) pairs: bool,
    /// Write a package to OUT in place of a data set, as `s3d pack` does, without millions of small files on
    /// the way [default of OUT: SCENE_2d3ds_KIND]
    #[arg(long, value_name = "webdataset|huggingface|dust3r|wai|vggt", value_parser = parsed::<PackageKind>,
        conflicts_with_all = ["pairs", "shard"])]
    pub(crate) to: Option<PackageKind>,
    #[command(flatten)]
    pub(crate) options: ExportOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: ExportArgs) -> Outcome<()> {
    if args.pairs && !args.options.modalities.contains(&Domain::Pose) {
        return Err(Failure::Usage("--pairs needs poses: add pose to --modalities".to_owned()));
    }
    let output = args
        .output
        .unwrap_or_else(|| default_output(&args.scenes.scenes[0], args.to));
    let export = Export::new(args.scenes.sources())
        .options(args.options)
        .overwrite(args.overwrite)
        .shard(args.shard)
        .plan(args.plan);
    on_threads(args.threads, |context| {
        if let Some(kind) = args.to {
            let package = PackageArguments::default().package(kind)?;
            return pack_scenes(&export, &package, &output, context).map(drop);
        }
        export.run(&output, context)?;
        if args.pairs {
            s3d_dataset::pairs::missing_pairs(&output, context)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use s3d_dataset::options::{Condition, Profile};
    use s3d_io::mesh::MeshFormat;

    #[test]
    fn the_help_names_all_that_can_be_chosen() {
        let mut command = crate::cli::Cli::command();
        let help = command
            .find_subcommand_mut("export")
            .unwrap()
            .render_long_help()
            .to_string();
        let names = Domain::ALL
            .map(|domain| domain.folder().to_owned())
            .into_iter()
            .chain(Profile::ALL.map(|profile| profile.to_string()))
            .chain(Condition::ALL.map(|condition| condition.to_string()))
            .chain(MeshFormat::ALL.iter().map(|format| format.name.to_owned()));
        for name in names {
            assert!(help.contains(&name), "{name}");
        }
    }
}
