//! The integration tests of the crate in one program: each program is compiled and linked with all crates.
//! `cargo test -p s3d-io --test all clouds::` runs the tests of one file.

mod feed;

mod camera_lists;
#[path = "cloud_forms/main.rs"]
mod cloud_forms;
mod clouds;
mod copyroom;
mod findings;
mod gltf;
mod gltf_compressed;
mod hard_inputs;
mod label_files;
mod limits;
mod mesh_dialects;
mod pointcloud_mat;
mod published;
mod readers;
mod saved_labels;
