//! The integration tests of the crate in one program: each program is compiled and linked with all crates.
//! `cargo test -p s3d-render --test all colors::` runs the tests of one file.

#[path = "../benches/common/mod.rs"]
mod common;
mod room;

mod colors;
mod cues;
mod cues_plain;
mod exact;
mod images;
mod modalities;
mod objects;
mod pairs;
