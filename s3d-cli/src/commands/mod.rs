//! One file a subcommand: its words, and the call that they mean.

pub(crate) mod additions;
pub(crate) mod compare;
pub(crate) mod demo;
pub(crate) mod export;
pub(crate) mod info;
pub(crate) mod label;
pub(crate) mod meshes;
pub(crate) mod pack;
pub(crate) mod report;
pub(crate) mod scores;
pub(crate) mod shards;
pub(crate) mod stats;
pub(crate) mod verify;

use crate::args::Threads;
use crate::console;
use crate::failure::Outcome;
use crate::stop;
use s3d_dataset::{Context, Result};
use s3d_io::Error as FileError;
use std::io;

/// Makes a call on a pool of the threads asked for. It tells the console, and a signal cancels it.
fn on_threads<T: Send>(threads: Threads, call: impl FnOnce(&Context) -> Result<T> + Send) -> Outcome<T> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.threads.map_or(0, usize::from))
        .build()
        .map_err(|e| FileError::io("threads".as_ref(), "start", io::Error::other(e)))?;
    let context = Context::default()
        .cancelled_by(stop::cancel())
        .observed_by(console::observe);
    Ok(pool.install(|| call(&context))?)
}
