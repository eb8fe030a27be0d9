//! The compiled part of the Python package `s3d_py`. Nothing here is public in Python: the modules in
//! `python/s3d_py` wrap it, and document what they publish.

// No argument and no file may cause a panic.
#![deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::string_slice)]

mod annotations;
mod arrays;
mod calls;
mod command_line;
mod dataset;
mod detect;
mod error;
mod export;
mod fuse;
mod mesh;
mod points;
mod poses;
mod scene;
mod segments;
mod work;

/// `s3d_py._native`.
#[pyo3::pymodule(name = "_native", gil_used = false)]
mod native {
    use super::work;
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::annotations::{read_points, write_points};
    #[pymodule_export]
    use super::calls::{
        compare, evaluate, info, pack, profile, refine, report, statistics, verify, write_xyz,
    };
    #[pymodule_export]
    use super::command_line::run_command_line;
    #[pymodule_export]
    use super::dataset::{DataSet, averaged};
    #[pymodule_export]
    use super::detect::Detector;
    #[pymodule_export]
    use super::export::{export, export_option_names, uuid_of_name};
    #[pymodule_export]
    use super::fuse::fuse;
    #[pymodule_export]
    use super::mesh::Mesh;
    #[pymodule_export]
    use super::mesh::edit::{merged, save_mesh, transformed, with_faces};
    #[pymodule_export]
    use super::points::{fill, sample, vote};
    #[pymodule_export]
    use super::poses::read_poses;
    #[pymodule_export]
    use super::scene::{Scene, encode_png, look_at};
    #[pymodule_export]
    use super::segments::segments;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        work::hide_caught_panics();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
