//! `s3d detect`: the paper's baseline detector, trained, run, and measured.

use crate::args::Threads;
use crate::commands::{on_threads, print};
use crate::failure::Outcome;
use crate::values::parsed;
use clap::{Args, Subcommand, value_parser};
use s3d_dataset::{Context, DataSet, NewFile, Result};
use s3d_detect::{
    Model, ParsedArea, Space, SpaceSource, TrainOptions, cross_validate, detect_area, read_areas, table,
};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct DetectArgs {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Train a detector on areas of a data set.
    Train(TrainArgs),
    /// Find elements in areas of a data set: a JSON list of boxes, which `s3d eval det` reads.
    Run(RunArgs),
    /// Train and test over the paper's folds, and print its table.
    Table(TableArgs),
}

/// What is learnt from.
#[derive(Clone, Debug, Args)]
struct Learning {
    /// Everything random comes from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// What is searched: spaces that are found in the points, or the annotated rooms.
    #[arg(long, default_value_t, value_parser = parsed::<SpaceSource>, value_name = "parsed|rooms")]
    spaces: SpaceSource,
    /// Learn from so many spaces at most, drawn at random: time and memory follow.
    #[arg(long, value_name = "N", default_value_t = 100,
        value_parser = value_parser!(u32).range(1..=100_000))]
    most_spaces: u32,
}

impl Learning {
    fn options(&self) -> TrainOptions {
        let most_spaces = self.most_spaces as usize;
        TrainOptions { seed: self.seed, spaces: self.spaces, most_spaces, ..TrainOptions::default() }
    }
}

#[derive(Debug, Args)]
struct TrainArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    dataset: PathBuf,
    /// The file of the model.
    #[arg(short, long, value_name = "MODEL.json")]
    output: PathBuf,
    /// Areas to learn from [default: all]
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    areas: Vec<u32>,
    #[command(flatten)]
    learning: Learning,
    /// Replace the file.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    threads: Threads,
}

#[derive(Debug, Args)]
struct RunArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    dataset: PathBuf,
    /// The model.
    #[arg(value_name = "MODEL.json")]
    model: PathBuf,
    /// The file of the boxes.
    #[arg(short, long, value_name = "FOUND.json")]
    output: PathBuf,
    /// Areas to search [default: all]
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    areas: Vec<u32>,
    /// Replace the file.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    threads: Threads,
}

#[derive(Debug, Args)]
struct TableArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    dataset: PathBuf,
    #[command(flatten)]
    learning: Learning,
    /// Do it for so many seeds, from --seed on, and tell how far they spread.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    threads: Threads,
}

pub(crate) fn run(args: DetectArgs) -> Outcome<()> {
    match args.command {
        Command::Train(args) => train(args),
        Command::Run(args) => find(args),
        Command::Table(args) => print_table(&args),
    }
}

fn read(dataset: &Path, areas: &[u32], spaces: SpaceSource, context: &Context) -> Result<Vec<ParsedArea>> {
    let data = DataSet::open(dataset)?;
    let areas = if areas.is_empty() { data.areas() } else { areas };
    read_areas(&data, areas, spaces, context)
}

fn train(args: TrainArgs) -> Outcome<()> {
    let TrainArgs { dataset, output, areas, learning, overwrite, threads } = args;
    on_threads(threads, |context| {
        let file = NewFile::begin(context, &output, overwrite)?;
        let options = learning.options();
        let areas = read(&dataset, &areas, options.spaces, context)?;
        let spaces: Vec<&Space> = areas.iter().flat_map(|a| &a.spaces).collect();
        Model::train(&spaces, &options, context)?.save(file.path())?;
        file.finish()
    })
}

fn find(args: RunArgs) -> Outcome<()> {
    let RunArgs { dataset, model, output, areas, overwrite, threads } = args;
    on_threads(threads, |context| {
        let file = NewFile::begin(context, &output, overwrite)?;
        let model = Model::load(&model)?;
        let mut found = Vec::new();
        for area in read(&dataset, &areas, model.spaces, context)? {
            found.extend(detect_area(&model, &area, context)?);
        }
        s3d_io::fs::write_json(file.path(), &found)?;
        file.finish()
    })
}

fn print_table(args: &TableArgs) -> Outcome<()> {
    let tables = on_threads(args.threads, |context| {
        let options = args.learning.options();
        let areas = read(&args.dataset, &[], options.spaces, context)?;
        let of_seed = |seed| cross_validate(&areas, &TrainOptions { seed, ..options.clone() }, context);
        (0..args.seeds)
            .map(|i| of_seed(options.seed.wrapping_add(i)))
            .collect::<Result<Vec<_>>>()
    })?;
    print(&if args.json {
        table::json(&tables)
    } else {
        table::markdown(&tables)
    })
}
