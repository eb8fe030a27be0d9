//! The integration tests of the crate in one program: each program is compiled and linked with all crates.
//! `cargo test -p s3d-eval --test all boxes::` runs the tests of one file.

mod scene;

mod boxes;
mod boxes_reference;
mod hints;
mod image_forms;
mod images;
mod images_reference;
mod panoptic;
mod panoptic_reference;
mod points;
mod points_panoptic;
mod points_reference;
mod points_scannet;
mod views;
