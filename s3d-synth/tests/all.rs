//! The integration tests of the crate in one program: each program is compiled and linked with all crates.
//! `cargo test -p s3d-synth --test all any_options::` runs the tests of one file.

mod common;

mod any_options;
mod areas;
mod demo;
mod devices;
mod errors;
mod generated;
#[cfg(feature = "files")]
mod raw_scans;
mod two_storeys;
