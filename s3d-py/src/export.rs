//! Scenes to data sets.

use crate::error::{exception, usage};
use crate::mesh::{Mesh, parsed};
use crate::work::watched;
use numpy::{PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use s3d_dataset::{Condition, Error, Export, ExportOptions, SceneSource, SharedScene};
use s3d_geom::{NO_INDEX, Pose};
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::Annotations;
use s3d_io::mesh::MeshFile;
use s3d_label::{Label, Taxonomy};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What labels of a mesh in memory are called in messages.
const LABELS: &str = "labels in memory";

/// An area whose mesh is at hand.
#[derive(FromPyObject)]
pub(crate) struct Area<'py> {
    area: u32,
    mesh: Bound<'py, Mesh>,
    /// The names of labels, which of them each face has (−1 for none), and the taxonomy of their classes.
    labels: Option<(Vec<String>, PyReadonlyArray1<'py, i32>, String)>,
    /// By uuid, camera → world.
    locations: Vec<(String, [[f64; 4]; 4])>,
}

/// Scenes: paths, of which those of meshes are one scene; or areas in memory.
#[derive(FromPyObject)]
pub(crate) enum Scenes<'py> {
    Paths(Vec<PathBuf>),
    Areas(Vec<Area<'py>>),
}

/// Makes a data set, or goes on with it. Options are JSON. Returns a summary as JSON; None if all was there
/// already.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn export(
    py: Python<'_>,
    scenes: Scenes<'_>,
    output: PathBuf,
    options: &str,
    allow: Vec<String>,
    overwrite: bool,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<Option<String>> {
    let mut options: ExportOptions = serde_json::from_str(options).map_err(|e| usage(e.to_string()))?;
    let conditions = Condition::ALL.map(|condition| condition.to_string()).join(", ");
    options.allow = allow
        .iter()
        .map(|word| parsed("allow", word, &conditions))
        .collect::<PyResult<_>>()?;
    let sources = match scenes {
        Scenes::Paths(paths) => SceneSource::list(paths, None, None),
        Scenes::Areas(areas) => areas.iter().map(source).collect::<PyResult<_>>()?,
    };
    let export = Export::new(sources).options(options).overwrite(overwrite);
    let summary = watched(py, threads, &sink, |ctx| export.run(output, ctx))?;
    let text = |summary| serde_json::to_string(&summary).map_err(|e| crate::error::fault(e.to_string()));
    summary.map(text).transpose()
}

fn source(area: &Area<'_>) -> PyResult<SceneSource> {
    let mesh = &area.mesh.get().file;
    let annotations = area
        .labels
        .as_ref()
        .map(|labels| annotations(mesh, area.area, labels))
        .transpose()?;
    let location = |(uuid, pose): &(String, [[f64; 4]; 4])| {
        let pose = Pose::from_opencv(*pose).map_err(|e| usage(format!("location {uuid}: {e}")))?;
        Ok(ScanLocation { uuid: uuid.clone(), pose, line: 0 })
    };
    let locations = area.locations.iter().map(location).collect::<PyResult<_>>()?;
    Ok(SharedScene::new(area.area, Arc::clone(mesh), annotations, locations).into())
}

fn annotations(
    mesh: &MeshFile,
    area: u32,
    (names, of_face, taxonomy): &(Vec<String>, PyReadonlyArray1<'_, i32>, String),
) -> PyResult<Annotations> {
    let taxonomy = Taxonomy::built_in(taxonomy).ok_or_else(|| {
        usage(format!("taxonomy={taxonomy:?}: must be one of {}", Taxonomy::BUILT_IN.join(", ")))
    })?;
    let label = |name: &String| {
        let label = taxonomy.label(&format!("{name}_{area}"));
        label
            .map_err(|e| usage(format!("labels: {e} (CLASS_INSTANCE_ROOM_NUMBER, such as chair_1_office_2)")))
    };
    let labels = names.iter().map(label).collect::<PyResult<Vec<Label>>>()?;
    let of_face = of_face.to_vec().map_err(|e| usage(format!("labels: {e}")))?;
    let faces = mesh.mesh.faces().len();
    if of_face.len() != faces {
        return Err(usage(format!("{} labels for {faces} faces: one for each", of_face.len())));
    }
    let place = |(face, place): (usize, &i32)| match usize::try_from(*place) {
        Ok(place) if place < labels.len() => Ok(place as u32),
        Err(_) if *place == -1 => Ok(NO_INDEX),
        _ => Err(usage(format!("labels: face {face} has {place}, and there are {} names", labels.len()))),
    };
    let of_face = of_face.iter().enumerate().map(place).collect::<PyResult<Vec<u32>>>()?;
    let found = Annotations::from_face_labels(Path::new(LABELS), &mesh.mesh, &labels, &of_face);
    let mut found = found.map_err(|e| exception(&Error::from(e)))?;
    found.taxonomy = taxonomy;
    Ok(found)
}

/// The uuid of a scan location that has a name alone.
#[pyfunction]
pub(crate) fn uuid_of_name(name: &str) -> String {
    s3d_io::camera::uuid_from_name(name)
}

/// The names of the options of an export, but `allow`.
#[pyfunction]
pub(crate) fn export_option_names() -> Vec<&'static str> {
    ExportOptions::names().to_vec()
}
