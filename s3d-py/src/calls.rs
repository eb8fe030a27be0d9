//! Calls on whole data sets. What they found goes to Python as JSON and text.

use crate::error::{exception, fault, input, usage};
use crate::mesh::parsed;
use crate::work::watched;
use pyo3::prelude::*;
use s3d_dataset::compare::CompareOptions;
use s3d_dataset::export::SceneSource;
use s3d_dataset::info::InfoOptions;
use s3d_dataset::options::Profile;
use s3d_dataset::pack::{ClassList, PackOptions, PackageArguments, PackageKind};
use s3d_dataset::profile::ProfileOptions;
use s3d_dataset::refine::RefineOptions;
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::xyz::XyzOptions;
use s3d_eval::{EvalOptions, Folds, Protocol};
use s3d_report::ReportOptions;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::path::PathBuf;

/// JSON and text.
type Answer = (String, String);

/// Topic, kind, count, and the first of them: file and message.
type Fault = (&'static str, &'static str, u64, Vec<(String, String)>);

/// Faults, notes, files, checks, what could not be read, and all of it as text.
type Verified = (Vec<Fault>, Vec<String>, u64, u64, Option<String>, String);

/// What Python reads as JSON.
pub(crate) fn json(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| fault(e.to_string()))
}

/// Reads options from JSON. An error names the option that does not fit.
pub(crate) fn options<T: DeserializeOwned>(text: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(|error| {
        let given: Map<String, Value> = serde_json::from_str(text).unwrap_or_default();
        let fault = given.into_iter().find_map(|(name, value)| {
            let alone = Map::from_iter([(name.clone(), value.clone())]);
            let error = T::deserialize(Value::Object(alone)).err()?;
            Some(format!("{name}={value}: {error}"))
        });
        usage(fault.unwrap_or_else(|| error.to_string()))
    })
}

/// What a scene, a mesh, or a data set holds, as text.
#[pyfunction]
pub(crate) fn info(
    py: Python<'_>,
    path: PathBuf,
    see: Option<f64>,
    place_cameras: Option<f64>,
    lenient: bool,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<String> {
    watched(py, threads, &sink, |ctx| {
        if s3d_dataset::info::is_data_set(&path) {
            return Ok(s3d_dataset::info::data_set_info(&path, ctx)?.to_string());
        }
        let options = InfoOptions { place_cameras, see, seed: 0, lenient };
        let scene = SceneSource::list([path], None, None).remove(0);
        Ok(s3d_dataset::info(scene, &options, ctx)?.to_string())
    })
}

#[pyfunction]
pub(crate) fn verify(
    py: Python<'_>,
    root: PathBuf,
    full: bool,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<Verified> {
    let report = watched(py, threads, &sink, |ctx| s3d_dataset::verify(&root, &VerifyOptions { full }, ctx))?;
    let text = report.to_string();
    let faults = report
        .faults
        .into_iter()
        .map(|f| (f.topic, f.kind, f.count, f.first))
        .collect();
    Ok((faults, report.notes, report.files, report.checks, report.unread, text))
}

/// Which areas: `folds` is a word, or `areas` are tested together.
#[derive(FromPyObject)]
pub(crate) struct Evaluated {
    variant: Option<String>,
    folds: String,
    areas: Vec<u32>,
    against: Option<PathBuf>,
    bootstrap: Option<u32>,
    seed: u64,
    median_scale: bool,
    images: Option<String>,
    classes: Option<Vec<String>>,
    boxes: Option<String>,
    stuff: Option<Vec<String>>,
}

#[pyfunction]
pub(crate) fn evaluate(
    py: Python<'_>,
    protocol: &str,
    truth: PathBuf,
    predictions: PathBuf,
    how: Evaluated,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<Answer> {
    let protocol: Protocol = protocol
        .parse()
        .map_err(|e: s3d_eval::UnknownProtocol| usage(e.to_string()))?;
    let mut options = EvalOptions::default();
    options.variant = how.variant;
    options.folds = match &*how.folds {
        _ if !how.areas.is_empty() => Folds::Areas(how.areas),
        "all" => Folds::All,
        "each" => Folds::EachArea,
        "paper" => Folds::Paper,
        other => return Err(usage(format!("folds={other:?}: must be one of all, each, paper"))),
    };
    options.against = how.against;
    options.bootstrap = how.bootstrap;
    options.seed = how.seed;
    options.median_scale = how.median_scale;
    options.images = how
        .images
        .map(|word| {
            word.parse()
                .map_err(|e: s3d_eval::UnknownImageKind| usage(e.to_string()))
        })
        .transpose()?;
    options.classes = how.classes;
    options.boxes = how
        .boxes
        .map(|word| {
            word.parse()
                .map_err(|e: s3d_eval::UnknownBoxSource| usage(e.to_string()))
        })
        .transpose()?;
    options.stuff = how.stuff.map(ClassList);

    let evaluation = watched(py, threads, &sink, |ctx| {
        Ok(s3d_eval::evaluate(protocol, &truth, &predictions, &options, ctx))
    })?;
    let evaluation = evaluation.map_err(|e| exception_of_evaluation(&e))?;
    Ok((json(&evaluation)?, evaluation.to_markdown()))
}

/// Returns the exception for an error of the evaluation.
fn exception_of_evaluation(error: &s3d_eval::Error) -> PyErr {
    match error {
        s3d_eval::Error::Dataset(error) => exception(error),
        error if error.is_usage() => usage(error.to_string()),
        error => input(error.to_string()),
    }
}

#[pyfunction]
pub(crate) fn compare(
    py: Python<'_>,
    a: PathBuf,
    b: PathBuf,
    full: bool,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<(bool, String, String)> {
    let options = CompareOptions { full };
    let comparison = watched(py, threads, &sink, |ctx| s3d_dataset::compare(&a, &b, &options, ctx))?;
    Ok((comparison.is_equal(), json(&comparison)?, comparison.to_string()))
}

#[pyfunction]
pub(crate) fn statistics(py: Python<'_>, root: PathBuf) -> PyResult<Answer> {
    let made = py
        .detach(|| s3d_dataset::statistics(&root))
        .map_err(|e| exception(&e))?;
    Ok((json(&made)?, made.to_markdown()))
}

/// How a report is made.
#[derive(FromPyObject)]
pub(crate) struct Reported {
    pano_width: u32,
    thumbs: u32,
    mesh_faces: u32,
    verify: bool,
    single: bool,
    scores: Vec<PathBuf>,
    overwrite: bool,
    poster: Option<PathBuf>,
}

/// Makes the report, and returns where it is.
#[pyfunction]
pub(crate) fn report(
    py: Python<'_>,
    root: PathBuf,
    to: Option<PathBuf>,
    against: Option<PathBuf>,
    how: Reported,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<PathBuf> {
    let Reported { pano_width, thumbs, mesh_faces, verify, single, scores, overwrite, poster } = how;
    let options = ReportOptions { pano_width, thumbs, mesh_faces, verify, single, scores, poster, overwrite };
    let made = watched(py, threads, &sink, |ctx| {
        let ending = if single { "_report.html" } else { "_report" };
        let to = to.map_or_else(|| s3d_dataset::store::beside(&root, ending), Ok)?;
        let made = match against {
            Some(other) => s3d_report::report_against(&root, &other, &to, &options, ctx),
            None => s3d_report::report(&root, &to, &options, ctx),
        };
        Ok(made.map(|_| if single { to } else { to.join("index.html") }))
    })?;
    made.map_err(|error| match error {
        s3d_report::Error::Dataset(error) => exception(&error),
        error => usage(error.to_string()),
    })
}

/// What a package is made of; each as on the command line.
#[derive(FromPyObject)]
pub(crate) struct Packed {
    output: Option<PathBuf>,
    overwrite: bool,
    areas: Vec<u32>,
    images: Option<String>,
    modalities: Option<Vec<String>>,
    max_size: Option<u32>,
    max_count: Option<u32>,
    prefix: Option<String>,
    shuffle: Option<u64>,
    points: Option<u32>,
    binary: bool,
    copy_images: bool,
    depth: Option<String>,
    stuff: Option<Vec<String>>,
    compression: Option<String>,
}

/// The value of a word that may be missing.
fn word<T: std::str::FromStr<Err: ToString>>(word: Option<String>) -> PyResult<Option<T>> {
    word.map(|word| word.parse().map_err(|e: T::Err| usage(e.to_string())))
        .transpose()
}

/// Makes the package, and returns where it is.
#[pyfunction]
pub(crate) fn pack(
    py: Python<'_>,
    root: PathBuf,
    kind: &str,
    how: Packed,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<PathBuf> {
    let kind = parsed("kind", kind, &PackageKind::WORDS.replace('|', ", "))?;
    let stuff = how.stuff.map(|classes| match &*classes {
        [] => "none".to_owned(),
        classes => classes.join(","),
    });
    let modalities = how.modalities.map(|words| {
        words
            .into_iter()
            .map(|modality| crate::dataset::domain(&modality))
            .collect::<PyResult<Vec<_>>>()
    });
    let arguments = PackageArguments {
        images: word(how.images)?,
        modalities: modalities.transpose()?,
        max_size: how.max_size,
        max_count: how.max_count,
        prefix: word(how.prefix)?,
        shuffle: how.shuffle,
        points: how.points,
        binary: how.binary,
        copy_images: how.copy_images,
        depth: word(how.depth)?,
        stuff: word(stuff)?,
        compression: word(how.compression)?,
    };
    let package = arguments.package(kind).map_err(|error| exception(&error))?;
    let options = PackOptions { output: how.output, overwrite: how.overwrite, areas: how.areas };
    watched(py, threads, &sink, |ctx| s3d_dataset::pack(&root, &package, &options, ctx))
}

#[pyfunction]
pub(crate) fn profile(
    py: Python<'_>,
    root: PathBuf,
    loaders: Vec<String>,
    overwrite: bool,
    sink: Py<PyAny>,
) -> PyResult<()> {
    let choices = "pointcept, open3d-ml, mmdet3d, pointnet";
    let loaders = loaders.iter().map(|name| parsed::<Profile>("loader", name, choices));
    let loaders = loaders.collect::<PyResult<Vec<_>>>()?;
    let options = ProfileOptions { overwrite };
    watched(py, None, &sink, |ctx| s3d_dataset::profile(root, &loaders, &options, ctx))
}

/// Adds images of refined labels, and returns how many.
#[pyfunction]
pub(crate) fn refine(
    py: Python<'_>,
    root: PathBuf,
    overwrite: bool,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<usize> {
    let options = RefineOptions { overwrite, ..RefineOptions::default() };
    watched(py, threads, &sink, |ctx| s3d_dataset::refine(root, &options, ctx))
}

/// Makes the images of world coordinates again, and returns how many.
#[pyfunction]
pub(crate) fn write_xyz(
    py: Python<'_>,
    root: PathBuf,
    kind: &str,
    overwrite: bool,
    threads: Option<usize>,
    sink: Py<PyAny>,
) -> PyResult<usize> {
    let xyz = parsed("kind", kind, "half, float")?;
    let options = XyzOptions { xyz, overwrite, ..XyzOptions::default() };
    watched(py, threads, &sink, |ctx| s3d_dataset::xyz(root, &options, ctx))
}
