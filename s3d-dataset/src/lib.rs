//! 2D-3D-Semantic data sets as a whole.
//!
//! - [`Export`] turns scenes, from files or [in memory](MemoryScene), into a data set under the published
//!   names, with [`ExportOptions`]. An export that was stopped, cancelled or killed goes on when the same
//!   call is made again, and ends with the same bytes. [`plan`], [`Shard`] and [`merge`] share one among many
//!   machines.
//! - [`verify`] reads a data set back, every pixel of it, and returns a [`VerifyReport`]; [`statistics`]
//!   counts it; [`compare`] tells what differs between two, as a [`Comparison`]; [`info`] what a scene holds
//!   before it is exported.
//! - [`pack`] makes packages for trainers of it, [`profile`] what loaders of point clouds want; [`xyz`] makes
//!   its world coordinates again; [`DataSet`] reads it for other crates, and [`NewFolder`] is what they make
//!   of it, whole or not at all. [`render`], [`render_poses`], [`sample`] and [`place_cameras`] need a mesh alone.
//!
//! Every call is handed a [`Context`]: a [`Cancel`] that ends it early, from any thread, and an [`Observer`]
//! that is told [what happens](Event). Nothing here prints, reads the command line, handles signals or exits;
//! several calls may run in one process at the same time. Work is done on the current rayon pool. World frame
//! everywhere: metres, Z-up, right-handed.
//!
//! ```
//! use s3d_dataset::{Context, Export, ExportOptions, VerifyOptions};
//! use s3d_synth::{Building, ScanOptions};
//!
//! # let folder = tempfile::tempdir()?;
//! # let folder = folder.path();
//! // A scene: here the built-in one, as files.
//! let scene = Building::demo().build()?.write_scan(&folder.join("scan"), &ScanOptions::default(), || true)?;
//!
//! let out = folder.join("dataset");
//! let small = ExportOptions { views: 2, size: 64, pano_width: 128, ..ExportOptions::default() };
//! let options = ExportOptions { points_per_m2: 20.0, ..small };
//! let export = Export::new([scene]).options(options);
//! let summary = export.run(&out, &Context::default())?.expect("a new folder");
//! assert_eq!((summary.areas, summary.tally.panoramas.images), (1, summary.locations));
//!
//! // Called again, there is nothing left to do.
//! assert!(export.run(&out, &Context::default())?.is_none());
//! let report = s3d_dataset::verify(&out, &VerifyOptions::default(), &Context::default())?;
//! assert_eq!(report.fault_count(), 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// What a file holds must not make it panic; loops index by what was checked.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic, clippy::string_slice))]

mod account;
mod compare;
mod condition;
mod context;
mod error;
mod event;
mod export;
mod info;
mod options;
mod pack;
mod parallel;
mod place;
mod profile;
mod reader;
mod record;
mod render;
mod sample;
mod stage;
mod store;
mod summary;
mod survey;
mod useful;
mod verify;
mod xyz;

pub use compare::comparison::{
    AreaChanges, ChangedPatch, ClassPair, ClassPixels, ComparedSet, Comparison, FaceChange, FileKindChanges,
    Geometry, ImageChange, InputChange, InstanceChange, LabelChanges, LabelCounts, LocationName,
    ModalityChanges, PixelChanges, PoseChange, PoseChanges, SettingChange, Side, UnreadFile, ViewChanges,
    ViewName,
};
pub use compare::{CompareOptions, compare};
pub use condition::Condition;
pub use context::{Cancel, Context, Observer, Progress};
pub use error::{
    Difference, Error, FieldNames, Held, InputError, OptionNames, Overwriting, Result, TemporaryError,
    UsageError, Work,
};
pub use event::{Event, Level, Task, UnitKind};
pub use export::Export;
pub use export::input::memory::{MemoryScene, SceneSource, SharedScene};
pub use export::shard::assignment::Shard;
pub use export::shard::make_plan::plan;
pub use export::shard::merge::merge;
pub use info::{
    DataSetInfo, InfoOptions, LocationInfo, MeshInfo, RoomInfo, SceneInfo, data_set_info, info, is_data_set,
};
pub use options::profile::Profile;
#[cfg(feature = "clap")]
pub use options::words;
pub use options::{ExportOptions, PadLabels, canonical_uuid};
pub use pack::{
    ClassList, CocoOptions, ColmapOptions, DepthFiles, NerfstudioOptions, PackOptions, Package,
    PackageArguments, PackageKind, PackedImages, ParquetOptions, ShardPrefix, WebdatasetOptions, pack,
};
pub use parallel::map_in_order;
pub use place::{PlaceOptions, place_cameras};
pub use profile::room::{TreeInstance, TreeRoom};
pub use profile::{ProfileOptions, profile};
pub use record::data_set::DataSet;
pub use record::statistics::{
    AreaStatistics, LabelStatistics, LabelTally, RoomTypeStatistics, Statistics, statistics,
};
pub use render::{PosesOptions, RenderOptions, RenderedPoses, render, render_poses};
pub use sample::{SampleOptions, sample};
pub use stage::Stage;
pub use store::new_file::NewFile;
pub use store::new_folder::{FolderKind, NewFolder, beside, check_apart};
pub use summary::{ImageTally, Summary, Surface, UnitTally, Unlabelled, ViewTally};
pub use useful::{Estimate, Storey};
pub use verify::{FaultGroup, VerifyOptions, VerifyReport, verify};
pub use xyz::{XyzOptions, xyz};

/// The crates whose types [`MemoryScene`] is made of.
pub use {s3d_geom, s3d_io, s3d_label};

/// The README's example, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
