//! The data set as a whole.

mod context;
mod error;
mod event;
mod export;
mod info;
mod options;
mod pack;
mod place;
mod profile;
mod render;
mod sample;
mod shard;
mod store;
mod tables;
mod verify;
mod xyz;

pub use context::{Cancel, Context, Observer, Task};
pub use error::{Error, Result};
pub use event::{Event, Level, Stage, UnitKind};
pub use export::{Export, MemoryScene, SceneSource, SharedScene};
pub use info::{InfoOptions, LocationInfo, MeshInfo, RoomInfo, SceneInfo, info};
pub use options::{ExportOptions, PadLabels, canonical_uuid};
pub use pack::{
    ClassList, DepthFiles, PackOptions, PackageKind, PackedImages, ShardPrefix, SpecificOptions, pack,
};
pub use profile::{Profile, ProfileOptions, profile};
pub use render::{RenderOptions, render};
pub use sample::{SampleOptions, sample};
pub use shard::assignment::Shard;
pub use shard::merge::merge;
pub use shard::plan::plan;
pub use tables::statistics::{AreaStatistics, RoomTypeStatistics, Statistics, statistics};
pub use tables::summary::{ImageTally, Summary, UnitTally, ViewTally};
pub use verify::{FaultGroup, VerifyOptions, VerifyReport, verify};
pub use xyz::{XyzOptions, xyz};
