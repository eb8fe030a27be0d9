//! A raw scan to a mesh.

use crate::work::watched;
use pyo3::prelude::*;
use s3d_dataset::fuse::{FuseOptions, Fused, fuse as fused};
use std::path::PathBuf;

/// Fuses a raw scan. `options` is JSON. Returns the numbers of images, fused faces, faces and closed holes,
/// and the largest error in metres.
#[pyfunction]
pub(crate) fn fuse(
    py: Python<'_>,
    inputs: Vec<PathBuf>,
    output: PathBuf,
    options: &str,
    overwrite: bool,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<([usize; 4], f64)> {
    let options: FuseOptions = crate::calls::options(options)?;
    let Fused { images, fused_faces, faces, max_error_m, closed } =
        watched(py, threads, &sink, |ctx| fused(&inputs, &output, &options, overwrite, ctx))?;
    Ok(([images, fused_faces, faces, closed], max_error_m))
}
