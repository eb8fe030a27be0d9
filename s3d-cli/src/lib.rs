//! The command line of `s3d`, from an annotated scan to a registered 2D-3D-Semantic data set, as one call:
//! [`run`]. This crate translates words into calls of `s3d-dataset`, and the events of these calls into lines
//! for a person or a program.

mod answer;
mod args;
mod cli;
mod commands;
mod console;
mod ending;
mod failure;
mod flags;
mod hint;
mod panics;
mod stop;
mod upright;
mod values;

use clap::Parser;
use cli::Cli;
use failure::Outcome;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread;
use tracing::error;

/// Runs the command line `args`, the name of the program first, and returns the exit code: 0 done, 1 the
/// input or the disk, 2 the call, 75 stopped by a signal or by something that may pass.
///
/// A process calls it once, as its whole work: it takes over the log, panics, SIGINT and SIGTERM. Five
/// seconds after such a signal it ends the process, if the work has not ended by then.
pub fn run(args: impl IntoIterator<Item = impl Into<OsString>>) -> u8 {
    let args: Vec<OsString> = args.into_iter().map(Into::into).collect();
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(e) => {
            // This prints the help, the version, or what is wrong with the call. The reader may be gone.
            let _ = e.print();
            return e.exit_code() as u8;
        }
    };

    console::start(cli.verbose, cli.quiet, cli.log);
    panics::install();
    if cli.command.stops_between_files() {
        ending::install();
    }
    let words: Vec<String> = args.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    console::started(&words);
    hint::remember(words);

    let outcome: std::thread::Result<Outcome<()>> = catch_unwind(AssertUnwindSafe(|| cli.command.run()));

    // After a signal another thread may have claimed the end. This one then waits for the process to end.
    while !ending::claim_end() {
        thread::park();
    }
    let exit_code = match outcome {
        Ok(Ok(())) => 0,
        Ok(Err(failure)) => {
            error!("{failure}");
            failure.exit_code()
        }
        // The log has the message of the panic already.
        Err(_) => 1,
    };
    console::finished(exit_code);
    exit_code
}
