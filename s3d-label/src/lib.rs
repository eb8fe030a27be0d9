//! Labels of the 2D-3D-S data set (Armeni et al. 2017): their names, their published order, and the vote that
//! gives them to the faces of a mesh.
//!
//! # Names
//!
//! A [`Taxonomy`] lists the classes and room types of a data set: S3DIS, another data set, or your own. A
//! [`Label`] is an instance of a [`Class`] in a [`Room`], with a name such as `chair_3_office_5_1`.
//!
//! # Numbers
//!
//! [`number_area`] turns the instance numbers of an annotated tree, which run per room, into the numbers of
//! labels, which run per area. A [`LabelTable`] gives every label of a data set its [`LabelId`], in the
//! published order. [`ClassCounts`] and [`RoomCounts`] are the tables of statistics of the paper.
//!
//! # Vote
//!
//! A [`Labeler`] takes labelled points block by block, and [`vote`] takes them all at once. Each point votes
//! for its nearest face. The result is the [`FaceLabels`] of the mesh, with all [`Votes`] and a
//! [`VoteReport`]. [`fill_labels`] labels faces without a vote, and [`Disputes`] shows where labels are not
//! clear.
//!
//! # Labels of images
//!
//! [`refine`](mod@refine) moves the borders between labels of an image to the edges of the picture.
//!
//! # Example
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
//! // Three points of the wall and one point of a chair vote for a mesh of two faces.
//! let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
//! let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2], [1, 3, 2]])?;
//! let wall = LabelId(3);
//! let chair = LabelId(1);
//! let points = [[0.1, 0.1], [0.2, 0.1], [0.1, 0.3], [0.3, 0.3]].map(|[x, y]| vec3(x, y, 0.002));
//! let labels = vote(&mesh, &points, &[wall, chair, wall, wall])?;
//! assert_eq!(labels.label_of_face(), [wall, LabelId::NULL]);
//! assert_eq!(labels.report(&table)?.classes[Class::WALL.index()].1.points, 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! `vote`, on by default, has the [`Labeler`] and everything under "Vote".
//!
//! `serde` serializes classes, rooms and labels as their names, a table as the list of its names, and votes,
//! reports, summaries and statistics as structs. Values read are checked: an invalid name or a table out of
//! order is refused. Names are read as names of S3DIS, or of another taxonomy within
//! [`Taxonomy::reading`](crate::Taxonomy).

// Only a caller's mistake panics, and a section "Panics" names it. Names and numbers may come from files.
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
pub mod refine;
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
    ClassDispute, DisputedPatch, Disputes, FaceLabels, FaceVotes, Labeler, PointTally, Stray, VoteError,
    VoteOptions, VoteReport, VoteRow, Votes, fill_labels, vote,
};
pub use wall_direction::wall_directions_deg;

/// The README's example, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
