//! The integration tests of the crate in one program: each program is compiled and linked with all crates.
//! `cargo test -p s3d-report --test all against::` runs the tests of one file.

mod common;

mod against;
mod contract;
mod figures;
mod ground;
mod meshes;
mod poster;
mod relations;
