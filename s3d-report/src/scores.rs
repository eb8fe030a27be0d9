//! Results of `s3d eval` that a report shows.

use crate::error::{Error, Result};
use s3d_dataset::DataSet;
use s3d_io::fs::read_json;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// `data/scores_N.js`: what the page shows of a file that `s3d eval --json` wrote.
#[derive(Deserialize, Serialize)]
pub(crate) struct Scores {
    /// The name of the file without its ending.
    #[serde(skip_deserializing)]
    name: String,
    protocol: String,
    version: u32,
    variant: String,
    evaluator: String,
    truth: Truth,
    definition: Vec<String>,
    counted: BTreeMap<String, u64>,
    tables: Vec<Table>,
    confusion: Option<Confusion>,
    against: Option<Against>,
    notes: Vec<String>,
    units: Units,
}

#[derive(Deserialize, Serialize)]
struct Truth {
    files_xxh3_128: String,
}

#[derive(Deserialize, Serialize)]
struct Table {
    title: String,
    columns: Vec<String>,
    rows: Vec<Row>,
}

#[derive(Deserialize, Serialize)]
struct Row {
    name: String,
    scores: Vec<Score>,
}

/// A number that is not defined is null.
#[derive(Deserialize, Serialize)]
struct Score {
    value: Option<f64>,
    interval: Option<[Option<f64>; 2]>,
}

#[derive(Deserialize, Serialize)]
struct Confusion {
    classes: Vec<String>,
    counts: Vec<Vec<u64>>,
}

#[derive(Deserialize, Serialize)]
struct Against {
    differences: Vec<Table>,
}

#[derive(Deserialize, Serialize)]
struct Units {
    columns: Vec<String>,
    rows: Vec<String>,
    units: Vec<Unit>,
}

#[derive(Deserialize, Serialize)]
struct Unit {
    area: u32,
    name: String,
    scores: Vec<Vec<Option<f64>>>,
}

impl Scores {
    /// Reads a result, which must be of this data set.
    pub(crate) fn read(path: &Path, data: &DataSet) -> Result<Self> {
        let mut scores: Self = read_json(path)?;
        if scores.truth.files_xxh3_128 != data.checksum() {
            return Err(Error::OtherDataSet(path.to_owned()));
        }
        scores.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(scores)
    }
}
