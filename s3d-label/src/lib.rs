//! Labels of the 2D-3D-S data set (Armeni et al. 2017): what they are called, in which order they are
//! numbered, and how the points of a scan give them to the faces of a mesh.
//!
//! The nouns: the [`Taxonomy`], which says which classes and types of rooms there are (S3DIS's, those of
//! other data sets, or one's own); [`Class`], [`Room`] and [`Label`] with its name; the [`LabelTable`], which
//! numbers the labels of a data set in the published order ([`LabelId`]); [`number_area`], which turns the
//! numbers of an annotated tree into those of labels; the [`Labeler`], which takes labelled points block by
//! block and gives the [`FaceLabels`] of a mesh (or [`vote`], for points that are all there), the [`Votes`]
//! behind them and the [`VoteReport`] on these; [`ClassCounts`] and [`RoomCounts`], the paper's tables of
//! statistics.
//!
//! ```
//! use s3d_geom::{TriMesh, glam::{Vec3, vec3}};
//! use s3d_label::{Class, LabelId, LabelTable, number_area, vote};
//!
//! // An annotated tree of one area: a wall and a chair of office_1, a chair of office_2.
//! let office = |number| format!("office_{number}").parse().unwrap();
//! let found = [(office(1), Class::WALL, 1), (office(2), Class::CHAIR, 1), (office(1), Class::CHAIR, 1)];
//! let numbered = number_area(5, found)?;
//! let table = LabelTable::from_labels(numbered.iter().map(|i| i.label))?;
//! assert_eq!(
//!     table.names(),
//!     ["<UNK>_0_<UNK>_0_0", "chair_1_office_1_5", "chair_2_office_2_5", "wall_1_office_1_5"]
//! );
//!
//! // Three points of the wall and one of a chair vote for a mesh of two faces.
//! let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
//! let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2], [1, 3, 2]])?;
//! let (wall, chair) = (LabelId(3), LabelId(1));
//! let points = [[0.1, 0.1], [0.2, 0.1], [0.1, 0.3], [0.3, 0.3]].map(|[x, y]| vec3(x, y, 0.002));
//! let labels = vote(&mesh, &points, &[wall, chair, wall, wall])?;
//! assert_eq!(labels.label_of_face(), [wall, LabelId::NULL]);
//! assert_eq!(labels.report(&table)?.classes[Class::WALL.index()].1.points, 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! With the cargo feature `serde`, classes, rooms and labels are data by their names, a table is the list of
//! its names, and votes, reports, summaries and statistics are structs of their fields. What is read is
//! checked: a name that is none, or a table out of order, is refused. Names are S3DIS's, or those of the
//! taxonomy that reads ([`Taxonomy::reading`](crate::Taxonomy)). The feature `vote`, on by default, is
//! the [`Labeler`] with what belongs to it.

// Nothing panics but what a caller did wrong, which "Panics" tells: names and numbers come from files.
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable,
        clippy::indexing_slicing,
        clippy::string_slice
    )
)]

mod class;
mod color;
mod instance;
mod label;
mod numbering;
mod room;
#[cfg(feature = "serde")]
mod serde_names;
mod statistics;
mod table;
mod taxonomy;
#[cfg(feature = "vote")]
mod voting;
mod wall_direction;

pub use class::{Class, UnknownClass};
pub use color::pretty_color;
pub use instance::InstanceSummary;
pub use label::{Label, LabelError, NULL_NAME, parse_name};
pub use numbering::{NumberedInstance, NumberingError, number_area};
pub use room::{Room, RoomError, RoomType, UNKNOWN_ROOM, UnknownRoomType};
pub use statistics::{ClassCounts, RoomCounts};
pub use table::{LabelId, LabelTable, MAX_LABELS, TableError};
pub use taxonomy::{
    ClassDefinition, Kind, MAX_CLASSES, RoomTypeDefinition, Taxonomy, TaxonomyDefinition, TaxonomyError,
};
#[cfg(feature = "vote")]
pub use voting::{
    ClassDispute, DisputedPatch, Disputes, FaceLabels, FaceVotes, Labeler, PointTally, VoteError,
    VoteOptions, VoteReport, VoteRow, Votes, fill_labels, vote,
};
pub use wall_direction::wall_directions_deg;

/// The README's example, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
