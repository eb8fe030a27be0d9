//! Images in another size.

use crate::arrays;
use crate::error::usage;
use numpy::{PyArray3, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use s3d_geom::Raster;

/// What an output pixel takes of a row or column: the first input pixel, and the weights from there on.
struct Share {
    first: usize,
    weights: Vec<f32>,
}

/// Shares `length` pixels from `start` on out among `count` output pixels.
fn shares(start: u32, length: u32, count: u32) -> Vec<Share> {
    let width = f64::from(length) / f64::from(count);
    let of = |i: u32| {
        let (begin, end) = (f64::from(i) * width, f64::from(i + 1) * width);
        let first = begin.floor();
        let last = end.ceil().min(f64::from(length));
        let pixels = first as u32..last as u32;
        let covered = |pixel: u32| {
            let pixel = f64::from(pixel);
            ((end.min(pixel + 1.0) - begin.max(pixel)).max(0.0) / width) as f32
        };
        Share { first: (start + pixels.start) as usize, weights: pixels.map(covered).collect() }
    };
    (0..count).map(of).collect()
}

/// Returns the window (x, y, width, height) of an image (H, W, 3) in another size (width, height). Each pixel
/// is the mean of the area that it covers.
#[pyfunction]
pub(crate) fn averaged<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'_, u8>,
    window: [u32; 4],
    size: [u32; 2],
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let [height, width, channels] = <[usize; 3]>::try_from(image.shape()).unwrap_or_default();
    let [x, y, wide, high] = window;
    let is_inside = x as usize + wide as usize <= width && y as usize + high as usize <= height;
    if channels != 3 || !is_inside || [wide, high, size[0], size[1]].contains(&0) {
        return Err(usage(format!("a window {window:?} in {size:?} of an image of {width} × {height}")));
    }
    let pixels = image.as_slice().map_err(|e| usage(e.to_string()))?;

    let averaged = py.detach(|| {
        let (columns, rows) = (shares(x, wide, size[0]), shares(y, high, size[1]));
        let mut averaged = Vec::with_capacity(size[0] as usize * size[1] as usize);
        let mut sums = vec![[0.0f32; 3]; size[0] as usize];
        for row in &rows {
            sums.fill([0.0; 3]);
            for (line, of_row) in pixels.chunks_exact(3 * width).skip(row.first).zip(&row.weights) {
                let (line, _) = line.as_chunks::<3>();
                for (sum, column) in sums.iter_mut().zip(&columns) {
                    for (pixel, of_column) in line.iter().skip(column.first).zip(&column.weights) {
                        let weight = of_row * of_column;
                        for (sum, level) in sum.iter_mut().zip(pixel) {
                            *sum += weight * f32::from(*level);
                        }
                    }
                }
            }
            averaged.extend(sums.iter().map(|sum| sum.map(|level| level.round() as u8)));
        }
        Raster::from_vec(size[0], size[1], averaged)
    });
    arrays::image_of_rows(py, averaged)
}
