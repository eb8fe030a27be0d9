//! Segments of a mesh.

use crate::arrays;
use crate::error::usage;
use crate::mesh::Mesh;
use crate::work::watched;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use s3d_annotate::segments::{SegmentOptions, segment_faces};

/// The segment of each face, the nodes of each merge, its cost.
type Columns<'py> = (Bound<'py, PyArray1<u32>>, Bound<'py, PyArray2<u32>>, Bound<'py, PyArray1<f32>>);

/// Returns the segment of each face, and the nodes and costs of the merges.
#[pyfunction]
pub(crate) fn segments<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, Mesh>,
    scale_m2: f64,
    smallest_m2: f64,
    color: f64,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<Columns<'py>> {
    if !(scale_m2.is_finite() && scale_m2 > 0.0) {
        return Err(usage(format!("scale_m2={scale_m2}: must be a number above 0")));
    }
    for (name, value) in [("smallest_m2", smallest_m2), ("color", color)] {
        if !(value.is_finite() && value >= 0.0) {
            return Err(usage(format!("{name}={value}: must be a number from 0")));
        }
    }
    let options = SegmentOptions { scale_m2, smallest_m2, color };
    let mesh = mesh.get();

    let found = watched(py, threads, &sink, |ctx| {
        ctx.check()?;
        Ok(segment_faces(mesh.mesh(), &options))
    })?;

    let tree = &found.tree;
    let (children, costs) = (tree.leaf_count()..tree.node_count())
        .filter_map(|node| Some((tree.children(node)?, tree.cost(node))))
        .unzip::<_, _, Vec<_>, Vec<_>>();
    Ok((
        PyArray1::from_vec(py, found.segment_of_face),
        arrays::rows(py, children)?,
        PyArray1::from_vec(py, costs),
    ))
}
