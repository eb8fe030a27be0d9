//! One file a subcommand.

pub(crate) mod demo;
pub(crate) mod export;
pub(crate) mod info;
pub(crate) mod merge;
pub(crate) mod pack;
pub(crate) mod plan;
pub(crate) mod profile;
pub(crate) mod render;
pub(crate) mod sample;
pub(crate) mod stats;
pub(crate) mod verify;
pub(crate) mod xyz;

use crate::args::Threads;
use crate::failure::{Failure, Outcome, passes};
use s3d_io::Error;
use std::io::{ErrorKind, Write, stdout};
use std::path::Path;

/// Runs `work` on a pool of the threads asked for.
fn on_threads<T: Send>(threads: Threads, work: impl FnOnce() -> Outcome<T> + Send) -> Outcome<T> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.threads.map_or(0, usize::from))
        .build()
        .map_err(|e| {
            let message = format!("cannot start threads: {e}");
            if passes(&e) { Failure::Again(message) } else { Failure::Input(message) }
        })?;
    pool.install(work)
}

/// Writes the answer of a command to standard output.
fn print(text: &str) -> Outcome<()> {
    match stdout().write_all(text.as_bytes()) {
        // Whoever reads may stop early: `s3d stats OUT | head`.
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::io("standard output".as_ref(), "write", e).into())
        }
        _ => Ok(()),
    }
}

/// Refuses to replace a file unless that was asked for.
pub(crate) fn refuse_existing(path: &Path, overwrite: bool) -> Outcome<()> {
    match path.try_exists() {
        Ok(true) if !overwrite => {
            Err(Failure::Call(format!("{} is there already: replace it with --overwrite", path.display())))
        }
        Ok(_) => Ok(()),
        Err(e) => Err(Error::io(path, "look for", e).into()),
    }
}
