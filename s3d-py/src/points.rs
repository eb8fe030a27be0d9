//! Points of a mesh: sampling, and votes for the labels of faces.

use crate::arrays;
use crate::error::usage;
use crate::mesh::Mesh;
use crate::work::watched;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use s3d_dataset::check_memory;
use s3d_dataset::error::InputError;
use s3d_geom::{Density, NearestFaces, PointCloud, SurfaceSampler};
use s3d_label::{FaceVotes, LabelId, Labeler, MAX_LABELS, VoteError, VoteOptions, fill_labels};

/// The number of points that are drawn or vote between two checks for cancelling.
const CHUNK: usize = 1 << 20;

/// The bytes of a point with its colour and its face.
const POINT_BYTES: f64 = 19.0;

type Rows<'py, T> = Bound<'py, PyArray2<T>>;
type Column<'py, T> = Bound<'py, PyArray1<T>>;

/// Returns the positions, colours and faces of points spread evenly over a mesh: `total` points, or `per_m2`
/// a square metre if `total` is `None`.
#[pyfunction]
pub(crate) fn sample<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, Mesh>,
    per_m2: f64,
    total: Option<u64>,
    seed: u64,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<(Rows<'py, f32>, Rows<'py, u8>, Column<'py, u32>)> {
    if !(per_m2.is_finite() && per_m2 >= 0.0) {
        return Err(usage(format!("points_per_m2={per_m2}: must be a number from 0")));
    }
    let density = total.map_or(Density::PerM2(per_m2), Density::Total);
    let mesh = mesh.get();

    let cloud = watched(py, threads, &sink, |ctx| {
        let sampler = SurfaceSampler::new(mesh.mesh(), density, seed);
        check_memory(&format!("{} points", sampler.len()), sampler.len() as f64 * POINT_BYTES)?;
        let progress = ctx.progress("sampling", "points", sampler.len());
        let mut cloud = PointCloud::default();
        cloud.positions.reserve_exact(sampler.len() as usize);
        cloud.colors.reserve_exact(sampler.len() as usize);
        cloud.faces.reserve_exact(sampler.len() as usize);
        let mut part = PointCloud::default();
        for start in (0..sampler.len()).step_by(CHUNK) {
            ctx.check()?;
            let end = sampler.len().min(start + CHUNK as u64);
            sampler.sample(start..end, &mut part);
            cloud.positions.append(&mut part.positions);
            cloud.colors.append(&mut part.colors);
            cloud.faces.append(&mut part.faces);
            progress.add(end - start);
        }
        Ok(cloud)
    })?;

    Ok((
        arrays::rows::<f32, 3>(py, bytemuck::cast_vec(cloud.positions))?,
        arrays::rows(py, cloud.colors)?,
        PyArray1::from_vec(py, cloud.faces),
    ))
}

/// The columns of votes: label, its votes, runner-up, its votes, all votes, mean and largest distance. A
/// label is −1 where there is none.
type VoteColumns<'py> = (
    Column<'py, i32>,
    Column<'py, u32>,
    Column<'py, i32>,
    Column<'py, u32>,
    Column<'py, u32>,
    Column<'py, f32>,
    Column<'py, f32>,
);

/// Lets each labelled point vote for the face that is nearest to it.
#[pyfunction]
pub(crate) fn vote<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, Mesh>,
    xyz: PyReadonlyArray2<'py, f32>,
    labels: PyReadonlyArray1<'py, i64>,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<VoteColumns<'py>> {
    let points = arrays::points("xyz", &xyz)?;
    let labels = labels.to_vec().map_err(|e| usage(format!("labels: {e}")))?;
    let labels = labels.iter().enumerate().map(label_id).collect::<PyResult<Vec<_>>>()?;
    if points.len() != labels.len() {
        return Err(usage(format!("{} labels for {} points: one for each", labels.len(), points.len())));
    }

    let mesh = mesh.get();
    let faces: Vec<Option<FaceVotes>> = watched(py, threads, &sink, |ctx| {
        let nearest = NearestFaces::new(mesh.mesh());
        let mut labeler = Labeler::with_options(&nearest, VoteOptions::default());
        let progress = ctx.progress("voting", "points", points.len() as u64);
        for (points, labels) in points.chunks(CHUNK).zip(labels.chunks(CHUNK)) {
            ctx.check()?;
            labeler
                .add_labelled_points(points, labels)
                .map_err(|e: VoteError| InputError::Labels { why: e.to_string() })?;
            progress.add(points.len() as u64);
        }
        Ok(labeler.finish().iter().collect())
    })?;

    Ok((
        PyArray1::from_iter(py, faces.iter().map(|f| f.map_or(-1, |f| python_label(f.label)))),
        PyArray1::from_iter(py, faces.iter().map(|f| f.map_or(0, |f| f.votes as u32))),
        PyArray1::from_iter(py, faces.iter().map(|f| f.map_or(-1, |f| python_label(f.runner_up)))),
        PyArray1::from_iter(py, faces.iter().map(|f| f.map_or(0, |f| f.runner_up_votes as u32))),
        PyArray1::from_iter(py, faces.iter().map(|f| f.map_or(0, |f| f.total as u32))),
        PyArray1::from_iter(py, faces.iter().map(|f| f.map_or(f32::NAN, |f| f.mean_m))),
        PyArray1::from_iter(py, faces.iter().map(|f| f.map_or(f32::NAN, |f| f.farthest_m))),
    ))
}

/// Returns the labels of faces, in which a face without one has the label of the labelled surface next to it.
#[pyfunction]
pub(crate) fn fill<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, Mesh>,
    labels: PyReadonlyArray1<'py, i64>,
    within: f64,
) -> PyResult<Column<'py, i32>> {
    let labels = labels.to_vec().map_err(|e| usage(format!("labels: {e}")))?;
    let mesh = mesh.get();
    let faces = mesh.mesh().faces().len();
    if labels.len() != faces {
        return Err(usage(format!("{} labels for {faces} faces: one for each", labels.len())));
    }
    if within.is_nan() || within < 0.0 {
        return Err(usage(format!("within={within}: must be metres, from 0")));
    }

    let mut ids = labels
        .iter()
        .enumerate()
        .map(|(place, label)| match label {
            -1 => Ok(LabelId::NULL),
            _ => label_id((place, label)),
        })
        .collect::<PyResult<Vec<_>>>()?;
    crate::work::detached(py, None, || fill_labels(mesh.mesh(), &mut ids, within))?;
    Ok(PyArray1::from_iter(py, ids.iter().map(|id| python_label(*id))))
}

/// The label of an id. Labels count from 0 in Python, and −1 is none; here 0 is none.
fn python_label(id: LabelId) -> i32 {
    id.0 as i32 - 1
}

/// The id of a label, which counts from 0.
fn label_id((place, label): (usize, &i64)) -> PyResult<LabelId> {
    match u32::try_from(*label) {
        Ok(label) if (label as usize) < MAX_LABELS - 1 => Ok(LabelId(label + 1)),
        _ => Err(usage(format!("labels[{place}] is {label}: must be from 0 to {}", MAX_LABELS - 2))),
    }
}
