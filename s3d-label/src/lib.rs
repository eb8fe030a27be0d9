//! Labels of the 2D-3D-S data set (Armeni et al. 2017): what they are called, in which order they are numbered, and
//! how the points of a scan give them to the faces of a mesh.
//!
//! The nouns: [`Class`], [`Room`] and [`Label`] with its name; the [`LabelTable`], which numbers the labels of a data
//! set in the published order ([`LabelId`]); [`number_area`], which turns the numbers of an annotated tree into those of
//! labels; [`Votes`], which counts labels by face, and the [`VoteReport`] on them; [`ClassCounts`] and [`RoomCounts`],
//! the paper's tables of statistics.
//!
//! ```
//! use s3d_label::{Class, LabelId, LabelTable, Votes, number_area};
//!
//! // An annotated tree of one area: a wall and a chair of office_1, a chair of office_2.
//! let office = |number| format!("office_{number}").parse().unwrap();
//! let found = [(office(1), Class::Wall, 1), (office(2), Class::Chair, 1), (office(1), Class::Chair, 1)];
//! let numbered = number_area(5, found)?;
//! let table = LabelTable::from_labels(numbered.iter().map(|i| i.label))?;
//! assert_eq!(
//!     table.names(),
//!     ["<UNK>_0_<UNK>_0_0", "chair_1_office_1_5", "chair_2_office_2_5", "wall_1_office_1_5"]
//! );
//!
//! // Three points of the wall and one of a chair vote for a mesh of two faces.
//! let (wall, chair) = (LabelId(3), LabelId(1));
//! let mut votes = Votes::new(2);
//! for label in [wall, chair, wall, wall] {
//!     votes.add(0, label, 0.002);
//! }
//! assert_eq!(votes.face_labels(), [wall, LabelId::NULL]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
mod instance;
mod label;
mod numbering;
mod report;
mod room;
mod statistics;
mod table;
mod vote;

pub use class::{Class, UnknownClass};
pub use instance::InstanceSummary;
pub use label::{Label, LabelError, NULL_NAME, parse_name};
pub use numbering::{NumberedInstance, NumberingError, number_area};
pub use report::{VoteReport, VoteRow};
pub use room::{Room, RoomError, RoomType, UnknownRoomType};
pub use statistics::{ClassCounts, RoomCounts};
pub use table::{LabelId, LabelTable, MAX_LABELS, TableError};
pub use vote::{PointTally, VoteOptions, Votes, Winner};

/// The README's example, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
