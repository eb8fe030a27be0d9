//! The integration tests of the crate in one program: each program is compiled and linked with all crates.
//! `cargo test -p s3d-dataset --test all fill::` runs the tests of one file.

mod common;

mod changed;
mod cues;
mod fill;
mod library;
mod parts;
mod refined;
mod storeys;
mod strays;
mod useful;
