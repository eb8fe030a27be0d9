//! 2D-3D-Semantic data sets as a whole.
//!
//! A scene goes in: a mesh, annotated points, and the places where a scanner stood. A data set comes out,
//! under the published names. The crate composes the stages of [`s3d_geom`], [`s3d_label`], `s3d-render` and
//! `s3d-sample`, and writes files by [`s3d_io`].
//!
//! | module | does |
//! |---|---|
//! | [`export`](mod@export), [`options`] | turn scenes into a data set, on one machine or many |
//! | [`info`](mod@info) | tells what a scene holds and what looks wrong, before it is exported |
//! | [`verify`](mod@verify) | reads a data set back, every pixel of it |
//! | [`compare`](mod@compare), [`statistics`](mod@statistics) | say how two data sets differ; count one |
//! | [`pack`](mod@pack), [`profile`](mod@profile), [`xyz`](mod@xyz) | write what trainers and loaders read |
//! | [`pairs`](mod@pairs) | finds the images that see the same surface |
//! | [`place`], [`render`](mod@render), [`sample`](mod@sample) | need a mesh alone: places, images, points |
//! | [`mesh_axes`] | reads a mesh whose up axis and unit are not known |
//! | [`store`], [`parallel`] | for crates that write results of their own beside a data set |
//! | [`error`], [`event`], [`summary`] | what a call answers, and what it tells on its way |
//!
//! World frame everywhere: metres, Z-up, right-handed. Work is done on the current rayon pool. Nothing here
//! prints, reads the command line, handles signals or exits, and several calls may run in one process at the
//! same time.
//!
//! # A data set from a scene
//!
//! [`Export`] takes scenes, one an area: paths of scene files, or values in memory ([`export::MemoryScene`]).
//! An export that was stopped, cancelled or killed goes on when the same call is made again, and ends with
//! the same bytes.
//!
//! ```
//! use s3d_dataset::{Context, Export, ExportOptions};
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
//!
//! // Every pixel is what the exported mesh shows.
//! let report = s3d_dataset::verify(&out, &Default::default(), &Context::default())?;
//! assert_eq!(report.fault_count(), 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Watching and ending a call
//!
//! Every long call is handed a [`Context`]. Its [`Observer`] is told of every [`Event`]: stages, progress,
//! warnings. Its [`Cancel`] ends the call from any thread; the call then returns [`Error::Cancelled`] and
//! keeps the work so far for the same call later.
//!
//! ```
//! use s3d_dataset::{Cancel, Context, Event, Export};
//!
//! let cancel = Cancel::default();
//! let context = Context::default().cancelled_by(cancel.clone()).observed_by(|event: &Event<'_>| {
//!     if let Event::Message { text, .. } = event {
//!         println!("{text}");
//!     }
//! });
//!
//! // An error has data: what is wrong, and where.
//! let missing = Export::new(["no/such/scene.toml"]).run(std::env::temp_dir().join("never"), &context);
//! assert!(missing.unwrap_err().to_string().contains("scene.toml"));
//! ```
//!
//! # One export on many machines
//!
//! [`plan()`] labels and scores the scenes once. Each machine then does an [`export::Shard`] of the work, and
//! [`merge()`] makes one data set of their folders, with the bytes of an export on one machine.
//!
//! ```no_run
//! use s3d_dataset::{Context, Export, ExportOptions};
//! use std::path::Path;
//!
//! let (options, context) = (ExportOptions::default(), Context::default());
//! s3d_dataset::plan(&["scene.toml"], Path::new("plan"), &options, None, &context)?;
//!
//! // Each of these on a machine of its own.
//! for part in ["1/2", "2/2"] {
//!     let export = Export::new(["scene.toml"]).options(options.clone()).plan(Some("plan".into()));
//!     export.shard(Some(part.parse()?)).run("parts", &context)?;
//! }
//!
//! s3d_dataset::merge(&["parts".into()], "dataset", false, &context)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Using a data set
//!
//! [`DataSet`] reads a data set for other crates: its mesh, labels, images and poses. [`pack()`] writes it
//! for a trainer, which [`pack_scenes`](pack::pack_scenes) does without a data set on the disk, and
//! [`compare()`] tells what differs from an earlier one.
//!
//! ```no_run
//! use s3d_dataset::pack::{Package, PackOptions, WebdatasetOptions};
//! use s3d_dataset::{Context, DataSet};
//! use std::path::Path;
//!
//! let context = Context::default();
//! let data = DataSet::open(Path::new("dataset"))?;
//! for &area in data.areas() {
//!     println!("area {area}: {} images", data.images(area).len());
//! }
//!
//! let shards = Package::Webdataset(WebdatasetOptions::default());
//! s3d_dataset::pack(Path::new("dataset"), &shards, &PackOptions::default(), &context)?;
//! let comparison = s3d_dataset::compare(
//!     Path::new("dataset"),
//!     Path::new("dataset_before"),
//!     &Default::default(),
//!     &context,
//! )?;
//! println!("{comparison}");
//! # Ok::<(), s3d_dataset::Error>(())
//! ```

// What a file holds must not make it panic; loops index by what was checked.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic, clippy::string_slice))]

mod account;
pub mod align;
mod bare;
pub mod compare;
mod condition;
mod context;
pub mod error;
pub mod event;
pub mod export;
pub mod fuse;
pub mod info;
mod memory;
pub mod mesh_axes;
pub mod options;
pub mod pack;
pub mod pairs;
pub mod parallel;
pub mod place;
pub mod profile;
mod reader;
mod record;
pub mod refine;
pub mod render;
pub mod sample;
mod stage;
pub mod statistics;
pub mod store;
pub mod summary;
mod survey;
mod useful;
pub mod verify;
pub mod xyz;

pub use align::{AlignOptions, AlignReport, align};
pub use bare::{BarePanorama, BarePhotograph, BareScene};
pub use compare::compare;
pub use context::{Cancel, Context, Observer, Progress};
pub use error::{Error, Result};
pub use event::Event;
pub use export::Export;
pub use export::shard::make_plan::plan;
pub use export::shard::merge::merge;
pub use info::info;
pub use memory::check_memory;
pub use mesh_axes::{MeshAxes, read_mesh};
pub use options::ExportOptions;
pub use pack::pack;
pub use pairs::{PairsOptions, pairs};
pub use place::{WalkOptions, place_cameras, walk};
pub use profile::profile;
pub use record::data_set::DataSet;
pub use refine::{RefineOptions, refine};
pub use render::{render, render_poses, render_walk};
pub use sample::sample;
pub use statistics::statistics;
pub use summary::Summary;
pub use verify::verify;
pub use xyz::xyz;

/// The crates whose types a scene [in memory](export::MemoryScene) is made of.
pub use {s3d_geom, s3d_io, s3d_label};

/// The README's example, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
