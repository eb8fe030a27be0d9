//! Values to arrays of NumPy, and back.

use crate::error::usage;
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use s3d_geom::Raster;
use s3d_geom::glam::{DMat3, DVec3, Vec3};

/// Turns rows into an array n × N, without a copy.
pub(crate) fn rows<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}

/// Turns an image into an array height × width, without a copy.
pub(crate) fn image<T: Element + Copy>(py: Python<'_>, image: Raster<T>) -> PyResult<Bound<'_, PyArray2<T>>> {
    let size = [image.height() as usize, image.width() as usize];
    PyArray1::from_vec(py, image.into_vec()).reshape(size)
}

/// Turns an image into an array height × width × N, without a copy.
pub(crate) fn image_of_rows<T: Element, const N: usize>(
    py: Python<'_>,
    image: Raster<[T; N]>,
) -> PyResult<Bound<'_, PyArray3<T>>>
where
    [T; N]: Copy,
{
    let size = [image.height() as usize, image.width() as usize, N];
    PyArray1::from_vec(py, image.into_vec().into_flattened()).reshape(size)
}

/// Returns the rows of an array n × N. Errors name the array as `what`.
pub(crate) fn from_rows<T: Element + Copy, const N: usize>(
    what: &str,
    array: &PyReadonlyArray2<'_, T>,
) -> PyResult<Vec<[T; N]>> {
    let shape = array.shape();
    let (rows, rest) = match array.as_slice() {
        Ok(numbers) if shape[1] == N => numbers.as_chunks(),
        _ => {
            return Err(usage(format!(
                "{what}: an array n × {N} in C order, not {} × {}",
                shape[0], shape[1]
            )));
        }
    };
    debug_assert!(rest.is_empty());
    Ok(rows.to_vec())
}

/// Returns the rows of an array n × 3 as vectors.
pub(crate) fn points(what: &str, array: &PyReadonlyArray2<'_, f32>) -> PyResult<Vec<Vec3>> {
    Ok(bytemuck::cast_vec(from_rows::<f32, 3>(what, array)?))
}

/// Returns the rows of an array n × 3 of 64-bit numbers as vectors.
pub(crate) fn points_f64(what: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<DVec3>> {
    Ok(bytemuck::cast_vec(from_rows::<f64, 3>(what, array)?))
}

/// The matrix camera → world in OpenCV's axes, 4 × 4, row by row.
pub(crate) fn world_from_opencv(pose: &s3d_geom::Pose) -> [[f64; 4]; 4] {
    let rotation: DMat3 = pose.opencv_from_world();
    // The rows of world → camera are the columns of camera → world.
    let [right, down, forward] = [0, 1, 2].map(|k| rotation.row(k));
    let at = pose.location;
    let row = |k: usize| [right[k], down[k], forward[k], at[k]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}
