//! `s3d detect`: the paper's baseline detector, trained, run, and measured.

use crate::answer::{print, print_json};
use crate::args::Threads;
use crate::commands::scores::on_threads_or;
use crate::failure::{Failure, Outcome};
use crate::values::parsed;
use clap::{Args, Subcommand, value_parser};
use s3d_dataset::store::NewFile;
use s3d_dataset::{Context, DataSet};
use s3d_detect::{
    Error, Model, ParsedArea, Result, Space, SpaceSource, TrainOptions, cross_validate, detect_area,
    read_areas, table,
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

/// The spaces to learn from.
#[derive(Clone, Debug, Args)]
struct Learning {
    /// The source of everything random.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The spaces to search: spaces that are found in the points, or the annotated rooms.
    #[arg(long, default_value_t, value_parser = parsed::<SpaceSource>, value_name = "parsed|rooms")]
    spaces: SpaceSource,
    /// Learn from at most N spaces, drawn at random. Time and memory grow with N.
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
    /// Repeat it for N seeds, from --seed on, and add the spread between them.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Print JSON.
    #[arg(long, conflicts_with = "latex")]
    json: bool,
    /// Print LaTeX in the layout of the paper's table.
    #[arg(long)]
    latex: bool,
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
    on_threads_or(threads, failure, |context| {
        let file = NewFile::begin(context, &output, overwrite)?;
        let options = learning.options();
        let areas = read(&dataset, &areas, options.spaces, context)?;
        let spaces: Vec<&Space> = areas.iter().flat_map(|a| &a.spaces).collect();
        Model::train(&spaces, &options, context)?.save(file.path())?;
        Ok(file.finish()?)
    })
}

fn find(args: RunArgs) -> Outcome<()> {
    let RunArgs { dataset, model, output, areas, overwrite, threads } = args;
    on_threads_or(threads, failure, |context| {
        let file = NewFile::begin(context, &output, overwrite)?;
        let model = Model::load(&model)?;
        let mut found = Vec::new();
        for area in read(&dataset, &areas, model.spaces, context)? {
            found.extend(detect_area(&model, &area, context)?);
        }
        s3d_io::fs::write_json(file.path(), &found)?;
        Ok(file.finish()?)
    })
}

fn print_table(args: &TableArgs) -> Outcome<()> {
    let tables = on_threads_or(args.threads, failure, |context| {
        let options = args.learning.options();
        let areas = read(&args.dataset, &[], options.spaces, context)?;
        (0..args.seeds)
            .map(|i| {
                let seed = options.seed.wrapping_add(i);
                cross_validate(&areas, &TrainOptions { seed, ..options.clone() }, context)
            })
            .collect::<Result<Vec<_>>>()
    })?;
    if args.json {
        print_json(&table::json(&tables))
    } else if args.latex {
        print(&table::latex(&tables))
    } else {
        print(&table::markdown(&tables))
    }
}

/// Translates an error of the detector into the words of the command line.
fn failure(error: Error) -> Failure {
    match error {
        Error::Dataset(error) => error.into(),
        error => Failure::Input(error.to_string()),
    }
}
