//! What several commands share.

use crate::values::{parsed, positive};
use clap::{Args, value_parser};
use s3d_dataset::{Condition, SceneSource};
use s3d_io::mesh::{LengthUnit, UpAxis};
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
    #[arg(long, default_value = "y", value_parser = parsed::<UpAxis>, value_name = "y|z")]
    pub(crate) up: UpAxis,
    /// The unit of the file [default: what the file says, or else metres]
    #[arg(long, value_parser = parsed::<LengthUnit>, value_name = "m|cm|mm|ft|in")]
    pub(crate) units: Option<LengthUnit>,
}

/// The scenes of a data set.
#[derive(Clone, Debug, Args)]
pub(crate) struct Scenes {
    /// Scene files, or folders of published areas (area_3), one an area; or the files of one mesh (OBJ,
    /// glTF, GLB, PLY), which is an area without labels.
    #[arg(required = true, value_name = "SCENE.toml")]
    pub(crate) scenes: Vec<PathBuf>,
    /// Which axis of the files of a mesh points up [default: y in glTF, guessed in others]
    #[arg(long, value_parser = parsed::<UpAxis>, value_name = "y|z")]
    pub(crate) up: Option<UpAxis>,
    /// The unit of the files of a mesh [default: metres in glTF; in others what the file says, or else
    /// guessed by the height of rooms]
    #[arg(long, value_parser = parsed::<LengthUnit>, value_name = "m|cm|mm|ft|in")]
    pub(crate) units: Option<LengthUnit>,
}

impl Scenes {
    pub(crate) fn sources(&self) -> Vec<SceneSource> {
        SceneSource::list(self.scenes.iter().cloned(), self.up, self.units)
    }
}

/// How scan locations are placed, if they are.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct Placing {
    /// Put scan locations on the floor of every room instead of reading some: no two of a room nearer than
    /// this, 1.5 m high, clear of walls and things.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub(crate) place_cameras: Option<f64>,
    /// Put as few scan locations as see this share of the surface that can be seen, instead of reading some
    /// [default where there are none to read: 0.95]
    #[arg(long, value_name = "SHARE", value_parser = positive, conflicts_with = "place_cameras")]
    pub(crate) see: Option<f64>,
}
