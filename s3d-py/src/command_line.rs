//! The command `s3d`, run in Python's process.

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the command line `words`, the name of the program first, and returns its exit code.
#[pyfunction]
pub(crate) fn run_command_line(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| s3d_cli::run(words))
}
