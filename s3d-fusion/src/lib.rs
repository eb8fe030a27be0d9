//! Raw scans to meshes: depth pictures with poses, and laser scans whose scanner's place is known, are fused
//! to a mesh with colours. Values in, values out: no files.
//!
//! # What was seen
//!
//! A [`RangeImage`] is what one sensor saw from one place: a pose, how pixels become rays, ranges, a
//! [`SensorNoise`], and colours if there are any. It is made of
//!
//! - a depth picture with its lens: [`RangeImage::from_depth`],
//! - a laser scan with rows and columns: [`RangeImage::from_scan`],
//! - points without a grid, but with the scanner's place: [`RangeImage::from_points`].
//!
//! Mobile scanners measure from another place with each ray: [`Fusion::add_rays`] takes an origin for each
//! point.
//!
//! # A grid of distances
//!
//! A [`Fusion`] gathers signed distances in voxels near surfaces, image by image. What a ray passes is free:
//! who walked through a scan vanishes where as many images look through. Then [`Fusion::mesh`] finds the
//! surface.
//!
//! ```
//! use s3d_fusion::{Fusion, FusionOptions, RangeImage, RangeKind, SensorNoise};
//! use s3d_geom::glam::{DVec3, dvec2};
//! use s3d_geom::{Lens, PhotoLens, Pose, Raster};
//!
//! // A wall 2 m ahead of a camera at the origin that looks along +Y.
//! let lens = Lens::new([64, 48], dvec2(50.0, 50.0), dvec2(32.0, 24.0), [0.0; 5]).ok_or("no lens")?;
//! let depth = Raster::filled(64, 48, 2.0);
//! let pose = Pose::level(DVec3::ZERO, 0.0);
//! let noise = SensorNoise::STRUCTURED_LIGHT;
//! let image = RangeImage::from_depth(pose, PhotoLens::Straight(lens), RangeKind::Depth, depth, noise)?;
//! let image = image.with_colors(Raster::filled(64, 48, [200, 180, 160]))?;
//!
//! let mut fusion = Fusion::new(FusionOptions { cell_m: 0.05, ..FusionOptions::default() })?;
//! fusion.add(&image)?;
//! let mesh = fusion.mesh()?;
//! assert!(mesh.positions.iter().all(|p| (p.y - 2.0).abs() < 1e-3));
//!
//! // The mesh that the other crates read. Its fronts look at the camera.
//! let mesh = mesh.into_tri_mesh()?;
//! assert!(mesh.normal(0).y < -0.99 && mesh.parts().colors[0] == [200, 180, 160]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # More than fits into memory
//!
//! A grid can be limited to a [`Tile`]: a box of blocks. A caller goes over tiles, adds to each the images
//! that see it, keeps its [`Surface`], and joins all of them. The mesh is the same as without tiles.
//!
//! # Two scans of one building
//!
//! [`align`] finds where one surface lies in the frame of another one, without a first guess, or says that it
//! does not know.
//!
//! # How it works
//!
//! **Planes.** A plane is fitted to each pixel by its neighbours on the same surface. The distance of a voxel
//! is that to the plane, not that along the ray, so planes come out exactly at any angle. Pixels between a
//! surface and another one behind it are dropped, and so are pixels without neighbours: a beam that hits an
//! edge measures a mixture.
//!
//! **Weights.** An observation weighs by the inverse square of its noise, by the cosine at which the ray
//! meets the surface, and less far from its plane: the nearest surface decides in corners. Distances are
//! gathered up to [`FusionOptions::truncation_cells`] before a surface, and two cells and two sigma behind
//! it. What is behind was not seen, so it weighs little there: a board of three cells keeps both sides, and
//! those of a sheet are within about a cell.
//!
//! **Free space.** A voxel behind a surface is given up if as many images saw through it, the pixels around
//! included, as saw it. Images also count what they see through block by block, where no voxels exist yet. So
//! a person is removed also if the empty room was seen before. Near what is behind (within about five
//! blocks along a ray, as feet are near the floor), the images that are added after the person count alone.
//!
//! **Mesh.** Marching cubes, over cells whose corners were all seen, and one of them just before the surface.
//!
//! **Memory.** A voxel takes 6 bytes, and 3 more with colours. The directory adds 0.05 bytes a voxel. The
//! same images in the same order give the same bytes, for any number of threads and tiles.
//!
//! The method is that of Curless and Levoy 1996, "A Volumetric Method for Building Complex Models from Range
//! Images", on the sparse blocks of Nießner and others 2013, "Real-time 3D Reconstruction at Scale using
//! Voxel Hashing".

// Only a caller's mistake panics, and a section "Panics" names it. Loops take their indices from checked
// columns.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

mod align;
mod close;
mod columns;
mod decimate;
mod error;
mod extract;
mod fusion;
mod grid;
mod lanes;
mod noise;
mod origin;
mod range_image;
mod register;

pub use align::{AlignError, AlignOptions, Aligned, Alignment, Doubt, SurfacePoints, align};
pub use close::{CloseError, CloseOptions, ClosedHoles, OpenLoops, close_holes};
pub use columns::{ColumnsError, MeshColumns};
pub use decimate::{DecimateError, DecimateOptions, Decimated, decimate, decimate_while};
pub use error::FusionError;
pub use extract::{FusedMesh, Surface};
pub use fusion::{Fusion, FusionOptions, PreparedImage, Preparer, Tile};
pub use noise::SensorNoise;
pub use origin::{FoundOrigin, OriginError, find_origin};
pub use range_image::{RangeImage, RangeKind};
pub use register::{
    Motion, OpenMotion, PairResidual, RefinedPoses, RegisterError, RegisterOptions, Residual, ScanPoints,
    pair_residuals, refine_poses,
};

/// The example of the README, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
