//! Scenes to data sets.

use crate::error::{exception, usage};
use crate::mesh::{Mesh, axes, parsed};
use crate::work::watched;
use numpy::{PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use s3d_dataset::export::{SceneSource, SharedScene};
use s3d_dataset::options::Condition;
use s3d_dataset::pack::{PackageArguments, PackageKind, pack_scenes};
use s3d_dataset::{Error, Export, ExportOptions};
use s3d_geom::{NO_INDEX, Pose};
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::Annotations;
use s3d_io::mesh::MeshFile;
use s3d_label::{Label, Taxonomy};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The name of the labels of a mesh in memory, for messages.
const LABELS: &str = "labels in memory";

/// An area whose mesh is in memory.
#[derive(FromPyObject)]
pub(crate) struct Area<'py> {
    area: u32,
    mesh: Bound<'py, Mesh>,
    /// The names of labels, the index of each face's name (−1 for none), and the taxonomy of their classes.
    labels: Option<(Vec<String>, PyReadonlyArray1<'py, i32>, String)>,
    /// The uuid and the matrix camera → world of each scan location.
    locations: Vec<(String, [[f64; 4]; 4])>,
}

/// Scenes: areas in memory, or paths. All paths of meshes together are one scene.
#[derive(FromPyObject)]
pub(crate) enum Scenes<'py> {
    Paths(Vec<PathBuf>),
    Areas(Vec<Area<'py>>),
}

/// Makes a data set, or with `to` a package of that kind, or goes on with it. `options` is JSON. Returns a
/// summary as JSON, or `None` if the data set was complete already.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn export(
    py: Python<'_>,
    scenes: Scenes<'_>,
    output: PathBuf,
    options: &str,
    allow: Vec<String>,
    up_and_units: (Option<String>, Option<String>),
    to: Option<&str>,
    overwrite: bool,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<Option<String>> {
    let mut options: ExportOptions = crate::calls::options(options)?;

    let conditions = Condition::ALL.map(|condition| condition.to_string()).join(", ");
    options.allow = allow
        .iter()
        .map(|word| parsed("allow", word, &conditions))
        .collect::<PyResult<_>>()?;
    let sources = match scenes {
        Scenes::Paths(paths) => {
            let axes = axes(up_and_units.0.as_deref(), up_and_units.1.as_deref())?;
            SceneSource::list(paths, axes.up, axes.units)
        }
        Scenes::Areas(areas) => areas.iter().map(source).collect::<PyResult<_>>()?,
    };

    let export = Export::new(sources).options(options).overwrite(overwrite);
    let kinds = PackageKind::WORDS.replace('|', ", ");
    let kind = to.map(|word| parsed("to", word, &kinds)).transpose()?;
    let summary = watched(py, threads, &sink, |ctx| match kind {
        Some(kind) => {
            let package = PackageArguments::default().package(kind)?;
            pack_scenes(&export, &package, &output, ctx).map(Some)
        }
        None => export.run(output, ctx),
    })?;
    summary.map(|summary| crate::calls::json(&summary)).transpose()
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

    let labels = names
        .iter()
        .map(|name| taxonomy.label(&format!("{name}_{area}")))
        .collect::<Result<Vec<Label>, _>>()
        .map_err(|e| usage(format!("labels: {e} (CLASS_INSTANCE_ROOM_NUMBER, such as chair_1_office_2)")))?;

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

/// The uuid of a scan location that has only a name.
#[pyfunction]
pub(crate) fn uuid_of_name(name: &str) -> String {
    s3d_io::camera::uuid_from_name(name)
}

/// The names of the options of an export, except `allow`.
#[pyfunction]
pub(crate) fn export_option_names() -> Vec<&'static str> {
    ExportOptions::names().to_vec()
}
