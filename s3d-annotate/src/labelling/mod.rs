//! The labels of a mesh while they are made: events, what they add up to, and the folder that holds them.
//!
//! # Events
//!
//! Everything that is done is an [`Event`] with an [`Action`]: paint, erase, join, cut, a class, a room, undo
//! and redo. A [`State`] is the fold of a log of events. It needs no clock, no files and no taxonomy, and
//! refuses an event that does not fit with a [`Fault`]. [`FaceRuns`] keep sets of faces short. Instances and
//! rooms have permanent numbers; names such as `chair_3` are made at output alone
//! ([`State::instance_names`]).
//!
//! # Folder
//!
//! A [`LabelFolder`] is a folder such as `scan.labels`, locked by one process. Its log `events.jsonl` only
//! grows: an undo is one more event. [`LabelFolder::add`] returns when the event is on the disk, so a kill
//! loses at most the event in hand. Each call names the revision that it was made from, and a stale one is
//! refused: two windows cannot write over each other.
//!
//! # Output
//!
//! [`LabelFolder::write_labels`] writes `labels.npz` and `rooms.json`. `s3d-io` reads the folder as
//! annotations: `[annotations] path = "scan.labels"`. [`carry_over`] takes labels to a mesh that has changed.
//!
//! ```
//! use s3d_annotate::labelling::{Action, FaceRuns, LabelFolder};
//! use s3d_geom::{TriMesh, glam::Vec3};
//! use s3d_io::cloud::SavedLabels;
//! use s3d_label::Taxonomy;
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("scan.labels");
//! let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
//! let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2], [1, 3, 2]])?;
//! let mut labels = LabelFolder::open(&path, &mesh, &Taxonomy::s3dis())?;
//!
//! let instance = labels.state().next_instance();
//! let faces = FaceRuns::of_range(0..2);
//! let paint = Action::Paint { faces, instance, class: Some("chair".into()) };
//! assert_eq!(labels.add(0, paint, None)?, 1);
//! labels.add(1, Action::Erase { faces: FaceRuns::of_range(1..2) }, None)?;
//! labels.undo(2, None)?;
//! assert!(labels.undo(2, None).is_err(), "made from an old revision");
//!
//! // After a kill, the log has it all.
//! drop(labels);
//! let labels = LabelFolder::open(&path, &mesh, &Taxonomy::s3dis())?;
//! assert_eq!((labels.state().revision(), labels.state().instance_of_face()), (3, &[1, 1][..]));
//! labels.write_labels(&mesh)?;
//! assert_eq!(SavedLabels::read(&path)?.instances, [(1, "chair_1".into())]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod carry_over;
mod check;
mod column;
mod error;
mod event;
mod face_runs;
mod fault;
mod folder;
mod log;
mod output;
mod plan;
mod state;

pub use carry_over::{CarriedOver, CarryOverReport, carry_over};
pub use error::{Error, Result};
pub use event::{Action, EVENT_VERSION, Event, Room, RoomPart};
pub use face_runs::FaceRuns;
pub use fault::Fault;
pub use folder::LabelFolder;
pub use output::{ROOMS_FILE, SEGMENTS_FILE};
pub use state::{MAX_NUMBER, State, Tally};
