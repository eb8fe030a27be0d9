//! The tests of this folder, as one program.

mod common;
mod errors;
mod origins;
mod same_bytes;
mod scans;
mod scenes;
mod surfaces;
