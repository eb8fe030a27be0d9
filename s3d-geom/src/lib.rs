//! Vocabulary and plain geometry of indoor scans.
//!
//! The nouns that the other crates of `s3d` exchange — [`TriMesh`], [`PointCloud`], [`Camera`], [`Lens`],
//! [`Pose`], [`Raster`] — and the geometry that needs nothing else: a surface's points ([`SurfaceSampler`]),
//! a point's nearest face ([`NearestFaces`]), polygons and their triangles ([`Polygon`],
//! [`triangulate_face`]), a room's floor ([`FootprintBuilder`]), the voxels of an instance
//! ([`Voxels`]), and meshes of fewer faces to look at ([`simplify()`]).
//! World frame everywhere: metres, Z-up, right-handed.
//!
//! ```
//! use s3d_geom::{Camera, Pose, glam::dvec3};
//!
//! // A camera 1.5 m above the floor that looks along +Y, and the pixel in which it sees a point ahead of it.
//! let camera = Camera::perspective(Pose::level(dvec3(0.0, 0.0, 1.5), 0.0), 75f64.to_radians(), 1080, 1080);
//! let (pixel, depth) = camera.project(dvec3(0.0, 4.0, 1.5)).unwrap();
//! assert!((pixel.x - 540.0).abs() < 1e-9 && (depth - 4.0).abs() < 1e-9);
//! ```
//!
//! With the cargo feature `serde`, the vocabulary is data: boxes, poses, cameras, lenses, outlines, polygons,
//! voxels, point clouds. What is read is checked as it is by constructors (a pose's matrix and a polygon's
//! corners are taken as they are), and a number that JSON can hold comes back to the bit where the reader
//! rounds correctly (serde_json's `float_roundtrip`). Meshes, textures and images have their own files.
//!
//! The features `nearest` ([`NearestFaces`]) and `sampling` ([`SurfaceSampler`]) are on by default; without
//! them, the crate builds from half as many packages.

// Nothing panics but what a caller did wrong, which "Panics" tells. Loops index by what a constructor
// checked.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

mod aabb;
mod camera;
mod cloud;
mod mesh;
#[cfg(feature = "nearest")]
mod nearest;
mod outline;
mod patches;
pub mod primitives;
mod raster;
mod simplify;
#[cfg(feature = "sampling")]
mod surface;
#[cfg(feature = "nearest")]
mod vertex_colors;
mod voxel;
#[cfg(any(feature = "nearest", feature = "sampling"))]
mod wide;

pub use aabb::Aabb;
pub use camera::{
    Camera, CameraError, FisheyeLens, Lens, NormalAxes, PhotoLens, Pose, Projection, Rays,
    euler_from_rotation, rotation_from_euler,
};
pub use cloud::PointCloud;
pub use glam;
pub use mesh::{
    DEFAULT_COLOR, FaceColor, Material, MeshError, MeshParts, MeshReport, NO_INDEX, Texture, TriMesh, Wrap,
    sample_bilinear,
};
#[cfg(feature = "nearest")]
pub use nearest::{Nearest, NearestFaces, nearest_brute_force};
pub use outline::{
    Footprint, FootprintBuilder, FootprintOptions, Polygon, PolygonError, dominant_wall_direction_deg,
    triangulate_face,
};
pub use patches::face_patches;
pub use raster::Raster;
pub use simplify::{SimplifiedMesh, simplify};
#[cfg(feature = "sampling")]
pub use surface::{Density, SurfaceSampler};
#[cfg(feature = "nearest")]
pub use vertex_colors::{ColoredVertices, VertexColors};
pub use voxel::{VoxelGrid, Voxels};

/// The example of the README, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
