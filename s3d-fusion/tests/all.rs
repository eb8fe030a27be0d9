//! The tests of this folder, as one program.

mod common;
mod errors;
mod same_bytes;
mod scans;
mod scenes;
mod surfaces;
