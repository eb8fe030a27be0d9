//! Arguments that several commands share.

use crate::values::parsed;
use clap::{Args, value_parser};
use s3d_dataset::MeshAxes;
use s3d_dataset::export::SceneSource;
use s3d_io::mesh::{LengthUnit, UpAxis};
use std::path::PathBuf;

#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct Threads {
    /// The number of threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=4096))]
    pub(crate) threads: Option<u16>,
}

#[derive(Debug, Args)]
pub(crate) struct MeshArgs {
    /// The mesh: OBJ, glTF, GLB or PLY.
    pub(crate) mesh: PathBuf,
    #[command(flatten)]
    frame: FrameArgs,
}

impl MeshArgs {
    pub(crate) fn axes(&self) -> MeshAxes {
        MeshAxes { up: self.frame.up, units: self.frame.units }
    }
}

/// The scenes of a data set.
#[derive(Clone, Debug, Args)]
pub(crate) struct Scenes {
    /// Scene files, or folders of published areas (area_3) or of scenes of ScanNet, ScanNet++, HM3D, Replica,
    /// 3RScan or ARKitScenes, one for each area; or the files of one mesh (OBJ, glTF, GLB, PLY), which
    /// becomes an area without labels.
    #[arg(required = true, value_name = "SCENE.toml")]
    pub(crate) scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) frame: FrameArgs,
}

impl Scenes {
    pub(crate) fn sources(&self) -> Vec<SceneSource> {
        SceneSource::list(self.scenes.iter().cloned(), self.frame.up, self.frame.units)
    }
}

/// The frame of meshes that are named without a scene file.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct FrameArgs {
    /// The axis of a mesh that points up [default: y in glTF, guessed in others]
    #[arg(long, value_parser = parsed::<UpAxis>, value_name = "y|z")]
    up: Option<UpAxis>,
    /// The unit of a mesh [default: metres in glTF; in others what the file says, or else guessed from the
    /// height of rooms]
    #[arg(long, value_parser = parsed::<LengthUnit>, value_name = "m|cm|mm|ft|in")]
    units: Option<LengthUnit>,
}

impl FrameArgs {
    pub(crate) fn source(self, scene: PathBuf) -> SceneSource {
        SceneSource::list([scene], self.up, self.units).remove(0)
    }
}
