//! A second pair of eyes: what to label next, what else is like a thing, and what looks wrong.
//!
//! [`Surroundings`] are measured once for a mesh. A [`Review`] puts them together with the labels of the
//! moment: [`Review::next_doubt`] leads to the largest patch without a label, [`Review::similar_patches`]
//! finds more of a thing, [`Review::checks`] lists likely mistakes. They only look; nothing is changed.
//!
//! ```
//! use s3d_annotate::labelling::State;
//! use s3d_annotate::review::{Review, Surroundings};
//! use s3d_annotate::segments::{FaceIndex, SegmentOptions, segment_faces};
//! use s3d_geom::{TriMesh, glam::{Vec3, vec3}, primitives::{cuboid, grid}};
//!
//! // A chest on a floor. The floor is the largest patch, and is seen from above.
//! let mut parts = grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, [40, 40]);
//! parts.append(cuboid(vec3(1.0, 1.0, 0.0), vec3(1.8, 1.5, 0.6)));
//! let mesh = TriMesh::new(parts)?;
//! let segments = segment_faces(&mesh, &SegmentOptions::default());
//! let index = FaceIndex::new(&mesh, &segments);
//! let surroundings = Surroundings::new(&mesh, &segments, index.into());
//! let state = State::of_mesh(&mesh);
//!
//! let review = Review { mesh: &mesh, segments: &segments, surroundings: &surroundings, state: &state };
//! let floor = review.next_doubt(&[]).expect("nothing has a label");
//! assert!((floor.area_m2 - 16.0).abs() < 1e-3 && floor.from[2] > 0.3);
//! let chest = review.next_doubt(&[segments.segment_of_face[0]]).expect("the floor is skipped");
//! assert!(chest.area_m2 < 2.5);
//! # Ok::<(), s3d_geom::MeshError>(())
//! ```

mod cells;
mod checks;
mod descriptor;
mod doubt;
mod pieces;
mod similar;
mod surroundings;
mod viewpoint;

pub use checks::{Check, CheckKind};
pub use doubt::{Doubt, Guess};
pub use surroundings::Surroundings;

use crate::labelling::State;
use crate::segments::Segments;
use s3d_geom::TriMesh;

/// The labels of a mesh, to be looked at.
///
/// # Panics
/// Methods panic if the parts are not of one mesh.
#[derive(Clone, Copy, Debug)]
pub struct Review<'a> {
    /// The mesh.
    pub mesh: &'a TriMesh,
    /// Its segments.
    pub segments: &'a Segments,
    /// What was measured of both.
    pub surroundings: &'a Surroundings,
    /// Its labels.
    pub state: &'a State,
}
