//! `s3d plan`: labels and scores, for the shards of an export.

use crate::args::{Scenes, Threads};
use crate::commands::on_threads;
use crate::failure::Outcome;
use crate::values::parsed;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use s3d_dataset::ExportOptions;
use s3d_dataset::export::Shard;
use std::ffi::OsString;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    pub(crate) scenes: Scenes,
    /// The plan's folder. A second call makes only what is missing in it.
    #[arg(short, long, value_name = "PLAN")]
    pub(crate) output: PathBuf,
    /// Make one of N parts of the plan, such as 2/4. The parts may be made anywhere, in any order.
    #[arg(long, value_name = "i/N", value_parser = parsed::<Shard>)]
    pub(crate) shard: Option<Shard>,
    #[command(flatten)]
    options: PlanOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

/// The options of an export on which labels and scores depend, in the order of the help.
const PLANNED: [&str; 10] = [
    "views",
    "size",
    "seed",
    "place_cameras",
    "see",
    "entropy_stride",
    "lenient",
    "fill",
    "trim_strays",
    "allow",
];

/// The options of an export for a plan. It takes the ones in [`PLANNED`] as `s3d export` does; all others
/// have their defaults.
#[derive(Clone, Debug)]
struct PlanOptions(ExportOptions);

impl PlanOptions {
    fn arguments() -> Vec<Arg> {
        let export = ExportOptions::augment_args(Command::new("export"));
        PLANNED
            .iter()
            .filter_map(|name| export.get_arguments().find(|argument| argument.get_id() == name))
            .map(|argument| argument.clone().display_order(None))
            .collect()
    }
}

impl Args for PlanOptions {
    fn augment_args(command: Command) -> Command {
        command.args(Self::arguments())
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for PlanOptions {
    /// Lets the arguments of an export read the given words again, since these make all of its options.
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut words: Vec<OsString> = Vec::new();
        for argument in Self::arguments() {
            let id = argument.get_id().as_str();
            if matches.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }

            let flag = format!("--{}", argument.get_long().unwrap_or(id));
            if argument.get_action().takes_values() {
                for value in matches.get_raw(id).into_iter().flatten() {
                    words.extend([flag.clone().into(), value.to_owned()]);
                }
            } else {
                words.push(flag.into());
            }
        }

        let export = ExportOptions::augment_args(Command::new("export").no_binary_name(true));
        ExportOptions::from_arg_matches(&export.try_get_matches_from(words)?).map(Self)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

pub(crate) fn run(args: PlanArgs) -> Outcome<()> {
    let PlanOptions(options) = args.options;
    on_threads(args.threads, |context| {
        s3d_dataset::plan(&args.scenes.sources(), &args.output, &options, args.shard, context)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use s3d_dataset::options::Condition;

    #[derive(Parser)]
    struct Plan {
        #[command(flatten)]
        args: PlanArgs,
    }

    fn options(words: &[&str]) -> Result<ExportOptions, clap::Error> {
        let call = ["plan", "a.toml", "-o", "plan"].iter().chain(words);
        Plan::try_parse_from(call).map(|plan| plan.args.options.0)
    }

    #[test]
    fn its_options_are_those_of_an_export() {
        assert_eq!(options(&[]).unwrap(), ExportOptions::default());
        let given = ["--views", "3", "--seed=7", "--fill", "0.5", "--lenient", "--allow", "up,size"];
        let expected = ExportOptions {
            views: 3,
            seed: 7,
            fill: Some(0.5),
            lenient: true,
            allow: vec![Condition::Up, Condition::Size],
            ..ExportOptions::default()
        };
        assert_eq!(options(&given).unwrap(), expected);

        for bad in
            [&["--xyz", "half"] as &[&str], &["--size", "7"], &["--see", "0.9", "--place-cameras", "2"]]
        {
            assert!(options(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn every_option_of_an_export_is_planned_or_makes_no_difference_to_a_plan() {
        let others = [
            "pano_width",
            "pool",
            "points_per_m2",
            "modalities",
            "keep_all",
            "only",
            "normals",
            "rgb_samples",
            "semantic_glb",
            "compression",
            "xyz",
            "normal_axes",
            "depth_units",
            "pad_labels",
            "profiles",
        ];
        let mut known: Vec<&str> = PLANNED.into_iter().chain(others).collect();
        known.sort_unstable();

        let export = ExportOptions::augment_args(Command::new("export"));
        let mut options: Vec<&str> = export.get_arguments().map(|a| a.get_id().as_str()).collect();
        options.sort_unstable();
        assert_eq!(known, options);
    }
}
