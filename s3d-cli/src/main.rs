//! `s3d`: from an annotated scan to a registered 2D-3D-Semantic data set.

mod arg_values;
mod args;
mod commands;
mod console;
mod event;
mod failure;
mod hint;
mod pack;
mod panics;
mod pipeline;
mod stop;
mod verify;

use args::{Cli, Command};
use clap::Parser;
use event::{Event, emit};
use failure::Outcome;
pub(crate) use hint::resume_hint;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::thread;
use tracing::error;

fn main() -> ExitCode {
    // clap prints its own message for a wrong call, as text, and exits with 2.
    let cli = Cli::parse();
    console::start(cli.verbose, cli.quiet, cli.log);
    panics::install();
    if cli.command.stops_between_files() {
        stop::install();
    }
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    emit(&Event::Started { version: env!("CARGO_PKG_VERSION"), command: &words });
    let outcome = catch_unwind(AssertUnwindSafe(|| run(cli.command)));
    // A signal may be ending the process at this moment.
    while !stop::claim_end() {
        thread::park();
    }
    let exit_code = match outcome {
        Ok(Ok(())) => 0,
        Ok(Err(failure)) => {
            error!("{failure}");
            failure.exit_code()
        }
        // Its message is in the log already.
        Err(_) => 1,
    };
    emit(&Event::Finished { exit_code });
    ExitCode::from(exit_code)
}

fn run(command: Command) -> Outcome<()> {
    match command {
        Command::Demo(args) => commands::demo::run(args),
        Command::Export(args) => commands::export::run(args),
        Command::Plan(args) => commands::plan::run(&args),
        Command::Merge(args) => commands::merge::run(args),
        Command::Sample(args) => commands::sample::run(args),
        Command::Render(args) => commands::render::run(args),
        Command::Info(args) => commands::info::run(args),
        Command::Pack(args) => commands::pack::run(&args),
        Command::Xyz(args) => commands::xyz::run(&args),
        Command::Profile(args) => commands::profile::run(&args),
        Command::Stats(args) => commands::stats::run(&args),
        Command::Verify(args) => commands::verify::run(&args),
    }
}
