//! `s3d`: from an annotated scan to a registered 2D-3D-Semantic data set. This crate translates words into
//! calls of `s3d-dataset`, and what these tell into lines for a person or a program.

mod args;
mod cli;
mod commands;
mod console;
mod failure;
mod hint;
mod panics;
mod stop;
mod values;

use clap::Parser;
use cli::Cli;
use failure::Outcome;
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
    console::started(&words);
    let outcome: std::thread::Result<Outcome<()>> = catch_unwind(AssertUnwindSafe(|| cli.command.run()));
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
    console::finished(exit_code);
    ExitCode::from(exit_code)
}
