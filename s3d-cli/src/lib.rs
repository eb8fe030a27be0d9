//! The command line of `s3d`, from an annotated scan to a registered 2D-3D-Semantic data set, as one call:
//! [`run`]. This crate translates words into calls of `s3d-dataset`, and what these tell into lines for a
//! person or a program.

mod answer;
mod args;
mod cli;
mod commands;
mod console;
mod failure;
mod flags;
mod hint;
mod panics;
mod stop;
mod values;

use clap::Parser;
use cli::Cli;
use failure::Outcome;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread;
use tracing::error;

/// Runs the command that `args` spell, the name of the program first, and returns the exit code: 0 done, 1
/// the input or the disk, 2 the call, 75 stopped by a signal or something that may pass.
///
/// It is the whole of a process: once in one, it takes over the log, panics, and SIGINT and SIGTERM; five
/// seconds after one of these it ends the process, if the work has not come to an end by then.
pub fn run(args: impl IntoIterator<Item = impl Into<OsString>>) -> u8 {
    let args: Vec<OsString> = args.into_iter().map(Into::into).collect();
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(e) => {
            // The help, the version, or what is wrong with the call. Whoever reads it may be gone.
            let _ = e.print();
            return e.exit_code() as u8;
        }
    };
    console::start(cli.verbose, cli.quiet, cli.log);
    panics::install();
    if cli.command.stops_between_files() {
        stop::install();
    }
    let words: Vec<String> = args.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    console::started(&words);
    hint::remember(words);
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
    exit_code
}
