//! Images that follow from the hits, the labels or the colours of an image: what trainers of many tasks at
//! once call mid-level cues.
//!
//! Names follow the annotator of Omnidata (Eftekhar et al., "Omnidata: A Scalable Pipeline for Making
//! Multi-Task Mid-Level Vision Datasets from 3D Scans", ICCV 2021). `s3d_io::formats` has a table of
//! meanings, units and missing values.
//!
//! A panorama has no left or right border: a neighbour of its first column is its last column. Its first and
//! last rows have no neighbour beyond them. Every function is sequential, and its image depends on its
//! arguments alone.

pub(crate) mod borders;
pub(crate) mod boundary_distance;
pub(crate) mod corners;
pub(crate) mod curvature;
pub(crate) mod distance;
pub(crate) mod face_sizes;
pub(crate) mod gray;
pub(crate) mod hessian;
pub(crate) mod occlusion;
mod plane;
pub(crate) mod reshading;
pub(crate) mod segments;
pub(crate) mod texture_edges;
