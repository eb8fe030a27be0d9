//! Labels for bare scans.
//!
//! [`segments`] cuts a mesh into patches that a person labels in one stroke, with the tree by which they join
//! to larger ones. [`segments::segment_file`] writes them for ScanNet's and Matterport3D's tools.
//! [`labelling`] keeps the labels, and [`workbench`] makes them of a person's gestures. [`review`] tells what
//! to label next, and what looks wrong.
//!
//! [`outputs`] writes labels for other programs: a PLY mesh, ScanNet, ScanNet++, S3DIS. [`proposals`] reads
//! labels of others, for a person to accept.
//! [`structure`] finds floors, ceilings, walls and rooms without labels.
//!
//! ```
//! use s3d_annotate::segments::{SegmentOptions, segment_faces};
//! use s3d_geom::{MeshParts, TriMesh, glam::{Vec3, vec3}, primitives::{cuboid, grid}};
//!
//! // A floor of 4 × 4 m with a chest on it.
//! let mut parts: MeshParts = grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, [40, 40]);
//! let floor = 0..parts.faces.len();
//! parts.append(cuboid(vec3(1.0, 1.0, 0.0), vec3(1.8, 1.5, 0.6)));
//! let mesh = TriMesh::new(parts)?;
//!
//! // The floor is the first segment; the sides of the chest are the others.
//! let found = segment_faces(&mesh, &SegmentOptions::default());
//! assert!(found.segment_of_face[floor].iter().all(|segment| *segment == 0));
//!
//! // The node below the root that has not the floor is the chest.
//! let [one, other] = found.tree.children(found.tree.node_count() - 1).expect("the floor touches the chest");
//! let chest = if found.tree.segments_of(one).contains(&0) { other } else { one };
//! assert_eq!(found.tree.segments_of(chest).len() + 1, found.tree.leaf_count() as usize);
//! # Ok::<(), s3d_geom::MeshError>(())
//! ```

// No content of a file may make this crate panic.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic, clippy::string_slice))]

pub mod labelling;
pub mod outputs;
pub mod proposals;
pub mod review;
pub mod segments;
#[cfg(feature = "server")]
pub mod server;
pub mod structure;
pub mod workbench;

/// The README's example, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
