//! The integration tests of the crate in one program: each program is compiled and linked with all crates.
//! `cargo test -p s3d-detect --test all detector::` runs the tests of one file.

mod detector;
mod svm_reference;
