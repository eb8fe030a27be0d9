//! `s3d`: from an annotated scan to a registered 2D-3D-Semantic data set.

mod args;
mod commands;
mod console;
mod demo;
mod failure;
mod pack;
mod pipeline;

use args::{Cli, Command};
use clap::Parser;
use std::process::ExitCode;
use tracing::error;

fn main() -> ExitCode {
    // clap prints its own message for a wrong call and exits with 2.
    let cli = Cli::parse();
    console::start(cli.verbose, cli.quiet);
    let outcome = match cli.command {
        Command::Demo(args) => commands::demo::run(args),
        Command::Export(args) => commands::export::run(args),
        Command::Sample(args) => commands::sample::run(args),
        Command::Render(args) => commands::render::run(args),
        Command::Info(args) => commands::info::run(args),
        Command::Pack(args) => commands::pack::run(&args),
        Command::Xyz(args) => commands::xyz::run(&args),
        Command::Profile(args) => commands::profile::run(&args),
        Command::Stats(args) => commands::stats::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            error!("{failure}");
            failure.exit_code()
        }
    }
}
