//! Annotated points, read and written.

use crate::arrays;
use crate::error::{exception, usage};
use crate::work::watched;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use s3d_dataset::Error;
use s3d_geom::PointCloud;
use s3d_geom::glam::DVec3;
use s3d_io::cloud::{AnnotationOptions, Annotations, OnFault, write_colored_points, write_las_points};
use s3d_label::Taxonomy;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// How annotated points are read.
#[derive(FromPyObject)]
pub(crate) struct Reading {
    taxonomy: String,
    classes: BTreeMap<String, Option<String>>,
    class_column: Option<String>,
    instance_column: Option<String>,
    room_column: Option<String>,
    columns: Vec<String>,
    room: Option<String>,
    offset: [f64; 3],
    lenient: bool,
}

impl Reading {
    fn options(self) -> PyResult<AnnotationOptions> {
        let taxonomy = Taxonomy::built_in(&self.taxonomy).ok_or_else(|| {
            usage(format!("taxonomy={:?}: must be one of {}", self.taxonomy, Taxonomy::BUILT_IN.join(", ")))
        })?;

        let classes = self
            .classes
            .into_iter()
            .map(|(name, class)| {
                let class = class.map(|class| taxonomy.class(&class));
                Ok((name, class.transpose().map_err(|e| usage(format!("classes: {e}")))?))
            })
            .collect::<PyResult<_>>()?;
        let room = self
            .room
            .map(|room| taxonomy.room(&room).map_err(|e| usage(format!("room: {e}"))))
            .transpose()?;

        Ok(AnnotationOptions {
            classes,
            room,
            taxonomy,
            on_fault: if self.lenient { OnFault::Skip } else { OnFault::Stop },
            unknown_as_clutter: self.lenient,
            class_column: self.class_column,
            instance_column: self.instance_column,
            room_column: self.room_column,
            columns: self.columns,
            offset_m: DVec3::from_array(self.offset),
            ..AnnotationOptions::default()
        })
    }
}

/// The position, the colour and the index of the instance's name of each point, and the names.
type Annotated<'py> =
    (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<u8>>, Bound<'py, PyArray1<i32>>, Vec<String>);

/// Reads the annotated points of an area, instance by instance.
#[pyfunction]
pub(crate) fn read_points<'py>(
    py: Python<'py>,
    paths: Vec<PathBuf>,
    how: Reading,
    sink: Py<PyAny>,
) -> PyResult<Annotated<'py>> {
    if paths.is_empty() {
        return Err(usage("paths: none"));
    }
    let options = how.options()?;
    let (cloud, places, names) = watched(py, None, &sink, |ctx| {
        let found = Annotations::open(&paths, &options)?;
        for warning in &found.warnings {
            ctx.warn(warning);
        }
        let instances = found.rooms.iter().map(|room| room.instances.len() as u64).sum();
        let progress = ctx.progress("reading", "instances", instances);

        let mut cloud = PointCloud::default();
        let mut places = Vec::new();
        let mut names = Vec::new();
        for room in &found.rooms {
            for instance in &room.instances {
                ctx.check()?;
                let skipped = instance.read(&mut cloud)?;
                if let Some(error) = skipped.first {
                    ctx.warn(format_args!("{} points are left out, the first: {error}", skipped.count));
                }
                places.resize(cloud.len(), names.len() as i32);
                names.push(format!("{}_{}_{}", instance.class, instance.number, room.room));
                progress.add(1);
            }
        }
        Ok((cloud, places, names))
    })?;

    Ok((
        arrays::rows::<f32, 3>(py, bytemuck::cast_vec(cloud.positions))?,
        arrays::rows(py, cloud.colors)?,
        PyArray1::from_vec(py, places),
        names,
    ))
}

/// Writes points with their colours and labels as LAS or PLY, whole or not at all.
#[pyfunction]
pub(crate) fn write_points(
    py: Python<'_>,
    path: PathBuf,
    xyz: PyReadonlyArray2<'_, f32>,
    rgb: Option<PyReadonlyArray2<'_, u8>>,
    labels: Option<PyReadonlyArray1<'_, i32>>,
    is_las: bool,
) -> PyResult<()> {
    let positions = arrays::points("xyz", &xyz)?;
    let colors = rgb.map(|rgb| arrays::from_rows("rgb", &rgb)).transpose()?;
    let labels = labels.map(|labels| labels.to_vec()).transpose();
    let labels = labels.map_err(|e| usage(format!("labels: {e}")))?;
    let counts = [("colours", colors.as_ref().map(Vec::len)), ("labels", labels.as_ref().map(Vec::len))];
    for (what, found) in counts.into_iter().filter_map(|(what, found)| Some((what, found?))) {
        if found != positions.len() {
            return Err(usage(format!("{found} {what} for {} points: one for each", positions.len())));
        }
    }

    let cloud = PointCloud { positions, colors: colors.unwrap_or_default(), ..PointCloud::default() };
    let labels = labels.unwrap_or_default();
    let write = if is_las { write_las_points } else { write_colored_points };
    let written = py.detach(|| write(&path, &cloud, &labels));
    written.map(|_| ()).map_err(|e| exception(&Error::from(e)))
}
