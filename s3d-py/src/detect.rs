//! The baseline detector: training, model files, detection.

use crate::error::{exception, input, usage};
use crate::mesh::parsed;
use crate::work::watched;
use pyo3::prelude::*;
use s3d_dataset::Context;
use s3d_detect::{
    Error, Model, ParsedArea, Result, Space, SpaceSource, TrainOptions, detect_area, read_areas,
};
use std::path::PathBuf;

/// A trained detector.
#[pyclass(frozen)]
pub(crate) struct Detector(Model);

fn read(root: PathBuf, areas: &[u32], spaces: SpaceSource, ctx: &Context) -> Result<Vec<ParsedArea>> {
    let data = s3d_dataset::DataSet::open(&root)?;
    if let Some(&area) = areas.iter().find(|area| !data.areas().contains(area)) {
        return Err(Error::UnknownArea { root, area, areas: data.areas().to_vec() });
    }
    read_areas(&data, if areas.is_empty() { data.areas() } else { areas }, spaces, ctx)
}

/// Returns the exception for an error of the detector.
fn exception_of(error: &Error) -> PyErr {
    match error {
        Error::Dataset(error) => exception(error),
        Error::UnknownArea { area, .. } => usage(format!("areas: there is no area {area}")),
        error => input(error.to_string()),
    }
}

#[pymethods]
impl Detector {
    /// Trains on areas of a data set; on all if none are named.
    #[staticmethod]
    #[allow(clippy::too_many_arguments)]
    fn train(
        py: Python<'_>,
        root: PathBuf,
        areas: Vec<u32>,
        spaces: &str,
        most_spaces: usize,
        seed: u64,
        threads: Option<usize>,
        sink: Py<PyAny>,
    ) -> PyResult<Self> {
        let spaces = parsed("spaces", spaces, "parsed, rooms")?;
        if most_spaces == 0 {
            return Err(usage("most_spaces=0: must be at least 1"));
        }
        let options = TrainOptions { seed, spaces, most_spaces, ..TrainOptions::default() };

        let train = |ctx: &Context| {
            let areas = read(root, &areas, spaces, ctx)?;
            let spaces: Vec<&Space> = areas.iter().flat_map(|area| &area.spaces).collect();
            Model::train(&spaces, &options, ctx)
        };
        let model = watched(py, threads, &sink, |ctx| Ok(train(ctx)))?;
        model.map(Self).map_err(|e| exception_of(&e))
    }

    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| Model::load(&path)).map(Self).map_err(|e| exception_of(&e))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.0.save(&path)).map_err(|e| exception_of(&e))
    }

    #[getter]
    fn areas(&self) -> Vec<u32> {
        self.0.areas.clone()
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// Returns the boxes found, as JSON.
    fn run(
        &self,
        py: Python<'_>,
        root: PathBuf,
        areas: Vec<u32>,
        threads: Option<usize>,
        sink: Py<PyAny>,
    ) -> PyResult<String> {
        let find = |ctx: &Context| {
            let mut found = Vec::new();
            for area in read(root, &areas, self.0.spaces, ctx)? {
                found.extend(detect_area(&self.0, &area, ctx)?);
            }
            Ok::<_, Error>(found)
        };
        let found = watched(py, threads, &sink, |ctx| Ok(find(ctx)))?.map_err(|e| exception_of(&e))?;
        crate::calls::json(&found)
    }
}
