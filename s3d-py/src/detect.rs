//! The baseline detector: trained, kept, run.

use crate::error::{exception, usage};
use crate::mesh::parsed;
use crate::work::watched;
use pyo3::prelude::*;
use s3d_dataset::{Context, Error};
use s3d_detect::{Model, ParsedArea, Space, SpaceSource, TrainOptions, detect_area, read_areas};
use std::path::PathBuf;

/// A trained detector.
#[pyclass(frozen)]
pub(crate) struct Detector(Model);

fn read(
    root: PathBuf,
    areas: &[u32],
    spaces: SpaceSource,
    ctx: &Context,
) -> s3d_dataset::Result<Vec<ParsedArea>> {
    let data = s3d_dataset::DataSet::open(&root)?;
    if let Some(area) = areas.iter().find(|area| !data.areas().contains(area)) {
        return Err(Error::Usage(format!("areas: there is no area {area}")));
    }
    read_areas(&data, if areas.is_empty() { data.areas() } else { areas }, spaces, ctx)
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
        let model = watched(py, threads, &sink, |ctx| {
            let areas = read(root, &areas, spaces, ctx)?;
            let spaces: Vec<&Space> = areas.iter().flat_map(|area| &area.spaces).collect();
            Model::train(&spaces, &options, ctx)
        })?;
        Ok(Self(model))
    }

    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| Model::load(&path)).map(Self).map_err(|e| exception(&e))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.0.save(&path)).map_err(|e| exception(&e))
    }

    #[getter]
    fn areas(&self) -> Vec<u32> {
        self.0.areas.clone()
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// The boxes that are found, as JSON.
    fn run(
        &self,
        py: Python<'_>,
        root: PathBuf,
        areas: Vec<u32>,
        threads: Option<usize>,
        sink: Py<PyAny>,
    ) -> PyResult<String> {
        let found = watched(py, threads, &sink, |ctx| {
            let mut found = Vec::new();
            for area in read(root, &areas, self.0.spaces, ctx)? {
                found.extend(detect_area(&self.0, &area, ctx)?);
            }
            Ok(found)
        })?;
        crate::calls::json(&found)
    }
}
