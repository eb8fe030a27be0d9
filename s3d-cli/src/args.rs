//! What several commands share.

use crate::values::parsed;
use clap::builder::PossibleValuesParser;
use clap::{Args, value_parser};
use s3d_dataset::Condition;
use s3d_io::mesh::UpAxis;
use std::path::PathBuf;

#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct Threads {
    /// Threads to work with [default: one a core]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=4096))]
    pub(crate) threads: Option<u16>,
}

/// What makes a data set of use, and need not be met.
#[derive(Clone, Debug, Args)]
pub(crate) struct Allow {
    /// Go on although the data set would be of no use: the error that stops an export names its condition.
    #[arg(long, value_delimiter = ',', value_parser = parsed::<Condition>,
        value_name = "colour|coverage|frame|inside-out|labels|locations|scale|size|up")]
    pub(crate) allow: Vec<Condition>,
}

#[derive(Debug, Args)]
pub(crate) struct MeshArgs {
    /// The mesh: OBJ, glTF, GLB or PLY.
    #[arg(value_name = "MESH")]
    pub(crate) mesh: PathBuf,
    /// Which axis of the file points up.
    #[arg(long, default_value = "y", value_parser = PossibleValuesParser::new(["y", "z"]))]
    pub(crate) up: String,
}

impl MeshArgs {
    pub(crate) fn up(&self) -> UpAxis {
        if self.up == "z" { UpAxis::Z } else { UpAxis::Y }
    }
}
