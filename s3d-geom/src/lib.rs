//! Vocabulary and plain geometry of indoor scans. World frame everywhere: metres, Z-up, right-handed.
//!
//! # Vocabulary
//!
//! The other crates of `s3d` exchange these nouns: [`TriMesh`], [`PointCloud`], [`Camera`], [`Lens`],
//! [`Pose`], [`Aabb`], [`Raster`], [`Texture`].
//!
//! # Surfaces
//!
//! [`SurfaceSampler`] draws points from a mesh, and [`NearestFaces`] finds the face nearest to a point.
//! [`VertexColors`] carries the colours of a cloud over to a mesh. [`simplify()`] makes meshes of fewer faces
//! to look at. [`primitives`] builds plain bodies.
//!
//! # Rooms and instances
//!
//! [`FootprintBuilder`] measures the floor of a room. [`Voxels`] fills the box of an instance, and
//! [`OrientedBox`] is a box that turns with it.
//! [`Polygon`] and [`triangulate_face`] cut polygons into triangles.
//!
//! # Sets and directions
//!
//! [`DisjointSets`] tells what hangs together, and [`symmetric_eigen`] in which directions points spread.
//!
//! # Example
//!
//! ```
//! use s3d_geom::glam::{dvec3, vec3};
//! use s3d_geom::{Camera, Density, NearestFaces, PointCloud, Pose, SurfaceSampler, TriMesh};
//!
//! // A wall 4 m ahead, as two triangles.
//! let corners = vec![vec3(-2.0, 4.0, 0.0), vec3(2.0, 4.0, 0.0), vec3(2.0, 4.0, 3.0), vec3(-2.0, 4.0, 3.0)];
//! let wall = TriMesh::from_faces(corners, vec![[0, 1, 2], [0, 2, 3]])?;
//!
//! // 100 points of the wall: each is nearest to the face that it was drawn from.
//! let mut cloud = PointCloud::default();
//! SurfaceSampler::new(&wall, Density::Total(100), 42).sample(0..100, &mut cloud);
//! let nearest = NearestFaces::new(&wall);
//! assert!((0..100).all(|i| nearest.nearest(cloud.positions[i]).face == cloud.faces[i]));
//!
//! // A camera 1.5 m above the floor that looks along +Y sees the middle of the wall in its central pixel.
//! let camera = Camera::perspective(Pose::level(dvec3(0.0, 0.0, 1.5), 0.0), 75f64.to_radians(), 1080, 1080);
//! let (pixel, depth) = camera.project(dvec3(0.0, 4.0, 1.5)).ok_or("behind the camera")?;
//! assert!((pixel.x - 540.0).abs() < 1e-9 && (depth - 4.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! `nearest` ([`NearestFaces`]) and `sampling` ([`SurfaceSampler`]) are on by default. Without them, the
//! crate builds from half as many packages.
//!
//! `serde` serializes the vocabulary: boxes, poses, cameras, lenses, outlines, polygons, voxels and point
//! clouds. Values read are checked like the arguments of constructors, except for the matrix of a pose and
//! the corners of a polygon. A number that JSON can hold is read back to the bit if the reader rounds
//! correctly (serde_json's `float_roundtrip`). Meshes, textures and images have their own files.

// Only a caller's mistake panics, and a section "Panics" names it. Loops take their indices from checked
// columns.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

mod aabb;
mod arctangent;
mod area_mean;
mod camera;
mod cloud;
mod disjoint_sets;
mod mesh;
#[cfg(feature = "nearest")]
mod nearest;
mod oriented_box;
mod outline;
mod patches;
pub mod primitives;
mod raster;
mod simplify;
#[cfg(feature = "sampling")]
mod surface;
mod symmetric_eigen;
#[cfg(feature = "nearest")]
mod vertex_colors;
mod voxel;
#[cfg(any(feature = "nearest", feature = "sampling"))]
mod wide;

pub use aabb::Aabb;
pub use arctangent::ARCTANGENT;
pub use area_mean::area_mean;
pub use camera::{
    Camera, CameraError, CaptureLens, FisheyeLens, Lens, NormalAxes, PhotoLens, Pose, Projection, Rays,
    SphericalLens, euler_from_rotation, rotation_from_euler,
};
pub use cloud::PointCloud;
pub use disjoint_sets::{DisjointSets, segment_graph};
pub use glam;
pub use mesh::{
    DEFAULT_COLOR, FaceColor, Material, MeshError, MeshParts, MeshReport, NO_INDEX, Texture, TriMesh, Wrap,
    moved_point, sample_bilinear,
};
#[cfg(feature = "nearest")]
pub use nearest::{Nearest, NearestFaces, nearest_brute_force};
pub use oriented_box::{OrientedBox, main_normals};
pub use outline::{
    Footprint, FootprintBuilder, FootprintOptions, Polygon, PolygonError, dominant_wall_direction_deg,
    triangulate_face,
};
pub use patches::face_patches;
pub use raster::Raster;
pub use simplify::{SimplifiedMesh, simplify};
#[cfg(feature = "sampling")]
pub use surface::{Density, SurfaceSampler};
pub use symmetric_eigen::symmetric_eigen;
#[cfg(feature = "nearest")]
pub use vertex_colors::{ColoredVertices, VertexColors};
pub use voxel::{VoxelGrid, Voxels};

/// The example of the README, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
